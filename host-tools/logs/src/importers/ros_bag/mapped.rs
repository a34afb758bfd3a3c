//! Numbers of a bag that have no meaning of their own, such as the commands of propeller and fins: a mapping says by
//! topic, field and element what each of them is.
//!
//! `column` of an entry is a topic, with `.field` where the message has several, and `[element]`, by number or by the
//! name that the message gives it: `/thruster/rpm`, `/fins[2]`, `/joint_states.position[fin_top]`.

use super::cdr::Cdr;
use crate::DataError;
use crate::importers::format::Role;
use crate::importers::mapping::ColumnMap;
use crate::log::Column;
use std::path::Path;

/// A number on the wire.
#[derive(Clone, Copy)]
enum Number {
    Double,
    Float,
    Int,
    Short,
}

/// A part of a message, in its order.
#[derive(Clone, Copy)]
enum Part {
    Header,
    /// Dimensions and offset in front of an array.
    Layout,
    /// Names of the elements of every array behind.
    Names,
    One(Number),
    Many(&'static str, Number),
}

use Number::{Double, Float, Int, Short};
use Part::{Header, Layout, Many, Names, One};

/// Types whose numbers a mapping can name.
const TYPES: [(&str, &[Part]); 10] = [
    ("std_msgs/msg/Float64", &[One(Double)]),
    ("std_msgs/msg/Float32", &[One(Float)]),
    ("std_msgs/msg/Int32", &[One(Int)]),
    ("std_msgs/msg/Int16", &[One(Short)]),
    ("std_msgs/msg/Float64MultiArray", &[Layout, Many("data", Double)]),
    ("std_msgs/msg/Float32MultiArray", &[Layout, Many("data", Float)]),
    ("std_msgs/msg/Int32MultiArray", &[Layout, Many("data", Int)]),
    (
        "sensor_msgs/msg/JointState",
        &[Header, Names, Many("position", Double), Many("velocity", Double), Many("effort", Double)],
    ),
    (
        "actuator_msgs/msg/Actuators",
        &[Header, Many("position", Double), Many("velocity", Double), Many("normalized", Double)],
    ),
    ("uuv_gazebo_ros_plugins_msgs/msg/FloatStamped", &[Header, One(Double)]),
];

/// Whether a mapping can name the numbers of a type.
pub(super) fn is_nameable(type_name: &str) -> bool {
    TYPES.iter().any(|(name, _)| *name == type_name)
}

/// The numbers of one message.
#[derive(Default)]
struct Numbers {
    /// The header's time; `None` without one, and where it was never set.
    stamp_us: Option<i64>,
    names: Vec<Vec<u8>>,
    /// Field and elements.
    arrays: Vec<(&'static str, Vec<f64>)>,
}

impl Number {
    fn read(self, cdr: &mut Cdr<'_>) -> Option<f64> {
        match self {
            Double => cdr.double(),
            Float => cdr.float().map(f64::from),
            Int => cdr.int().map(f64::from),
            Short => cdr.short().map(f64::from),
        }
    }
}

impl Numbers {
    /// Reads a message of a type that is nameable; `None` if it is too short.
    fn read(type_name: &str, message: &[u8]) -> Option<Self> {
        let (_, parts) = TYPES.iter().find(|(name, _)| *name == type_name)?;
        let (mut cdr, mut numbers) = (Cdr::new(message)?, Self::default());
        for part in *parts {
            match *part {
                Header => numbers.stamp_us = Some(cdr.header_us()?).filter(|&time_us| time_us != 0),
                Layout => {
                    for _ in 0..cdr.length()? {
                        cdr.string()?;
                        cdr.int()?;
                        cdr.int()?;
                    }
                    cdr.int()?;
                }
                Names => {
                    let count = cdr.length()?;
                    numbers.names = (0..count).map(|_| cdr.string().map(<[u8]>::to_vec)).collect::<Option<_>>()?;
                }
                One(number) => numbers.arrays.push(("data", vec![number.read(&mut cdr)?])),
                Many(field, number) => {
                    let count = cdr.length()?;
                    numbers.arrays.push((field, (0..count).map(|_| number.read(&mut cdr)).collect::<Option<_>>()?));
                }
            }
        }
        Some(numbers)
    }

    /// The element that is meant; `None` if there is none, or more than one.
    fn get(&self, field: Option<&str>, element: Option<&str>) -> Option<f64> {
        let mut arrays = self.arrays.iter().filter(|(name, _)| field.is_none_or(|field| field == *name));
        let (Some((_, values)), None) = (arrays.next(), arrays.next()) else { return None };
        let place = match element {
            None => (values.len() == 1).then_some(0)?,
            Some(element) => match self.names.iter().position(|name| name == element.as_bytes()) {
                Some(place) => place,
                None => element.parse().ok()?,
            },
        };
        values.get(place).copied()
    }
}

/// What an entry of the mapping takes from where.
struct TopicNumber<'a> {
    topic: &'a str,
    field: Option<&'a str>,
    element: Option<&'a str>,
    /// As the mapping has it.
    name: &'a str,
    column: Column,
    scale: f64,
    offset: f64,
    is_found: bool,
}

/// Samples of a message.
pub(super) struct Mapped {
    pub stamp_us: Option<i64>,
    pub samples: Vec<(Column, f64)>,
}

/// The entries of a mapping, as the bag is read.
#[derive(Default)]
pub(super) struct Sources<'a> {
    sources: Vec<TopicNumber<'a>>,
}

impl<'a> Sources<'a> {
    /// The entries of a mapping for the bag `path`.
    pub(super) fn new(path: &Path, map: &'a ColumnMap) -> Result<Self, DataError> {
        let fail = |name: &str, message: &str| Err(DataError::file(path, format!("mapped {name}: {message}")));
        let mut sources = Vec::new();
        for known in map.format().columns.iter() {
            let name = &*known.name;
            let Role::Sample { column, scale, offset } = known.role else {
                return fail(name, "a ROS 2 bag has its own times, positions and attitudes; map numbers alone");
            };
            let (path, element) = match name.split_once('[') {
                None => (name, None),
                Some((path, rest)) => match rest.strip_suffix(']') {
                    Some(element) if !element.is_empty() => (path, Some(element)),
                    _ => return fail(name, "expected /topic, /topic[element] or /topic.field[element]"),
                },
            };
            let (topic, field) = path.split_once('.').map_or((path, None), |(topic, field)| (topic, Some(field)));
            sources.push(TopicNumber { topic, field, element, name, column, scale, offset, is_found: false });
        }
        Ok(Self { sources })
    }

    /// Whether an entry names a topic.
    pub(super) fn has_topic(&self, topic: &str) -> bool {
        self.sources.iter().any(|source| source.topic == topic)
    }

    /// Whether an entry fills a column.
    pub(super) fn fills(&self, column: Column) -> bool {
        self.sources.iter().any(|source| source.column == column)
    }

    /// The samples of a message; `None` if it is shorter than its type.
    pub(super) fn read(&mut self, topic: &str, type_name: &str, message: &[u8]) -> Option<Mapped> {
        let numbers = Numbers::read(type_name, message)?;
        let mut samples = Vec::new();
        for source in self.sources.iter_mut().filter(|source| source.topic == topic) {
            if let Some(value) = numbers.get(source.field, source.element) {
                source.is_found = true;
                samples.push((source.column, (value + source.offset) * source.scale));
            }
        }
        Some(Mapped { stamp_us: numbers.stamp_us, samples })
    }

    /// An entry for which the bag has nothing.
    pub(super) fn missing(&self) -> Option<&'a str> {
        self.sources.iter().find(|source| !source.is_found).map(|source| source.name)
    }

    /// What became of the entries.
    pub(super) fn note(&self) -> Option<String> {
        let texts: Vec<String> = self.sources.iter().map(|s| format!("{} is {}", s.name, s.column.name())).collect();
        (!texts.is_empty()).then(|| format!("by the mapping: {}", texts.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_is_found_by_number_or_name_and_never_guessed() {
        let numbers = Numbers {
            stamp_us: None,
            names: vec![b"fin_top".to_vec(), b"7".to_vec()],
            arrays: vec![("position", vec![0.1, 0.2]), ("velocity", vec![3.0])],
        };
        for (field, element, value) in [
            (Some("position"), Some("fin_top"), Some(0.1)),
            (Some("position"), Some("1"), Some(0.2)),
            (Some("position"), Some("7"), Some(0.2)),
            (Some("position"), Some("2"), None),
            (Some("position"), None, None),
            (Some("velocity"), None, Some(3.0)),
            (Some("velocity"), Some("fin_top"), Some(3.0)),
            (Some("effort"), Some("0"), None),
            (None, Some("0"), None),
        ] {
            assert_eq!(numbers.get(field, element), value, "{field:?} {element:?}");
        }
    }

    /// An array that announces more than the message has.
    #[test]
    fn a_message_cut_off_has_no_numbers() {
        let mut message = vec![0, 1, 0, 0];
        [0_u32, 0, u32::MAX >> 1].iter().for_each(|word| message.extend(word.to_le_bytes()));
        message.extend([0; 12]);
        assert!(Numbers::read("std_msgs/msg/Float64MultiArray", &message).is_none());
        assert!(Numbers::read("std_msgs/msg/Float64", &[0, 1, 0, 0, 1]).is_none());
    }
}

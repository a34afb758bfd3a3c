//! The numbers of ROS' messages: those that `messages.toml` turns into columns, and those that have no meaning of their
//! own, such as the commands of propeller and fins, which a mapping names.
//!
//! An element of an array is a number by its place or by the name that the message gives it: `position[2]`,
//! `position[fin_top]`; of a message with one array its name may be left out.

use super::cdr::Cdr;
use std::borrow::Cow;

/// A part of a message, in its order.
#[derive(Clone, Copy)]
enum Part {
    Header,
    Text,
    /// Status of a fix, and which systems it is by.
    Status,
    /// Doubles, each with its name.
    Doubles(&'static [&'static str]),
    /// So many doubles of no use.
    Skip(usize),
    /// Dimensions and offset in front of an array.
    Layout,
    /// Names of the elements of every array behind.
    Names,
    /// A number by its letter.
    One(u8),
    Many(&'static str, u8),
}

use Part::{Doubles, Header, Layout, Many, Names, One, Skip, Status, Text};

const TYPES: [(&str, &[Part]); 15] = [
    ("sensor_msgs/msg/Imu", &[Header, Doubles(&["qx", "qy", "qz", "qw"]), Skip(9), Doubles(&["p", "q", "r"])]),
    (ODOMETRY, &[Header, Text, Doubles(&["x", "y", "z", "qx", "qy", "qz", "qw"]), Skip(36), Doubles(&["u", "v", "w"])]),
    (PRESSURE, &[Header, Doubles(&["pressure"])]),
    ("geometry_msgs/msg/TwistWithCovarianceStamped", &[Header, Doubles(&["u", "v", "w"])]),
    ("sensor_msgs/msg/NavSatFix", &[Header, Status, Doubles(&["latitude", "longitude"])]),
    ("std_msgs/msg/Float64", &[One(b'd')]),
    ("std_msgs/msg/Float32", &[One(b'f')]),
    ("std_msgs/msg/Int32", &[One(b'i')]),
    ("std_msgs/msg/Int16", &[One(b'h')]),
    ("std_msgs/msg/Float64MultiArray", &[Layout, Many("data", b'd')]),
    ("std_msgs/msg/Float32MultiArray", &[Layout, Many("data", b'f')]),
    ("std_msgs/msg/Int32MultiArray", &[Layout, Many("data", b'i')]),
    (
        "sensor_msgs/msg/JointState",
        &[Header, Names, Many("position", b'd'), Many("velocity", b'd'), Many("effort", b'd')],
    ),
    (
        "actuator_msgs/msg/Actuators",
        &[Header, Many("position", b'd'), Many("velocity", b'd'), Many("normalized", b'd')],
    ),
    ("uuv_gazebo_ros_plugins_msgs/msg/FloatStamped", &[Header, One(b'd')]),
];

pub(super) const ODOMETRY: &str = "nav_msgs/msg/Odometry";
pub(super) const PRESSURE: &str = "sensor_msgs/msg/FluidPressure";

/// Elements of an array that a mapping can name; one with more is a picture.
const MOST_ELEMENTS: usize = 1024;

/// Whether a type is read at all.
pub(super) fn is_known(type_name: &str) -> bool {
    TYPES.iter().any(|(name, _)| *name == type_name)
}

/// The numbers of one message.
#[derive(Default)]
pub(super) struct Numbers {
    /// The header's time; `None` without one, and where it was never set.
    pub stamp_us: Option<i64>,
    pub fields: Vec<(Cow<'static, str>, f64)>,
}

impl Numbers {
    /// Reads a message of a type that is known; `None` if it is too short.
    pub(super) fn read(type_name: &str, message: &[u8]) -> Option<Self> {
        let (_, parts) = TYPES.iter().find(|(name, _)| *name == type_name)?;
        let (mut cdr, mut numbers, mut names) = (Cdr::new(message)?, Self::default(), Vec::new());
        let is_alone = parts.iter().filter(|part| matches!(part, One(_) | Many(..))).count() == 1;
        for part in *parts {
            match *part {
                Header => numbers.stamp_us = Some(cdr.header_us()?).filter(|&time_us| time_us != 0),
                Text => drop(cdr.string()?),
                Status => {
                    numbers.fields.push(("status".into(), cdr.number(b'b')?));
                    cdr.number(b'H')?;
                }
                Doubles(fields) => {
                    for field in fields {
                        numbers.fields.push(((*field).into(), cdr.number(b'd')?));
                    }
                }
                Skip(count) => drop(cdr.numbers(b'd', count)?),
                Layout => {
                    for _ in 0..cdr.length()? {
                        cdr.string()?;
                        cdr.numbers(b'i', 2)?;
                    }
                    cdr.number(b'i')?;
                }
                Names => {
                    for _ in 0..cdr.length()? {
                        names.push(String::from_utf8_lossy(cdr.string()?).into_owned());
                    }
                }
                One(code) => numbers.add("data", &names, &[cdr.number(code)?], is_alone),
                Many(field, code) => {
                    let count = cdr.length()?;
                    numbers.add(field, &names, &cdr.numbers(code, count)?, is_alone);
                }
            }
        }
        Some(numbers)
    }

    /// Adds an array, each element by the name that the message gives it, if any, and by its place.
    fn add(&mut self, field: &'static str, names: &[String], values: &[f64], is_alone: bool) {
        let values = values.get(..MOST_ELEMENTS).unwrap_or(values);
        for field in [Some(field), is_alone.then_some("")].into_iter().flatten() {
            let by_name = names.iter().zip(values).map(|(name, value)| (format!("{field}[{name}]").into(), *value));
            self.fields.extend(by_name);
            let by_place = values.iter().enumerate().map(|(k, value)| (format!("{field}[{k}]").into(), *value));
            self.fields.extend(by_place);
            if let [value] = values {
                self.fields.push((field.into(), *value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_is_found_by_number_or_name_and_never_guessed() {
        let mut numbers = Numbers::default();
        let names = ["fin_top".to_owned(), "7".to_owned()];
        numbers.add("position", &names, &[0.1, 0.2], false);
        numbers.add("velocity", &names, &[3.0], false);
        for (field, value) in [
            ("position[fin_top]", Some(0.1)),
            ("position[1]", Some(0.2)),
            ("position[7]", Some(0.2)),
            ("position[2]", None),
            ("position", None),
            ("velocity", Some(3.0)),
            ("velocity[fin_top]", Some(3.0)),
            ("effort[0]", None),
            ("[0]", None),
        ] {
            let found = numbers.fields.iter().find(|(name, _)| name == field).map(|(_, value)| *value);
            assert_eq!(found, value, "{field}");
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

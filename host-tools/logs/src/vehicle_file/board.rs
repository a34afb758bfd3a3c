//! A board's parameters as a file: a vehicle file with a section `[app]` for what belongs to the board itself.

use super::schema::BOARD_SECTION;
use super::{VehicleFile, read};
use crate::DataError;
use std::fmt::Write as _;
use std::path::Path;

/// Contents of a board's file: a vehicle, or an `[app]` section, or both.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardFile {
    /// The vehicle, if the file has any section of one (then it has to be whole).
    pub vehicle: Option<VehicleFile>,
    /// The numbers of `[app]` under their dotted names: `app.use_dvl`.
    pub app: Vec<(String, f64)>,
}

/// A parameter as a board declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardParameter {
    /// Dotted name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// What is written beside it: unit, meaning, range.
    pub comment: String,
}

impl BoardFile {
    /// Reads such a file.
    ///
    /// # Errors
    /// As [`VehicleFile::read`]; if there is nothing in it.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let text = crate::settings::read(path)?;
        Self::parse(&text, path)
    }

    /// Parses the text of such a file; `path` is for the messages.
    ///
    /// # Errors
    /// As [`BoardFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, DataError> {
        let read::Contents { vehicle, app } = read::parse(text, path, false)?;
        if app.is_empty() && vehicle.is_none() {
            return Err(DataError::file(path, "no parameters: neither the sections of a vehicle nor [app]"));
        }
        Ok(Self { vehicle, app })
    }

    /// Every number under its dotted name, the vehicle's first.
    pub fn flatten(&self) -> Vec<(String, f64)> {
        let vehicle = self.vehicle.iter().flat_map(VehicleFile::flatten);
        vehicle.chain(self.app.iter().cloned()).collect()
    }

    /// The text of a file with all parameters of a board: what [`BoardFile::flatten`] makes of it are the same numbers
    /// to the bit. `name` is the vehicle's, `source` stands in the first lines.
    ///
    /// # Errors
    /// In one line, if the board lacks a number of the vehicle, or has one that such a file has no place for.
    pub fn text_of(parameters: &[BoardParameter], name: &str, source: &str) -> Result<String, String> {
        let mut vehicle = VehicleFile { name: name.to_owned(), ..VehicleFile::reference() };
        let names: Vec<String> = vehicle.flatten().into_iter().map(|(name, _)| name).collect();
        if let Some(missing) = names.iter().find(|name| parameters.iter().all(|p| p.name != **name)) {
            return Err(format!("the board has no {missing}"));
        }
        let (of_vehicle, others): (Vec<_>, Vec<_>) = parameters.iter().partition(|p| names.contains(&p.name));
        vehicle.apply(of_vehicle.iter().map(|p| (&p.name, p.value)))?;
        let mut text = vehicle.to_toml(source);
        let _ = writeln!(text, "\n[{BOARD_SECTION}]  # what belongs to the board itself");
        for parameter in others {
            let key =
                key(&parameter.name).ok_or_else(|| format!("{}: no place in [{BOARD_SECTION}]", parameter.name))?;
            let _ = writeln!(text, "{key} = {:?}  # {}", parameter.value, parameter.comment);
        }
        Ok(text)
    }
}

/// The key in `[app]` of a dotted name.
fn key(name: &str) -> Option<&str> {
    let key = name.strip_prefix(BOARD_SECTION)?.strip_prefix('.')?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    (!key.is_empty() && key.chars().all(plain)).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str, value: f64) -> BoardParameter {
        BoardParameter { name: name.to_owned(), value, comment: "m; somewhere; -20 to 20".to_owned() }
    }

    fn full() -> Vec<BoardParameter> {
        let mut parameters: Vec<_> = VehicleFile::reference()
            .flatten()
            .iter()
            .map(|(name, value)| parameter(name, value * (1.0 - 1.0e-13)))
            .collect();
        let app = [("app.late_tolerance_s", 1e-300), ("app.use_dvl", 1.0), ("app.helm_pitch_max_rad", 1.0 / 3.0)];
        parameters.extend(app.map(|(name, value)| parameter(name, value)));
        parameters
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let parameters = full();
        let text = BoardFile::text_of(&parameters, "a board", "from a test").unwrap();
        let file = BoardFile::parse(&text, Path::new("b.toml")).unwrap();
        let expected: Vec<_> = parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
        assert_eq!(file.flatten(), expected);
        // the filter takes it as the vehicle file it is
        assert_eq!(VehicleFile::parse(&text, Path::new("b.toml")).unwrap(), file.vehicle.unwrap());
    }

    #[test]
    fn either_half_may_stand_alone() {
        let file = BoardFile::parse("[app]\nuse_dvl = 1\ngate_sigma = 4.5\n", Path::new("a.toml")).unwrap();
        let expected = [("app.gate_sigma", 4.5), ("app.use_dvl", 1.0)];
        assert_eq!(file.flatten(), expected.map(|(name, value)| (name.to_owned(), value)));
        let text = VehicleFile::reference().to_toml("");
        let file = BoardFile::parse(&text, Path::new("v.toml")).unwrap();
        assert_eq!(file.flatten(), VehicleFile::reference().flatten());
    }

    #[test]
    fn errors_say_where() {
        let cases = [
            ("", "b.toml: no parameters"),
            ("[app]\n", "b.toml: no parameters"),
            ("app = 3\n", "b.toml:1:7: app: expected a table, found a number"),
            ("[app]\nuse_dvl = true\n", "b.toml:2:11: app.use_dvl: expected a number, found true or false"),
            ("[app]\nuse_dvl = 0.5\n", "b.toml:2:11: app.use_dvl: 0.5 is no whole number, or outside 0 to 1 (1)"),
            ("[app]\nuse_dlv = 1\n", "b.toml:2:1: unknown key use_dlv in [app]; it has"),
            ("[app\n", "b.toml:1:5:"),
            ("[ap]\nuse_dvl = 1\n", "b.toml:1:2: unknown key ap; expected"),
            ("[app]\nuse_dvl = 1\n[vehicle]\nname = \"x\"\n", "b.toml:3:2: [vehicle] lacks length_m"),
        ];
        for (text, message) in cases {
            let error = BoardFile::parse(text, Path::new("b.toml")).unwrap_err().to_string();
            assert!(error.starts_with(message), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_set_without_a_place_in_the_file_is_refused() {
        let mut parameters = full();
        parameters.push(parameter("effects.heading_bias", 0.0));
        assert!(BoardFile::text_of(&parameters, "b", "").unwrap_err().contains("effects.heading_bias"));
        parameters.pop();
        parameters.remove(0);
        assert!(BoardFile::text_of(&parameters, "b", "").unwrap_err().contains("vehicle.length_m"));
    }
}

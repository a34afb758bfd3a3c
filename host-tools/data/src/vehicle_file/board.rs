//! A board's parameters as a file: a vehicle file, and what else a board is told in its section `[app]`.

use super::schema::BOARD_SECTION;
use super::{VehicleFile, read};
use crate::DataError;
use std::fmt::Write as _;
use std::path::Path;

/// What a file says about a board: a vehicle, or an `[app]` section, or both.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardFile {
    /// The vehicle, if the file has any section of one (then it has to be whole).
    pub vehicle: Option<VehicleFile>,
    /// The numbers of `[app]` under their dotted names: `app.use_dvl`, `app.dvl_arm_m[2]`.
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
    /// Reads such a file. Which names there are and what values they may have is for the board to say, except for
    /// the vehicle's.
    ///
    /// # Errors
    /// As [`VehicleFile::read`]; if there is nothing in it.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let text = std::fs::read_to_string(path).map_err(|e| DataError::io(path, &e))?;
        Self::parse(&text, path)
    }

    /// Parses the text of such a file; `path` is for the messages.
    ///
    /// # Errors
    /// As [`BoardFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, DataError> {
        let (app, has_vehicle) = read::board_section(text, path)?;
        if app.is_empty() && !has_vehicle {
            return Err(DataError::file(path, "no parameters: neither the sections of a vehicle nor [app]"));
        }
        let vehicle = has_vehicle.then(|| VehicleFile::parse(text, path)).transpose()?;
        Ok(Self { vehicle, app })
    }

    /// Every number under its dotted name, the vehicle's first.
    #[must_use]
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
        let _ = writeln!(text, "\n[{BOARD_SECTION}]  # what else the board is told");
        let mut rest = others.as_slice();
        while let Some((first, _)) = rest.split_first() {
            let key = key(&first.name).ok_or_else(|| format!("{}: no place in [{BOARD_SECTION}]", first.name))?;
            let count = rest.iter().take_while(|p| self::key(&p.name) == Some(key)).count();
            let (group, others) = rest.split_at(count);
            let values: Vec<f64> = group.iter().map(|p| p.value).collect();
            let value = match group {
                [p] if p.name.ends_with(key) => format!("{:?}", p.value),
                _ if in_order(group) => format!("{values:?}"),
                _ => return Err(format!("{}: not the beginning of an array in order", first.name)),
            };
            let _ = writeln!(text, "{key} = {value}  # {}", first.comment);
            rest = others;
        }
        Ok(text)
    }
}

/// The key in `[app]` of a dotted name, without its index.
fn key(name: &str) -> Option<&str> {
    let key = name.strip_prefix(BOARD_SECTION)?.strip_prefix('.')?;
    let key = key.split('[').next()?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    (!key.is_empty() && key.chars().all(plain)).then_some(key)
}

/// Names that end in `[0]`, `[1]`, … with nothing left out.
fn in_order(group: &[&BoardParameter]) -> bool {
    let is_at = |(index, p): (usize, &&BoardParameter)| {
        p.name.ends_with(&format!("[{index}]")) && p.name.matches('[').count() == 1
    };
    group.iter().enumerate().all(is_at)
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
        let app = [("app.use_dvl", 1.0), ("app.arm_m[0]", -0.1), ("app.arm_m[1]", 1.0 / 3.0), ("app.arm_mm", 1e-300)];
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
        let file = BoardFile::parse("[app]\nuse_dvl = 1\narm_m = [0, 0.5]\n", Path::new("a.toml")).unwrap();
        let expected = [("app.use_dvl", 1.0), ("app.arm_m[0]", 0.0), ("app.arm_m[1]", 0.5)];
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
            ("[app]\narm_m = [1.0, \"x\"]\n", "b.toml:2:15: app.arm_m[1]: expected a number, found a text"),
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

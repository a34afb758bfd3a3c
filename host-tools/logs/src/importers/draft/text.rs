//! The draft as text: TOML, each entry marked as sure or to be checked.

use super::Draft;
use super::entry::{Entry, Frames};
use super::seen::Seen;
use std::fmt::Write as _;
use std::path::Path;

/// What a draft is made of.
pub(super) struct Parts<'a> {
    pub path: &'a Path,
    pub separator: u8,
    pub columns: &'a [Seen],
    /// Column of the time, its unit and base.
    pub time: Option<(usize, (&'static str, &'static str))>,
    pub frames: &'a Frames,
    pub quaternion: Option<[usize; 4]>,
    pub entries: Vec<Entry>,
    /// Columns of actuators in no unit.
    pub counts: &'a [usize],
}

/// Width of comments.
const WIDTH: usize = 110;

impl Parts<'_> {
    pub fn text(&self) -> String {
        let mut text = format!(
            "# Column mapping of {}, drafted by `backseat map` from names, ranges, and tests of columns against each other.\n\
             # \"sure\": by its name in the vehicle log, or by the test that is named. \"check\": a guess.\n\
             # Heading is clockwise from true north, pitch nose up, depth and w down, v and y to starboard and east.\n\
             # An entry has: column, unit, sign (1 or -1), scale, offset (added first, in the table's unit).\n",
            self.path.file_name().map_or_else(|| "a table".into(), |name| name.to_string_lossy())
        );
        let shown = if self.separator == b'\t' { "\\t".to_owned() } else { char::from(self.separator).to_string() };
        let _ = writeln!(text, "separator = \"{shown}\"");
        let mut missing: Vec<String> = self.columns.iter().flat_map(Seen::marks).map(|word| quoted(word)).collect();
        let is_guess = self.columns.iter().any(|column| !column.guessed_marks().is_empty());
        let mark = if is_guess { "check: " } else { "" };
        missing.sort_unstable();
        missing.dedup();
        if !missing.is_empty() {
            let _ = writeln!(text, "missing = [{}]  # {mark}what stands where there is no sample", missing.join(", "));
        }
        text += "\n[time]\n";
        match self.time {
            Some((place, (unit, base))) => {
                let column = &self.columns[place];
                let is_sure = column.unit == Some(unit) || base == "epoch" || unit == "hms";
                text += if column.is_open_date() {
                    "# check: these dates read with the day first and with the month first: dmy or mdy\n"
                } else if is_sure {
                    "# sure: by its name and size\n"
                } else {
                    "# check: its name states no unit\n"
                };
                let _ = writeln!(text, "column = {}  # {}", quoted(&column.name), column.range());
                let _ = writeln!(
                    text,
                    "unit = \"{unit}\"  # s, ms, us, ns, min, h, d, hms, iso, dmy, mdy, datenum or excel"
                );
                let _ = writeln!(text, "base = \"{base}\"  # start, or epoch: the first row is zero");
            }
            None => text += "column = \"?\"  # no column looks like a time: name it here\nunit = \"s\"\n",
        }
        let axes = |given: &Option<(bool, String)>, turned: &str, plain: &str| {
            given.as_ref().map(|(is_turned, name)| format!("{} ({name})", if *is_turned { turned } else { plain }))
        };
        let axes = [
            axes(&self.frames.body, "body axes forward, left, up", "body axes forward, starboard, down"),
            axes(&self.frames.world, "east, north, up", "north, east, down"),
        ];
        let axes: Vec<String> = axes.into_iter().flatten().collect();
        if !axes.is_empty() {
            let said = format!("By names of columns taken for all: {}.", axes.join("; "));
            comment(&mut text, "\n", &said);
        }
        if let Some(places) = self.quaternion {
            let names = places.map(|place| quoted(&self.columns[place].name)).join(", ");
            let frames = if self.frames.is_enu() || self.frames.is_flu() { "enu-flu" } else { "ned-frd" };
            let _ = writeln!(text, "\n[quaternion]\n# check: the axes\ncolumns = [{names}]  # w, x, y, z");
            let _ = writeln!(text, "frames = \"{frames}\"  # ned-frd or enu-flu");
        }
        for entry in &self.entries {
            self.entry(&mut text, entry);
        }
        if !self.counts.is_empty() {
            comment(
                &mut text,
                "\n",
                "Commands in counts, which are no unit: an entry needs scale (radians or rpm for a count, of your vehicle) and \
                 offset (minus the count of the middle).",
            );
            for &place in self.counts {
                let column = &self.columns[place];
                let _ = writeln!(text, "#   {}: {}", quoted(&column.name), column.range());
            }
        }
        let unused: Vec<&Seen> = self.unused().collect();
        if !unused.is_empty() {
            text += "\n# Not used; to use one, write an entry as above:\n";
        }
        for column in unused {
            let _ = writeln!(text, "#   {}: {}", quoted(&column.name), column.range());
        }
        text + "\n# For what the table does not have, but every row shares: [constants], such as\n\
                # [constants]\n# prop_rpm = 1000.0\n\
                # For an attitude as a quaternion (frames: \"ned-frd\", or \"enu-flu\" as ROS has it):\n\
                # [quaternion]\n# columns = [\"qw\", \"qx\", \"qy\", \"qz\"]\n# frames = \"enu-flu\"\n\
                # A yaw from east, counter-clockwise: unit = \"deg\", sign = -1, offset = -90.\n"
    }

    fn entry(&self, text: &mut String, entry: &Entry) {
        let column = &self.columns[entry.place];
        let _ = writeln!(text, "\n[columns.{}]", entry.target);
        comment(text, "", &mark(entry));
        let _ = writeln!(text, "column = {}  # {}", quoted(&column.name), column.range());
        if !entry.unit.is_empty() {
            let _ = writeln!(text, "unit = \"{}\"", entry.unit);
        }
        if entry.sign < 0.0 {
            *text += "sign = -1\n";
        }
        if entry.scale != 1.0 {
            let _ = writeln!(text, "scale = {:?}", entry.scale);
        }
        if entry.offset != 0.0 || column.is_pressure() {
            let _ = writeln!(text, "offset = {:?}", entry.offset);
        }
    }

    fn unused(&self) -> impl Iterator<Item = &Seen> {
        let is_used = |place: &usize| {
            self.time.is_some_and(|time| time.0 == *place)
                || self.quaternion.is_some_and(|places| places.contains(place))
                || self.counts.contains(place)
                || self.entries.iter().any(|entry| entry.place == *place)
        };
        self.columns.iter().enumerate().filter(move |(place, _)| !is_used(place)).map(|(_, column)| column)
    }

    pub fn draft(&self, changes: Vec<String>, doubts: Vec<String>) -> Draft {
        let name = |place: usize| self.columns[place].name.clone();
        let mut guesses: Vec<(String, String)> =
            self.time.iter().map(|(place, (unit, _))| (name(*place), format!("time in {unit}"))).collect();
        guesses.extend(self.quaternion.into_iter().flatten().map(|at| (name(at), "part of a quaternion".to_owned())));
        guesses.extend(self.entries.iter().map(|entry| (name(entry.place), entry.target.to_owned())));
        let dates = self.time.filter(|(place, _)| self.columns[*place].is_open_date());
        let dates = dates.map(|_| ("time".to_owned(), "the day or the month first: dmy or mdy".to_owned()));
        let checks = self.entries.iter().filter(|entry| entry.sure.is_none());
        let checks = dates.into_iter().chain(checks.map(|entry| (entry.target.to_owned(), entry.checks.join("; "))));
        let mut head = String::new();
        for doubt in &doubts {
            comment(&mut head, "", &format!("Not right yet: {doubt}"));
        }
        let mut unused: Vec<String> = self.counts.iter().map(|place| name(*place)).collect();
        unused.extend(self.unused().map(|column| column.name.clone()));
        Draft { text: head + &self.text(), guesses, unused, checks: checks.collect(), changes, doubts }
    }
}

/// "sure" or "check", and why.
fn mark(entry: &Entry) -> String {
    match (&entry.sure, entry.checks.is_empty()) {
        (Some(why), true) => format!("sure: {why}"),
        (Some(why), false) => format!("sure: {why}; {}", entry.checks.join("; ")),
        (None, true) => "check: by its name alone; no test of this table shows it".to_owned(),
        (None, false) => format!("check: {}", entry.checks.join("; ")),
    }
}

/// Adds lines of comment.
fn comment(text: &mut String, before: &str, said: &str) {
    *text += before;
    let mut line = String::from("#");
    for word in said.split_whitespace() {
        if line.len() + word.len() > WIDTH {
            let _ = writeln!(text, "{line}");
            line = String::from("#  ");
        }
        line = format!("{line} {word}");
    }
    let _ = writeln!(text, "{line}");
}

/// A name as a TOML string.
fn quoted(name: &str) -> String {
    toml::Value::from(name).to_string()
}

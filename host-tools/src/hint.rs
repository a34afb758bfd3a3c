//! How the command line gives what an error of the libraries asks for: they know no options and no commands.

/// Words of an error, and what to do about it here.
pub const HINTS: [(&str, &str); 17] = [
    ("exists already", "--force replaces it"),
    (" does not fly: ", "`backseat vehicle check` says more, --force flies it"),
    ("holds a flight already", "--out names another"),
    ("needs a mapping of its columns", "`backseat map` drafts one, --columns reads by it"),
    ("takes no mapping of columns", "leave --columns out"),
    ("needs no mapping of its columns", "`backseat info` says what it holds"),
    ("a column mapping, not a log", "`LOG --columns FILE` reads a log by it"),
    ("a configuration of topside, not a log", "`backseat topside FILE` runs it"),
    ("a scenario, not a log", "`backseat sim run FILE` flies it and writes one"),
    ("a mission, not a log", "`backseat mission put PORT FILE` stores it on the board"),
    ("a vehicle file, not a log", "--vehicle FILE"),
    ("give one of the logs in it", "`backseat info FILE` says what each is for"),
    ("a session, not a table", "`backseat export FILE --csv DIR`"),
    ("without the latitude and longitude of their origin", "--origin states that of the vehicle's log"),
    ("has its model in the laboratory", "in a clone of the repository `cargo lab single-log LOG`"),
    ("the kinematic model does not", "--model kinematic"),
    ("what is common to runs shows in", "`--predict` judges a vehicle file on any number"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The sources of what Python has as well, without comments and tests.
    fn sources() -> Vec<(String, String)> {
        fn collect(folder: &Path, sources: &mut Vec<(String, String)>) {
            for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
                let path = entry.path();
                if path.is_dir() {
                    collect(&path, sources);
                } else if path.extension().is_some_and(|extension| extension == "rs") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
                    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
                    sources.push((path.display().to_string(), lines.collect::<Vec<_>>().join("\n")));
                }
            }
        }
        let mut sources = Vec::new();
        for of in ["analysis", "diagnose", "estimation", "identify", "logs", "python"] {
            collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join(of).join("src"), &mut sources);
        }
        sources
    }

    #[test]
    fn every_hint_belongs_to_an_error() {
        let sources = sources();
        for (words, _) in HINTS {
            assert!(sources.iter().any(|(_, source)| source.contains(words)), "no error says {words:?}");
        }
    }

    /// Python shows the same errors.
    #[test]
    fn errors_of_the_libraries_speak_of_no_options_and_commands() {
        const ERRORS: [&str; 10] = [
            "bail!(",
            "anyhow!(",
            "ensure!(",
            "Err(",
            "fail(",
            "DataError::file(",
            "DataError::at(",
            "context(",
            "#[error(",
            "let message = ",
        ];
        let is_option = |text: &str| {
            text.split("--").skip(1).any(|after| after.starts_with(|first: char| first.is_ascii_lowercase()))
        };
        let mut found = 0;
        for (path, source) in sources() {
            for (at, _) in ERRORS.iter().flat_map(|error| source.match_indices(error)) {
                let statement = source[at..].split(";\n").next().and_then(|text| text.split("} else").next());
                let statement = statement.unwrap_or_default();
                // the literals alone: every second part between quotes
                for text in statement.split('"').skip(1).step_by(2).take(2) {
                    found += 1;
                    let is_command = text.contains("`backseat ") || text.contains("(backseat ");
                    assert!(!is_option(text) && !is_command, "{path}: {text}");
                }
            }
        }
        assert!(found > 300, "{found}");
    }
}

//! Commands that a user can paste.

use std::path::Path;

/// A path as one word of a command line: quoted where it has blanks, or what means something to a shell.
#[must_use]
pub fn word(path: &Path) -> String {
    let text = path.display().to_string();
    shlex::try_quote(&text).map(std::borrow::Cow::into_owned).unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_are_kept_together() {
        assert_eq!(word(Path::new("out/survey-1/log.csv")), "out/survey-1/log.csv");
        assert_eq!(word(Path::new("my log.csv")), "'my log.csv'");
        assert_eq!(word(Path::new("it's.csv")), "\"it's.csv\"");
    }
}

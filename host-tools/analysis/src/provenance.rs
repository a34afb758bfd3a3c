//! How a report was made.

use std::path::Path;

/// The command as typed; in another program than `backseat`, that program's name.
pub fn command() -> String {
    let mut words = std::env::args_os();
    let program = words.next().unwrap_or_default();
    let name = Path::new(&program).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if name != "backseat" {
        return format!("backseat as a library of {name}");
    }
    let rest: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    format!("backseat {}", rest.join(" "))
}

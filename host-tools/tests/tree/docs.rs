//! README and docs: every link leads somewhere, every command line is one, every page is in the book.

use backseat_logs::Column;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Every Markdown page of the repository that is written for people, relative to its root.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(PathBuf::from).into();
    let folders = ["docs", "docs/guide", "docs/method", "docs/results", "host-tools/fuzz", "firmware/boards/stm32h743"];
    for folder in folders {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name();
            if Path::new(&name).extension().is_some_and(|extension| extension == "md") {
                pages.push(Path::new(folder).join(name));
            }
        }
    }
    pages.sort();
    pages
}

/// The page's lines with their number, and whether each is code.
fn lines(page: &Path) -> Vec<(usize, String, bool)> {
    let text = std::fs::read_to_string(root().join(page)).unwrap();
    let (mut fenced, mut out) = (false, Vec::new());
    for (index, line) in text.lines().enumerate() {
        let fence = line.trim_start().starts_with("```");
        out.push((index + 1, line.to_owned(), fenced || fence || line.starts_with("    ")));
        fenced ^= fence;
    }
    out
}

/// The anchor of a heading, as GitHub and mdBook make it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

fn has_anchor(page: &Path, wanted: &str) -> bool {
    lines(page)
        .iter()
        .any(|(_, line, is_code)| !is_code && line.starts_with('#') && anchor(line.trim_start_matches('#')) == wanted)
}

/// Targets of the links in a line of Markdown.
fn links(line: &str) -> Vec<&str> {
    line.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target).collect()
}

#[test]
fn every_link_leads_somewhere() {
    let mut dead = Vec::new();
    for page in pages() {
        for (number, line, is_code) in lines(&page) {
            if is_code {
                continue;
            }
            for target in links(&line).into_iter().filter(|target| !target.contains("://")) {
                let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
                let file =
                    if file.is_empty() { page.clone() } else { page.parent().unwrap_or(Path::new("")).join(file) };
                let is_there = root().join(&file).exists();
                if !is_there || !(anchor.is_empty() || has_anchor(&file, anchor)) {
                    dead.push(format!("{}:{number}: {target}", page.display()));
                }
            }
        }
    }
    assert!(dead.is_empty(), "links that lead nowhere:\n{}", dead.join("\n"));
}

/// A page of the book cannot reach a file that the book does not hold.
#[test]
fn links_of_the_book_stay_in_it() {
    let mut outside = Vec::new();
    for page in pages().into_iter().filter(|page| page.starts_with("docs")) {
        let depth = page.components().count() - 2;
        for (number, line, is_code) in lines(&page) {
            let leaves = |target: &&str| target.matches("../").count() > depth;
            let targets = if is_code { Vec::new() } else { links(&line) };
            outside.extend(
                targets.iter().filter(|target| leaves(target)).map(|t| format!("{}:{number}: {t}", page.display())),
            );
        }
    }
    assert!(outside.is_empty(), "links that leave docs/:\n{}", outside.join("\n"));
}

#[test]
fn every_page_is_in_the_book() {
    let summary = std::fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let listed: BTreeSet<PathBuf> =
        summary.lines().flat_map(links).map(|target| Path::new("docs").join(target)).collect();
    let there: BTreeSet<PathBuf> =
        pages().into_iter().filter(|page| page.starts_with("docs") && !page.ends_with("SUMMARY.md")).collect();
    assert_eq!(listed, there, "docs/SUMMARY.md lists other pages than there are");
}

#[test]
fn every_column_is_on_the_page_of_the_log_format() {
    let page = std::fs::read_to_string(root().join("docs/guide/log_format.md")).unwrap();
    let missing: Vec<&str> =
        Column::ALL.into_iter().map(Column::name).filter(|name| !page.contains(&format!("`{name}`"))).collect();
    assert!(missing.is_empty(), "columns that docs/guide/log_format.md does not have: {missing:?}");
}

/// Text that names an option without its value is not meant to be typed.
fn is_mention(span: &str) -> bool {
    span.split(' ').next_back().is_some_and(|word| word.starts_with("--"))
}

/// The arguments of a command line that runs `backseat`, without its comment; `None` of any other line.
fn arguments(line: &str) -> Option<Vec<String>> {
    let command = line.split(" #").next().unwrap_or_default().trim();
    let prefixes = ["cargo run --release --", "cargo run --", "cargo run --release", "cargo backseat", "backseat"];
    let rest = prefixes.iter().find_map(|prefix| command.strip_prefix(prefix))?;
    let is_end = rest.is_empty() || rest.starts_with(' ');
    // Quoted words hold blanks.
    let quoted = rest.split(['"', '\'']).enumerate();
    let words = quoted.flat_map(|(i, part)| if i % 2 == 1 { vec![part] } else { part.split_whitespace().collect() });
    is_end.then(|| words.map(str::to_owned).collect())
}

/// Of code and of text in backticks. With `--help` behind it a command line is parsed up to its end and not run.
#[test]
fn every_command_line_is_one() {
    let mut wrong = Vec::new();
    let mut commands = BTreeSet::new();
    for page in pages() {
        for (number, line, is_code) in lines(&page) {
            let spans = line
                .split('`')
                .skip(1)
                .step_by(2)
                .filter(|span| !span.contains(['[', '<', '|', '…']) && !is_mention(span));
            let texts: Vec<&str> = if is_code { vec![&*line] } else { spans.collect() };
            commands.extend(texts.into_iter().filter_map(|text| Some((arguments(text)?, page.clone(), number))));
        }
    }
    assert!(commands.len() > 50, "only {} command lines were found", commands.len());
    for (arguments, page, number) in commands {
        let output = Command::new(env!("CARGO_BIN_EXE_backseat")).args(&arguments).arg("--help").output().unwrap();
        if !output.status.success() {
            let complaint = String::from_utf8_lossy(&output.stderr);
            let first = complaint.lines().next().unwrap_or_default().to_owned();
            wrong.push(format!("{}:{number}: backseat {}\n  {first}", page.display(), arguments.join(" ")));
        }
    }
    assert!(wrong.is_empty(), "command lines that `backseat` does not understand:\n{}", wrong.join("\n"));
}

/// Pages whose long lines are a program's.
fn is_generated(page: &Path) -> bool {
    ["cost.md", "emulation.md", "parameters.md"].iter().any(|name| page.ends_with(name))
}

/// Tables, code and links may be long; prose is read.
#[test]
fn prose_is_no_wider_than_120_characters() {
    let mut wide = Vec::new();
    for page in pages() {
        for (number, line, is_code) in lines(&page) {
            let is_prose = !is_code
                && !is_generated(&page)
                && !line.starts_with('|')
                && !line.starts_with('!')
                && !line.starts_with("<!--");
            if is_prose && line.chars().count() > 120 {
                wide.push(format!("{}:{number}", page.display()));
            }
        }
    }
    assert!(wide.is_empty(), "prose wider than 120 characters:\n{}", wide.join("\n"));
}

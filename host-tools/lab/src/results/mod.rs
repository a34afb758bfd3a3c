//! Which pages of `docs/results` are older than the code they show.
//!
//! `docs/results/made_with.csv` holds for each page a sum over the sources that it shows, as they were when it was made.
//! Comments and tests do not count.

mod tables;

use anyhow::{Context, bail};
use backseat_report::console;
use crc::{CRC_64_XZ, Crc, Digest};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SUM: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// Which pages to do what with.
#[derive(clap::Args)]
pub struct Args {
    /// Run the commands of these pages, of all old ones if none is named, and note that they were made
    #[arg(long, value_name = "PAGE", num_args = 0..)]
    renew: Option<Vec<String>>,
    /// Note that these pages were made with the code as it is
    #[arg(long, value_name = "PAGE", num_args = 1.., conflicts_with = "renew")]
    made: Vec<String>,
}

#[derive(Deserialize)]
struct Pages {
    groups: BTreeMap<String, Vec<PathBuf>>,
    pages: BTreeMap<String, Page>,
}

#[derive(Deserialize)]
struct Page {
    /// A group of sources; none is never old.
    shows: Option<String>,
    command: Option<String>,
    /// The command writes the page.
    #[serde(default)]
    out: bool,
}

impl Args {
    /// Lists the pages, or renews them.
    ///
    /// # Errors
    /// A page that is unknown, a command that fails, a file that cannot be read or written.
    pub fn run(&self) -> anyhow::Result<()> {
        let root = root();
        let mut results = Results::read(&root)?;
        for page in &self.made {
            results.note(page)?;
        }
        if let Some(named) = &self.renew {
            let old = || results.old().map(str::to_owned).collect();
            for page in if named.is_empty() { old() } else { named.clone() } {
                results.renew(&page)?;
            }
        }
        console::print(results.table().as_bytes())
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The pages, and what each was made with.
struct Results {
    root: PathBuf,
    pages: Pages,
    /// Sum of each group of sources as they are.
    now: BTreeMap<String, String>,
    made_with: BTreeMap<String, String>,
}

impl Results {
    /// Reads the sources below `root`.
    ///
    /// # Errors
    /// A file that cannot be read.
    fn read(root: &Path) -> anyhow::Result<Self> {
        let pages: Pages = toml::from_str(include_str!("pages.toml"))?;
        let sum = |(name, folders): (&String, &Vec<PathBuf>)| -> anyhow::Result<_> {
            let mut sum = SUM.digest();
            for folder in folders {
                add(&root.join(folder), &mut sum)?;
            }
            Ok((name.clone(), format!("{:016x}", sum.finalize())))
        };
        let now = pages.groups.iter().map(sum).collect::<anyhow::Result<_>>()?;
        let mut made_with = BTreeMap::new();
        let path = root.join("docs/results/made_with.csv");
        for line in csv::Reader::from_path(&path).with_context(|| path.display().to_string())?.into_deserialize() {
            let (page, sum): (String, String) = line.with_context(|| path.display().to_string())?;
            made_with.insert(page, sum);
        }
        Ok(Self { root: root.to_owned(), pages, now, made_with })
    }

    /// Names of all pages.
    fn names(&self) -> impl Iterator<Item = &str> {
        self.pages.pages.keys().map(String::as_str)
    }

    /// Pages that are older than their code.
    fn old(&self) -> impl Iterator<Item = &str> {
        self.names().filter(|name| self.sum(name).is_some_and(|now| self.made_with.get(*name) != Some(now)))
    }

    fn page(&self, name: &str) -> anyhow::Result<&Page> {
        let known = || self.names().collect::<Vec<_>>().join(", ");
        self.pages.pages.get(name).with_context(|| format!("no page {name} in docs/results; there are {}", known()))
    }

    /// Of the sources that it shows.
    fn sum(&self, name: &str) -> Option<&String> {
        self.now.get(self.pages.pages.get(name)?.shows.as_ref()?)
    }

    fn note(&mut self, name: &str) -> anyhow::Result<()> {
        self.page(name)?;
        let Some(sum) = self.sum(name).cloned() else { bail!("{name} shows no code of the tree and is never old") };
        self.made_with.insert(name.to_owned(), sum);
        let mut out = csv::Writer::from_path(self.root.join("docs/results/made_with.csv"))?;
        out.write_record(["page", "sources"])?;
        self.made_with.iter().try_for_each(|(page, sum)| out.write_record([page, sum]))?;
        Ok(out.flush()?)
    }

    fn renew(&mut self, name: &str) -> anyhow::Result<()> {
        let page = self.page(name)?;
        let Some(command) = &page.command else { bail!("{name} is renewed by hand: its commands are in the page") };
        let file = format!("docs/results/{name}.md");
        console::print(format!("{file}: {command}\n").as_bytes())?;
        let done =
            Command::new("sh").arg("-c").arg(command).current_dir(&self.root).stderr(Stdio::inherit()).output()?;
        console::print(&done.stdout)?;
        if !done.status.success() {
            bail!("{command}: {}", done.status);
        }
        if page.out {
            return self.note(name);
        }
        let path = self.root.join(&file);
        let old = fs::read_to_string(&path).with_context(|| file.clone())?;
        let (new, put, left) = tables::put(&old, &String::from_utf8_lossy(&done.stdout));
        fs::write(&path, new)?;
        let next = format!(
            "{file}: {put} tables renewed, {left} printed that it does not have; read its text, then: cargo lab results --made {name}\n"
        );
        console::print(next.as_bytes())
    }

    fn table(&self) -> String {
        let old: Vec<&str> = self.old().collect();
        let mut out = String::new();
        for (name, Page { shows, command, .. }) in &self.pages.pages {
            let state = match shows {
                None => "kept",
                Some(_) if old.contains(&name.as_str()) => "old",
                Some(_) => "as the code",
            };
            let _ = writeln!(out, "{name:<26}  {state:<11}  {}", command.as_deref().unwrap_or("by hand"));
        }
        let _ =
            writeln!(out, "\n{} of {} pages are older than the code that they show", old.len(), self.pages.pages.len());
        out
    }
}

/// Adds the code of a folder: what is not a comment, a blank line or a test.
fn add(folder: &Path, sum: &mut Digest<'_, u64>) -> anyhow::Result<()> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<Vec<_>>>()?;
    paths.sort();
    for path in paths {
        let name = path.file_stem().unwrap_or_default();
        if name == "tests" {
            continue;
        }
        if path.is_dir() {
            add(&path, sum)?;
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "toml") {
            let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            code(&text).for_each(|line| sum.update(line.as_bytes()));
        }
    }
    Ok(())
}

fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).take_while(|line| *line != "#[cfg(test)]").filter(|line| !line.starts_with("//"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(text: &str) -> u64 {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.rs"), text).unwrap();
        let mut digest = SUM.digest();
        add(folder.path(), &mut digest).unwrap();
        digest.finalize()
    }

    #[test]
    fn code_makes_a_page_old_and_a_comment_does_not() {
        let code = "fn f() -> f64 {\n    1.0\n}\n";
        assert_eq!(sum(code), sum("//! One.\n\nfn f() -> f64 {\n    // why\n    1.0\n}\n#[cfg(test)]\nmod tests {}\n"));
        assert_ne!(sum(code), sum(&code.replace("1.0", "2.0")));
    }

    #[test]
    fn every_page_has_an_entry() {
        let results = Results::read(&root()).unwrap();
        let entries = fs::read_dir(root().join("docs/results")).unwrap().map(|entry| entry.unwrap().path());
        let mut pages: Vec<String> = entries
            .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
            .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
            .collect();
        pages.sort();
        assert_eq!(pages, results.names().collect::<Vec<_>>());
    }

    #[test]
    #[ignore = "fails as long as a page is old: .ci/nightly"]
    fn no_page_is_older_than_the_code_that_it_shows() {
        let results = Results::read(&root()).unwrap();
        assert!(results.old().next().is_none(), "\n{}", results.table());
    }
}

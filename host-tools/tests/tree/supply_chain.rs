//! What the project depends on, and what it forbids itself, held to `.cargo/deny.toml` without any tool.

use spdx::{Expression, ParseMode};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::{Table, Value};

/// Where hardware is touched, and `unsafe` with it.
const BOARDS: [&str; 2] = ["firmware/boards/mps2", "firmware/boards/stm32h743"];
/// What PyO3's macros make is unsafe; what is written there is not.
const PYTHON: &str = "host-tools/python";
/// What libFuzzer's macro makes is unsafe, when it is switched on; what is written there is not.
const FUZZ: &str = "host-tools/fuzz";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a workspace").to_owned()
}

fn read(path: &str) -> Table {
    let path = root().join(path);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn text<'a>(table: &'a Value, key: &str) -> &'a str {
    table.get(key).and_then(Value::as_str).unwrap_or_default()
}

fn strings(list: &Value) -> impl Iterator<Item = &str> {
    list.as_array().expect("a list").iter().map(|item| item.as_str().expect("a string"))
}

fn locked() -> Vec<Value> {
    read("Cargo.lock")["package"].as_array().expect("packages").clone()
}

fn members() -> Vec<String> {
    strings(&read("Cargo.toml")["workspace"]["members"]).map(str::to_owned).collect()
}

#[test]
fn every_crate_is_of_crates_io_and_has_a_checksum() {
    let ours: Vec<_> = locked().into_iter().filter(|package| package.get("source").is_none()).collect();
    assert_eq!(ours.len(), members().len(), "a path outside the workspace: {ours:?}");
    for package in locked().iter().filter(|package| package.get("source").is_some()) {
        assert_eq!(text(package, "source"), "registry+https://github.com/rust-lang/crates.io-index", "{package}");
        assert_eq!(text(package, "checksum").len(), 64, "{package}");
    }
}

#[test]
fn no_crate_comes_in_two_versions_but_for_those_named() {
    let number =
        |version: &str| -> Vec<u64> { version.split(['.', '-', '+']).map(|part| part.parse().unwrap_or(0)).collect() };
    let mut versions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in locked() {
        versions.entry(text(&package, "name").to_owned()).or_default().push(text(&package, "version").to_owned());
    }
    // All but the newest of each.
    let older: BTreeSet<String> = versions
        .iter_mut()
        .flat_map(|(name, versions)| {
            versions.sort_by_key(|version| number(version));
            versions.pop();
            versions.iter().map(|version| format!("{name}@{version}")).collect::<Vec<_>>()
        })
        .collect();
    let deny = read(".cargo/deny.toml");
    let named: BTreeSet<String> = deny["bans"]["skip"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|skip| {
            assert!(!text(skip, "reason").is_empty(), "{skip}");
            text(skip, "crate").to_owned()
        })
        .collect();
    assert_eq!(older, named, "left: what Cargo.lock has; right: what .cargo/deny.toml names");
}

#[test]
fn only_the_boards_may_be_unsafe() {
    let workspace = read("Cargo.toml");
    assert_eq!(text(&workspace["workspace"]["lints"]["rust"], "unsafe_code"), "forbid");
    for member in members() {
        let manifest = read(&format!("{member}/Cargo.toml"));
        let lints = &manifest["lints"];
        if BOARDS.contains(&member.as_str()) {
            // Each of its few blocks says why it is sound.
            assert_eq!(text(&lints["clippy"], "undocumented_unsafe_blocks"), "warn", "{member}");
        } else if member == FUZZ {
            // libFuzzer's entry points are, inside its macro; the library forbids it by itself.
            let library = "#![forbid(unsafe_code)]";
            assert!(
                sources(&root().join(&member).join("src")).iter().any(|source| source.contains(library)),
                "{member}"
            );
            let rest = |source: &String| source.replace(library, "");
            assert!(sources(&root().join(&member)).iter().all(|s| !rest(s).contains("unsafe")), "{member}");
        } else if member == PYTHON {
            assert_eq!(text(&lints["rust"], "unsafe_code"), "deny", "{member}");
            assert!(sources(&root().join(&member)).iter().all(|source| !source.contains("unsafe")), "{member}");
        } else {
            assert_eq!(lints.get("workspace").and_then(Value::as_bool), Some(true), "{member}");
        }
    }
}

/// The Rust files of a folder and those in it.
fn sources(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(std::fs::read_to_string(&path).expect("a text"));
        }
    }
    found
}

#[test]
fn the_oldest_compiler_promised_is_the_one_that_builds() {
    let workspace = read("Cargo.toml");
    let promised = text(&workspace["workspace"]["package"], "rust-version").to_owned();
    let used = read("rust-toolchain.toml");
    let used = text(&used["toolchain"], "channel");
    assert!(used == promised || used.starts_with(&format!("{promised}.")), "{used} {promised}");
    for member in members() {
        let inherited = read(&format!("{member}/Cargo.toml"))["package"]["rust-version"].get("workspace").is_some();
        assert!(inherited, "{member}");
    }
}

#[test]
#[ignore = "needs the manifests of every target's crates: cargo fetch --locked"]
fn every_licence_is_one_of_those_allowed() {
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--locked", "--offline", "--format-version", "1"])
        .current_dir(root())
        .output()
        .expect("cargo");
    assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&metadata.stdout).expect("JSON");
    let deny = read(".cargo/deny.toml");
    let licenses = &deny["licenses"];
    let of_all: Vec<&str> = strings(&licenses["allow"]).collect();
    for package in metadata["packages"].as_array().expect("packages") {
        let name = package["name"].as_str().expect("a name");
        let exceptions = licenses["exceptions"].as_array().expect("a list").iter();
        let of_this = exceptions.filter(|exception| text(exception, "crate") == name);
        let mut allowed: Vec<&str> = of_this.flat_map(|exception| strings(&exception["allow"])).collect();
        allowed.extend(&of_all);
        let licence = package["license"].as_str().unwrap_or_else(|| panic!("{name} has no licence"));
        let expression = Expression::parse_mode(licence, ParseMode::LAX)
            .unwrap_or_else(|error| panic!("{name}: {licence}: {error}"));
        let is_allowed = expression.evaluate(|requirement| {
            let id = requirement.license.id();
            let is_plain = requirement.addition.is_none() && id.is_some_and(|id| allowed.contains(&id.name));
            // with what it adds to a licence only where the list says so by name
            is_plain || allowed.contains(&requirement.to_string().as_str())
        });
        assert!(is_allowed, "{name}: {licence}");
    }
}

//! `cargo lab reproduce` as a user runs it.

use std::path::Path;
use std::process::{Command, Output};

fn lab(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lab")).args(arguments).current_dir(folder).output().expect("starts")
}

fn reproduce(folder: &Path, arguments: &[&str]) -> Output {
    lab(folder, &[&["reproduce"], arguments].concat())
}

fn ok(output: &Output) -> &[u8] {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    &output.stdout
}

/// The cheapest item: surge alone.
const CHEAP: &str = "least-squares-4.3.2.3";

#[test]
fn finished_runs_are_kept_and_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join("out").join(name);
    let arguments = [CHEAP, "--runs", "2", "--report", "out", "--json"];
    let first = reproduce(folder.path(), &arguments);
    let json: serde_json::Value = serde_json::from_slice(ok(&first)).unwrap();
    assert_eq!((&json["items"][0]["id"], &json["items"][0]["runs"]), (&CHEAP.into(), &2.into()));
    let kept = |name: &str| std::fs::read(path(name)).unwrap();
    let (runs, page) = (kept("runs.jsonl"), kept("report.html"));
    assert_eq!(runs.iter().filter(|byte| **byte == b'\n').count(), 2);

    let again = reproduce(folder.path(), &arguments);
    assert_eq!(ok(&again), first.stdout);
    assert_eq!((kept("runs.jsonl"), kept("report.html")), (runs.clone(), page));

    // Interrupted while it wrote the second run: that one alone is run again.
    let first_line = runs.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    std::fs::write(path("runs.jsonl"), &runs[..first_line + 20]).unwrap();
    assert_eq!(ok(&reproduce(folder.path(), &arguments)), first.stdout);
    assert_eq!(kept("runs.jsonl"), runs);

    // Another's page stays.
    std::fs::write(path("report.html"), "mine").unwrap();
    let refused = reproduce(folder.path(), &arguments);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
    ok(&reproduce(folder.path(), &[&arguments[..], &["--force"]].concat()));
    assert_ne!(kept("report.html"), b"mine");
}

#[test]
fn an_unknown_item_is_refused_with_what_there_is() {
    let output = reproduce(Path::new("."), &["table-9.9"]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    for id in ["table-4.15", "figures-2.2-2.6", "closed-loop-models", CHEAP] {
        assert!(message.contains(id), "{message}");
    }
    assert_eq!(reproduce(Path::new("."), &[CHEAP, "--runs", "0"]).status.code(), Some(2));
}

#[test]
fn two_parts_merged_give_the_same_page_as_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let page = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let runs = |more: &[&str]| reproduce(folder.path(), &[&[CHEAP, "--runs", "3"], more].concat());
    let whole = runs(&["--out", "whole.md"]);
    for (part, store) in [("1/2", "a.jsonl"), ("2/2", "b.jsonl")] {
        let text = runs(&["--shard", part, "--store", store]);
        assert!(String::from_utf8_lossy(ok(&text)).contains("of 3 runs in"), "{text:?}");
    }
    ok(&lab(folder.path(), &["merge", "a.jsonl", "b.jsonl", "-o", "both.jsonl"]));
    let merged = runs(&["--store", "both.jsonl", "--out", "merged.md"]);
    assert_eq!(ok(&merged), ok(&whole));
    assert_eq!(page("merged.md"), page("whole.md"));
    assert_eq!(page("both.jsonl").iter().filter(|byte| **byte == b'\n').count(), 3, "a run was done again");

    // A result of another program is refused by file and line.
    let other = String::from_utf8(page("b.jsonl")).unwrap().replacen("\"build\":\"", "\"build\":\"0", 1);
    std::fs::write(folder.path().join("c.jsonl"), other).unwrap();
    let refused = lab(folder.path(), &["merge", "a.jsonl", "c.jsonl", "-o", "all.jsonl"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("c.jsonl, line 1: a result of version"), "{refused:?}");
}

//! What is released is what was tried.

use std::path::{Path, PathBuf};

const BUILD: &str = "firmware/boards/stm32h743/build";
const EMULATION: &str = "firmware/boards/stm32h743/emulation/run";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn script(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Each other way to build it would choose profile, features and packages of its own.
#[test]
fn the_scripts_build_the_boards_image_in_one_place() {
    let folder = std::fs::read_dir(root().join(".ci")).unwrap();
    let scripts = folder.map(|entry| format!(".ci/{}", entry.unwrap().file_name().to_string_lossy()));
    for path in scripts.chain([EMULATION.to_owned()]) {
        let text = script(&path);
        let own = text.lines().find(|line| line.contains(" build ") && line.contains("backseat-stm32h743"));
        assert_eq!(own, None, "{path} builds the image by itself: {BUILD}");
    }
    assert!(script(BUILD).contains("--profile dist -p backseat-stm32h743 "));
    for path in [".ci/run", ".ci/release"] {
        assert!(script(path).contains(BUILD), "{path}");
    }
    assert!(script(EMULATION).contains("../build"));
}

/// The emulation of a release runs the file that was put into it, not another one.
#[test]
fn the_emulation_runs_the_file_that_is_released() {
    let release = script(".ci/release");
    let place = "$out/backseat-$version-stm32h743.elf";
    let at = |what: &str| release.find(what).unwrap_or_else(|| panic!(".ci/release has no {what}"));
    let (put, tried) = (at(&format!("cp \"$({BUILD})\" \"{place}\"")), at(&format!("IMAGE={place} ")));
    assert!(put < tried && tried < at("sha256sum"), "copied, tried, and then named with its checksum");
    assert!(release[tried..].lines().next().is_some_and(|line| line.ends_with(".ci/emulation")));
    assert!(script(".ci/emulation").contains(EMULATION) && script(".ci/run").contains(".ci/emulation"));
    assert!(script(EMULATION).contains("image=${IMAGE:-"));
}

//! Builds and runs the ARM images.

use crate::stack::{self, Stack};
use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const EMULATOR: &str = "qemu-system-arm";
const TARGET: &str = "thumbv7em-none-eabihf";
/// An image ends within seconds; on a busy machine within some more.
const PATIENCE_S: &str = "120";
/// When it is set, what is missing is an error.
const REQUIRED: &str = "BACKSEAT_REQUIRE_QEMU";

/// Whether emulator and ARM target are installed; says so when they are not.
pub fn ready() -> bool {
    let Some(missing) = hil_sim::backseat::missing() else { return true };
    assert!(std::env::var_os(REQUIRED).is_none(), "{missing}");
    // Past the capture of a passing test's output.
    let _ = writeln!(std::io::stderr(), "\nSKIPPED: {missing}\n");
    false
}

/// One of the toolchain's programs, as the cargo that started this names it, without flags meant for this computer.
fn tool(variable: &str, name: &str) -> Command {
    let mut command = Command::new(std::env::var_os(variable).unwrap_or_else(|| name.into()));
    command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).stdin(Stdio::null());
    command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    command
}

/// Builds one binary of `backseat-mps2` with the firmware profile, as boards run it; its path.
pub fn build(binary: &str) -> anyhow::Result<PathBuf> {
    build_as(binary, "firmware")
}

/// The same with another profile.
pub fn build_as(binary: &str, profile: &str) -> anyhow::Result<PathBuf> {
    let output = tool("CARGO", "cargo")
        .args(["build", "--package", "backseat-mps2", "--bin", binary, "--profile", profile, "--target", TARGET])
        .args(["--quiet", "--message-format", "json-render-diagnostics"])
        .output()
        .context("cargo")?;
    ensure!(output.status.success(), "{binary} does not build:\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == binary)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .context("cargo names no image")
}

/// Runs an image to its end; what it wrote.
///
/// An instruction takes 2⁶ ns of the machine's time, whatever this computer is busy with.
pub fn run(image: &Path) -> anyhow::Result<String> {
    let output = Command::new("timeout")
        .args([PATIENCE_S, EMULATOR, "-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "none"])
        .args(["-icount", "shift=6,sleep=off", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .stdin(Stdio::null())
        .output()
        .context("timeout")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        bail!("{}: {}\n{text}\n{}", image.display(), output.status, String::from_utf8_lossy(&output.stderr));
    }
    Ok(text)
}

/// What an image takes, in bytes.
pub struct Image {
    /// Code, constants and initial values.
    pub flash: u64,
    /// Variables, without stack and DMA buffers.
    pub ram: u64,
    /// Variables that do not begin as zero: they take flash as well.
    pub initialised: u64,
    /// Its deepest stack.
    pub stack: Stack,
}

/// By the sections and the code of the ELF file.
pub fn examine(image: &Path) -> anyhow::Result<Image> {
    let bytes = std::fs::read(image)?;
    let file = object::File::parse(&*bytes)?;
    let sum = |names: &[&str]| {
        file.sections().filter(|s| s.name().is_ok_and(|name| names.contains(&name))).map(|s| s.size()).sum()
    };
    Ok(Image {
        flash: sum(&[".vector_table", ".text", ".rodata", ".data"]),
        ram: sum(&[".data", ".bss", ".uninit"]),
        initialised: sum(&[".data"]),
        stack: stack::bound(&bytes)?,
    })
}

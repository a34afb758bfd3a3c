//! Builds and runs the ARM images.

use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const EMULATOR: &str = "qemu-system-arm";
const TARGET: &str = "thumbv7em-none-eabihf";
/// What takes longer hangs: an image ends within seconds, on a busy machine within minutes.
const PATIENCE_S: &str = "600";
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

/// Builds one binary of a board's package as the board runs it; its path.
pub fn build(package: &str, binary: &str) -> anyhow::Result<PathBuf> {
    let output = tool("CARGO", "cargo")
        .args(["build", "--package", package, "--bin", binary, "--profile", "dist", "--target", TARGET])
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

/// What an image takes and may take, in bytes.
pub struct Image {
    /// Its package.
    pub name: &'static str,
    /// Code, constants and initial values.
    pub flash: Share,
    /// Variables in DTCM, without the stack.
    pub dtcm: Share,
    /// Variables in AXI SRAM.
    pub axi: Share,
    /// What its stack may take.
    pub stack_limit: u32,
}

/// Bytes taken, and their limit.
pub struct Share {
    pub taken: u32,
    pub limit: u32,
}

/// By the sections and the limits (`memory.x`) of the ELF file.
pub fn examine(name: &'static str, image: &Path) -> anyhow::Result<Image> {
    let bytes = std::fs::read(image)?;
    let file = object::File::parse(&*bytes)?;
    let limit = |symbol: &str| -> anyhow::Result<u32> {
        let found = file.symbols().find(|candidate| candidate.name() == Ok(symbol));
        Ok(u32::try_from(found.with_context(|| format!("{name} has no {symbol}: memory.x"))?.address())?)
    };
    let share = |names: &[&str], symbol| -> anyhow::Result<Share> {
        let sizes = file.sections().filter(|s| s.name().is_ok_and(|name| names.contains(&name))).map(|s| s.size());
        Ok(Share { taken: u32::try_from(sizes.sum::<u64>())?, limit: limit(symbol)? })
    };
    Ok(Image {
        name,
        flash: share(&[".vector_table", ".text", ".rodata", ".data"], "_limit_flash")?,
        dtcm: share(&[".data", ".bss", ".uninit"], "_limit_dtcm")?,
        axi: share(&[".axisram", ".axizero"], "_limit_axi")?,
        stack_limit: limit("_stack_start")? - limit("_stack_end")?,
    })
}

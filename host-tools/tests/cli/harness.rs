//! The program under test, run as a user runs it.

use serde_json::Value;
use std::ffi::OsStr;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_backseat");

/// What takes longer has hung: on a busy machine what is a matter of seconds may take minutes, and that is no error.
pub const HANG: Duration = Duration::from_mins(10);

/// What a run of the program gave.
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// The program, to be run in a folder; nobody types.
pub fn command(folder: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs the program; its bytes.
pub fn backseat(folder: &Path, arguments: &[&str]) -> Output {
    command(folder).args(arguments).output().unwrap()
}

/// Runs the program.
pub fn program(folder: &Path, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Outcome {
    let output = command(folder).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Outcome { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// What was printed.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

impl Outcome {
    /// What it printed; it has to have succeeded.
    #[track_caller]
    pub fn good(&self, what: &str) -> String {
        assert_eq!(self.code, Some(0), "{what}: {}{}", self.stdout, self.stderr);
        self.stdout.clone()
    }

    /// The object that it printed; it has to have succeeded, or (exit code 3) to say that its result is not to be trusted.
    #[track_caller]
    pub fn json(&self) -> Value {
        assert!(matches!(self.code, Some(0 | 3)), "{:?}: {}{}", self.code, self.stdout, self.stderr);
        self.object()
    }

    /// The object that it printed, whatever its exit code.
    #[track_caller]
    pub fn object(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}{}", self.stdout, self.stderr))
    }

    /// Its one line of complaint; it has to have printed nothing else.
    #[track_caller]
    pub fn complaint(&self, what: &str) -> String {
        let Self { code, stdout, stderr } = self;
        assert_eq!(*code, Some(1), "{what}: {stdout}{stderr}");
        assert!(stdout.is_empty() && stderr.lines().count() == 1 && stderr.starts_with("error: "), "{what}: {stderr}");
        stderr.clone()
    }
}

/// Asks until there is an answer. What is asked says why there is none yet.
#[track_caller]
pub fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Result<T, String>) -> T {
    let begun = Instant::now();
    loop {
        match ask() {
            Ok(answer) => return answer,
            Err(why) => assert!(begun.elapsed() < HANG, "{what} did not come: {why}"),
        }
        sleep(Duration::from_millis(20));
    }
}

/// Sends a signal, by its name.
pub fn signal(name: &str, pid: u32) {
    assert!(Command::new("kill").args([&format!("-{name}"), &pid.to_string()]).status().unwrap().success());
}

/// Whether QEMU and the ARM target are installed. If not, the test passes over what needs them and says so; with
/// `BACKSEAT_REQUIRE_QEMU` set in the environment it fails instead.
pub fn is_qemu_there() -> bool {
    let Some(missing) = hil_sim::backseat::missing() else { return true };
    assert!(std::env::var_os("BACKSEAT_REQUIRE_QEMU").is_none(), "{missing}");
    // Past the capture of a passing test's output.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {missing}");
    false
}

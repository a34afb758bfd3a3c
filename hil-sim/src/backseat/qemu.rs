//! The ARM image in QEMU: a Cortex-M7 whose five UARTs are Unix sockets.

use anyhow::{Context, bail, ensure};
use backseat_link::{BackseatError, Ports};
use backseat_wire::hostlink::Port;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::ffi::OsString;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const EMULATOR: &str = "qemu-system-arm";
const PACKAGE: &str = "backseat-mps2";
const TARGET: &str = "thumbv7em-none-eabihf";
/// After this long a silent backseat hangs. A step takes some hundredths of a second of a processor of its own; on a
/// machine that is busy with other work it may get none for many seconds.
const PATIENCE: Duration = Duration::from_mins(10);
const POLL_MS: u32 = 200;
/// Bytes come one by one; to wait for some more than the first costs less than to wake for each.
const REST: Duration = Duration::from_micros(100);
/// QEMU closes its sockets before it is gone.
const ENDING: Duration = Duration::from_millis(200);

/// One UART's socket, and what has come from it.
struct EmulatedUart {
    stream: UnixStream,
    received: Vec<u8>,
}

/// The image on an emulated board; it is ended when this is dropped.
pub struct Qemu {
    child: Child,
    /// In the order of [`Port::ALL`].
    lines: Vec<EmulatedUart>,
    // Removed with the sockets in it when the emulator is gone.
    _sockets: TempDir,
}

impl Qemu {
    /// Starts the emulator with an image of `firmware/boards/mps2`; [`build_image`] makes one.
    ///
    /// # Errors
    /// When the emulator is not installed, or ends at once.
    pub fn start(image: &Path) -> anyhow::Result<Self> {
        ensure!(image.is_file(), "{}: no such image", image.display());
        let sockets = tempfile::Builder::new().prefix("hil-sim-").tempdir().context("folder for sockets")?;
        let mut command = Command::new(EMULATOR);
        command.args(["-M", "mps2-an500", "-display", "none", "-monitor", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        // No byte is an escape to a multiplexer.
        command.args(["-echr", "256"]);
        let mut listeners = Vec::new();
        for port in 0..Port::ALL.len() {
            let path = sockets.path().join(format!("uart{port}"));
            listeners.push(UnixListener::bind(&path).with_context(|| path.display().to_string())?);
            // A multiplexer of one line is a queue of 32 bytes: without it each byte takes a turn of
            // QEMU's main loop, and a step some 1.6 times as long.
            let mut chardev = OsString::from(format!("socket,id=uart{port},mux=on,path="));
            chardev.push(&path);
            command.arg("-chardev").arg(chardev).arg("-serial").arg(format!("chardev:uart{port}"));
        }
        let log = tempfile::NamedTempFile::new_in(&sockets).context("file for the image's log")?;
        let child = command
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            // The image's log; what it says before it ends is on standard error.
            .stdout(log.as_file().try_clone()?)
            .stderr(Stdio::piped())
            // Ctrl-C is for the simulator, which then ends the backseat in order.
            .process_group(0)
            .spawn()
            .with_context(|| without_emulator().unwrap_or_else(|| EMULATOR.into()))?;
        let mut qemu = Self { child, lines: Vec::new(), _sockets: sockets };
        for listener in listeners {
            let stream = qemu.accept(&listener)?;
            qemu.lines.push(EmulatedUart { stream, received: Vec::new() });
        }
        // The first it says is that its ports are open.
        qemu.wait_until("boot", || Ok((log.as_file().metadata()?.len() > 0).then_some(())))?;
        Ok(qemu)
    }

    /// The emulator's connection, which it makes before anything runs.
    fn accept(&mut self, listener: &UnixListener) -> anyhow::Result<UnixStream> {
        listener.set_nonblocking(true)?;
        let stream = self.wait_until("open its ports", || match listener.accept() {
            Ok((stream, _)) => Ok(Some(stream)),
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        })?;
        stream.set_nonblocking(true)?;
        Ok(stream)
    }

    /// Asks every few milliseconds.
    fn wait_until<T>(&mut self, what: &str, mut ask: impl FnMut() -> io::Result<Option<T>>) -> anyhow::Result<T> {
        let begun = Instant::now();
        loop {
            if let Some(answer) = ask()? {
                return Ok(answer);
            }
            self.check_alive()?;
            ensure!(begun.elapsed() < PATIENCE, "{EMULATOR} did not {what} within {} s", PATIENCE.as_secs());
            sleep(Duration::from_millis(5));
        }
    }

    fn check_alive(&mut self) -> Result<(), BackseatError> {
        let Ok(Some(status)) = self.child.try_wait() else { return Ok(()) };
        let mut message = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            // What cannot be read is left out.
            let _ = stderr.read_to_string(&mut message);
        }
        // After the first line QEMU prints the registers.
        Err(BackseatError::Ended { status, message: message.lines().next().unwrap_or("no message").to_owned() })
    }

    /// Waits until something comes on any line, and takes in all that has come; whether there was any.
    ///
    /// A socket holds fewer than 300 bytes that were sent one by one. Were only the line read that is
    /// waited for, the image might wait for room in another.
    fn take_in(&mut self, timeout_ms: u32) -> Result<bool, BackseatError> {
        let mut fds: Vec<_> = self.lines.iter().map(|line| PollFd::new(&line.stream, PollFlags::IN)).collect();
        let timeout = Timespec { tv_sec: 0, tv_nsec: i64::from(timeout_ms) * 1_000_000 };
        match poll(&mut fds, Some(&timeout)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(false),
            Ok(_) => {}
            Err(error) => return Err(BackseatError::Port { port: Port::Host, error: error.into() }),
        }
        let ready: Vec<bool> = fds.iter().map(|fd| !fd.revents().is_empty()).collect();
        sleep(REST);
        let mut buffer = [0; 4096];
        for ((line, port), _) in self.lines.iter_mut().zip(Port::ALL).zip(ready).filter(|(_, ready)| *ready) {
            match line.stream.read(&mut buffer) {
                Ok(count) if count > 0 => line.received.extend_from_slice(&buffer[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                outcome => {
                    // It is about to end.
                    sleep(ENDING);
                    self.check_alive()?;
                    let error = outcome.err().unwrap_or_else(|| ErrorKind::UnexpectedEof.into());
                    return Err(BackseatError::Port { port, error });
                }
            }
        }
        Ok(true)
    }
}

impl Ports for Qemu {
    fn write(&mut self, port: Port, mut bytes: &[u8]) -> Result<(), BackseatError> {
        let begun = Instant::now();
        while !bytes.is_empty() {
            match self.lines[port as usize].stream.write(bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(error) if error.kind() == ErrorKind::WouldBlock && begun.elapsed() < PATIENCE => {
                    self.check_alive()?;
                    self.take_in(1)?;
                }
                Err(error) => {
                    self.check_alive()?;
                    return Err(BackseatError::Port { port, error });
                }
            }
        }
        Ok(())
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let begun = Instant::now();
        while self.lines[port as usize].received.is_empty() {
            if !self.take_in(POLL_MS)? {
                self.check_alive()?;
            }
            if begun.elapsed() > PATIENCE {
                return Err(BackseatError::Silent { port, seconds: PATIENCE.as_secs() as u32 });
            }
        }
        received.append(&mut self.lines[port as usize].received);
        Ok(())
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        if !self.take_in(0)? {
            self.check_alive()?;
        }
        received.append(&mut self.lines[port as usize].received);
        Ok(())
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // Both fail only when it has ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What has to be installed before an image can be built and flown, and how; `None` when nothing.
#[must_use]
pub fn missing() -> Option<String> {
    without_emulator().or_else(without_target)
}

fn without_emulator() -> Option<String> {
    let outcome = Command::new(EMULATOR).arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).status();
    let absent = outcome.is_err_and(|error| error.kind() == ErrorKind::NotFound);
    absent
        .then(|| format!("{EMULATOR} is not installed (Debian: apt install qemu-system-arm; macOS: brew install qemu)"))
}

/// The standard library of the target is looked for.
fn without_target() -> Option<String> {
    let output = tool("RUSTC", "rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
    let folder = output.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    let present = folder.is_ok_and(|folder| Path::new(&folder).is_dir());
    (!present).then(|| format!("Rust's {TARGET} target is not installed (rustup target add {TARGET})"))
}

/// Builds the image from the sources that this program was built from; its path.
///
/// # Errors
/// Without the sources, or something that is [`missing`]; when it does not compile.
pub fn build_image() -> anyhow::Result<PathBuf> {
    ensure!(workspace().join("memory.x").is_file(), "the sources are not in {}: give --image", workspace().display());
    if let Some(missing) = missing() {
        bail!(missing);
    }
    let output = tool("CARGO", "cargo")
        .args(["build", "--package", PACKAGE, "--bin", PACKAGE, "--profile", "dist", "--target", TARGET])
        .args(["--quiet", "--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit())
        .output()
        .context("cargo cannot be started: give --image")?;
    ensure!(output.status.success(), "the ARM image does not build ({})", output.status);
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == PACKAGE)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .context("cargo names no image")
}

/// One of the toolchain's programs, as the cargo that started this names it.
fn tool(variable: &str, name: &str) -> Command {
    let mut command = Command::new(std::env::var_os(variable).unwrap_or_else(|| name.into()));
    // Flags meant for this computer.
    command.current_dir(workspace()).env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS").stdin(Stdio::null());
    command
}

fn workspace() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

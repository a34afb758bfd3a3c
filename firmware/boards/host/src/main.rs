//! `backseat-host`: the backseat on serial ports of this computer.

use anyhow::{Context, Result};
use backseat_host::{HostPorts, PortSettings, run};
use backseat_wire::hostlink::Port;
use clap::Parser;
use std::fs::File;
use std::io::Read as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// The backseat on serial ports of this computer.
#[derive(Parser)]
#[command(
    version,
    after_help = "Example:\n  backseat-host --frontseat /dev/ttyUSB0 --dvl /dev/ttyUSB1 --ahrs /dev/ttyUSB2 \\\n      \
                  --modem /dev/ttyUSB3 --host /dev/ttyUSB4 --baud 19200,115200,115200,19200,115200 \\\n      \
                  --store /var/lib/backseat/parameters"
)]
struct Args {
    /// Iver frontseat computer
    #[arg(long, value_name = "DEVICE")]
    frontseat: PathBuf,
    /// Doppler velocity log
    #[arg(long, value_name = "DEVICE")]
    dvl: PathBuf,
    /// Attitude and heading reference
    #[arg(long, value_name = "DEVICE")]
    ahrs: PathBuf,
    /// WHOI Micro-Modem
    #[arg(long, value_name = "DEVICE")]
    modem: PathBuf,
    /// PC: telemetry, parameters, mission
    #[arg(long, value_name = "DEVICE")]
    host: PathBuf,
    /// Baud rates of the five ports, in the order above
    #[arg(long, value_name = "RATE", value_delimiter = ',', num_args = 5, default_values_t = Port::DEFAULT_BAUD)]
    baud: Vec<u32>,
    /// Keep parameters in this file (`backseat params store`): two copies, of which one is whole at any moment
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
}

/// Random numbers of the kernel.
const RANDOM: &str = "/dev/urandom";

static STOP: AtomicBool = AtomicBool::new(false);

fn main() -> ExitCode {
    match start(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("backseat-host: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn start(arguments: Args) -> Result<()> {
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    let Args { frontseat, dvl, ahrs, modem, host, baud, store } = arguments;
    let mut ports = HostPorts::new([frontseat, dvl, ahrs, modem, host]);
    for (PortSettings { baud, .. }, wanted) in ports.ports.iter_mut().zip(baud) {
        *baud = wanted;
    }
    ports.store = store;
    let mut challenge = [0; 8];
    File::open(RANDOM).and_then(|mut file| file.read_exact(&mut challenge)).context(RANDOM)?;
    ports.challenge = u64::from_ne_bytes(challenge);
    run(&ports, &STOP)
}

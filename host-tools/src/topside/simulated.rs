//! Topside at the other end of a simulator: a third line, the host link, brings the key and, in lock-step, the clock.

use super::line::SerialLine;
use super::{Acted, POLL, Session, config};
use crate::live::{Course, print_line};
use anyhow::{Context, anyhow, bail};
use backseat_topside::{Port, Topside};
use backseat_wire::hostlink::{self, Decoder, FromBoard, ImageId, MAX_FRAME, Refusal, Step, StepDone, ToBoard, encode};
use hil_sim::ship_end::announced;
use std::path::PathBuf;

/// Arguments of the hidden subcommand.
#[derive(clap::Args)]
pub struct Simulated {
    /// As of `topside`
    config: PathBuf,
    /// Serial device of the host link
    host: String,
    /// On its own clock
    #[arg(long)]
    realtime: bool,
}

/// The simulator's line.
struct Host {
    line: SerialLine,
    decoder: Decoder,
    unread: Vec<u8>,
    /// The clock is this program's.
    own_clock: bool,
}

impl Host {
    /// Answers what has been read, up to the first step that is asked for.
    fn serve(&mut self, topside: &mut Topside) -> anyhow::Result<Option<Step>> {
        let mut bytes = self.unread.as_slice();
        let mut asked = None;
        while asked.is_none()
            && let Some(frame) = self.decoder.feed(&mut bytes)
        {
            let message = frame.and_then(|frame| frame.message::<ToBoard<'_>>());
            let message = message.map_err(|error| anyhow!("the simulator's line: {error:?}"))?;
            let answer = match message {
                ToBoard::Step(step) if !self.own_clock => {
                    asked = Some(step);
                    continue;
                }
                ToBoard::Step(_) => FromBoard::Refused(Refusal::OwnClock),
                ToBoard::Hello => FromBoard::Hello {
                    firmware: env!("CARGO_PKG_VERSION"),
                    parameter_schema: 0,
                    image: ImageId::default(),
                },
                ToBoard::KeyBegin => FromBoard::Key { set: topside.config().key.is_set() },
                ToBoard::KeySet(key) => {
                    topside.set_key(key);
                    FromBoard::Done
                }
                _ => FromBoard::Refused(Refusal::NotReady),
            };
            send(&mut self.line, &answer)?;
        }
        let consumed = self.unread.len() - bytes.len();
        self.unread.drain(..consumed);
        Ok(asked)
    }

    /// The next step, once it is announced.
    fn step(&mut self, topside: &mut Topside) -> anyhow::Result<Step> {
        loop {
            if let Some(step) = self.serve(topside)? {
                return Ok(step);
            }
            let mut buffer = [0; MAX_FRAME];
            let count = self.line.wait(&mut buffer)?;
            self.unread.extend_from_slice(&buffer[..count]);
        }
    }

    /// Answers what has come by now.
    fn poll(&mut self, topside: &mut Topside) -> anyhow::Result<()> {
        self.unread.extend(self.line.poll().map_err(|_| anyhow!("{}: the simulator has gone", self.line.name))?);
        self.serve(topside).map(|_| ())
    }
}

fn send(line: &mut SerialLine, answer: &FromBoard<'_>) -> anyhow::Result<()> {
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(answer, &mut buffer).map_err(|error| anyhow!("an answer that fits no frame: {error:?}"))?;
    line.send(frame).map_err(|why| anyhow!(why))
}

/// Topside with the simulator on its host line, until that hangs up.
///
/// # Errors
/// A configuration that cannot be used, a port that is not there or hangs up.
pub fn run_simulated(args: &Simulated) -> anyhow::Result<()> {
    let read = config::read(&args.config)?;
    let topside = Topside::new(read.config.clone()).with_context(|| args.config.display().to_string())?;
    let mut host = Host {
        line: SerialLine::open("host", &args.host, 115_200)?,
        decoder: Decoder::new(),
        unread: Vec::new(),
        own_clock: args.realtime,
    };
    let mut session = Session::new(topside, read, None, Course::new(None))?;
    if args.realtime {
        loop {
            std::thread::sleep(POLL);
            host.poll(&mut session.topside)?;
            if let Some(object) = session.poll()? {
                print_line(&object)?;
            }
        }
    }
    loop {
        let step = host.step(&mut session.topside)?;
        let done = session.lockstep(&step)?;
        send(&mut host.line, &FromBoard::StepDone(done))?;
    }
}

impl Session {
    /// Hears the announced chunks, steps if the time is that of a step, and sends. A [`Step`] comes with the time at
    /// which bytes arrive as well, so that they are answered then and not a step later. What topside knows stands in the
    /// line of the second rather than in the digest.
    fn lockstep(&mut self, step: &Step) -> anyhow::Result<StepDone> {
        for chunk in &step.chunks {
            let port = Port::ALL.into_iter().find(|port| announced(*port) == chunk.port);
            let Some(port) = port else { bail!("the simulator announces bytes for a port {:?}", chunk.port) };
            let mut bytes = vec![0; usize::from(chunk.length)];
            let mut taken = 0;
            while taken < bytes.len() {
                let line = if port == Port::Gnss { &mut self.gnss } else { &mut self.modem };
                taken += line.wait(&mut bytes[taken..])?;
            }
            self.hear(port, chunk.time_us, &bytes)?;
        }
        let Acted { sent: count, second } = self.act(step.time_us)?;
        if let Some(object) = second {
            print_line(&object)?;
        }
        let mut sent = [0; 4];
        sent[hostlink::Port::Modem as usize] = u16::try_from(count).context("more bytes than a step can announce")?;
        Ok(StepDone { time_us: step.time_us, sent, digest: 0 })
    }
}

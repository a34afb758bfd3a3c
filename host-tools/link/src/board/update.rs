//! A new image of the firmware, over the host port.

use super::{Board, reason};
use crate::image::FirmwareImage;
use crate::serial::slowness;
use anyhow::bail;
use backseat_report::console::{Progress, Spinner};
use backseat_wire::hostlink::{FromBoard, Images, Refusal, ToBoard, UPDATE_CHUNK};
use std::time::{Duration, Instant};

/// The new image answers within this time of the commit: the reset, and the start of a board that looks for its card.
const START: Duration = Duration::from_secs(20);
/// It is confirmed after so many steps, for which it needs seven seconds, within this time.
const PROOF_STEPS: usize = 50;
const PROOF: Duration = Duration::from_secs(30);
const MOMENT: Duration = Duration::from_millis(100);

impl Board {
    /// Which images it has.
    pub fn images(&mut self) -> anyhow::Result<Images> {
        let answer = self.ask(&ToBoard::UpdateGet, |message| match message {
            FromBoard::Images(images) => Some(Ok(images)),
            FromBoard::Refused(refusal) => Some(Err(refusal)),
            _ => None,
        })?;
        match answer {
            Ok(images) => Ok(images),
            Err(Refusal::NoStore) => bail!("{}: this board has no second bank of flash to be updated in", self.port),
            Err(refusal) => bail!("{}: {}", self.port, reason(refusal)),
        }
    }

    /// Writes an image into its other bank; it runs on as it is.
    pub fn write_image(&mut self, image: &FirmwareImage) -> anyhow::Result<()> {
        self.demand(&ToBoard::UpdateBegin(image.announced()), "the image")?;
        let progress = Progress::new("bytes written", image.bytes.len());
        for (offset, bytes) in (0..).step_by(UPDATE_CHUNK).zip(image.bytes.chunks(UPDATE_CHUNK)) {
            progress.set(offset as usize);
            self.demand(&ToBoard::UpdateWrite { offset, bytes }, "to go on with the image")?;
        }
        Ok(())
    }

    /// Starts the image that was written, and waits until it answers: the board, anew.
    pub fn start_image(mut self, image: &FirmwareImage) -> anyhow::Result<Self> {
        self.demand(&ToBoard::UpdateCommit, "to start the image")?;
        let spinner = Spinner::new("update");
        spinner.set("the board starts again");
        let (port, key) = (self.port.clone(), self.client.key());
        drop(self);
        let begun = Instant::now();
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let connected = Self::connect(&port, key);
            match connected {
                Ok(board) if board.identity.image.build == image.build => return Ok(board),
                outcome if begun.elapsed() > START * slowness() => match outcome {
                    Ok(board) => bail!(
                        "{port}: the board runs image {:08x}, not {:08x}: the new one failed, or the banks were not \
                         exchanged",
                        board.identity.image.build,
                        image.build
                    ),
                    Err(error) => {
                        return Err(error.context(
                            "the new image does not answer; left alone the board returns to the one before within \
                             three minutes",
                        ));
                    }
                },
                _ => {}
            }
        }
    }

    /// Keeps the image that runs, if it navigates.
    pub fn confirm_image(&mut self) -> anyhow::Result<()> {
        let spinner = Spinner::new("update");
        spinner.set("the new image proves itself");
        let (begun, mut steps) = (Instant::now(), 0);
        while steps < PROOF_STEPS && begun.elapsed() < PROOF * slowness() {
            steps += self.listen(MOMENT)?.len();
        }
        if steps < PROOF_STEPS {
            bail!(
                "{}: {steps} steps in {} s; it is not confirmed, and returns to the image before",
                self.port,
                PROOF.as_secs()
            );
        }
        self.demand(&ToBoard::UpdateConfirm, "to keep the image")
    }
}

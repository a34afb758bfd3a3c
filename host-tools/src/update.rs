//! `backseat update`: new firmware for the board, over its host port.

use crate::board::Common;
use anyhow::ensure;
use backseat_link::board::Board;
use backseat_link::image::FirmwareImage;
use backseat_wire::hostlink::{ImageId, Images, StoredImage};
use serde_json::json;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat update /dev/ttyACM0 backseat-0.1.0-stm32h743.elf             some two minutes
  backseat update /dev/ttyACM0 backseat-0.1.0-stm32h743.elf --key ship.key
  backseat update /dev/ttyACM0                                          which images the board has
  backseat update /dev/ttyACM0 --confirm                                keep the one that is on trial

The image is written beside the one that runs, checked, and started on trial. When it has sent telemetry for some
seconds it is confirmed. One that is not confirmed starts again after a minute, and after three starts the board
returns to the image before by itself; so it does when the new one crashes. At any time the supply may be lost: a whole
image starts. No mission starts on trial, and nothing is updated under way. Parameters stay, unless the new image has
another list of them: export them before (backseat params export).";

/// Renew the board's firmware
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    common: Common,
    /// ELF file of the image
    image: Option<PathBuf>,
    /// Keep the image that runs on trial
    #[arg(long, conflicts_with = "image")]
    confirm: bool,
}

/// Does what is asked.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let common = &args.common;
    let image = args.image.as_deref().map(FirmwareImage::read).transpose()?;
    let mut board = common.connect()?;
    let Some(image) = image else {
        let before = board.images()?;
        if args.confirm {
            ensure!(before.trial.is_some(), "{}: the image that runs is not on trial", common.port);
            board.confirm_image()?;
        }
        let images = board.images()?;
        return common.say(&json_of(&board, &images), &text_of(&board, &images));
    };
    board.images()?;
    let schema = board.identity.schema;
    board.write_image(&image)?;
    let mut board = board.start_image(&image)?;
    board.confirm_image()?;
    let images = board.images()?;
    let mut text = text_of(&board, &images);
    if board.identity.schema != schema {
        text += &format!(
            "Its list of parameters has version {}, that of the image before {schema}: it runs on the defaults, without \
             a key. Next: backseat params import {} FILE; backseat params store\n",
            board.identity.schema, common.port
        );
    }
    common.say(&json_of(&board, &images), &text)
}

fn text_of(board: &Board, images: &Images) -> String {
    let runs = images.trial.map_or("confirmed, or written by a programmer".to_owned(), |starts| {
        format!("on trial, start {starts}: not yet confirmed")
    });
    let other = match images.other {
        None => "no whole image of an update".to_owned(),
        Some(StoredImage { image, confirmed: true, .. }) => format!("image {:08x}, which ran before", image.build),
        Some(StoredImage { image, starts: 0, .. }) => format!("image {:08x}, which was never started", image.build),
        Some(StoredImage { image, starts, .. }) => {
            format!(
                "image {:08x}, which was started {starts} times and not confirmed: the board has returned",
                image.build
            )
        }
    };
    let identity = &board.identity;
    format!("{}, {}: {runs}\nother bank: {other}\n", identity.image, identity.firmware)
}

fn json_of(board: &Board, images: &Images) -> serde_json::Value {
    let other = images.other.map(|StoredImage { image, starts, confirmed }| {
        json!({"build": format!("{:08x}", image.build), "bytes": image.length, "starts": starts, "confirmed": confirmed})
    });
    let ImageId { build, crc, commit, .. } = board.identity.image;
    json!({"build": format!("{build:08x}"), "crc": format!("{crc:08x}"), "commit": format!("{commit:08x}"), "firmware": board.identity.firmware,
           "trial_start": images.trial, "other": other})
}

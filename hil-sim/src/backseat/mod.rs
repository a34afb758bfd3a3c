//! Backseats that the simulator runs itself: the app in this process, and the ARM image in QEMU.

mod in_process;
mod qemu;

pub use in_process::{InProcess, Memory};
pub use qemu::{Qemu, build_image, missing};

//! What the core may reach: the memory protection unit holds one table, and what is not in it faults. So does address 0
//! and its neighbourhood, what lies below each stack, an instruction in RAM, and a write to the image.
//!
//! The table is ARMv7-M's (manual, B3.5). Kinds of memory are those of its default map. Faults' own handlers run without
//! it, and the core's own registers are always within reach.

use cortex_m::peripheral::MPU;

/// RASR (B3.5.9): no instructions; the core may read and write, or only read.
const NO_CODE: u32 = 1 << 28;
const READ_WRITE: u32 = 0b011 << 24;
const READ_ONLY: u32 = 0b110 << 24;
/// Kind of memory by TEX, C and B (B3.5.9, B3.1): normal, write-through; normal, write-back; device.
const FLASH: u32 = 1 << 17;
const RAM: u32 = 1 << 19 | 1 << 17 | 1 << 16;
const DEVICE: u32 = 1 << 16;
const ENABLED: u32 = 1;
/// RBAR: the number of the region is in it.
const NUMBERED: u32 = 1 << 4;

const DATA: u32 = NO_CODE | READ_WRITE;

/// Address, size as a power of two, what is permitted; the last that holds an address counts. Sizes are the chip's.
const REGIONS: [(u32, u32, u32); 7] = [
    // the bank that runs: the image
    (0x0800_0000, 20, READ_ONLY | FLASH),
    // its trailer, for marks: the last 4 KB of its sixth sector
    (0x080B_F000, 12, DATA | FLASH),
    // the other bank: the image before it or the next, parameter sets
    (0x0810_0000, 20, DATA | FLASH),
    // DTCM, from the interrupts' stack on
    (0x2000_0000, 17, DATA | RAM),
    // AXI SRAM, from thread mode's stack on
    (0x2400_0000, 19, DATA | RAM),
    // backup SRAM
    (0x3880_0000, 12, DATA | RAM),
    // peripherals
    (0x4000_0000, 29, DATA | DEVICE),
];

/// Before anything else, on either stack.
pub fn start() {
    // SAFETY: nobody else uses these registers, and what the table permits is all that the image uses.
    unsafe {
        let mpu = &*MPU::PTR;
        for (number, (address, size, permitted)) in (0..).zip(REGIONS) {
            mpu.rbar.write(address | NUMBERED | number);
            mpu.rasr.write(permitted | (size - 1) << 1 | ENABLED);
        }
        mpu.ctrl.write(ENABLED);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

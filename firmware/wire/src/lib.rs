//! Serial protocols of the backseat, one file each: parse and emit.
#![no_std]

pub mod hostlink;

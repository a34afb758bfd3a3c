//! Searches with libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| backseat_fuzz::importers(data));

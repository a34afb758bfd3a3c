//! A search without libFuzzer, on any compiler: tracked inputs, mutated. Off unless it is given a time:
//!
//! ```text
//! BACKSEAT_FUZZ_SECONDS=120 BACKSEAT_FUZZ_TARGETS=day,frontseat cargo test -p backseat-fuzz --test search -- --nocapture
//! ```

use backseat_fuzz::TARGETS;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// SplitMix64 (Steele, Lea and Flood, 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % count.max(1) as u64) as usize
    }

    /// A few bytes of an input written over, taken out, repeated or added.
    fn mutated(&mut self, input: &[u8]) -> Vec<u8> {
        let mut data = input.to_vec();
        for _ in 0..=self.below(8) {
            let place = self.below(data.len() + 1);
            match self.below(4) {
                0 if place < data.len() => data[place] = self.below(256) as u8,
                1 if place < data.len() => {
                    data.remove(place);
                }
                2 => {
                    let part: Vec<u8> = data[place..].iter().take(1 + self.below(16)).copied().collect();
                    data.splice(place..place, part);
                }
                _ => data.insert(place, self.below(256) as u8),
            }
        }
        data.truncate(1000);
        data
    }
}

#[test]
fn mutated_inputs_pass() {
    let Some(seconds) = std::env::var("BACKSEAT_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok()) else { return };
    let wanted = std::env::var("BACKSEAT_FUZZ_TARGETS").unwrap_or_default();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.split(',').any(|part| part == name);
    for (name, target) in TARGETS.into_iter().filter(|(name, _)| is_wanted(name)) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
        let mut inputs: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| fs::read(entry.unwrap().path()).unwrap()).collect();
        inputs.sort();
        let (begun, mut random, mut count) = (Instant::now(), Random(1), 0);
        while begun.elapsed() < Duration::from_secs(seconds) {
            let input = &inputs[random.below(inputs.len())];
            let data = random.mutated(input);
            if std::panic::catch_unwind(|| target(&data)).is_err() {
                panic!("{name}: {:?}", data.escape_ascii().to_string());
            }
            count += 1;
        }
        println!("{name}: {count} inputs in {seconds} s");
    }
}

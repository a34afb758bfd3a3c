//! A search without libFuzzer, on any compiler: tracked inputs, mutated. A few with every run of the tests; for a time:
//!
//! ```text
//! BACKSEAT_FUZZ_SECONDS=120 BACKSEAT_FUZZ_TARGETS=day,frontseat cargo test -p backseat-fuzz for_a_time -- --ignored --nocapture
//! ```

use crate::duration::seconds;
use crate::random::Random;
use backseat_fuzz::TARGETS;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Inputs of a run without a time, for each target: those of whole flights take a second for some of them.
const FEW: u64 = 3;

/// A few bytes of an input written over, taken out, repeated or added.
fn mutated(random: &mut Random, input: &[u8]) -> Vec<u8> {
    let mut data = input.to_vec();
    for _ in 0..=random.below(8) {
        let place = random.below(data.len() + 1);
        match random.below(4) {
            0 if place < data.len() => data[place] = random.below(256) as u8,
            1 if place < data.len() => {
                data.remove(place);
            }
            2 => {
                let part: Vec<u8> = data[place..].iter().take(1 + random.below(16)).copied().collect();
                data.splice(place..place, part);
            }
            _ => data.insert(place, random.below(256) as u8),
        }
    }
    data.truncate(1000);
    data
}

/// Mutated inputs through a target, while it is told to go on after so many; how many.
fn search(name: &str, target: fn(&[u8]), goes_on: impl Fn(u64) -> bool) -> u64 {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let mut inputs: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| fs::read(entry.unwrap().path()).unwrap()).collect();
    inputs.sort();
    let (mut random, mut count) = (Random(1), 0);
    while goes_on(count) {
        let input = &inputs[random.below(inputs.len())];
        let data = mutated(&mut random, input);
        if std::panic::catch_unwind(|| target(&data)).is_err() {
            panic!("{name}: {:?}", data.escape_ascii().to_string());
        }
        count += 1;
    }
    count
}

#[test]
fn mutated_inputs_pass() {
    for (name, target) in TARGETS {
        search(name, target, |count| count < FEW);
    }
}

#[test]
#[ignore = "for as long as BACKSEAT_FUZZ_SECONDS says, each target: .ci/nightly"]
fn mutated_inputs_pass_for_a_time() {
    let time = seconds("BACKSEAT_FUZZ_SECONDS");
    let wanted = std::env::var("BACKSEAT_FUZZ_TARGETS").unwrap_or_default();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.split(',').any(|part| part == name);
    for (name, target) in TARGETS.into_iter().filter(|(name, _)| is_wanted(name)) {
        let begun = Instant::now();
        let count = search(name, target, |_| begun.elapsed() < time);
        println!("{name}: {count} inputs in {} s", time.as_secs());
    }
}

//! The identifier.

use crate::measure::{Worst, count};
use crate::motion;
use crate::random::Random;
use crate::row;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::{IdentificationConfig, Identifier, SampleOutcome};
use core::hint::black_box;

/// Seven hundred samples: the filter's window fills, the gains settle for a minute, and the last five seconds adapt.
const SAMPLES: u64 = 700;

/// Everything.
pub fn measure(identifier: &mut Identifier) {
    let (config, prior) = (IdentificationConfig::DEFAULT, VehicleParameters::IVER3);
    assert!(identifier.configure(&config, &prior).is_ok());
    let (mut random, mut warming, mut adapting) = (Random(9), Worst(0), Worst(0));
    for k in 1..=SAMPLES {
        let (attitude, velocity, input) = motion::sample(k, &mut random);
        let time_us = k * 100_000;
        let (report, instructions) =
            count(|| black_box(&mut *identifier).sample(time_us, black_box(&attitude), black_box(&velocity), &input));
        match report.outcome {
            SampleOutcome::WarmingUp => warming.0 = warming.0.max(instructions),
            SampleOutcome::Adapting => adapting.0 = adapting.0.max(instructions),
            _ => {}
        }
    }
    assert!(adapting.0 > 0 && identifier.adapted_s() > 1.0);
    row("identification", "sample, gains not yet known", 0, 0, warming.0, 0);
    row("identification", "sample, adapting (10 Hz)", 0, 0, adapting.0, 0);
    row(
        "identification",
        "what the motion shows of each parameter (0.1 Hz)",
        0,
        0,
        count(|| identifier.excitation()).1,
        0,
    );
}

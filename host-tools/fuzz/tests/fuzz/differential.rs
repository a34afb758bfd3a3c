//! The ARM image in QEMU and the app in this process under the same meddling: the same bytes, the same digests.
//!
//! A few flights with every run of the tests; more, drawn from seed 2 on, for as long as one likes:
//!
//! ```text
//! BACKSEAT_DIFFERENTIAL_SECONDS=1200 cargo test -p backseat-fuzz --test differential -- --nocapture
//! ```

use crate::random::Random;
use backseat_fuzz::meddled;
use backseat_link::Client;
use hil_sim::backseat::{InProcess, Qemu, build_image, missing};
use std::io::Write as _;
use std::time::{Duration, Instant};

/// Flights of a run without a time.
const FEW: u64 = 2;
/// Bytes that say what is done to the lines of one flight.
const INPUT: usize = 300;

#[test]
fn arm_and_host_do_the_same_whatever_the_lines_say() {
    if let Some(missing) = missing() {
        assert!(std::env::var_os("BACKSEAT_REQUIRE_QEMU").is_none(), "{missing}");
        // past the capture of a passing test's output
        let _ = writeln!(std::io::stderr(), "SKIPPED: {missing}");
        return;
    }
    let limit = std::env::var("BACKSEAT_DIFFERENTIAL_SECONDS").ok();
    let limit = limit.map(|text| Duration::from_secs(text.parse().expect("whole seconds")));
    let image = build_image().unwrap();
    let (begun, mut steps, mut under_way, mut seed) = (Instant::now(), 0, 0, 0);
    while limit.map_or(seed < FEW, |limit| begun.elapsed() < limit) {
        seed += 1;
        let mut random = Random(seed);
        let data: Vec<u8> = (0..INPUT).map(|_| random.below(256) as u8).collect();
        let host = meddled(&mut Client::new(InProcess::new()), &data).unwrap();
        let arm = meddled(&mut Client::new(Qemu::start(&image).unwrap()), &data).unwrap();
        for (step, (host, arm)) in host.iter().zip(&arm).enumerate() {
            assert_eq!(format!("{arm:?}"), format!("{host:?}"), "seed {seed}, step {step}, ARM and host");
        }
        assert_eq!(arm.len(), host.len(), "seed {seed}");
        let legs = host.iter().filter(|step| step.telemetry.as_ref().is_some_and(|telemetry| telemetry.leg.is_some()));
        steps += host.len();
        under_way += legs.count();
    }
    println!("{seed} flights, {steps} steps, {under_way} of them under way: ARM and host agree to the bit");
    assert!(under_way > 0, "no flight got under way");
}

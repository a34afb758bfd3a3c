//! The ARM image in QEMU and the app in this process under the same meddling: the same bytes, the same digests.
//!
//! A few flights with every run of the tests; more for as long as one likes:
//!
//! ```text
//! BACKSEAT_DIFFERENTIAL_SECONDS=1200 cargo test -p backseat-fuzz agree_for_a_time -- --ignored --nocapture
//! ```

use crate::duration::seconds;
use crate::random::Random;
use backseat_fuzz::fly_disturbed;
use backseat_link::Client;
use hil_sim::backseat::{InProcess, Qemu, build_image, missing};
use std::io::Write as _;
use std::time::Instant;

/// Flights of a run without a time.
const FEW: u64 = 2;
/// Bytes that say what is done to the lines of one flight.
const INPUT: usize = 300;

/// Flights of seed 1 on, while it is told to go on after so many.
fn agree(goes_on: impl Fn(u64) -> bool) {
    if let Some(missing) = missing() {
        assert!(std::env::var_os("BACKSEAT_REQUIRE_QEMU").is_none(), "{missing}");
        // past the capture of a passing test's output
        let _ = writeln!(std::io::stderr(), "SKIPPED: {missing}");
        return;
    }
    let image = build_image().unwrap();
    let (mut steps, mut under_way, mut seed) = (0, 0, 0);
    while goes_on(seed) {
        seed += 1;
        let mut random = Random(seed);
        let data: Vec<u8> = (0..INPUT).map(|_| random.below(256) as u8).collect();
        let host = fly_disturbed(&mut Client::new(InProcess::new()), &data).unwrap();
        let arm = fly_disturbed(&mut Client::new(Qemu::start(&image).unwrap()), &data).unwrap();
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

#[test]
fn arm_and_host_do_the_same_whatever_the_lines_say() {
    agree(|flights| flights < FEW);
}

#[test]
#[ignore = "for as long as BACKSEAT_DIFFERENTIAL_SECONDS says: .ci/nightly"]
fn arm_and_host_agree_for_a_time() {
    let (begun, time) = (Instant::now(), seconds("BACKSEAT_DIFFERENTIAL_SECONDS"));
    agree(|_| begun.elapsed() < time);
}

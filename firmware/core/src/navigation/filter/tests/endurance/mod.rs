//! Days of filtering against a square-root filter: does P stay symmetric and positive definite, does rounding add up?
//!
//! The short run is part of every test; the long one, 10⁷ steps, is described in `docs/results/endurance.md`.

#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

extern crate std;

mod mission;
mod reference;
mod spectrum;

use crate::navigation::filter::cekf::Filter;
use crate::navigation::*;
use mission::{Mission, STEP_US};
use reference::Reference;
use spectrum::{eigenvalue_range, smallest_pivot};
use std::boxed::Box;
use std::println;

/// Steps between two looks at the whole covariance: they fall on every phase of the exchanges in turn.
const CHECK_EVERY: u64 = 700;
/// The first look: while the first exchange holds its clone.
const FIRST_CHECK: u64 = 20;

/// States that are no clones: vehicle, four effects, ship.
const PRESENT: usize = 22;

/// What the looks found, over all of them.
#[derive(Debug)]
struct Findings {
    /// Least pivot of Cholesky's factorisation of the correlation matrix of the present states.
    pivot: f64,
    /// Least eigenvalue of the same matrix, and that over the largest.
    eigenvalue: f64,
    condition: f64,
    /// Least eigenvalue of the whole correlation matrix: a fresh clone is a copy, so that it is singular by nature.
    with_clones: f64,
    /// Largest |P_ij − P_ji| / (σ_i σ_j).
    asymmetry: f64,
    /// Largest |x − x_ref| / σ, |P − P_ref| / (σ_i σ_j) of the square-root filter.
    state: f64,
    covariance: f64,
    /// The latter of the ship's heading and turn rate, which nothing measures: their variance grows for ever.
    unobserved: f64,
    most_states: usize,
    tally: Consistency,
}

impl Findings {
    const START: Self = Self {
        pivot: f64::INFINITY,
        eigenvalue: f64::INFINITY,
        condition: f64::INFINITY,
        with_clones: f64::INFINITY,
        asymmetry: 0.0,
        state: 0.0,
        covariance: 0.0,
        unobserved: 0.0,
        most_states: 0,
        tally: Consistency::new(),
    };

    fn look(&mut self, navigator: &Filter, reference: &Reference) {
        let n = navigator.dimension();
        self.most_states = self.most_states.max(n);
        self.pivot = self.pivot.min(smallest_pivot(navigator, PRESENT));
        let (least, largest) = eigenvalue_range(navigator, PRESENT);
        self.eigenvalue = self.eigenvalue.min(least);
        self.condition = self.condition.min(least / largest);
        self.with_clones = self.with_clones.min(eigenvalue_range(navigator, n).0);
        for i in 0..n {
            for j in 0..i {
                let scale = (navigator.variance(i) * navigator.variance(j)).sqrt();
                let difference = (navigator.covariance(i, j) - navigator.covariance(j, i)).abs() / scale;
                self.asymmetry = self.asymmetry.max(difference);
            }
        }
        let deviation = reference.deviation(navigator);
        self.state = self.state.max(deviation.state);
        self.covariance = self.covariance.max(deviation.covariance);
        self.unobserved = self.unobserved.max(deviation.unobserved);
    }

    fn print(&self, step: u64) {
        println!(
            "{step:9} pivot {:.2e} eigenvalue {:.2e} condition {:.2e} with clones {:.1e} asymmetry {:.1e} state {:.1e} covariance {:.1e} unobserved {:.1e}",
            self.pivot,
            self.eigenvalue,
            self.condition,
            self.with_clones,
            self.asymmetry,
            self.state,
            self.covariance,
            self.unobserved
        );
    }
}

/// Flies filter and reference side by side.
fn fly(steps: u64, print_every: u64) -> Findings {
    let mut mission = Mission::new();
    let mut navigator = Box::new(Filter::new());
    mission.start(&mut navigator);
    let mut reference = Reference::of(&navigator, |shadow| mission.start(shadow));
    let mut findings = Findings::START;
    for step in 1..=steps {
        let input = mission.advance();
        let to_us = step * STEP_US;
        navigator.predict(to_us, &input).expect("a healthy filter");
        reference.predict(to_us, &input);
        mission.clones(&mut navigator, &mut reference);
        for measurement in mission.measure() {
            let fusions = navigator.fuse(&measurement);
            reference.fuse(&measurement, &fusions);
            fusions.iter().for_each(|record| findings.tally.add(record));
        }
        mission.drop_clones(&mut navigator, &mut reference);
        if step % CHECK_EVERY == FIRST_CHECK {
            findings.look(&navigator, &reference);
        }
        if step % print_every == 0 {
            findings.print(step);
        }
    }
    for sensor in Sensor::ALL {
        let tally = findings.tally.tally(sensor);
        if tally.count > 0 {
            let (mean, recoveries) = (tally.mean().unwrap_or(f64::NAN), navigator.recoveries(sensor));
            println!(
                "{:10} {:9} fused, {} rejected, nis {mean:.4}, {recoveries} recoveries",
                sensor.name(),
                tally.count,
                tally.rejected
            );
            // The reference knows no recovery.
            assert_eq!(recoveries, 0, "{}", sensor.name());
        }
    }
    findings
}

fn judge(findings: &Findings) {
    // Vehicle, four effects, ship and two clones.
    assert_eq!(findings.most_states, 12 + 4 + 6 + 2 * 6, "the largest filter of this mission was looked at");
    // Stored once for both.
    assert_eq!(findings.asymmetry, 0.0);
    // Against a diagonal of ones and the rounding of 34 terms, 1e-14: what is above 1e-11 is no rounding.
    assert!(findings.pivot > 1.0e-11 && findings.eigenvalue > 1.0e-11, "{findings:?}");
    // Nothing but that rounding and what it has done to P below zero.
    assert!(findings.with_clones > -1.0e-11, "{findings:?}");
    // One unit in the last place a step would add up to this over 10⁷ steps.
    assert!(findings.state < 1.0e-9 && findings.covariance < 1.0e-9, "{findings:?}");
    // Where no measurement takes rounding back it does add up.
    assert!(findings.unobserved < 1.0e-8, "{findings:?}");
}

#[test]
fn val_covariance_follows_the_square_root_filter_over_1e5_steps() {
    let findings = fly(100_000, 100_000);
    judge(&findings);
}

/// 11.6 days; see docs/results/endurance.md.
#[test]
#[ignore = "ten million steps, six minutes: .ci/nightly"]
fn val_covariance_follows_the_square_root_filter_over_1e7_steps() {
    let findings = fly(10_000_000, 500_000);
    judge(&findings);
}

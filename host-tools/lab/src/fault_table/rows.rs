//! The rows of the fault table, and how one is flown.

use super::{Judge, JudgedFlight};
use anyhow::Context;
use backseat_app::Loss;
use backseat_link::Client;
use hil_sim::backseat::InProcess;
use hil_sim::flight;
use hil_sim::scenario::{End, Limits, Scenario};
use hil_sim::ship_end::{self, ShipEnd};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;

macro_rules! built_in {
    ($($name:literal)*) => {
        /// Names and texts, in the order of the table.
        const BUILT_IN: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../../../hil-sim/scenarios/faults/", $name, ".toml")))),*];
    };
}

built_in! {
    "none"
    "none_dvl"
    "lost_frontseat"
    "lost_dvl"
    "lost_ahrs"
    "lost_modem"
    "repeated_frontseat"
    "repeated_dvl"
    "repeated_ahrs"
    "repeated_modem"
    "reordered_frontseat"
    "reordered_dvl"
    "reordered_ahrs"
    "reordered_modem"
    "late_frontseat"
    "late_dvl"
    "late_ahrs"
    "late_modem"
    "bit_flipped_frontseat"
    "bit_flipped_dvl"
    "bit_flipped_ahrs"
    "bit_flipped_modem"
    "truncated_frontseat"
    "truncated_dvl"
    "truncated_ahrs"
    "truncated_modem"
    "silent_frontseat_1s"
    "silent_frontseat_60s"
    "cut_frontseat"
    "silent_ahrs_1s"
    "silent_ahrs_60s"
    "silent_dvl"
    "silent_modem"
    "babbling_frontseat"
    "babbling_dvl"
    "babbling_ahrs"
    "babbling_modem"
    "garbage_frontseat"
    "garbage_dvl"
    "garbage_ahrs"
    "garbage_modem"
    "storm"
    "dvl_no_lock"
    "dvl_false_lock"
    "dvl_false_lock_slow"
    "ahrs_frozen"
    "ahrs_nan"
    "ahrs_upside_down"
    "ahrs_timer_rollover"
    "depth_jump"
    "depth_drift"
    "depth_feet"
    "depth_metres"
    "flooding"
    "flooding_little"
    "gnss_jump_20s"
    "gnss_jump"
    "packet_late"
    "packet_too_late"
    "packet_duplicated"
    "packet_wrong_source"
    "packet_forged"
    "packet_replayed"
    "packet_abort"
    "packet_wrong_second"
    "multipath"
    "modem_clock_step"
    "modem_clock_step_large"
    "modem_clock_drift"
    "ship_position"
    "ship_position_from_start"
    "ship_gnss_jump"
    "frontseat_refuses_2s"
    "frontseat_refuses"
    "frontseat_reboots"
    "frontseat_parks"
    "frontseat_manual"
    "reset_watchdog"
    "reset_brown_out"
    "resets"
    "flash_one_copy"
    "flash_both_copies"
    "board_clock_back"
    "board_clock_back_glitch"
    "board_clock_ahead"
    "oms_frontseat_refuses"
    "first_fixes_off"
    "receivers_off"
    "receivers_wander"
    "gnss_spoof_slow"
    "gnss_spoof_slow_dvl"
    "gnss_spoof"
    "gnss_spoof_dvl"
    "gnss_spoof_fast"
    "gnss_spoof_fast_dvl"
    "ordinary_day"
    "ordinary_day_dvl"
    "file_wrong_dvl"
    "light_and_trimmed"
    "tide"
    "tide_hour"
    "compass_3_dvl"
    "compass_5"
    "compass_5_dvl"
    "heading_jump"
    "heading_drift"
    "heading_drift_dvl"
    "dvl_scale"
    "no_packets"
    "clock_drift_slow"
    "clock_step_second"
    "multipath_half"
    "two_ships"
    "waves"
    "waves_dvl"
}

/// A row of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// Its name, that of its file.
    pub name: String,
    /// The scenario that is flown.
    pub scenario: Scenario,
    /// The limits that it must keep.
    pub limits: Limits,
}

/// All rows, in the order of the table.
///
/// # Errors
/// A built-in scenario that cannot be read, or has no limits.
pub fn rows() -> anyhow::Result<Vec<Row>> {
    let row = |(name, text): &(&str, &str)| {
        let scenario = Scenario::with_built_in_vehicle(text, &format!("faults/{name}.toml"))?;
        let limits = scenario.settings.limits.clone().with_context(|| format!("{name}: has no [limits]"))?;
        Ok(Row { name: (*name).to_owned(), scenario, limits })
    };
    BUILT_IN.iter().map(row).collect()
}

/// Causes of packets without a range that indicate a fault. Not counted: every cycle initialisation has statistics
/// without a packet.
const LOSSES: [(Loss, &str); 11] = [
    (Loss::NotReady, "not ready"),
    (Loss::Replaced, "replaced"),
    (Loss::TimedOut, "timed out"),
    (Loss::Bad, "bad"),
    (Loss::Stranger, "stranger"),
    (Loss::NotSynchronous, "not synchronous"),
    (Loss::NoTime, "no time"),
    (Loss::Undisciplined, "undisciplined clock"),
    (Loss::Arrival, "arrival"),
    (Loss::Repeated, "repeated"),
    (Loss::Absurd, "absurd"),
];

/// Flies a row in lock-step, the app in this process. A panic, or a flight that fails, is an outcome.
#[must_use]
pub fn fly(row: &Row, seed: u64) -> JudgedFlight {
    catch_unwind(AssertUnwindSafe(|| flown(row, seed)))
        .unwrap_or_else(|_| Err(anyhow::anyhow!("panic")))
        .unwrap_or_else(|error| failed(seed, &format!("{error:#}")))
}

/// Topside, where the row has a fault that it alone hears; elsewhere the vehicle's modem plays the ship's part, which
/// takes half the time.
pub fn ship_of(scenario: &Scenario) -> anyhow::Result<Option<ShipEnd>> {
    let ship = ship_end::fault_of_receiver(scenario).map(|_| ShipEnd::with_topside(scenario));
    ship.transpose().context("acoustics")
}

fn flown(row: &Row, seed: u64) -> anyhow::Result<JudgedFlight> {
    let mut scenario = row.scenario.clone();
    scenario.settings.seed = seed;
    let mut client = Client::new(InProcess::new());
    let mut judge = Judge::new(&scenario);
    let mut ship = ship_of(&scenario)?;
    let stop = AtomicBool::new(false);
    let flight = flight::fly_watched(&scenario, &mut client, ship.as_mut(), &stop, |step| judge.watch(&step))?;
    let health = client.ports().health();
    let lost = LOSSES.map(|(loss, name)| (name, health.lost_packets(loss)));
    Ok(judge.finish(seed, &flight, &lost, &row.limits))
}

fn failed(seed: u64, why: &str) -> JudgedFlight {
    JudgedFlight {
        seed,
        error_m: [f64::NAN; 2],
        navigating_errors_m: Vec::new(),
        end_error_m: f64::NAN,
        ratios: [f64::NAN; 2],
        deepest_m: f64::NAN,
        steered_deepest_m: f64::NAN,
        silent_s: [f64::NAN; 2],
        navigating: f64::NAN,
        spells: Vec::new(),
        fault_us: 0,
        alarms: Default::default(),
        commands: [0; 3],
        end: End::Any,
        digest: 0,
        violations: vec![why.to_owned()],
    }
}

//! The board's records with names and units, as they go into JSON and CSV.

use crate::log::RADPS_PER_RPM;
use backseat_core::navigation::{ESTIMATE_NAMES, Sensor};
use backseat_wire::hostlink::{Estimate, Estimates, FusionTelemetry, Mode, ModeReason, Telemetry};
use serde::Serialize;
use std::collections::BTreeMap;

/// A record as a row: each field with the expression that it is of the record.
macro_rules! row {
    ($(#[$about:meta])* $row:ident of |$record:ident: $source:ty| {
        $($(#[$doc:meta])* $field:ident: $type:ty = $value:expr,)*
    }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[allow(missing_docs)] // names with units
        pub struct $row {
            /// When it was sent, by the log's clock; board time until that is known.
            pub t_s: f64,
            /// Board time.
            pub board_t_s: f64,
            $($(#[$doc])* pub $field: $type,)*
        }

        impl From<&$source> for $row {
            fn from($record: &$source) -> Self {
                let board_t_s = seconds($record.time_us);
                Self { t_s: board_t_s, board_t_s, $($field: $value,)* }
            }
        }

        impl $row {
            /// Sent at this time by the log's clock.
            #[must_use]
            pub fn at(self, time_us: u64) -> Self {
                Self { t_s: seconds(time_us), ..self }
            }
        }
    };
}

row! {
    /// [`Telemetry`] of one step, flat; seven digits, for the exact ones are in the bytes beside it.
    TelemetryRow of |telemetry: Telemetry| {
        /// Since 1970; missing while the board does not know it.
        utc_s: Option<f64> = (telemetry.utc_us != 0).then(|| seconds(telemetry.utc_us)),
        mode: Mode = telemetry.mode,
        reason: ModeReason = telemetry.reason,
        x_m: f32 = telemetry.state[0] as f32,
        y_m: f32 = telemetry.state[1] as f32,
        depth_m: f32 = telemetry.state[2] as f32,
        roll_rad: f32 = telemetry.state[3] as f32,
        pitch_rad: f32 = telemetry.state[4] as f32,
        heading_rad: f32 = telemetry.state[5] as f32,
        u_mps: f32 = telemetry.state[6] as f32,
        v_mps: f32 = telemetry.state[7] as f32,
        w_mps: f32 = telemetry.state[8] as f32,
        p_radps: f32 = telemetry.state[9] as f32,
        q_radps: f32 = telemetry.state[10] as f32,
        r_radps: f32 = telemetry.state[11] as f32,
        sigma_x_m: f32 = telemetry.sigma[0] as f32,
        sigma_y_m: f32 = telemetry.sigma[1] as f32,
        sigma_depth_m: f32 = telemetry.sigma[2] as f32,
        sigma_roll_rad: f32 = telemetry.sigma[3] as f32,
        sigma_pitch_rad: f32 = telemetry.sigma[4] as f32,
        sigma_heading_rad: f32 = telemetry.sigma[5] as f32,
        sigma_u_mps: f32 = telemetry.sigma[6] as f32,
        sigma_v_mps: f32 = telemetry.sigma[7] as f32,
        sigma_w_mps: f32 = telemetry.sigma[8] as f32,
        sigma_p_radps: f32 = telemetry.sigma[9] as f32,
        sigma_q_radps: f32 = telemetry.sigma[10] as f32,
        sigma_r_radps: f32 = telemetry.sigma[11] as f32,
        cov_xy_m2: f32 = telemetry.cov_xy_m2 as f32,
        current_north_mps: f32 = telemetry.current_mps[0] as f32,
        current_east_mps: f32 = telemetry.current_mps[1] as f32,
        /// Commanded, as the fins.
        prop_rpm: f32 = (telemetry.propeller_radps / RADPS_PER_RPM) as f32,
        fin_top_rad: f32 = telemetry.fins_rad[0] as f32,
        fin_bottom_rad: f32 = telemetry.fins_rad[1] as f32,
        fin_port_rad: f32 = telemetry.fins_rad[2] as f32,
        fin_starboard_rad: f32 = telemetry.fins_rad[3] as f32,
        /// Of the mission, from 0; missing while none runs.
        leg: Option<u16> = telemetry.leg,
        /// Frames refused since start.
        rejected_frontseat: u32 = telemetry.rejected_frames[0],
        rejected_dvl: u32 = telemetry.rejected_frames[1],
        rejected_ahrs: u32 = telemetry.rejected_frames[2],
        rejected_modem: u32 = telemetry.rejected_frames[3],
        /// Protection level; 0 while there is no position.
        level_horizontal_m: f32 = telemetry.level_m[0],
        level_depth_m: f32 = telemetry.level_m[1],
    }
}

row! {
    /// [`FusionTelemetry`] of one scalar fusion, flat; board time is that of the measurement.
    FusionRow of |fusion: FusionTelemetry| {
        /// Name of the sensor.
        sensor: &'static str = Sensor::ALL.get(usize::from(fusion.sensor)).map_or("unknown", |sensor| sensor.name()),
        /// Component.
        axis: u8 = fusion.axis,
        /// `fused`, `gated`, `invalid`, `stale`, `uncertain` or `redundant`.
        outcome: &'static str = OUTCOMES.get(usize::from(fusion.outcome)).unwrap_or(&"unknown"),
        /// In the sensor's unit.
        innovation: f64 = fusion.innovation,
        /// Of the innovation, as the filter expects it.
        sigma: f64 = fusion.variance.sqrt(),
        /// Innovation over its sigma, squared: 1 in the mean where the filter is consistent.
        nis: f64 = fusion.innovation * fusion.innovation / fusion.variance,
    }
}

/// By the number in a record.
const OUTCOMES: [&str; 6] = ["fused", "gated", "invalid", "stale", "uncertain", "redundant"];

row! {
    /// What the robust filter estimates, by name.
    EstimatesRow of |record: Estimates| {
        /// Weight of the nominal filter, 0 to 1.
        weight_nominal: f32 = record.weights[0],
        /// Weight of the filter whose current changes, 0 to 1.
        weight_tidal: f32 = record.weights[1],
        /// Dives that it started from.
        dives: u16 = record.dives,
        /// Each estimate, by its name in `backseat_core::navigation::ESTIMATE_NAMES`.
        estimates: BTreeMap<&'static str, EstimateRow> = named(record),
    }
}

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EstimateRow {
    /// In its unit; of a parameter of the model the logarithm of true over declared.
    pub value: f32,
    /// One sigma.
    pub sigma: f32,
    /// Whether the motion has separated it from the prior and the other estimates. If not, it is used, and is no finding.
    pub separable: bool,
}

fn named(record: &Estimates) -> BTreeMap<&'static str, EstimateRow> {
    let row = |estimate: &Estimate| {
        let Estimate { place, value, sigma, separable } = *estimate;
        Some((*ESTIMATE_NAMES.get(usize::from(place))?, EstimateRow { value, sigma, separable }))
    };
    record.estimates.iter().filter_map(row).collect()
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 / 1e6
}

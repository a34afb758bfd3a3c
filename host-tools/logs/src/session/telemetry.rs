//! The board's records with names and units, as they go into JSON and CSV.

use crate::log::RADPS_PER_RPM;
use backseat_core::navigation::{ESTIMATE_NAMES, Sensor};
use backseat_wire::hostlink::{Estimate, Estimates, FusionTelemetry, Mode, ModeReason, Telemetry};
use serde::Serialize;
use std::collections::BTreeMap;

/// [`Telemetry`] of one step, flat; seven digits, for the exact ones are in the bytes beside it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "names with units")]
pub struct TelemetryRow {
    /// When it was sent, by the log's clock; board time until that is known.
    pub t_s: f64,
    /// Board time.
    pub board_t_s: f64,
    /// Since 1970; missing while the board does not know it.
    pub utc_s: Option<f64>,
    pub mode: Mode,
    pub reason: ModeReason,
    pub x_m: f32,
    pub y_m: f32,
    pub depth_m: f32,
    pub roll_rad: f32,
    pub pitch_rad: f32,
    pub heading_rad: f32,
    pub u_mps: f32,
    pub v_mps: f32,
    pub w_mps: f32,
    pub p_radps: f32,
    pub q_radps: f32,
    pub r_radps: f32,
    pub sigma_x_m: f32,
    pub sigma_y_m: f32,
    pub sigma_depth_m: f32,
    pub sigma_roll_rad: f32,
    pub sigma_pitch_rad: f32,
    pub sigma_heading_rad: f32,
    pub sigma_u_mps: f32,
    pub sigma_v_mps: f32,
    pub sigma_w_mps: f32,
    pub sigma_p_radps: f32,
    pub sigma_q_radps: f32,
    pub sigma_r_radps: f32,
    pub cov_xy_m2: f32,
    pub current_north_mps: f32,
    pub current_east_mps: f32,
    /// Commanded, as the fins.
    pub prop_rpm: f32,
    pub fin_top_rad: f32,
    pub fin_bottom_rad: f32,
    pub fin_port_rad: f32,
    pub fin_starboard_rad: f32,
    /// Of the mission, from 0; missing while none runs.
    pub leg: Option<u16>,
    /// Frames refused since start.
    pub rejected_frontseat: u32,
    pub rejected_dvl: u32,
    pub rejected_ahrs: u32,
    pub rejected_modem: u32,
    /// Protection level; 0 while there is no position.
    pub level_horizontal_m: f32,
    pub level_depth_m: f32,
}

impl From<&Telemetry> for TelemetryRow {
    fn from(telemetry: &Telemetry) -> Self {
        let [x_m, y_m, depth_m, roll_rad, pitch_rad, heading_rad, u_mps, v_mps, w_mps, p_radps, q_radps, r_radps] =
            telemetry.state.map(|value| value as f32);
        let sigma = telemetry.sigma.map(|value| value as f32);
        let [fin_top_rad, fin_bottom_rad, fin_port_rad, fin_starboard_rad] =
            telemetry.fins_rad.map(|value| value as f32);
        let [rejected_frontseat, rejected_dvl, rejected_ahrs, rejected_modem] = telemetry.rejected_frames;
        let [current_north_mps, current_east_mps] = telemetry.current_mps.map(|value| value as f32);
        Self {
            t_s: seconds(telemetry.time_us),
            board_t_s: seconds(telemetry.time_us),
            utc_s: (telemetry.utc_us != 0).then(|| seconds(telemetry.utc_us)),
            mode: telemetry.mode,
            reason: telemetry.reason,
            x_m,
            y_m,
            depth_m,
            roll_rad,
            pitch_rad,
            heading_rad,
            u_mps,
            v_mps,
            w_mps,
            p_radps,
            q_radps,
            r_radps,
            sigma_x_m: sigma[0],
            sigma_y_m: sigma[1],
            sigma_depth_m: sigma[2],
            sigma_roll_rad: sigma[3],
            sigma_pitch_rad: sigma[4],
            sigma_heading_rad: sigma[5],
            sigma_u_mps: sigma[6],
            sigma_v_mps: sigma[7],
            sigma_w_mps: sigma[8],
            sigma_p_radps: sigma[9],
            sigma_q_radps: sigma[10],
            sigma_r_radps: sigma[11],
            cov_xy_m2: telemetry.cov_xy_m2 as f32,
            current_north_mps,
            current_east_mps,
            prop_rpm: (telemetry.propeller_radps / RADPS_PER_RPM) as f32,
            fin_top_rad,
            fin_bottom_rad,
            fin_port_rad,
            fin_starboard_rad,
            leg: telemetry.leg,
            rejected_frontseat,
            rejected_dvl,
            rejected_ahrs,
            rejected_modem,
            level_horizontal_m: telemetry.level_m[0],
            level_depth_m: telemetry.level_m[1],
        }
    }
}

impl TelemetryRow {
    /// Sent at this time by the log's clock.
    #[must_use]
    pub fn at(self, time_us: u64) -> Self {
        Self { t_s: seconds(time_us), ..self }
    }
}

/// [`FusionTelemetry`] of one scalar fusion, flat.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FusionRow {
    /// When it was sent, by the log's clock; board time until that is known.
    pub t_s: f64,
    /// Board time of the measurement.
    pub board_t_s: f64,
    /// Name of the sensor.
    pub sensor: &'static str,
    /// Component.
    pub axis: u8,
    /// `fused`, `gated`, `invalid` or `stale`.
    pub outcome: &'static str,
    /// In the sensor's unit.
    pub innovation: f64,
    /// Of the innovation, as the filter expects it.
    pub sigma: f64,
    /// Innovation over its sigma, squared: 1 in the mean where the filter is consistent.
    pub nis: f64,
}

impl From<&FusionTelemetry> for FusionRow {
    fn from(fusion: &FusionTelemetry) -> Self {
        let sensor = Sensor::ALL.get(usize::from(fusion.sensor)).map_or("unknown", |sensor| sensor.name());
        let outcome = *["fused", "gated", "invalid", "stale", "uncertain", "redundant"]
            .get(usize::from(fusion.outcome))
            .unwrap_or(&"unknown");
        Self {
            t_s: seconds(fusion.time_us),
            board_t_s: seconds(fusion.time_us),
            sensor,
            axis: fusion.axis,
            outcome,
            innovation: fusion.innovation,
            sigma: fusion.variance.sqrt(),
            nis: fusion.innovation * fusion.innovation / fusion.variance,
        }
    }
}

impl FusionRow {
    /// Sent at this time by the log's clock.
    #[must_use]
    pub fn at(self, time_us: u64) -> Self {
        Self { t_s: seconds(time_us), ..self }
    }
}

/// What the robust filter estimates, by name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimatesRow {
    /// When it was sent, by the log's clock; board time until that is known.
    pub t_s: f64,
    /// Board time.
    pub board_t_s: f64,
    /// Weight of the nominal filter, 0 to 1.
    pub weight_nominal: f32,
    /// Weight of the filter whose current changes, 0 to 1.
    pub weight_tidal: f32,
    /// Dives that it started from.
    pub dives: u16,
    /// Each estimate, by its name in `backseat_core::navigation::ESTIMATE_NAMES`.
    pub estimates: BTreeMap<&'static str, EstimateRow>,
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

impl From<&Estimates> for EstimatesRow {
    fn from(record: &Estimates) -> Self {
        let named = record.estimates.iter().filter_map(|estimate| {
            let Estimate { place, value, sigma, separable } = *estimate;
            Some((*ESTIMATE_NAMES.get(usize::from(place))?, EstimateRow { value, sigma, separable }))
        });
        let [weight_nominal, weight_tidal] = record.weights;
        Self {
            t_s: seconds(record.time_us),
            board_t_s: seconds(record.time_us),
            weight_nominal,
            weight_tidal,
            dives: record.dives,
            estimates: named.collect(),
        }
    }
}

impl EstimatesRow {
    /// Sent at this time by the log's clock.
    #[must_use]
    pub fn at(self, time_us: u64) -> Self {
        Self { t_s: seconds(time_us), ..self }
    }
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 / 1e6
}

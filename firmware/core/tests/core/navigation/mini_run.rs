//! The filter over `nav_mini_run.csv` against an independent implementation, in four configurations.

use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::navigation::*;
use backseat_core::state::VehicleState;
use serde_json::Value;

const CSV: &str = include_str!("../../data/nav_mini_run.csv");

/// Decimal seconds to microseconds, exactly.
fn microseconds(t: &str) -> u64 {
    let (whole, part) = t.split_once('.').unwrap_or((t, ""));
    let digits = format!("{part:0<6}");
    whole.parse::<u64>().unwrap() * 1_000_000 + digits.parse::<u64>().unwrap()
}

struct Log {
    names: Vec<&'static str>,
    rows: Vec<Vec<&'static str>>,
}

impl Log {
    fn new() -> Self {
        let mut lines = CSV.lines().map(|line| line.split(',').collect::<Vec<_>>());
        Self { names: lines.next().unwrap(), rows: lines.collect() }
    }

    fn cell(&self, row: usize, name: &str) -> Option<&str> {
        let column = self.names.iter().position(|n| *n == name).unwrap();
        Some(self.rows[row][column]).filter(|cell| !cell.is_empty())
    }

    fn get<const K: usize>(&self, row: usize, names: [&str; K]) -> Option<[f64; K]> {
        self.cell(row, names[0])?;
        Some(names.map(|name| self.cell(row, name).unwrap().parse().unwrap()))
    }
}

#[derive(Clone, Copy)]
struct MiniRun {
    name: &'static str,
    model: ProcessModel,
    dvl: bool,
    range: bool,
    range_rate: bool,
    current: bool,
    gps: bool,
}

/// Worst deviations: state, current, covariance and range innovation.
fn run(log: &Log, vectors: &Value, run: MiniRun) -> [f64; 4] {
    let mini = &vectors["mini_run"];
    let expected = &mini["results"][run.name];
    let numbers = |v: &Value| v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    let noise = match run.model {
        ProcessModel::Dynamic => ProcessNoise::DYNAMIC,
        ProcessModel::Kinematic => ProcessNoise::KINEMATIC,
    };
    let config = NavigationConfig {
        process_model: run.model,
        process_noise: noise,
        effect_states: if run.current { EffectStates::water_current(0.3, 1e-4) } else { EffectStates::NONE },
        gate_sigma: 1e3,
        range_curvature: 1e6, // the reference is of first order
        ..NavigationConfig::REFERENCE
    };
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(&config, &VehicleModel::new(&VehicleParameters::IVER3).unwrap()).unwrap();
    let initial = InitialState {
        state: VehicleState::from_column_slice(&numbers(&mini["init_x"])),
        sigma: VehicleState::from_column_slice(&numbers(&mini["init_sd"])),
    };
    navigator.initialise(0, &initial).unwrap();
    let fixes: Vec<[f64; 2]> =
        (0..log.rows.len()).filter_map(|row| log.get(row, ["ship_gps_x_m", "ship_gps_y_m"])).take(6).collect();
    let ship = InitialShip {
        state: [
            fixes[0][0],
            fixes[0][1],
            0.0,
            (fixes[5][0] - fixes[0][0]) / 5.0,
            (fixes[5][1] - fixes[0][1]) / 5.0,
            0.0,
        ],
        sigma: [0.5, 0.5, 0.1, 0.15, 0.15, 0.01],
    };
    navigator.initialise_ship(&ship).unwrap();

    let mut input = ActuatorInput::default();
    let mut clone: Option<CloneId> = None;
    let mut innovations = Vec::new();
    let mut worst = [0.0_f64; 4];
    for row in 0..log.rows.len() {
        let time_us = microseconds(log.cell(row, "t_s").unwrap());
        navigator.predict(time_us, &input).unwrap();
        if let Some([rpm, top, bottom, port, starboard]) =
            log.get(row, ["prop_rpm", "fin_top_rad", "fin_bottom_rad", "fin_port_rad", "fin_starboard_rad"])
        {
            input = ActuatorInput {
                propeller_radps: rpm * core::f64::consts::PI / 30.0,
                fins_rad: [top, bottom, port, starboard],
            };
        }
        let mut measurements = Vec::new();
        measurements.extend(log.get(row, ["depth_m"]).map(|[z_m]| Measurement::Depth { z_m }));
        let attitude = log.get(row, ["roll_rad", "pitch_rad", "heading_rad"]);
        measurements.extend(attitude.map(|euler_rad| Measurement::Attitude { euler_rad }));
        let rates = log.get(row, ["p_radps", "q_radps", "r_radps"]);
        measurements.extend(rates.map(|rates_radps| Measurement::Rates { rates_radps }));
        if run.dvl {
            let dvl = log.get(row, ["dvl_u_mps", "dvl_v_mps", "dvl_w_mps"]);
            measurements.extend(dvl.map(|velocity_mps| Measurement::BottomTrack { velocity_mps }));
        }
        let ship = log.get(row, ["ship_gps_x_m", "ship_gps_y_m"]);
        measurements.extend(ship.map(|position_m| Measurement::ShipGnss { position_m }));
        if run.gps {
            let gps = log.get(row, ["gps_x_m", "gps_y_m"]);
            measurements.extend(gps.map(|position_m| Measurement::VehicleGnss { position_m }));
        }
        if let Some(clone) = clone {
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Delayed(clone) };
            if let Some([range_m]) = log.get(row, ["range_m"]).filter(|_| run.range) {
                measurements.push(Measurement::Range { path, range_m });
            }
            if let Some([range_rate_mps]) = log.get(row, ["range_rate_mps"]).filter(|_| run.range_rate) {
                measurements.push(Measurement::RangeRate { path, range_rate_mps });
            }
        }
        for measurement in &measurements {
            for record in navigator.fuse(measurement).iter() {
                assert_eq!(record.outcome, FusionOutcome::Fused);
                if record.sensor == Sensor::Range {
                    innovations.push([time_us as f64 * 1e-6, record.innovation, record.variance]);
                }
            }
        }
        if time_us >= 60_000_000 && time_us.is_multiple_of(30_000_000) {
            if let Some(old) = clone.take() {
                navigator.drop_clone(old);
            }
            clone = Some(navigator.clone_ship().unwrap());
        }

        let checkpoints = numbers(&expected["rows"]);
        let Some(k) = checkpoints.iter().position(|r| *r as usize == row) else { continue };
        assert!((numbers(&expected["t"])[k] - time_us as f64 * 1e-6).abs() < 1e-9);
        let state = numbers(&expected["veh_state"][k]);
        for i in 0..12 {
            worst[0] = worst[0].max((navigator.state()[i] - state[i]).abs());
        }
        let current = numbers(&expected["current"][k]);
        for i in 0..2 {
            worst[1] = worst[1].max((navigator.current()[i] - current[i]).abs());
        }
        let p = numbers(&expected["P_xx_xy_yy_psi_u_v"][k]);
        for (index, (i, j)) in [(0, 0), (0, 1), (1, 1), (5, 5), (6, 6), (7, 7)].into_iter().enumerate() {
            let scale = (navigator.variance(i) * navigator.variance(j)).sqrt();
            worst[2] = worst[2].max((navigator.covariance(i, j) - p[index]).abs() / scale);
        }
    }
    let rows = expected["range_innovation_S"].as_array().unwrap();
    assert_eq!(rows.len(), innovations.len());
    for (row, ours) in rows.iter().zip(&innovations) {
        let theirs = numbers(row);
        assert!((theirs[0] - ours[0]).abs() < 1e-9);
        worst[3] = worst[3].max((theirs[1] - ours[1]).abs()).max((theirs[2] / ours[2] - 1.0).abs());
    }
    worst
}

#[test]
fn val_mini_run_in_four_configurations() {
    let vectors: Value = serde_json::from_str(include_str!("../../data/nav_vectors.json")).unwrap();
    let log = Log::new();
    let base = MiniRun {
        name: "dyn_range",
        model: ProcessModel::Dynamic,
        dvl: false,
        range: true,
        range_rate: false,
        current: false,
        gps: false,
    };
    let runs = [
        base,
        MiniRun { name: "dyn_range_rr_current", range_rate: true, current: true, ..base },
        MiniRun { name: "kin_dvl_range", model: ProcessModel::Kinematic, dvl: true, ..base },
        MiniRun { name: "dyn_dvl_gps", dvl: true, gps: true, ..base },
    ];
    for case in runs {
        let worst = run(&log, &vectors, case);
        // Carrying our series to rounding moves these deviations by less than 1e-12: they are the reference's own
        // differentiation and quadrature, largest where no DVL forgets them (4e-7 m; 2e-6 as a correlation).
        assert!(worst.iter().all(|deviation| *deviation < 3e-6), "{}: {worst:?}", case.name);
        // The kinematic model is exact on both sides: only the ten digits of the log remain.
        assert!(case.model == ProcessModel::Dynamic || worst.iter().all(|deviation| *deviation < 3e-8), "{worst:?}");
    }
}

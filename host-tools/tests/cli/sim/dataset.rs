//! Data sets: clean where nothing is injected, repeatable, complete, and silent about the truth.

use crate::harness::program;
use backseat_core::navigation::ProcessModel;
use backseat_estimation::filter::{self, FilterOptions};
use backseat_logs::{Column, Log, Truth, VehicleFile};
use hil_sim::dataset::{Dataset, Shape, Spec, simulate};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::Request;
use std::f64::consts::{FRAC_PI_2, TAU};

fn spec(effect: Option<&str>) -> Spec {
    Spec {
        effects: effect.map(|name| Request::parse(name).unwrap()).into_iter().collect(),
        ..Spec::new(VehicleFile::reference())
    }
}

fn excited(spec: Spec) -> Spec {
    Spec { shape: Shape::Excite, ..spec }
}

/// Horizontal errors, m: median and largest.
fn navigated(dataset: &Dataset, use_dvl: bool) -> (filter::FilterRun, [f64; 2]) {
    let vehicle = VehicleFile::reference();
    let options = FilterOptions { use_dvl, ..FilterOptions::new(&vehicle, ProcessModel::Dynamic) };
    let run = filter::run(&dataset.log, &vehicle, &options).unwrap();
    let mut errors: Vec<f64> = run
        .track
        .iter()
        .filter(|sample| sample.time_us > 120_000_000)
        .filter_map(|sample| dataset.truth.horizontal_error_m(sample.time_us, sample.state[0], sample.state[1]))
        .collect();
    errors.sort_by(f64::total_cmp);
    let summary = [errors[errors.len() / 2], errors[errors.len() - 1]];
    (run, summary)
}

#[test]
fn val_a_log_without_effects_is_what_the_declared_model_expects() {
    for (spec, seed) in [(spec(None), 11), (excited(spec(None)), 12)] {
        let dataset = simulate(&spec, seed);
        for use_dvl in [true, false] {
            let (run, [median, worst]) = navigated(&dataset, use_dvl);
            for sensor in &run.sensors {
                let nis = sensor.nis.unwrap();
                // Mean of n squared normal numbers: sigma √(2/n); four of them, and 3 % for the filter's time steps.
                let tolerance = 4.0 * (2.0 / sensor.fused as f64).sqrt() + 0.03;
                assert!((nis - 1.0).abs() < tolerance, "{:?} {nis} of {}", sensor.sensor, sensor.fused);
            }
            assert!(median < 1.5 && worst < 6.0, "{median} {worst}");
        }
    }
}

#[test]
fn effects_spoil_navigation_that_does_not_know_of_them() {
    for effect in ["water_current:north_mps=0.2", "thrust_loss:k_n_s2_per_rad_m=0.01", "heading_bias:const_rad=0.1"] {
        let (_, [median, _]) = navigated(&simulate(&spec(Some(effect)), 11), false);
        assert!(median > 3.0, "{effect}: {median} m");
    }
}

#[test]
fn a_seed_gives_the_same_bits_and_another_seed_others() {
    let spec = Spec { noise: NoiseKind::Coloured, ..excited(spec(Some("random"))) };
    let [a, b, c] = [5, 5, 6].map(|seed| simulate(&spec, seed));
    assert_eq!(a.log.rows, b.log.rows);
    assert_eq!((&a.truth.rows, &a.effects, &a.legs), (&b.truth.rows, &b.effects, &b.legs));
    assert_ne!(a.log.rows, c.log.rows);
}

#[test]
fn rates_are_those_of_a_real_log() {
    let Dataset { log, truth, .. } = simulate(&Spec { ctd: true, ..spec(None) }, 3);
    assert!(log.rows.windows(2).all(|pair| pair[0].time_us < pair[1].time_us));
    let count = |column| log.column(column).count() as f64 / 1800.0;
    for (column, rate_hz) in [
        (Column::PropRpm, 5.0),
        (Column::Depth, 7.0),
        (Column::Heading, 3.0),
        (Column::R, 3.0),
        (Column::DvlU, 5.0),
        (Column::ShipGpsX, 1.0),
        (Column::WaterDensity, 1.0),
        (Column::Range, 1.0 / 30.0),
    ] {
        // First and last sample: one each way.
        assert!((count(column) - rate_hz).abs() < 2.0 / 1800.0 + 1e-4, "{column:?} {}", count(column));
    }
    // Surfaced at both ends, and only there.
    let fixes: Vec<u64> = log.column(Column::GpsX).map(|(time_us, _)| time_us / 1_000_000).collect();
    assert!(fixes[0] == 0 && *fixes.last().unwrap() == 1800 && (80..300).contains(&fixes.len()));
    assert!(fixes.iter().all(|second| *second < 200 || *second > 1600));
    assert_eq!(truth.rows.len(), 1801);
}

#[test]
fn without_noise_the_log_is_the_truth() {
    let Dataset { log, truth, .. } = simulate(&Spec { noise: NoiseKind::Off, duration_s: 300.0, ..spec(None) }, 3);
    for (column, state) in [(Column::Depth, 2), (Column::Heading, 5), (Column::R, 11)] {
        let whole = log.column(column).filter(|(time_us, _)| time_us.is_multiple_of(1_000_000));
        let pairs: Vec<_> = whole.map(|(time_us, value)| (value, truth.at(time_us).unwrap().state[state])).collect();
        // Headings of one turn; rounding.
        assert!(!pairs.is_empty());
        assert!(pairs.iter().all(|(a, b)| libm::remainder(a - b, std::f64::consts::TAU).abs() < 1e-12), "{column:?}");
    }
}

#[test]
fn sensors_can_be_left_out() {
    let log = simulate(&Spec { dvl: false, ranges: false, duration_s: 300.0, ..spec(None) }, 3).log;
    assert!([Column::DvlU, Column::Range, Column::ShipX, Column::WaterDensity].iter().all(|column| !log.has(*column)));
    assert!(log.has(Column::Heading) && log.has(Column::ShipGpsX));
}

#[test]
fn an_exciting_log_has_dives_steps_of_speed_and_legs_across() {
    for seed in 0..20 {
        let Dataset { truth, legs, .. } = simulate(&Spec { duration_s: 1200.0, ..excited(spec(None)) }, seed);
        let spread = |state: usize| {
            let values = truth.rows.iter().map(|row| row.state[state]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        // Depth, pitch, speed; the legs' headings cover the compass.
        assert!(spread(2) > 5.0 && spread(4) > 0.25 && spread(6) > 0.35, "{seed}");
        let quadrants: std::collections::BTreeSet<_> =
            legs.iter().map(|leg| (leg.heading_rad.rem_euclid(TAU) / FRAC_PI_2) as u8).collect();
        assert!(quadrants.len() >= 3, "{seed}: {quadrants:?}");
        // Nothing undeclared moves it: it stays in the water and near its depths.
        assert!(truth.rows.iter().all(|row| (-0.2..17.0).contains(&row.state[2])), "{seed}");
    }
}

#[test]
fn the_folder_keeps_the_truth_apart_and_the_log_betrays_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let make = |effect, out| {
        let arguments = ["sim", "dataset", "--effect", effect, "--seed", "4", "--hours", "0.1", "--out", out, "--json"];
        let said = program(folder.path(), arguments).good(effect);
        assert!(!said.contains(effect));
    };
    make("random", "a");
    make("fin_stuck:fin=top,rad=0.05", "b");
    let names = |out: &str| {
        let entries = std::fs::read_dir(folder.path().join(out)).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("a"), ["log.csv", "truth", "vehicle.toml"]);
    assert_eq!(names("a/truth"), ["effects.json", "truth.csv"]);
    let text = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    // Same header, same vehicle, whatever the effect.
    assert_eq!(text("a/log.csv").lines().next(), text("b/log.csv").lines().next());
    assert_eq!(text("a/vehicle.toml"), text("b/vehicle.toml"));
    assert!(Log::read(&folder.path().join("a/log.csv")).unwrap().duration_s() > 350.0);
    assert!(Truth::read(&folder.path().join("a/truth/truth.csv")).unwrap().rows.len() > 350);
    let effects: serde_json::Value = serde_json::from_str(&text("b/truth/effects.json")).unwrap();
    let stuck = &effects["effects"][0];
    assert_eq!((&stuck["name"], &stuck["parameters"]["fin"]), (&"fin_stuck".into(), &"top".into()));
    // 20 to 80 % of six minutes.
    assert!((72.0..=288.0).contains(&stuck["parameters"]["time_s"].as_f64().unwrap()));

    let refused =
        program(folder.path(), ["sim", "dataset", "--effect", "none", "--seed", "4", "--hours", "0.1", "--out", "a"]);
    assert_eq!(refused.code, Some(1));
    let unknown = program(
        folder.path(),
        ["sim", "dataset", "--effect", "gremlin", "--seed", "4", "--hours", "0.1", "--out", "c"],
    );
    assert!(unknown.stderr.contains("no effect gremlin"));
    assert!(!folder.path().join("c").exists());
}

#[test]
fn the_list_of_effects_is_as_wide_as_a_terminal() {
    let list = program(std::env::temp_dir().as_path(), ["sim", "dataset", "--list"]).good("--list");
    assert!(list.lines().all(|line| line.chars().count() <= 80), "{list}");
    assert!(list.contains("water_density") && list.contains("In no catalogue"), "{list}");
}

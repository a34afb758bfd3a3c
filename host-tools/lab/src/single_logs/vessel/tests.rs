use super::*;
use backseat_logs::LogRow;
use hil_sim::rng::{Source, Stream};

const MASS_KG: f64 = 200.0;
const LENGTH_M: f64 = 3.0;

/// Five runs of turns and zigzags of five minutes at 10 Hz, each in a wind of its own; equations of its own, with
/// inflow angle and propeller race, integrated by steps of 20 ms. In the second a hand holds the vessel for some
/// seconds.
fn log(winds: &[[f64; 2]]) -> Log {
    let (mut log, mut random) = (Log::default(), Stream::new(7, Source::Study));
    let mut noise = || random.uniform() - 0.5;
    for (run, [north, east]) in winds.iter().enumerate() {
        let revolutions = [8.0, 12.0, 10.0][run % 3];
        let (mut u, mut v, mut r, mut heading) = (0.0_f64, 0.0_f64, 0.0_f64, 1.1 * run as f64);
        let (mut x, mut y, mut rudder) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..3000_u64 {
            let t = 0.1 * k as f64;
            let wanted = if run % 2 == 0 {
                if t < 40.0 { 0.0 } else { 0.5_f64.copysign((t / 170.0).sin()) }
            } else {
                0.35_f64.copysign((t / 7.0).sin())
            };
            rudder += (wanted - rudder).clamp(-0.03, 0.03);
            let mut row = LogRow::new(run as u64 * 400_000_000 + k * 100_000);
            row.set_all(Column::DvlU, &[u + 0.002 * noise(), v + 0.002 * noise()]).set(Column::R, r + 2e-4 * noise());
            row.set(Column::Heading, wrap_angle(heading));
            row.set_all(Column::GpsX, &[x + 0.02 * noise(), y + 0.02 * noise()]);
            row.set(Column::PropRpm, 60.0 * revolutions).set(Column::Rudder, rudder).set(Column::Run, (run + 1) as f64);
            row.set(Column::Mass, MASS_KG).set(Column::Length, LENGTH_M);
            row.set(Column::WindageFront, 0.15).set(Column::WindageSide, 0.5);
            log.rows.push(row);
            for _ in 0..5 {
                let (sin, cos) = heading.sin_cos();
                let (ahead, side) = (north * cos + east * sin - u, east * cos - north * sin - v);
                let speed = ahead.hypot(side);
                let race = (0.36 * u * u + 0.0016 * revolutions * revolutions).sqrt();
                let lift = race * race * (rudder - (-v + 1.4 * r).atan2(race.max(0.05))).sin();
                let thrust = 0.06 * revolutions * revolutions - 0.25 * revolutions * u;
                let x_force = thrust - 12.0 * u * u.abs() - 5.0 * lift * rudder.sin();
                let y_force = -40.0 * u * v - 120.0 * v * v.abs() + 5.0 * lift;
                let n_force = -25.0 * u * v - 90.0 * u * r - 150.0 * r * r.abs() + 8.0 * lift;
                let (mx, my, inertia) = (1.05 * MASS_KG, 1.85 * MASS_KG, 1.8 * MASS_KG * 0.5625);
                let wind = [0.7 * 0.15 * speed * ahead, 0.825 * 0.5 * speed * side];
                let wind_n = -(0.825 * 0.05 * speed * side + 0.08 * ahead * side) * 0.5 * LENGTH_M;
                let hold = if run == 1 && (100.0..106.0).contains(&t) { 0.15 } else { 0.0 };
                u += 0.02 * ((x_force + 0.6125 * wind[0] + my * v * r) / mx - hold * u);
                v += 0.02 * ((y_force + 0.6125 * wind[1] - mx * u * r) / my - hold * v);
                r += 0.02 * ((n_force + 0.6125 * wind_n) / inertia - hold * r);
                heading += 0.02 * r;
                let (sin, cos) = heading.sin_cos();
                x += 0.02 * (u * cos - v * sin);
                y += 0.02 * (u * sin + v * cos);
            }
        }
    }
    log
}

const WINDS: [[f64; 2]; 5] = [[1.5, -1.0], [-2.0, 0.8], [0.5, 1.8], [-1.2, -1.2], [1.8, 0.9]];

#[test]
fn val_wind_of_each_run_from_the_motion_alone() {
    let log = log(&WINDS);
    assert!(is_for(&log));
    let found = run(&log, &VehicleFile::reference()).unwrap();
    let effects = &found.diagnosis.effects;
    let wind = effects.iter().find(|effect| effect.instance.candidate.effect == "wind");
    let values = &wind.unwrap_or_else(|| panic!("{effects:?} {:?}", found.diagnosis.notes)).values;
    for (run, truth) in WINDS.iter().enumerate() {
        let (north, east) = (values[2 * run].value, values[2 * run + 1].value);
        let turned = wrap_angle(east.atan2(north) - truth[1].atan2(truth[0])).to_degrees();
        let ratio = north.hypot(east) / truth[0].hypot(truth[1]);
        // The demand: 25 degrees and 35 %.
        assert!(turned.abs() < 25.0 && (ratio - 1.0).abs() < 0.35, "run {run}: {north} {east} {truth:?}");
    }
    assert_eq!(values[0].name, "north_mps (run 1)");
    let [before, after] = found.scores;
    for ((name, before), (_, after)) in before.unexplained_variance.iter().zip(&after.unexplained_variance).skip(1) {
        assert!(*after < 0.75 * before, "{name}: {before} {after}");
    }
}

#[test]
fn val_no_wind_is_found_in_still_air() {
    let found = run(&log(&[[0.0; 2]; 5]), &VehicleFile::reference()).unwrap();
    let names: Vec<&str> = found.diagnosis.effects.iter().map(|effect| effect.instance.candidate.effect).collect();
    assert!(!names.contains(&"wind"), "{:?}", found.diagnosis.effects);
}

#[test]
#[ignore = "a quarter of a minute: .ci/nightly"]
fn val_coefficients_with_an_anemometer() {
    let mut log = log(&WINDS);
    for row in &mut log.rows {
        let [north, east] = WINDS[row.get(Column::Run).unwrap() as usize - 1];
        row.set(Column::WindSpeed, north.hypot(east)).set(Column::WindFrom, (-east).atan2(-north));
    }
    let found = run(&log, &VehicleFile::reference()).unwrap();
    let effects = &found.diagnosis.effects;
    let wind = effects.iter().find(|effect| effect.instance.candidate.effect == "wind").unwrap();
    // Ahead and to the side within a quarter: hull terms are not those of the simulated hull.
    for (value, truth) in wind.values.iter().zip([0.7, 0.825]) {
        assert!((value.value / truth - 1.0).abs() < 0.25, "{:?}", wind.values);
    }
}

#[test]
#[ignore = "a minute without optimisation: .ci/nightly"]
fn val_the_order_of_runs_changes_nothing() {
    let log = log(&WINDS);
    let winds = |order: &[usize]| {
        let mut ordered = Log::default();
        for (place, run) in order.iter().enumerate() {
            let own = log.rows.iter().filter(|row| row.get(Column::Run) == Some((run + 1) as f64));
            for row in own {
                let mut row = row.clone();
                row.time_us = row.time_us - *run as u64 * 400_000_000 + place as u64 * 477_700_000;
                row.set(Column::Run, (place + 1) as f64);
                ordered.rows.push(row);
            }
        }
        let found = run(&ordered, &VehicleFile::reference()).unwrap();
        let effects = found.diagnosis.effects;
        let wind = effects.iter().find(|effect| effect.instance.candidate.effect == "wind").unwrap();
        let mut by_run = vec![[0.0; 2]; order.len()];
        for (place, run) in order.iter().enumerate() {
            by_run[*run] = [wind.values[2 * place].value, wind.values[2 * place + 1].value];
        }
        (by_run, found.diagnosis.verdict, found.scores[1].position_rmse_m, found.scores[1].velocity_rmse_mps)
    };
    let first = winds(&[0, 1, 2, 3, 4]);
    for order in [[4, 3, 2, 1, 0], [2, 0, 4, 1, 3]] {
        let other = winds(&order);
        assert_eq!(first.1, other.1);
        // Sums in another order round otherwise, and the steps of the search for noise with them.
        for (a, b) in first.0.iter().flatten().zip(other.0.iter().flatten()) {
            assert!((a - b).abs() < 1e-3, "{order:?}: {a} {b}");
        }
        assert!((first.3.unwrap() / other.3.unwrap() - 1.0).abs() < 1e-3);
    }
}

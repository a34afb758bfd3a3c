//! The floor under every word: what no sensor makes is not to be believed.

use super::*;

/// Nothing good is said of a log with its heading negated, nor of one that is too short for anything to judge it.
#[test]
fn the_floor_under_every_word() {
    let vehicle = VehicleFile::reference();
    let verdict = |log: &backseat_logs::Log| {
        let mut log_data = PreparedLog::new(log, &vehicle, true).unwrap();
        let d = diagnosis::run(&mut log_data, |_| {}).unwrap();
        let set = d.set(&vehicle.effects.set.into());
        let scores = scores::of(&log_data, &d.after, &set, log, &vehicle, None, true).unwrap();
        let d = floor::under(d, &log_data, &scores);
        (d.verdict, d.remaining)
    };
    let mut spec = Spec::new(vehicle.clone());
    spec.duration_s = 600.0;
    let mut log = dataset::simulate(&spec, 51).log;
    assert_eq!(verdict(&log).0, Verdict::None);
    for row in &mut log.rows {
        if let Some(heading) = row.get(Column::Heading) {
            row.set(Column::Heading, -heading);
        }
    }
    let (said, remaining) = verdict(&log);
    assert!(matches!(said, Verdict::Implausible | Verdict::Unexplained), "{said:?} {remaining:?}");
    spec.duration_s = 60.0;
    let said = verdict(&dataset::simulate(&spec, 52).log).0;
    assert!(!matches!(said, Verdict::None | Verdict::Explained), "{said:?}");
}

/// What a hull does in waves at the surface is no sensor's error; the same below them is not to be believed.
#[test]
fn the_floor_does_not_count_what_waves_move() {
    let vehicle = VehicleFile::reference();
    let mut spec = Spec::new(vehicle.clone());
    (spec.duration_s, spec.shape) = (1200.0, Shape::Surfacing);
    let log = dataset::simulate(&spec, 53).log;
    let mut log_data = PreparedLog::new(&log, &vehicle, true).unwrap();
    let d = diagnosis::run(&mut log_data, |_| {}).unwrap();
    let set = d.set(&vehicle.effects.set.into());
    let scores = scores::of(&log_data, &d.after, &set, &log, &vehicle, None, true).unwrap();
    let verdict = |in_waves: bool| {
        let mut d = d.clone();
        let of_roll = d.after.residuals.iter_mut().filter(|r| r.channel == ResidualChannel::P && r.used);
        let spoilt = of_roll.filter(|r| r.is_moved_by_waves == in_waves && log_data.is_judged(r.t_s));
        let count = spoilt.map(|r| r.innovation = 0.3).count();
        assert!(count > 50, "{count}");
        floor::under(d, &log_data, &scores).verdict
    };
    assert_eq!([verdict(true), verdict(false)], [Verdict::None, Verdict::Implausible]);
}

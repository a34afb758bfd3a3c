//! The mistakes that were added last. When nobody had tried them yet a fifth was named right; the tests were mended since.

use super::change::{Change, Wrong};
use super::recordings::{self, negated, other, pairs, swapped, values};
use backseat_logs::{Column, LogRow};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Of the vehicle's own axes to the ground's, which no line of a mapping undoes.
fn to_north_and_east(row: &mut LogRow) {
    if let [Some(psi), Some(u), Some(v)] = [Column::Heading, Column::DvlU, Column::DvlV].map(|column| row.get(column)) {
        row.set(Column::DvlU, u * psi.cos() - v * psi.sin()).set(Column::DvlV, u * psi.sin() + v * psi.cos());
    }
}

/// A transducer whose beams, not its axes, point ahead.
fn turned_by_an_eighth(row: &mut LogRow) {
    if let [Some(u), Some(v)] = [Column::DvlU, Column::DvlV].map(|column| row.get(column)) {
        let (sin, cos) = FRAC_PI_4.sin_cos();
        row.set(Column::DvlU, u * cos + v * sin).set(Column::DvlV, v * cos - u * sin);
    }
}

/// Where the vehicle goes in place of where it points.
fn course_for_heading(row: &mut LogRow) {
    if let [Some(psi), Some(u), Some(v)] = [Column::Heading, Column::DvlU, Column::DvlV].map(|column| row.get(column)) {
        row.set(Column::Heading, psi + v.atan2(u));
    }
}

/// Every wrong recording that is tried.
pub fn all() -> Vec<Wrong> {
    recordings::known().into_iter().chain(latest()).collect()
}

fn latest() -> Vec<Wrong> {
    use Column::*;
    let wrapped = |x: f64| (x + PI).rem_euclid(2.0 * PI) - PI;
    let hundredths = |x: f64| x.to_degrees() * 100.0;
    let rows = |name: &str, columns: &[Column], change: fn(&mut LogRow)| {
        other(name, Change::Rows(columns.to_vec(), change), "")
    };
    let no_mend = |mut wrong: Wrong| {
        wrong.mends = vec![String::new()];
        wrong
    };
    let fins = [FinTop, FinBottom, FinPort, FinStarboard];
    vec![
        values(
            "heading in hundredths of a degree",
            &[Heading],
            move |x| hundredths(x).rem_euclid(36_000.0),
            ", unit = \"cdeg\"",
        ),
        values(
            "heading in bytes of a turn",
            &[Heading],
            |x| x.rem_euclid(2.0 * PI) * 128.0 / PI,
            ", scale = 0.0245437",
        ),
        values("heading in mils", &[Heading], |x| x.rem_euclid(2.0 * PI) * 3200.0 / PI, ", scale = 0.0009817"),
        no_mend(values("heading folded at half a turn", &[Heading], |x| x.rem_euclid(PI), "")),
        no_mend(values("heading without its sign", &[Heading], move |x| wrapped(x).abs(), "")),
        rows("course in place of heading", &[Heading], course_for_heading),
        values("pitch in hundredths of a degree", &[Pitch], hundredths, ", unit = \"cdeg\""),
        values("roll in hundredths of a degree", &[Roll], hundredths, ", unit = \"cdeg\""),
        no_mend(values("pitch without its sign", &[Pitch], f64::abs, "")),
        negated(&[Roll, Pitch]),
        negated(&[Roll, Pitch, P, Q]),
        values("roll of an inverted sensor", &[Roll], move |x| wrapped(x + PI), ", offset = 3.1415927"),
        values("pitch from the vertical", &[Pitch], |x| x + FRAC_PI_2, ", offset = -1.5707963"),
        values("rates in mrad/s", &[P, Q, R], |x| x * 1e3, ", scale = 0.0010000"),
        values("yaw rate in turns a minute", &[R], |x| x * 30.0 / PI, ", scale = 0.1047198"),
        no_mend(values("yaw rate without its sign", &[R], f64::abs, "")),
        swapped(Heading, R),
        swapped(Pitch, Q),
        swapped(Pitch, Heading),
        values("depth of the absolute pressure", &[Depth], |x| x + 10.079, ", offset = -10.0790000"),
        values("height above a bottom of 60 m", &[Depth], |x| 60.0 - x, ", sign = -1, offset = -60.0000000")
            .or("columns.depth_m = { column = \"depth_m\", sign = -1 }"),
        values("depth in yards", &[Depth], |x| x / 0.9144, ", scale = 0.9144000"),
        no_mend(values(
            "depth without what is above the surface, in steps of 5 m",
            &[Depth],
            |x| (x / 5.0).round() * 5.0,
            "",
        )),
        swapped(Depth, Pitch),
        swapped(Depth, DvlU),
        rows("DVL in north and east", &[DvlU, DvlV], to_north_and_east),
        rows("DVL turned by an eighth", &[DvlU, DvlV], turned_by_an_eighth),
        no_mend(values("DVL without signs", &[DvlU, DvlV, DvlW], f64::abs, "")),
        values("DVL ahead in cm/s", &[DvlU], |x| x * 100.0, ", unit = \"cm/s\""),
        values("speed in ft/s", &[SpeedLog], |x| x / 0.3048, ", unit = \"ft/s\""),
        values("fixes in nautical miles", &[GpsX, GpsY], |x| x / 1852.0, ", scale = 1852.0000000"),
        values("east of the fixes in minutes of longitude at 60 degrees", &[GpsY], |x| x * 2.0, ", scale = 0.5000000"),
        pairs("ship's fixes for own", &[(GpsX, ShipGpsX), (GpsY, ShipGpsY)]),
        values("ship's places in feet", &[ShipX, ShipY], |x| x / 0.3048, ", unit = \"ft\""),
        values("range in yards", &[Range], |x| x / 0.9144, ", scale = 0.9144000"),
        values("range in fathoms", &[Range], |x| x / 1.8288, ", unit = \"fathom\""),
        values("range in ms of a two-way travel time", &[Range], |x| x / 0.75, ", scale = 0.7500000"),
        no_mend(values("range with 40 m of a modem's delay", &[Range], |x| x + 40.0, "")),
        values("range rate in km/h", &[RangeRate], |x| x * 3.6, ", unit = \"km/h\""),
        values("fins in mrad", &fins, |x| x * 1e3, ", scale = 0.0010000"),
        values("fins about a quarter turn", &fins, |x| x + FRAC_PI_2, ", offset = -1.5707963"),
        no_mend(values("fins without signs", &fins, f64::abs, "")),
        swapped(FinTop, PropRpm),
        values("propeller in tens of rpm", &[PropRpm], |x| x * 0.1, ", scale = 10.0000000"),
        values("propeller in per mille of 3000 rpm", &[PropRpm], |x| x / 3.0, ", scale = 3.0000000"),
        other("time in days", Change::Time(1.0 / 86_400.0), "time = { column = \"t_s\", unit = \"d\" }"),
        other("time in hundredths of a second", Change::Time(100.0), ""),
    ]
}

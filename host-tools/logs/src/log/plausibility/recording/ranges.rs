//! Ranges against travel times, against their own rate, and against the way of vehicle and ship.

use super::grid::Grid;
use super::legs::{Way, polar};
use super::relation::{Demand, Outcome, Relation, State};
use super::slope::{Equation, Slope};
use crate::log::Column;
use crate::stats::{median, percentile};
use nalgebra::{Normed, SMatrix, SVector};

/// Speeds that sound has in water with room for clocks and conversions, m/s.
const SOUND_MPS: [f64; 2] = [1300.0, 1700.0];
/// Shorter ranges are mostly error of the clocks, m.
const SHORTEST_M: f64 = 20.0;
/// Pings further apart say nothing of the rate between, s.
const BETWEEN_S: f64 = 120.0;
/// Dead reckoning holds for so long, s, with so many pings.
const SEGMENT_S: f64 = 1800.0;
const PINGS: usize = 10;
/// What the track may be wrong by where all columns are right: current, m/s; heading, rad; speed, share; fix, m.
const CURRENT_MPS: f64 = 0.3;
const HEADING: f64 = 0.1;
const SPEED: f64 = 0.1;
const FIX_M: f64 = 5.0;
/// Fixes nearer to each other in time say the same, s; a fix of four may be an outlier.
const BETWEEN_FIXES_S: f64 = 30.0;
const MOST_FIXES: f64 = 0.75;
/// Error of a range beside which nothing else counts, m, and residuals beyond so many of them weigh less (Huber 1964).
const RANGE_M: f64 = 3.0;
const HUBER: f64 = 2.0;
/// A track misses its ranges by this: m, and share of the typical range.
const MISSED: (f64, f64) = (15.0, 0.05);

const OF_RANGE: &[Column] = &[Column::Range, Column::Heading];
const OF_TRACK: &[Column] = &[
    Column::ShipX,
    Column::ShipY,
    Column::ShipGpsX,
    Column::ShipGpsY,
    Column::GpsX,
    Column::GpsY,
    Column::DvlU,
    Column::DvlV,
    Column::SpeedLog,
    Column::WaterSpeed,
    Column::Depth,
];

pub const RELATIONS: [Relation; 4] = [
    Relation {
        name: "range against travel time",
        needs: &[Column::Range, Column::Tol, Column::Toa],
        uses: &[],
        test: travel_time,
    },
    Relation { name: "range rate against range", needs: &[Column::Range, Column::RangeRate], uses: &[], test: rate },
    Relation {
        name: "ship's place against its track",
        needs: &[Column::ShipX, Column::ShipY, Column::ShipGpsX, Column::ShipGpsY],
        uses: &[],
        test: ship,
    },
    Relation { name: "range against the way of vehicle and ship", needs: OF_RANGE, uses: OF_TRACK, test: track },
];

fn travel_time(grid: &Grid) -> Outcome {
    let Some([range, tol, toa]) = grid.all([Column::Range, Column::Tol, Column::Toa]) else {
        return Outcome::untested("no travel times");
    };
    let speeds: Vec<f64> = (0..grid.len)
        .map(|k| (range[k], toa[k] - tol[k]))
        .filter(|(range_m, travel_s)| *travel_s > SHORTEST_M / SOUND_MPS[1] && *range_m > 0.0)
        .map(|(range_m, travel_s)| range_m / travel_s)
        .collect();
    let Some(speed) = median(&speeds).filter(|_| speeds.len() >= 5) else {
        return Outcome::untested(format!("{} ranges with a travel time", speeds.len()));
    };
    let is_sound = (SOUND_MPS[0]..=SOUND_MPS[1]).contains(&speed);
    let state = if is_sound { State::Holds } else { State::Contradicted };
    let evidence = format!(
        "range_m over (toa_s - tol_s) is {speed:.1} m/s in the median of {} pings, the speed of sound about 1500",
        speeds.len()
    );
    Outcome::new(state, evidence)
}

fn rate(grid: &Grid) -> Outcome {
    let Some([range, rate]) = grid.all([Column::Range, Column::RangeRate]) else {
        return Outcome::untested("no range rates");
    };
    let pings: Vec<usize> = (0..grid.len).filter(|&k| !range[k].is_nan() && !rate[k].is_nan()).collect();
    let pairs = pings.windows(2).filter_map(|pair| {
        let seconds = (pair[1] - pair[0]) as f64 * grid.cell_s;
        let (y, x) = ((range[pair[1]] - range[pair[0]]) / seconds, 0.5 * (rate[pair[0]] + rate[pair[1]]));
        (seconds <= BETWEEN_S).then_some(Equation { stretch: pair[0], y, x, others: [0.0; 4] })
    });
    // a knot is 0.51 m/s
    let demand = Demand { gain: [0.65, 1.6], correlation: 0.4, stretch_s: grid.cell_s };
    Outcome::of([Slope::of(pairs.collect())], "range_rate_mps", "the change of range_m from ping to ping", &demand)
}

fn ship(grid: &Grid) -> Outcome {
    let wanted = [Column::ShipX, Column::ShipY, Column::ShipGpsX, Column::ShipGpsY];
    let Some([x, y, gps_x, gps_y]) = grid.all(wanted) else { return Outcome::untested("no track of the ship") };
    let apart: Vec<f64> =
        (0..grid.len).map(|k| (x[k] - gps_x[k]).hypot(y[k] - gps_y[k])).filter(|apart| !apart.is_nan()).collect();
    let Some(typical) = median(&apart).filter(|_| apart.len() >= 5) else {
        return Outcome::untested("no ship's place at a time of its track");
    };
    // antennas, steps of packets, and a packet that waited
    let state = match typical {
        ..20.0 => State::Holds,
        60.0.. => State::Contradicted,
        _ => State::Untested,
    };
    let evidence = format!(
        "ship_x_m, ship_y_m are {typical:.0} m from ship_gps_x_m, ship_gps_y_m of that time, median of {} packets",
        apart.len()
    );
    Outcome::new(state, evidence)
}

/// A range from a place of the ship, after the start of a segment.
struct Ping {
    seconds: f64,
    way: Way,
    ship: Way,
    level_m: f64,
}

/// Part of a log that dead reckoning spans.
#[derive(Default)]
struct Segment {
    pings: Vec<Ping>,
    /// Fixes: seconds, way and place.
    fixes: Vec<(f64, Way, Way)>,
}

fn track(grid: &Grid) -> Outcome {
    let Some(segments) = segments(grid) else {
        return Outcome::untested("no speed, or no place of the ship, beside the ranges");
    };
    let segments: Vec<Segment> = segments.into_iter().filter(|segment| segment.pings.len() >= PINGS).collect();
    let missed: Vec<f64> = segments.iter().filter_map(Segment::missed_m).collect();
    let Some(typical) = median(&missed) else {
        return Outcome::untested(format!("fewer than {PINGS} ranges in {SEGMENT_S:.0} s of dead reckoning"));
    };
    let ranges: Vec<f64> = segments.iter().flat_map(|segment| segment.pings.iter().map(|ping| ping.level_m)).collect();
    let bound = MISSED.0.max(MISSED.1 * median(&ranges).unwrap_or(0.0));
    let state = match typical / bound {
        ..0.5 => State::Holds,
        1.0.. => State::Contradicted,
        _ => State::Untested,
    };
    let evidence = format!(
        "dead reckoning misses ranges or fixes by {typical:.0} m in the median of {} stretches of {SEGMENT_S:.0} s, current, \
         heading bias and start fitted",
        segments.len()
    );
    Outcome::new(state, evidence)
}

fn segments(grid: &Grid) -> Option<Vec<Segment>> {
    let [range, heading] = grid.all([Column::Range, Column::Heading])?;
    let (_, u) = grid.speed()?;
    let v = grid.get(Column::DvlV);
    let ship = grid.all([Column::ShipX, Column::ShipY]).or_else(|| grid.all([Column::ShipGpsX, Column::ShipGpsY]))?;
    let depth = grid.get(Column::Depth);
    let own = grid.all([Column::GpsX, Column::GpsY]);
    let span = grid.cells(SEGMENT_S, 2);
    let mut segments = Vec::new();
    let (mut way, mut last) = (Way::default(), Way::default());
    for cell in 0..grid.len {
        if cell % span == 0 {
            segments.push(Segment::default());
            way = Way::default();
        }
        let segment = segments.last_mut()?;
        let seconds = (cell % span) as f64 * grid.cell_s;
        let here = Way::new(ship[0][cell], ship[1][cell]);
        if !range[cell].is_nan() && !here.re.is_nan() && !here.im.is_nan() {
            let down = depth.map_or(0.0, |depth| if depth[cell].is_nan() { 0.0 } else { depth[cell] });
            let level_m = (range[cell] * range[cell] - down * down).max(0.0).sqrt();
            segment.pings.push(Ping { seconds, way, ship: here, level_m });
        }
        if let Some([x, y]) = own.filter(|[x, y]| !x[cell].is_nan() && !y[cell].is_nan())
            && segment.fixes.last().is_none_or(|(before, ..)| seconds - before >= BETWEEN_FIXES_S)
        {
            segment.fixes.push((seconds, way, Way::new(x[cell], y[cell])));
        }
        let sway = v.map_or(0.0, |v| if v[cell].is_nan() { 0.0 } else { v[cell] });
        let step = polar(grid.cell_s, heading[cell]) * Way::new(u[cell], sway);
        if step.re.is_finite() {
            last = step;
        }
        way += last;
    }
    Some(segments)
}

/// Start north and east, current north and east, turn of the heading, share of the speed.
type Unknowns = SVector<f64, 6>;

impl Segment {
    /// What the best dead reckoning misses the ranges or the fixes by, median, m.
    fn missed_m(&self) -> Option<f64> {
        let first = self.pings.first()?;
        let ring =
            (0..8).map(|k| first.ship + polar(first.level_m, f64::from(k) * std::f64::consts::FRAC_PI_4) - first.way);
        let starts = self.fixes.first().map(|(_, way, place)| place - way).into_iter().chain(ring);
        let fitted = starts.map(|start| self.fit(start));
        let (_, best) = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let of_pings = self.pings.iter().map(|p| ((place(&best, p.seconds, p.way) - p.ship).norm() - p.level_m).abs());
        let of_fixes = self.fixes.iter().map(|(seconds, way, fix)| (place(&best, *seconds, *way) - fix).norm());
        let of_fixes = percentile(&of_fixes.collect::<Vec<_>>(), MOST_FIXES).unwrap_or(0.0);
        Some(median(&of_pings.collect::<Vec<_>>())?.max(of_fixes))
    }

    /// Weighted misfit and unknowns, by Gauss and Newton from a start.
    fn fit(&self, start: Way) -> (f64, Unknowns) {
        let mut at = Unknowns::from([start.re, start.im, 0.0, 0.0, 0.0, 0.0]);
        let mut cost = f64::INFINITY;
        for _ in 0..12 {
            let mut normal = SMatrix::<f64, 6, 6>::zeros();
            let mut right = Unknowns::zeros();
            let mut sum = 0.0;
            for (k, sigma) in [(2, CURRENT_MPS), (3, CURRENT_MPS), (4, HEADING), (5, SPEED)] {
                normal[(k, k)] += 1.0 / (sigma * sigma);
                right[k] -= at[k] / (sigma * sigma);
                sum += (at[k] / sigma).powi(2);
            }
            let mut add = |jacobian: Unknowns, residual: f64| {
                let size = residual.abs();
                let weight = if size > HUBER { HUBER / size } else { 1.0 };
                sum += if size > HUBER { HUBER * (2.0 * size - HUBER) } else { size * size };
                normal += jacobian * jacobian.transpose() * weight;
                right -= jacobian * (residual * weight);
            };
            for ping in &self.pings {
                let apart = place(&at, ping.seconds, ping.way) - ping.ship;
                let distance = apart.norm().max(1.0);
                let jacobian = along(&at, ping.seconds, ping.way, apart / distance) / RANGE_M;
                add(jacobian, (distance - ping.level_m) / RANGE_M);
            }
            for (seconds, way, fix) in &self.fixes {
                let apart = place(&at, *seconds, *way) - fix;
                add(along(&at, *seconds, *way, Way::new(1.0, 0.0)) / FIX_M, apart.re / FIX_M);
                add(along(&at, *seconds, *way, Way::new(0.0, 1.0)) / FIX_M, apart.im / FIX_M);
            }
            cost = sum;
            normal += SMatrix::identity() * 1e-9;
            let Some(factor) = normal.cholesky() else { break };
            at += factor.solve(&right);
        }
        (cost, at)
    }
}

fn place(at: &Unknowns, seconds: f64, way: Way) -> Way {
    Way::new(at[0] + at[2] * seconds, at[1] + at[3] * seconds) + way * polar(1.0 + at[5], at[4])
}

/// Derivative of the place along a direction.
fn along(at: &Unknowns, seconds: f64, way: Way, direction: Way) -> Unknowns {
    let turned = way * polar(1.0 + at[5], at[4]);
    let dot = |of: Way| of.re * direction.re + of.im * direction.im;
    Unknowns::from([
        direction.re,
        direction.im,
        direction.re * seconds,
        direction.im * seconds,
        dot(turned * Way::i()),
        dot(way * polar(1.0, at[4])),
    ])
}

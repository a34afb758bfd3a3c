//! The three filters over one log, compared with the truth and with each other.

use super::deif::Deif;
use super::packet_fed::{PacketFed, reports};
use super::quantised::{Layout, short_floats};
use super::ship::{Delta, NUMBERS};
use super::walk::{DeifRun, Packet, PacketArrival, deltas, lose, packets, walk};
use anyhow::{Context, anyhow};
use backseat_core::dynamics::VehicleModel;
use backseat_core::state::{PSI, VEHICLE_STATES, X, Y, wrap_angle};
use backseat_estimation::filter::{self, FilterOptions, TrackSample};
use backseat_logs::stats::{ErrorSummary, rms};
use backseat_logs::{Column, Log, Truth, VehicleFile};
use backseat_wire::ship_state;
use hil_sim::scenario;

/// Largest differences from the centralized filter over all times of arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Horizontal distance of the estimates, m.
    pub position_m: f64,
    /// Any of the twelve states, in units of its own sigma.
    pub sigmas: f64,
    /// Any sigma, relative.
    pub sigma_ratio: f64,
}

impl Difference {
    fn of(arrivals: &[PacketArrival], centralized: &[TrackSample]) -> Option<Self> {
        let mut worst = Self::default();
        for arrival in arrivals {
            let at = centralized.binary_search_by_key(&arrival.time_us, |sample| sample.time_us).ok()?;
            let (reference, (mean, covariance)) = (&centralized[at], &arrival.moments);
            let difference = |i: usize| mean[i] - reference.state[i];
            worst.position_m = worst.position_m.max(difference(X).hypot(difference(Y)));
            for i in 0..VEHICLE_STATES {
                let difference = if i == PSI { wrap_angle(difference(i)) } else { difference(i) };
                let sigma = reference.sigma[i];
                worst.sigmas = worst.sigmas.max(difference.abs() / sigma);
                worst.sigma_ratio = worst.sigma_ratio.max((covariance[(i, i)].sqrt() / sigma - 1.0).abs());
            }
        }
        Some(worst)
    }
}

/// Results of one filter.
#[derive(Clone, Debug)]
pub struct Method {
    /// Its name in tables.
    pub name: &'static str,
    /// Bytes that each packet must carry about the ship; `None`: it needs every fix.
    pub bytes: Option<usize>,
    /// What became of it.
    pub result: Result<Judged, String>,
}

/// A filter that ran to the end.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Horizontal error, once a second.
    pub error: ErrorSummary,
    /// One sigma by the filter's own covariance, root mean square, m.
    pub drms_m: f64,
    /// From the centralized filter, at arrivals.
    pub difference: Option<Difference>,
}

impl Judged {
    fn of(track: &[TrackSample], truth: &Truth) -> anyhow::Result<Self> {
        let (mut errors_m, mut bounds_m) = (Vec::new(), Vec::new());
        for row in &truth.rows {
            let Ok(at) = track.binary_search_by_key(&row.time_us, |sample| sample.time_us) else { continue };
            let sample = &track[at];
            errors_m.push((sample.state[X] - row.state[X]).hypot(sample.state[Y] - row.state[Y]));
            bounds_m.push(sample.drms_m());
        }
        let error = ErrorSummary::of(&errors_m).context("the log has no row at a time of the truth")?;
        Ok(Self { error, drms_m: rms(&bounds_m).unwrap_or(f64::NAN), difference: None })
    }
}

impl Method {
    fn of(name: &'static str, bytes: Option<usize>, track: &[TrackSample], truth: &Truth) -> anyhow::Result<Self> {
        Ok(Self { name, bytes, result: Ok(Judged::of(track, truth)?) })
    }
}

/// The deltas as the vehicle has them, or why they cannot be sent so.
type Deltas = anyhow::Result<Vec<Delta>>;

/// Number of filters of a [`study()`].
pub const METHODS: usize = 11;

/// Runs all filters over a log of which the `lost` packets were not received; `progress` is called after each.
///
/// # Errors
/// A log without what the filters need, or a filter that fails on numbers that were not rounded.
pub fn study(
    log: &Log,
    lost: &[Packet],
    truth: &Truth,
    vehicle: &VehicleFile,
    options: &FilterOptions,
    ship: &scenario::Ship,
    mut progress: impl FnMut(),
) -> anyhow::Result<Vec<Method>> {
    let start = options.start.context("the study starts from a given state")?;
    let start_us = log.rows.first().context("an empty log")?.time_us;
    let model = VehicleModel::new(&vehicle.parameters).map_err(|error| anyhow!("{error}"))?;
    let (config, launches, log) = (&options.navigation, packets(log), &lose(log, lost));
    let received = packets(log);

    let centralized = filter::run(log, vehicle, options)?.track;
    progress();
    let reports = reports(log, &received, ship, config.sensors.ship_gnss_m);
    let mut packet_fed = PacketFed::new(start_us, &start.vehicle, config, &model, reports, options.use_range_rate)?;
    let packet_track = walk(log, &received, &mut packet_fed)?;
    progress();
    let mut methods = vec![
        Method::of("centralized, every ship fix", None, &centralized, truth)?,
        Method::of("packet-fed, independent errors", Some(ship_state::LENGTH), &packet_track, truth)?,
    ];

    let exact = deltas(log, start.ship.as_ref(), config, &launches, &received)?;
    let floats = |bits| exact.iter().map(|delta| short_floats(delta, bits)).collect::<Vec<Delta>>();
    let carried = |layout: Layout| layout.carry(&exact).map_err(anyhow::Error::from);
    let runs: [(&'static str, Deltas, Option<&[TrackSample]>, usize); METHODS - 2] = [
        ("DEIF, same linearisation points", Ok(exact.clone()), Some(&centralized[..]), NUMBERS * 8),
        ("DEIF, its own points", Ok(exact.clone()), None, NUMBERS * 8),
        ("DEIF, 32-bit floats", Ok(exact.iter().map(Delta::rounded).collect()), None, NUMBERS * 4),
        ("DEIF, 24-bit floats", Ok(floats(24)), None, NUMBERS * 3),
        ("DEIF, 16-bit floats", Ok(floats(16)), None, NUMBERS * 2),
        ("DEIF, conditional form", carried(Layout::TWO_FRAMES), None, Layout::TWO_FRAMES.bytes()),
        ("DEIF, conditional form", carried(Layout::FINE), None, Layout::FINE.bytes()),
        ("DEIF, conditional form", carried(Layout::COARSE), None, Layout::COARSE.bytes()),
        ("DEIF, conditional form", carried(Layout::COARSEST), None, Layout::COARSEST.bytes()),
    ];
    for (name, deltas, points, bytes) in runs {
        let judged = deltas.and_then(|deltas| {
            let deif = Deif::new(start_us, &start.vehicle, config, &model);
            let mut run = DeifRun::new(deif, &deltas, points, options.use_range_rate);
            let track = walk(log, &received, &mut run)?;
            let difference = Difference::of(&run.arrivals, &centralized);
            Ok(Judged { difference, ..Judged::of(&track, truth)? })
        });
        let is_rounded = bytes < NUMBERS * 8;
        let result = match judged {
            Err(error) if !is_rounded => return Err(error.context(name)),
            judged => judged.map_err(|error| format!("{error:#}")),
        };
        methods.push(Method { name, bytes: Some(bytes), result });
        progress();
    }
    Ok(methods)
}

/// The same log with the ship's fixes at least `period_us` apart.
#[must_use]
pub fn thin_fixes(log: &Log, period_us: u64) -> Log {
    let mut log = log.clone();
    let mut due_us = 0;
    for row in log.rows.iter_mut().filter(|row| row.ship_gnss_m().is_some()) {
        if row.time_us >= due_us {
            due_us = row.time_us + period_us;
        } else {
            row.set(Column::ShipGpsX, f64::NAN).set(Column::ShipGpsY, f64::NAN);
        }
    }
    log
}

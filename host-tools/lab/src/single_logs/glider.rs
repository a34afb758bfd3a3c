//! Logs of a glider: buoyancy drives it, wings make it go ahead.
//!
//! The plain model is the steady glide of Merckelbach, Smeed and Griffiths (2010, J. Atmos. Oceanic Technol. 27,
//! 547-563), with the coefficients of its authors' public code (repository smerckel/gliderflight): angle of attack α
//! from α (a_h + a_w) tan(θ + α) = C_D0 + C_D1 α², speed through the water from ½ ρ S U² (C_D0 + C_D1 α²) = F sin(θ +
//! α), F = net buoyancy; the rate of depth is −U sin(θ + α). Nobody declares how the glider is ballasted and what its
//! hull's drag is: it is taken as neutral at zero ballast in the water's mean density, and C_D0 is always fitted. Rates
//! of depth and, where there is one, a measured speed through the water are compared over windows of steady flight; the
//! ways between surfacings with GNSS.

use backseat_diagnose::log_models::{self, Entry, Layout, LogModel, LogModelDiagnosis, Measures, OutsideTerm, Row};
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::{mean, median};
use backseat_logs::{Log, VehicleFile};

const G_MPS2: f64 = 9.81;
/// Reference area of the coefficients, m².
const S_M2: f64 = 0.1;
/// Lift slope of the hull.
const HULL_LIFT: f64 = 3.8;
/// Lift slope and induced drag of the wings: aspect ratio 7, sweep 43 degrees, Oswald's efficiency 0.8; hull 9.7.
const WING_LIFT: f64 = 3.734_269_837;
const INDUCED_DRAG: f64 = 10.492_635_454;
/// Parasite drag from which the fit starts.
const PARASITE_DRAG: f64 = 0.15;
/// Displaced volume, m³: of a Slocum; only its change with density and pressure matters.
const VOLUME_M3: f64 = 0.06;
/// Compressibility of the hull, 1/Pa.
const COMPRESSIBILITY: f64 = 5e-10;

/// Length of a window, s: well above a depth's resolution over its rate.
const WINDOW_S: f64 = 16.0;
/// Fewest windows that are worth a fit.
const FEWEST: usize = 60;
/// Waves and the surfacing itself are no steady flight.
const SHALLOWEST_M: f64 = 3.0;
/// Nor is what is flatter than this.
const LEAST_PITCH_RAD: f64 = 0.15;
/// Nor is a change of ballast of this share of its range, and some time after.
const BALLAST_SHARE: f64 = 0.02;
const SETTLING_S: f64 = 20.0;
/// Readings further apart do not belong together, s.
const LONGEST_GAP_S: f64 = 12.0;
/// A way under water shorter than this says nothing of a current, s.
const SHORTEST_WAY_S: f64 = 300.0;

/// Columns: parasite drag; buoyancy, kg; pitch bias, rad, and scale; current north, east, m/s; heading, rad; then those
/// without a name: share by which wings and hull lift more, induced drag, volume, compressibility, ballast scale; the
/// speed log's scale, and its change over the log.
const COLUMNS: usize = 14;
const STEPS: [f64; COLUMNS] = [1e-4, 1e-4, 1e-5, 1e-4, 1.0, 1.0, 1e-5, 1e-4, 1e-3, 1e-5, 1e-12, 1e-4, 1e-4, 1e-4];

/// One reading in flight.
#[derive(Clone, Copy)]
struct GliderSample {
    t_s: f64,
    dt_s: f64,
    pitch_rad: f64,
    heading_rad: f64,
    depth_m: f64,
    ballast_m3: f64,
    density: f64,
}

/// A stretch of steady flight.
struct Window {
    t_s: f64,
    samples: Vec<GliderSample>,
    depth_rate_mps: f64,
    speed_mps: Option<f64>,
}

/// What a glider did between two fixes.
struct Way {
    t_s: f64,
    under_water_s: f64,
    moved_m: [f64; 2],
    samples: Vec<GliderSample>,
}

struct Glider {
    windows: Vec<Window>,
    ways: Vec<Way>,
    density: f64,
    has_speed: bool,
    duration_s: f64,
}

/// Whether a log is a glider's.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    log.has(Column::Ballast) && log.has(Column::Depth) && log.has(Column::Pitch)
}

impl Glider {
    /// Speed through the water and angle of the path, up positive.
    fn fly(&self, sample: &GliderSample, theta: &[f64]) -> (f64, f64) {
        let pitch = (sample.pitch_rad - theta[2]) / (1.0 + theta[3]);
        let (drag, induced) = (PARASITE_DRAG + theta[0], INDUCED_DRAG + theta[8]);
        let lift = (HULL_LIFT + WING_LIFT) / (1.0 - theta[7]).max(0.01);
        let mut alpha = 0.0;
        // Contracts by a factor of about ten a round.
        for _ in 0..12 {
            let fresh = (drag + induced * alpha * alpha) / (lift * (pitch.abs() + alpha).tan().max(0.05));
            alpha = fresh.clamp(0.0, 0.5);
        }
        let gamma = pitch.abs() + alpha;
        let pressure = sample.depth_m * G_MPS2 * self.density;
        let volume = (VOLUME_M3 + theta[9]) * (1.0 - (COMPRESSIBILITY + theta[10]) * pressure);
        let displaced = sample.density * (volume + sample.ballast_m3 * (1.0 + theta[11]));
        let neutral = self.density * (VOLUME_M3 + theta[9]);
        let force = G_MPS2 * (displaced - neutral + theta[1]) * pitch.signum();
        let square = 2.0 * force * gamma.sin() / (sample.density * S_M2 * (drag + induced * alpha * alpha));
        (square.max(0.0).sqrt(), gamma * pitch.signum())
    }

    /// Rate of depth and speed of a window.
    fn window(&self, window: &Window, theta: &[f64]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for sample in &window.samples {
            let (speed, gamma) = self.fly(sample, theta);
            sum[0] -= speed * gamma.sin();
            sum[1] += speed;
        }
        sum.map(|sum| sum / window.samples.len() as f64)
    }

    /// Velocity made good between two fixes.
    fn way(&self, way: &Way, theta: &[f64]) -> [f64; 2] {
        let mut moved = [0.0; 2];
        for sample in &way.samples {
            let (speed, gamma) = self.fly(sample, theta);
            let (sin, cos) = (sample.heading_rad - theta[6]).sin_cos();
            let ahead = speed * gamma.cos() * sample.dt_s;
            moved[0] += ahead * cos;
            moved[1] += ahead * sin;
        }
        [0, 1].map(|axis| moved[axis] / way.under_water_s + theta[4 + axis])
    }

    /// Everything predicted, in the order of `measured`.
    fn predicted(&self, theta: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        for window in &self.windows {
            let [rate, speed] = self.window(window, theta);
            all.push(rate);
            let scale = 1.0 + theta[12] + theta[13] * (window.t_s / self.duration_s - 0.5);
            all.extend(window.speed_mps.map(|_| scale * speed));
        }
        for way in &self.ways {
            all.extend(self.way(way, theta));
        }
        all
    }

    fn measured(&self) -> Vec<(f64, ResidualChannel, f64)> {
        let mut all = Vec::new();
        for window in &self.windows {
            all.push((window.t_s, ResidualChannel::DepthRate, window.depth_rate_mps));
            all.extend(window.speed_mps.map(|speed| (window.t_s, ResidualChannel::WaterSpeed, speed)));
        }
        for way in &self.ways {
            let velocity = way.moved_m.map(|m| m / way.under_water_s);
            all.extend([
                (way.t_s, ResidualChannel::GnssX, velocity[0]),
                (way.t_s, ResidualChannel::GnssY, velocity[1]),
            ]);
        }
        all
    }
}

impl LogModel for Glider {
    fn columns(&self) -> usize {
        COLUMNS
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        let base = self.predicted(theta);
        let moved: Vec<Vec<f64>> = (0..COLUMNS)
            .map(|column| {
                let mut theta = theta.to_vec();
                theta[column] += STEPS[column];
                self.predicted(&theta)
            })
            .collect();
        let row = |(i, (t_s, channel, measured)): (usize, (f64, ResidualChannel, f64))| {
            let slopes = (0..COLUMNS).map(|column| (moved[column][i] - base[i]) / STEPS[column]).collect();
            Row { t_s, channel, sequence: 0, residual: measured - base[i], slopes }
        };
        self.measured().into_iter().enumerate().map(row).collect()
    }

    fn calibrated(&self) -> Vec<usize> {
        vec![0]
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = vec![("buoyancy_offset", vec![1])];
        if self.has_speed {
            entries.extend([("pitch_sensor", vec![2, 3]), ("dvl_scale", vec![12])]);
        }
        if self.ways.len() > 2 {
            entries.extend([("water_current", vec![4, 5]), ("heading_bias", vec![6])]);
        }
        entries
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        let mut terms = vec![
            ("the displaced volume (how buoyancy follows the water's density)", vec![9]),
            ("the hull's compressibility", vec![10]),
            ("the scale of the ballast reading", vec![11]),
        ];
        if self.has_speed {
            terms.extend([("the lift (an angle of attack that is smaller)", vec![7]), ("the induced drag", vec![8])]);
            terms.push(("a speed log whose scale changes with time", vec![13]));
        }
        terms
    }

    fn block_s(&self) -> f64 {
        backseat_diagnose::prepared_log::BLOCK_S
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let mut measures = Measures { against: Some("GNSS at surfacing"), ..Measures::default() };
        let (flown, surfaced): (Vec<&Row>, Vec<&Row>) = rows
            .iter()
            .partition(|row| matches!(row.channel, ResidualChannel::DepthRate | ResidualChannel::WaterSpeed));
        measures.velocity.extend(flown.iter().map(|row| (row.t_s, row.residual)));
        for (way, missing) in self.ways.iter().zip(surfaced.chunks_exact(2)) {
            let missing_m = missing[0].residual.hypot(missing[1].residual) * way.under_water_s;
            measures.position.push((way.t_s, missing_m));
        }
        measures
    }
}

/// Diagnoses a glider's log; `None` if it has too little steady flight.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let model = model(log)?;
    let mut found = log_models::run(&model, log, vehicle)?;
    let mut notes = vec![format!(
        "glider log: steady glide from ballast, pitch and density (Merckelbach et al. 2010), neutral at zero ballast in the \
         mean density of {:.2} kg/m^3. {} windows of {WINDOW_S:.0} s, {} of them with a measured speed through the water; {} \
         legs between fixes",
        model.density,
        model.windows.len(),
        model.windows.iter().filter(|window| window.speed_mps.is_some()).count(),
        model.ways.len()
    )];
    let drag = |i: usize| PARASITE_DRAG + found.theta[i][0];
    notes.push(format!("parasite drag fitted: {:.3} before, {:.3} after", drag(0), drag(1)));
    if !log.has(Column::WaterDensity) {
        notes.push("the log has no water density: one value is used at all depths".to_owned());
    }
    if !model.has_speed {
        notes.push(
            "the log has no speed through the water: a pitch error and drag cannot be separated; pitch is used as measured"
                .to_owned(),
        );
    }
    if model.has_speed {
        notes.push("dvl_scale means here the scale of the measured speed through the water".to_owned());
    }
    if model.ways.len() > 2 {
        notes.push("heading_bias: only its constant is fitted, because the legs do not cover all headings".to_owned());
    }
    let own = [Column::OwnCurrentN, Column::OwnCurrentE]
        .map(|column| median(&log.column(column).map(|(_, value)| value).collect::<Vec<_>>()));
    if let [Some(north), Some(east)] = own {
        notes.push(format!("current by the glider's own estimate, median: {north:.3} m/s north, {east:.3} m/s east"));
    }
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

fn model(log: &Log) -> Option<Glider> {
    let densities: Vec<f64> = log.column(Column::WaterDensity).map(|(_, density)| density).collect();
    // Without a CTD: brackish or salt, it only scales with the drag that is fitted.
    let density = mean(&densities).unwrap_or(1025.0);
    let samples = samples(log, density);
    let ballast = samples.iter().map(|s| s.ballast_m3);
    let range = ballast.clone().fold(f64::MIN, f64::max) - ballast.fold(f64::MAX, f64::min);
    let speeds: Vec<(f64, f64)> = log.column(Column::WaterSpeed).map(|(us, speed)| (seconds(log, us), speed)).collect();
    let windows = windows(&samples, BALLAST_SHARE * range, &speeds);
    let has_speed = windows.iter().filter(|window| window.speed_mps.is_some()).count() >= FEWEST / 2;
    (windows.len() >= FEWEST).then(|| Glider {
        ways: ways(log, &samples),
        windows,
        density,
        has_speed,
        duration_s: log.duration_s(),
    })
}

fn seconds(log: &Log, time_us: u64) -> f64 {
    log.rows.first().map_or(0.0, |first| (time_us as f64 - first.time_us as f64) * 1e-6)
}

/// Readings of pitch, depth and ballast with the heading and the density of their time.
fn samples(log: &Log, density: f64) -> Vec<GliderSample> {
    let (mut heading_rad, mut water) = (0.0, density);
    let mut samples: Vec<GliderSample> = Vec::new();
    for row in &log.rows {
        heading_rad = row.get(Column::Heading).unwrap_or(heading_rad);
        water = row.get(Column::WaterDensity).unwrap_or(water);
        let group = (row.get(Column::Pitch), row.get(Column::Depth), row.get(Column::Ballast));
        let (Some(pitch_rad), Some(depth_m), Some(ballast_m3)) = group else { continue };
        let t_s = seconds(log, row.time_us);
        if let Some(last) = samples.last_mut() {
            last.dt_s = (t_s - last.t_s).min(LONGEST_GAP_S);
        }
        samples.push(GliderSample { t_s, dt_s: 0.0, pitch_rad, heading_rad, depth_m, ballast_m3, density: water });
    }
    samples
}

/// Windows of steady flight, one after the other.
fn windows(samples: &[GliderSample], ballast_step: f64, speeds: &[(f64, f64)]) -> Vec<Window> {
    let mut found: Vec<Window> = Vec::new();
    let (mut window, mut settled_s): (Vec<GliderSample>, f64) = (Vec::new(), 0.0);
    for pair in samples.windows(2) {
        let [before, sample] = [pair[0], pair[1]];
        let is_disturbed = (sample.ballast_m3 - before.ballast_m3).abs() > ballast_step
            || sample.pitch_rad * before.pitch_rad < 0.0
            || sample.t_s - before.t_s > LONGEST_GAP_S;
        if is_disturbed {
            settled_s = sample.t_s + SETTLING_S;
        }
        let is_gliding = sample.t_s >= settled_s
            && sample.depth_m > SHALLOWEST_M
            && sample.pitch_rad.abs() > LEAST_PITCH_RAD
            // Ballast out, nose up: as a glider flies.
            && sample.pitch_rad * sample.ballast_m3 > 0.0;
        if !is_gliding {
            window.clear();
            continue;
        }
        window.push(sample);
        let (first, last) = (window[0], sample);
        if last.t_s - first.t_s < WINDOW_S {
            continue;
        }
        let inside = |t_s: f64| (first.t_s..=last.t_s).contains(&t_s);
        let measured: Vec<f64> = speeds.iter().filter(|(t_s, _)| inside(*t_s)).map(|(_, speed)| *speed).collect();
        found.push(Window {
            t_s: 0.5 * (first.t_s + last.t_s),
            depth_rate_mps: (last.depth_m - first.depth_m) / (last.t_s - first.t_s),
            // A beam that hits something else makes outliers.
            speed_mps: median(&measured).filter(|_| measured.len() >= 5),
            samples: std::mem::take(&mut window),
        });
        window.push(last);
    }
    found
}

/// From the last fix before a dive to the first one after.
fn ways(log: &Log, samples: &[GliderSample]) -> Vec<Way> {
    let fixes: Vec<(f64, [f64; 2])> =
        log.rows.iter().filter_map(|row| Some((seconds(log, row.time_us), row.gnss_m()?))).collect();
    let mut ways = Vec::new();
    for pair in fixes.windows(2) {
        let ((from_s, from), (to_s, to)) = (pair[0], pair[1]);
        if to_s - from_s < SHORTEST_WAY_S {
            continue;
        }
        let inside: Vec<GliderSample> = samples
            .iter()
            .filter(|s| (from_s..to_s).contains(&s.t_s) && s.pitch_rad * s.ballast_m3 > 0.0)
            .copied()
            .collect();
        let gliding_s: f64 = inside.iter().map(|s| s.dt_s).sum();
        // Adrift at the surface between two fixes is no glide.
        if gliding_s > 0.8 * (to_s - from_s) {
            let moved_m = [0, 1].map(|axis| to[axis] - from[axis]);
            ways.push(Way { t_s: to_s, under_water_s: to_s - from_s, moved_m, samples: inside });
        }
    }
    ways
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;
    use hil_sim::rng::{Source, Stream};

    const DRAG: f64 = 0.16;

    /// Speed and path angle by the balance of lift and drag along and across the path, solved for the angle by
    /// bisection: not the way the model goes.
    fn balance(pitch: f64, force: f64, density: f64) -> (f64, f64) {
        let slope = HULL_LIFT + WING_LIFT;
        let alpha = |gamma: f64| {
            let lift = slope * gamma.tan();
            (lift - (lift * lift - 4.0 * INDUCED_DRAG * DRAG).max(0.0).sqrt()) / (2.0 * INDUCED_DRAG)
        };
        let (mut low, mut high) = (pitch.abs(), pitch.abs() + 0.3);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if middle - alpha(middle) < pitch.abs() { low = middle } else { high = middle }
        }
        let drag = DRAG + INDUCED_DRAG * alpha(low).powi(2);
        ((2.0 * force.abs() * low.sin() / (density * S_M2 * drag)).sqrt(), low * pitch.signum())
    }

    /// Twenty-four dives to 40 m, surfacing after every fourth; 30 g too buoyant, in a current.
    fn log() -> Log {
        let (mut log, mut random) = (Log::default(), Stream::new(3, Source::Study));
        let mut noise = || random.uniform() - 0.5;
        let (mut t_s, mut depth, mut position) = (0.0_f64, 1.0_f64, [0.0_f64; 2]);
        let mean_density = 1005.0;
        for dive in 0..24 {
            let heading = 0.7 * f64::from(dive / 4);
            if dive % 4 == 0 {
                let mut row = LogRow::new((t_s * 1e6) as u64);
                row.set_all(Column::GpsX, &[position[0] + noise(), position[1] + noise()]);
                log.rows.push(row);
            }
            for direction in [-1.0, 1.0] {
                while (direction < 0.0 && depth < 40.0) || (direction > 0.0 && depth > 1.0) {
                    let density = mean_density + 0.04 * (depth - 20.5);
                    let (pitch, ballast) = (0.44 * direction + 0.01 * noise(), 230e-6 * direction);
                    let volume = VOLUME_M3 * (1.0 - COMPRESSIBILITY * depth * G_MPS2 * mean_density);
                    let force = G_MPS2 * (density * (volume + ballast) - mean_density * VOLUME_M3 + 0.03);
                    let (speed, gamma) = balance(pitch, force, density);
                    let mut row = LogRow::new((t_s * 1e6) as u64);
                    row.set(Column::Pitch, pitch).set(Column::Depth, depth + 0.03 * noise());
                    row.set(Column::Ballast, ballast).set(Column::WaterDensity, density).set(Column::Heading, heading);
                    row.set(Column::WaterSpeed, if direction < 0.0 { speed + 0.01 * noise() } else { f64::NAN });
                    log.rows.push(row);
                    let dt_s = 2.0;
                    depth -= speed * gamma.sin() * dt_s;
                    let ahead = speed * gamma.cos();
                    position[0] += (ahead * heading.cos() + 0.10) * dt_s;
                    position[1] += (ahead * heading.sin() - 0.05) * dt_s;
                    t_s += dt_s;
                }
            }
        }
        let mut row = LogRow::new((t_s * 1e6) as u64);
        row.set_all(Column::GpsX, &position);
        log.rows.push(row);
        log
    }

    #[test]
    fn val_ballast_and_current_of_a_glide() {
        let log = log();
        assert!(is_for(&log));
        let found = run(&log, &VehicleFile::reference()).unwrap();
        let d = &found.diagnosis;
        let names: Vec<&str> = d.effects.iter().map(|found| found.instance.candidate.effect).collect();
        assert!(names.contains(&"water_current") && names.contains(&"buoyancy_offset"), "{names:?}");
        assert_eq!(names.len(), 2, "{names:?}");
        let value = |effect: &str, place: usize| {
            d.effects.iter().find(|found| found.instance.candidate.effect == effect).unwrap().values[place].value
        };
        // Windows start a little after the turn and the readings have noise: a gram, some mm/s.
        assert!((value("buoyancy_offset", 0) - 0.03).abs() < 2e-3, "{}", value("buoyancy_offset", 0));
        assert!((value("water_current", 0) - 0.10).abs() < 6e-3, "{}", value("water_current", 0));
        assert!((value("water_current", 1) + 0.05).abs() < 6e-3, "{}", value("water_current", 1));
        // 0.15 from the start; what the balance was made with.
        assert!((PARASITE_DRAG + found.theta[1][0] - DRAG).abs() < 3e-3);
        let [before, after] = &found.scores;
        assert!(after.position_rmse_m.unwrap() < 0.2 * before.position_rmse_m.unwrap());
    }

    #[test]
    fn too_short_a_glide_is_none() {
        let mut log = log();
        log.rows.truncate(300);
        assert!(run(&log, &VehicleFile::reference()).is_none());
    }
}

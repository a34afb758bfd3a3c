//! A ship's model on the surface, with a propeller and a rudder: logs for the manoeuvring model.
//!
//! The KVLCC2 tanker's 7 m model by the MMG standard method (Yasukawa and Yoshimura 2015, Journal of Marine Science and
//! Technology 20, tables 2 to 4): hull forces in powers of the drift angle and the yaw rate, a propeller with wake and
//! thrust deduction, a rudder in its race. These are not the terms that identification fits. A wind pushes it if asked
//! for. It flies zigzags and turning circles at several speeds, each a run of its own.

use backseat_core::state::{VehicleState, wrap_angle};
use backseat_logs::{Column, Log, LogRow, Truth, TruthRow};
use hil_sim::rng::{Source, Stream};

/// Water and air, kg/m³.
const WATER: f64 = 1000.0;
const AIR: f64 = 1.225;
/// Length, draught, m; displacement, m³; centre of gravity ahead of midship, m.
const LENGTH_M: f64 = 7.0;
const DRAUGHT_M: f64 = 0.46;
const DISPLACEMENT_M3: f64 = 3.27;
const CENTRE_M: f64 = 0.25;
/// Diameter of the propeller, height and area of the rudder.
const PROPELLER_M: f64 = 0.216;
const RUDDER_HEIGHT_M: f64 = 0.345;
const RUDDER_M2: f64 = 0.0539;
/// Windage from ahead and from the side, m²: freeboard 0.2 m, with a deckhouse.
const WINDAGE_M2: [f64; 2] = [0.5, 2.0];
/// Time between two readings, and steps of the integration in it.
const PERIOD_S: f64 = 0.1;
const STEPS: u32 = 10;
/// Largest rate of the rudder, rad/s.
const RUDDER_RATE_RADPS: f64 = 0.2;
/// Between two runs the log rests, s.
const PAUSE_S: f64 = 20.0;
const RUN_S: f64 = 300.0;
/// One sigma of position, m, heading, rad, surge and sway, m/s, and yaw rate, rad/s: a survey receiver, a fibre gyro.
const SIGMA: [f64; 4] = [0.02, 1e-3, 5e-3, 1e-3];

/// What is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Voyage {
    /// Length of the log, s.
    pub duration_s: f64,
    /// Log surge, sway and yaw rate.
    pub velocities: bool,
    /// True wind towards north and east, m/s.
    pub wind_mps: [f64; 2],
    /// Sensors have noise.
    pub noise: bool,
}

/// u, v at midship, r, heading, north, east.
type State = [f64; 6];

/// Accelerations by the MMG method.
fn derivative(x: &State, rps: f64, rudder_rad: f64, wind_mps: [f64; 2]) -> State {
    let [u, v, r, heading, ..] = *x;
    let speed = u.hypot(v).max(1e-6);
    // of midship, dimensionless
    let (vd, rd) = (v / speed, r * LENGTH_M / speed);
    let drift = (-v).atan2(u);
    let hull = 0.5 * WATER * LENGTH_M * DRAUGHT_M * speed * speed;
    let ahead = hull
        * (-0.022 * (u / speed) * (u / speed).abs() - 0.040 * vd * vd
            + 0.002 * vd * rd
            + 0.011 * rd * rd
            + 0.771 * vd.powi(4));
    let aside = hull
        * (-0.315 * vd + 0.083 * rd - 1.607 * vd.powi(3) + 0.379 * vd * vd * rd - 0.391 * vd * rd * rd
            + 0.008 * rd.powi(3));
    let turning = hull
        * LENGTH_M
        * (-0.137 * vd - 0.049 * rd - 0.030 * vd.powi(3) - 0.294 * vd * vd * rd + 0.055 * vd * rd * rd
            - 0.013 * rd.powi(3));

    // propeller, 0.48 of the length abaft midship: wake changed by its own angle of inflow
    let inflow = drift + 0.48 * rd;
    let side = if inflow > 0.0 { 1.6 } else { 1.1 };
    let wake = (1.0 + (1.0 - (-2.0 * inflow.abs()).exp()) * (side - 1.0)) * (1.0 - 0.40);
    let n = rps.max(1e-6);
    let advance = u * wake / (n * PROPELLER_M);
    let thrust_coefficient = 0.2931 - 0.2753 * advance - 0.1385 * advance * advance;
    let thrust = (1.0 - 0.220) * WATER * n * n * PROPELLER_M.powi(4) * thrust_coefficient;

    // rudder in its race
    let share = PROPELLER_M / RUDDER_HEIGHT_M;
    let race = 8.0 * thrust_coefficient.max(0.0) / (std::f64::consts::PI * advance * advance).max(1e-9);
    let faster = (1.0 + 0.50 * ((1.0 + race).sqrt() - 1.0)).powi(2);
    let ahead_of_rudder = 1.09 * u * wake * (share * faster + 1.0 - share).sqrt();
    let angle = drift + 0.710 * rd;
    let straightened = if angle < 0.0 { 0.395 } else { 0.640 };
    let aside_of_rudder = speed * straightened * angle;
    let normal = 0.5
        * WATER
        * RUDDER_M2
        * 2.747
        * (ahead_of_rudder.powi(2) + aside_of_rudder.powi(2))
        * (rudder_rad - aside_of_rudder.atan2(ahead_of_rudder)).sin();
    let (sin, cos) = rudder_rad.sin_cos();
    let rudder = [
        -(1.0 - 0.387) * normal * sin,
        -(1.0 + 0.312) * normal * cos,
        -(-0.5 + 0.312 * -0.464) * LENGTH_M * normal * cos,
    ];

    let wind = wind_force(x, wind_mps);
    let mass = WATER * DISPLACEMENT_M3;
    let added = 0.5 * WATER * LENGTH_M * LENGTH_M * DRAUGHT_M;
    let (mx, my, jz) = (0.022 * added, 0.223 * added, 0.011 * added * LENGTH_M * LENGTH_M);
    let inertia = mass * (0.25 * LENGTH_M).powi(2);
    let [x_force, y_force, moment] = [ahead + thrust, aside, turning].map(f64::from);
    let x_force = x_force + rudder[0] + wind[0] + (mass + my) * v * r + CENTRE_M * mass * r * r;
    let y_force = y_force + rudder[1] + wind[1] - (mass + mx) * u * r;
    let moment = moment + rudder[2] + wind[2] - CENTRE_M * mass * u * r;
    // sway and yaw are coupled by the centre of gravity off midship
    let (a, b, c) = (mass + my, CENTRE_M * mass, inertia + CENTRE_M * CENTRE_M * mass + jz);
    let determinant = a * c - b * b;
    let (sin, cos) = heading.sin_cos();
    [
        x_force / (mass + mx),
        (c * y_force - b * moment) / determinant,
        (a * moment - b * y_force) / determinant,
        r,
        u * cos - v * sin,
        u * sin + v * cos,
    ]
}

/// Forces and moment of a wind by coefficients of a slender ship (Fossen 2011, section 8.1), N and N m.
fn wind_force([u, v, _, heading, ..]: &State, [north, east]: [f64; 2]) -> [f64; 3] {
    if [north, east] == [0.0; 2] {
        return [0.0; 3];
    }
    let (sin, cos) = heading.sin_cos();
    let (ahead, aside) = (north * cos + east * sin - u, east * cos - north * sin - v);
    let pressure = 0.5 * AIR * ahead.hypot(aside);
    let [front, side] = WINDAGE_M2;
    [0.7 * pressure * front * ahead, 0.8 * pressure * side * aside, -0.05 * LENGTH_M * 0.8 * pressure * side * aside]
}

/// How a run is steered: a rudder that is held, or a zigzag of rudder and heading.
#[derive(Clone, Copy, Debug)]
enum Manoeuvre {
    Turn { rudder_rad: f64 },
    Zigzag { rudder_rad: f64, heading_rad: f64 },
}

impl Manoeuvre {
    fn of(run: u32) -> (Self, f64) {
        let side = if run.is_multiple_of(2) { 1.0 } else { -1.0 };
        let rps = [10.0, 12.0, 8.0, 14.0][run as usize % 4];
        let degrees = |degrees: f64| degrees.to_radians();
        let manoeuvre = match run % 5 {
            0 => Self::Zigzag { rudder_rad: side * degrees(20.0), heading_rad: degrees(20.0) },
            1 => Self::Turn { rudder_rad: side * degrees(35.0) },
            2 => Self::Zigzag { rudder_rad: side * degrees(10.0), heading_rad: degrees(10.0) },
            3 => Self::Turn { rudder_rad: side * degrees(15.0) },
            _ => Self::Zigzag { rudder_rad: side * degrees(30.0), heading_rad: degrees(30.0) },
        };
        (manoeuvre, rps)
    }

    /// The rudder that is wanted, `turned_rad` from the heading at the start, after `t_s`.
    fn wanted_rad(self, t_s: f64, turned_rad: f64, last_rad: f64) -> f64 {
        const STRAIGHT_S: f64 = 10.0;
        match self {
            _ if t_s < STRAIGHT_S => 0.0,
            Self::Turn { rudder_rad } => rudder_rad,
            Self::Zigzag { rudder_rad, heading_rad } => match turned_rad {
                turned if turned > heading_rad => -rudder_rad.abs(),
                turned if turned < -heading_rad => rudder_rad.abs(),
                _ if last_rad == 0.0 => rudder_rad,
                _ => last_rad,
            },
        }
    }
}

/// Simulates a log; the true motion beside it.
#[must_use]
pub fn simulate(voyage: &Voyage, seed: u64) -> (Log, Truth) {
    let (mut log, mut truth) = (Log::default(), Truth { rows: Vec::new(), notes: Vec::new() });
    let mut noise = [Source::VehicleGnss, Source::Ahrs, Source::Dvl].map(|source| Stream::new(seed, source));
    let factor = if voyage.noise { 1.0 } else { 0.0 };
    let (mut from_s, mut run) = (0.0, 0);
    while from_s + 0.5 * RUN_S <= voyage.duration_s || run == 0 {
        let (manoeuvre, rps) = Manoeuvre::of(run);
        // about the speed at which thrust and resistance balance
        let mut x: State = [0.1 * rps, 0.0, 0.0, 0.7 * f64::from(run), 0.0, 0.0];
        let heading_rad = x[3];
        let (mut rudder_rad, mut wanted_rad) = (0.0, 0.0);
        let duration_s = RUN_S.min(voyage.duration_s - from_s);
        for k in 0..=(duration_s / PERIOD_S) as u32 {
            let t_s = PERIOD_S * f64::from(k);
            let time_us = ((from_s + t_s) * 1e6).round() as u64;
            let mut row = LogRow::new(time_us);
            let [u, v, r, heading, north, east] = x;
            let [sigma_position, sigma_heading, sigma_speed, sigma_rate] = SIGMA.map(|sigma| factor * sigma);
            let [gnss, gyro, speed] = &mut noise;
            row.set(Column::Run, f64::from(run + 1));
            let [dn, de] = gnss.normals::<2>(sigma_position);
            row.set_all(Column::GpsX, &[north + dn, east + de]);
            row.set(Column::Heading, wrap_angle(heading + sigma_heading * gyro.normal()));
            if voyage.velocities {
                let [du, dv] = speed.normals::<2>(sigma_speed);
                row.set(Column::DvlU, u + du).set(Column::DvlV, v + dv);
                row.set(Column::R, r + sigma_rate * gyro.normal());
            }
            row.set(Column::PropRpm, 60.0 * rps).set(Column::Rudder, rudder_rad);
            if log.rows.is_empty() {
                row.set(Column::Length, LENGTH_M).set(Column::Mass, WATER * DISPLACEMENT_M3);
                row.set(Column::WindageFront, WINDAGE_M2[0]).set(Column::WindageSide, WINDAGE_M2[1]);
            }
            log.rows.push(row);
            if k.is_multiple_of(10) {
                let state = [north, east, 0.0, 0.0, 0.0, wrap_angle(heading), u, v, 0.0, 0.0, 0.0, r];
                truth.rows.push(TruthRow {
                    time_us,
                    state: VehicleState::from_column_slice(&state),
                    current_mps: [0.0; 2],
                });
            }
            wanted_rad = manoeuvre.wanted_rad(t_s, heading - heading_rad, wanted_rad);
            for _ in 0..STEPS {
                let dt = PERIOD_S / f64::from(STEPS);
                let most = RUDDER_RATE_RADPS * dt;
                rudder_rad += (wanted_rad - rudder_rad).clamp(-most, most);
                let moved = |x: &State, slope: &State, by: f64| [0, 1, 2, 3, 4, 5].map(|i| x[i] + slope[i] * by);
                let first = derivative(&x, rps, rudder_rad, voyage.wind_mps);
                let middle = derivative(&moved(&x, &first, 0.5 * dt), rps, rudder_rad, voyage.wind_mps);
                x = moved(&x, &middle, dt);
            }
        }
        from_s += duration_s + PAUSE_S;
        run += 1;
    }
    (log, truth)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Free-running tests of models of this hull with 35 degrees of rudder give tactical diameters of 3.1 to 3.4 lengths
    /// (SIMMAN 2008); the method is good to a tenth.
    #[test]
    fn val_the_tanker_turns_in_three_lengths() {
        for side in [-1.0, 1.0] {
            let rudder_rad = side * 35.0_f64.to_radians();
            let mut x: State = [1.18, 0.0, 0.0, 0.0, 0.0, 0.0];
            let mut half = None;
            for _ in 0..20_000 {
                let slope = derivative(&x, 10.4, rudder_rad, [0.0; 2]);
                x = [0, 1, 2, 3, 4, 5].map(|i| x[i] + 0.01 * slope[i]);
                if x[3].abs() >= std::f64::consts::PI && half.is_none() {
                    half = Some(x[5].abs() / LENGTH_M);
                }
            }
            let diameter = half.unwrap();
            assert!((2.8..3.8).contains(&diameter), "{diameter} lengths");
            // speed falls to about two fifths
            assert!((0.25..0.6).contains(&(x[0].hypot(x[1]) / 1.18)), "{x:?}");
        }
    }

    #[test]
    fn a_wind_from_the_side_drives_it_aside() {
        let still = derivative(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0, 0.0, [0.0; 2]);
        let wind = derivative(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0, 0.0, [0.0, 5.0]);
        assert!(still[1].abs() < 1e-12 && wind[1] > 1e-3 && wind[0].abs() < 1e-9, "{wind:?}");
    }
}

//! The cross-check of depth: pressure against what pitch and speed make of it.
//!
//! Pressure says z. Pitch and speed say how fast the nose points down: -u sin θ. In steady flight the two differ by the
//! angle of attack, by which a vehicle carries its weight in water, and by the error of the pitch sensor: a constant
//! for one speed. The cross-check learns that constant over the flight and sums what pressure departs from it.
//! A sensor that drifts makes the controller fly the vehicle up or down, which pitch shows; so does a vehicle that
//! takes in water, which has to carry more. The two cannot be told apart, nor from a current that sinks or rises for
//! minutes: all three are reason to surface.

/// The constant is learned over this time of steady flight before anything is summed, s.
const LEARN_S: f64 = 60.0;
/// From then on a departure moves it by this share of what it would move a mean: with a mean, a drift that begins soon
/// after the dive is learned before it is seen.
const FOLLOW: f64 = 0.5;
/// Up to this time; later as at this time, s.
const FOLLOW_S: f64 = 900.0;
/// What was summed is forgotten with this time constant, s: a slower departure than a tenth of the limit in a minute is
/// the weather.
const MEMORY_S: f64 = 600.0;
/// Steady: turns slower than this, rad/s.
const TURN_RADPS: f64 = 0.03;
/// Steady: rolls less than this, rad.
const ROLL_RAD: f64 = 0.3;
/// Steady: within this of the leg's depth, m.
const LEVEL_M: f64 = 1.0;
/// Steady: deeper than this, m. At the surface waves and buoyancy carry the vehicle, not its hull.
const SUBMERGED_M: f64 = 1.0;
/// Steady: faster than this, m/s. Below it a vehicle is carried by other forces than its hull's.
const SPEED_MPS: f64 = 0.4;
/// The same for what came quickly, s: with half of the limit of 3 m, an error of 5 cm/s is seen in 40 s.
const RECENT_S: f64 = 120.0;
/// A leg that differs by this in speed has a constant of its own, m/s.
const SAME_SPEED_MPS: f64 = 0.05;
/// One sigma of depth for each metre of drift that is seen: the constant follows a drift and the sum forgets it, so that
/// the error is up to four times what is seen.
const SIGMA_PER_DRIFT: f64 = 2.0;
/// Time constant of the rate of pressure, s.
const SINK_S: f64 = 5.0;
/// No vehicle sinks or rises faster: a jump of the sensor is no rate, m/s.
const MOST_MPS: f64 = 1.0;
/// The vehicle is steady after so long without a break, s.
const SETTLE_S: f64 = 20.0;

/// One step of the vehicle.
#[derive(Clone, Copy, Debug)]
pub struct DepthStep {
    /// Since the last, s.
    pub dt_s: f64,
    /// Of the pressure sensor at the centre of gravity, m.
    pub pressure_m: f64,
    /// Roll, pitch, rad.
    pub roll_rad: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Yaw rate, rad/s.
    pub yaw_radps: f64,
    /// Surge through the water, m/s.
    pub surge_mps: f64,
    /// The leg's.
    pub leg_depth_m: f64,
    /// The leg's.
    pub leg_speed_mps: f64,
}

/// What has been learned and summed in this mission.
#[derive(Clone, Copy, Debug)]
pub struct DepthCrossCheck {
    /// The last depth of the pressure sensor, m.
    last_m: Option<f64>,
    /// How long the vehicle has been steady, s.
    steady_s: f64,
    /// Speed of the legs for which `rate_mps` holds, m/s; 0 before the first.
    speed_mps: f64,
    /// The time over which it was learned, s.
    learned_s: f64,
    /// -u sin θ minus the rate of pressure, in steady flight, m/s.
    rate_mps: f64,
    /// What has departed from it, m, with either memory.
    pub drift_m: f64,
    /// By how much it is deeper by the last two minutes, m.
    pub recent_m: f64,
    /// The most of it, m, forgotten as it is: it crosses zero by chance.
    most_m: f64,
    /// The rate of pressure, m/s.
    pub sink_mps: f64,
}

impl DepthCrossCheck {
    pub const fn new() -> Self {
        Self {
            last_m: None,
            steady_s: 0.0,
            speed_mps: 0.0,
            learned_s: 0.0,
            rate_mps: 0.0,
            drift_m: 0.0,
            recent_m: 0.0,
            most_m: 0.0,
            sink_mps: 0.0,
        }
    }

    /// One sigma of depth that covers it, m.
    pub fn sigma_m(&self) -> f64 {
        SIGMA_PER_DRIFT * self.most_m
    }

    /// Another step.
    pub fn step(&mut self, step: &DepthStep) {
        let DepthStep { dt_s, pressure_m, .. } = *step;
        let Some(last_m) = self.last_m.replace(pressure_m) else { return };
        if dt_s > 0.0 {
            let rate_mps = ((pressure_m - last_m) / dt_s).clamp(-MOST_MPS, MOST_MPS);
            self.sink_mps += (rate_mps - self.sink_mps) * (dt_s / SINK_S).min(1.0);
        }
        let steady = step.surge_mps > SPEED_MPS
            && step.yaw_radps.abs() < TURN_RADPS
            && step.roll_rad.abs() < ROLL_RAD
            && pressure_m > SUBMERGED_M
            && (pressure_m - step.leg_depth_m).abs() < LEVEL_M;
        self.steady_s = if steady { self.steady_s + dt_s } else { 0.0 };
        if (step.leg_speed_mps - self.speed_mps).abs() > SAME_SPEED_MPS {
            (self.speed_mps, self.rate_mps, self.learned_s) = (step.leg_speed_mps, 0.0, 0.0);
            (self.drift_m, self.recent_m) = (0.0, 0.0);
        }
        self.most_m = self.drift_m.abs().max(self.most_m * (1.0 - (dt_s / MEMORY_S).min(1.0)));
        self.drift_m *= 1.0 - (dt_s / MEMORY_S).min(1.0);
        self.recent_m *= 1.0 - (dt_s / RECENT_S).min(1.0);
        if self.steady_s < SETTLE_S {
            return;
        }
        // deeper by pitch and speed than by pressure
        let departed_m = -step.surge_mps * libm::sin(step.pitch_rad) * dt_s - (pressure_m - last_m);
        let beyond_m = departed_m - self.rate_mps * dt_s;
        let mut share = 1.0;
        if self.learned_s >= LEARN_S {
            self.drift_m += beyond_m;
            self.recent_m += beyond_m;
            share = FOLLOW;
        }
        // and goes on after the first minute, which is of a vehicle that has just dived
        self.learned_s = (self.learned_s + dt_s).min(FOLLOW_S);
        if self.learned_s > 0.0 {
            self.rate_mps += share * beyond_m / self.learned_s;
        }
    }
}

/// The mean holds so many seconds: three waves or more.
const WAVES_S: f64 = 20.0;

/// What the pressure sensor says at the surface, where a fix is received: zero but for its error. Waves are averaged.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceDepth {
    mean_m: f64,
    /// How long fixes have come without a break, s.
    since_s: f64,
}

impl SurfaceDepth {
    pub const fn new() -> Self {
        Self { mean_m: 0.0, since_s: 0.0 }
    }

    /// Another step.
    pub fn step(&mut self, dt_s: f64, has_fix: bool, pressure_m: f64) {
        if !has_fix {
            *self = Self::new();
            return;
        }
        self.since_s += dt_s;
        let share = if self.since_s > 0.0 { dt_s / self.since_s.min(WAVES_S) } else { 1.0 };
        self.mean_m += share * (pressure_m - self.mean_m);
    }

    /// m; `None` until waves are averaged.
    pub fn mean_m(&self) -> Option<f64> {
        (self.since_s >= WAVES_S).then_some(self.mean_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEADY: DepthStep = DepthStep {
        dt_s: 0.1,
        pressure_m: 3.0,
        roll_rad: 0.02,
        pitch_rad: -0.04,
        yaw_radps: 0.0,
        surge_mps: 1.0,
        leg_depth_m: 3.0,
        leg_speed_mps: 1.0,
    };

    /// After so many seconds of a flight given by time.
    fn after(seconds: u32, flight: impl Fn(f64) -> DepthStep) -> DepthCrossCheck {
        let mut check = DepthCrossCheck::new();
        (0..10 * seconds).for_each(|i| check.step(&flight(0.1 * f64::from(i))));
        check
    }

    fn drift_after(seconds: u32, flight: impl Fn(f64) -> DepthStep) -> f64 {
        after(seconds, flight).drift_m
    }

    /// The angle of attack and the pitch sensor's error are learned.
    #[test]
    fn a_constant_pitch_is_no_drift() {
        assert!(drift_after(3600, |_| STEADY).abs() < 1e-6);
    }

    /// 5 cm/s of drift from 200 s on, when the constant was learned for n = 180 s: the controller holds what the sensor
    /// says, the nose goes down by 0.05 rad. The constant follows, so that s seconds later 0.05 √(n / (n + s)) is left.
    /// With the memory M, ∫ 0.05 √(n / (n + s)) exp(-(T - s) / M) ds by quadrature: 6.86 m for T = 200 s, M = 600 s.
    #[test]
    fn val_a_drifting_sensor_shows_in_pitch() {
        let flight = |t: f64| DepthStep { pitch_rad: if t < 200.0 { -0.04 } else { -0.0901 }, ..STEADY };
        let check = after(400, flight);
        let drift_m = check.drift_m;
        assert!((drift_m - 6.86).abs() < 0.05, "{drift_m}");
        // the largest drift is that of the step before: within 5 mm
        assert!((check.sigma_m() - 2.0 * drift_m).abs() < 0.02);
        // the short memory: T = 100 s, M = 120 s
        let recent_m = after(300, flight).recent_m;
        assert!((recent_m - 2.97).abs() < 0.05, "{recent_m}");
    }

    /// A minute at the surface, level, at the speed of the dive that follows: nothing of it is learned.
    #[test]
    fn the_surface_teaches_nothing() {
        let flight = |t: f64| match t {
            ..60.0 => DepthStep { pressure_m: 0.1, pitch_rad: 0.0, leg_depth_m: 0.0, ..STEADY },
            _ => STEADY,
        };
        assert!(drift_after(3600, flight).abs() < 1e-6);
    }

    #[test]
    fn turns_dives_and_other_speeds_are_not_summed() {
        let turning = |t: f64| {
            let turns = t > 200.0 && t % 100.0 < 30.0;
            DepthStep {
                yaw_radps: if turns { 0.1 } else { 0.0 },
                pitch_rad: if turns { -0.2 } else { -0.04 },
                ..STEADY
            }
        };
        assert!(drift_after(3600, turning).abs() < 0.1);
        let faster = |t: f64| {
            let (leg_speed_mps, pitch_rad) = if t < 600.0 { (1.0, -0.04) } else { (1.5, -0.02) };
            DepthStep { leg_speed_mps, surge_mps: leg_speed_mps, pitch_rad, ..STEADY }
        };
        assert!(drift_after(1800, faster).abs() < 0.1);
    }

    /// An offset shows through waves of half a metre, after twenty seconds of fixes and not before; the next dive
    /// forgets it.
    #[test]
    fn waves_are_averaged_at_the_surface() {
        let mut surface = SurfaceDepth::new();
        for step in 0..400 {
            assert_eq!(surface.mean_m().is_some(), step >= 200, "step {step}");
            surface.step(0.1, true, 0.4 + 0.5 * libm::sin(f64::from(step)));
        }
        assert!((surface.mean_m().unwrap() - 0.4).abs() < 0.02, "{surface:?}");
        surface.step(0.1, false, 3.0);
        assert_eq!(surface.mean_m(), None);
    }
}

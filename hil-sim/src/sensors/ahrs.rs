//! Attitude and heading reference with rate gyros.

use super::Sampler;
use crate::noise::{Colour, Colouring, NoiseKind, SensorClass};
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario;
use crate::scenario::effects::Instruments;
use crate::truth::{VehicleTruth, mounting};
use backseat_core::navigation::SensorNoise;

/// Euler angles and body rates with noise, and the errors of compass, pitch sensor and gyros.
#[derive(Clone, Debug)]
pub(super) struct Ahrs {
    pub(super) sampler: Sampler,
    random: Stream,
    attitude_sigma_rad: [f64; 3],
    rates_sigma_radps: f64,
    colouring: Option<[Colouring<3>; 2]>,
    instruments: Instruments,
    turn_rad: [f64; 3],
    /// True and lagged heading at the last sample, unwrapped.
    lagged: Option<(u64, [f64; 2])>,
}

impl Ahrs {
    pub(super) fn new(
        settings: &scenario::Ahrs,
        declared: &SensorNoise,
        instruments: &Instruments,
        turn_rad: [f64; 3],
        noise: NoiseKind,
        seed: u64,
    ) -> Self {
        let [attitude, rates] =
            [SensorClass::Attitude, SensorClass::Rates].map(|class| noise.mixture(class, Colour::AHRS, seed));
        let mut angles = settings.attitude_sigma_rad.map_or(declared.angles_rad(), |sigma| [sigma; 3]);
        angles[2] = settings.heading_sigma_rad.unwrap_or(angles[2]);
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Ahrs),
            attitude_sigma_rad: angles.map(|sigma| attitude.size * sigma),
            rates_sigma_radps: rates.size * settings.rates_sigma_radps.unwrap_or(declared.rates_radps),
            colouring: attitude
                .colouring(seed, Source::AttitudeColour)
                .zip(rates.colouring(seed, Source::RatesColour))
                .map(|(a, r)| [a, r]),
            instruments: *instruments,
            turn_rad,
            lagged: None,
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let [_, _, _, roll, pitch, heading, _, _, _, p, q, r] = vehicle.state;
            let ([roll, pitch, heading], [p, q, r]) = self.in_its_axes([roll, pitch, heading], [p, q, r]);
            let compass = &self.instruments.compass;
            let (sin, cos) = libm::sincos(heading);
            let (sin2, cos2) = libm::sincos(2.0 * heading);
            let [first, second] = [compass.first, compass.second];
            let motor = compass.motor_s2 * vehicle.actuators.propeller_radps.powi(2);
            let time_s = 1e-6 * vehicle.time_us as f64;
            let constant = compass.constant + compass.change.at(time_s);
            let bias = constant + motor + first[0] * sin + first[1] * cos + second[0] * sin2 + second[1] * cos2;
            let heading = self.lag(vehicle.time_us, heading);
            let unit = self.random.normals::<3>(1.0);
            let mut angle: [f64; 3] = core::array::from_fn(|axis| self.attitude_sigma_rad[axis] * unit[axis]);
            let mut rate = self.random.normals::<3>(self.rates_sigma_radps);
            if let Some([attitude, rates]) = &mut self.colouring {
                angle = attitude.mix_axes(angle, self.attitude_sigma_rad, vehicle.time_us);
                rate = rates.mix(rate, self.rates_sigma_radps, vehicle.time_us);
            }
            let ([pitch_bias, pitch_scale], gyro) = (self.instruments.pitch, self.instruments.gyro_radps);
            let pitch_bias = pitch_bias + self.instruments.pitch_change.at(time_s);
            ObservationKind::Ahrs {
                euler_rad: [
                    roll + angle[0],
                    (1.0 + pitch_scale) * pitch + pitch_bias + angle[1],
                    libm::remainder(heading + bias + angle[2], std::f64::consts::TAU),
                ],
                rates_radps: [p + gyro[0] + rate[0], q + gyro[1] + rate[1], r + gyro[2] + rate[2]],
            }
        })
    }

    /// Attitude and rates of a turned sensor.
    fn in_its_axes(&self, euler_rad: [f64; 3], rates_radps: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        if self.turn_rad == [0.0; 3] {
            return (euler_rad, rates_radps);
        }
        (
            mounting::turned(euler_rad, self.turn_rad),
            mounting::into_frame(&mounting::rotation(self.turn_rad), rates_radps),
        )
    }

    /// The heading behind the compass' lag, which is exact for a heading that changes evenly between samples.
    fn lag(&mut self, time_us: u64, heading: f64) -> f64 {
        let tau_s = self.instruments.compass.lag_s;
        if tau_s <= 0.0 {
            return heading;
        }
        let (last_us, [before, lagged]) = self.lagged.unwrap_or((time_us, [heading, heading]));
        let now = before + libm::remainder(heading - before, std::f64::consts::TAU);
        let dt_s = (time_us - last_us) as f64 * 1e-6;
        // Behind a ramp the lag settles at slope times time constant.
        let behind = if dt_s > 0.0 { tau_s * (now - before) / dt_s } else { 0.0 };
        let lagged = now - behind + (lagged - before + behind) * libm::exp(-dt_s / tau_s);
        self.lagged = Some((time_us, [now, lagged]));
        lagged
    }
}

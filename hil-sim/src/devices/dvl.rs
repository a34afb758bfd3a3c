//! An Explorer-class DVL that streams PD0 ensembles in instrument axes, mounted at 45°.

use super::uart::Uart;
use crate::observation::{Observation, ObservationKind};
use backseat_wire::dvl::pd0::{Ensemble, MAX_ENSEMBLE};
use backseat_wire::dvl::{Coordinates, DvlSample};

/// Direction of beam 3 in the vehicle.
pub const MOUNTING_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// The emulated DVL.
pub struct Dvl {
    /// Towards the backseat.
    pub transmitter: Uart,
    ensemble: u32,
}

impl Dvl {
    /// On a line of `baud`.
    pub fn new(baud: u32) -> Self {
        Self { transmitter: Uart::new(baud), ensemble: 0 }
    }

    /// A ping.
    pub fn observe(&mut self, observation: &Observation) {
        let ObservationKind::Dvl { velocity_mps, altitude_m } = observation.kind else { return };
        self.ensemble = self.ensemble.wrapping_add(1);
        let sample = DvlSample {
            bottom_mps: velocity_mps,
            altitude_m,
            error_mps: velocity_mps.map(|_| 0.0),
            frame: Coordinates::Instrument,
            ..DvlSample::default()
        };
        let mut buffer = [0; MAX_ENSEMBLE];
        if let Ok(bytes) = Ensemble::from_sample(&sample, self.ensemble, MOUNTING_RAD).emit(&mut buffer) {
            self.transmitter.send(observation.time_us, bytes);
        }
    }
}

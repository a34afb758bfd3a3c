//! The faults, and the vehicle that has one.

use crate::dynamics::{FINS, VehicleModel, VehicleParameters};

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultCause {
    /// A fin, in the order of the actuators, lost lift and drag; magnitude: share lost.
    Fin(u8),
    /// Surge drag grew, something hangs on the hull; magnitude: d11's gain, relative.
    Entanglement,
    /// The propeller pushes less, β5; magnitude: share lost.
    Fouling,
    /// Water came in; magnitude: kg.
    Flooding,
}

impl FaultCause {
    /// Number of faults.
    pub const COUNT: usize = 7;
    /// All of them.
    pub const ALL: [Self; Self::COUNT] =
        [Self::Fin(0), Self::Fin(1), Self::Fin(2), Self::Fin(3), Self::Entanglement, Self::Fouling, Self::Flooding];
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diagnosis {
    /// The fault that explains most.
    pub cause: FaultCause,
    /// Its magnitude, see [`FaultCause`].
    pub magnitude: f64,
    /// Moment of the water about y, over its weight: kg m, ahead of the centre of gravity is positive. 0 of other
    /// faults.
    pub moment_kgm: f64,
    /// Another fault that explains nearly as much: the present motion does not separate the two (a speed step separates
    /// drag from thrust, a dive or a turn one fin from another).
    pub rival: Option<FaultCause>,
    /// Likelihood of this fault against the next best.
    pub confidence: f64,
    /// When the gain began to rise, µs.
    pub since_us: u64,
}

impl Diagnosis {
    /// The vehicle with the fault: its parameters, and the shares that its fins still have.
    #[must_use]
    pub fn compensated(&self, model: &VehicleModel) -> (VehicleParameters, [f64; FINS]) {
        let mut vehicle = *model.parameters();
        let mut fins = model.fin_effectiveness();
        match self.cause {
            FaultCause::Fin(fin) => {
                if let Some(share) = fins.get_mut(usize::from(fin)) {
                    *share *= 1.0 - self.magnitude;
                }
            }
            FaultCause::Entanglement => vehicle.quadratic_diag[0] *= 1.0 + self.magnitude,
            FaultCause::Fouling => vehicle.beta5_n_s2_per_rad2 *= 1.0 - self.magnitude,
            FaultCause::Flooding => {
                vehicle.mass_kg += self.magnitude;
                for mass in vehicle.m_diag.iter_mut().take(3) {
                    *mass += self.magnitude;
                }
                vehicle.b_cb_to_cg_m[0] += self.moment_kgm / vehicle.displaced_mass_kg;
            }
        }
        (vehicle, fins)
    }
}

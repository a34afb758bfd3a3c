//! `[backseat]`: how the backseat under test is configured.

use super::Scenario;
use crate::quantity::{self, settings};
use crate::rng::{Source, Stream};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::parameters::Installation;
use backseat_logs::VehicleFile;
use serde::Deserialize;

settings! {
    /// `[backseat]`.
    #[derive(Copy)]
    pub struct Backseat {
        /// The app may fuse DVL velocities (it is simulated and logged either way).
        dvl: bool = false,
        /// The app may fuse acoustic range rates.
        range_rate: bool = true,
        /// The app may fuse ranges to other vehicles.
        peers: bool = false,
        /// The app may fuse body rates.
        rates: bool = true,
        /// Which law steers.
        control_law: ControlLaw = ControlLaw::default(),
        /// What is commanded.
        control_mode: ControlMode = ControlMode::default(),
        /// The app estimates what the declaration leaves open; otherwise it takes the vehicle as declared.
        robust: bool = true,
        /// Estimate a water current, if it is not robust.
        current_state: bool = false,
        /// The backseat's values of inertia, drag, fins and thrust are each too high or too low by this share; the seed
        /// has the signs.
        wrong_share: f64 as "quantity::share" = 0.0,
        /// The seed that has them, if it is not the flight's: of a second dive of the same vehicle.
        wrong_seed: Option<u64> = None,
        /// One sigma per axis of a GNSS receiver's slow error, as the board is told, m. The simulated receivers have
        /// none but by faults.
        receiver_bias_m: f64 as "quantity::non_negative" = 0.0,
    }
}

/// Which law steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlLaw {
    /// Linear-quadratic regulator.
    #[default]
    Lqr,
    /// Proportional-derivative with kappa guidance.
    Pd,
    /// Linear-quadratic regulator about the reference trajectory of 5.1, a forward simulation of model and PD.
    LqrOnReference,
}

/// What is commanded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlMode {
    /// Fins and motor directly (`$OMP`).
    #[default]
    Omp,
    /// Heading, depth and speed (`$OMS`).
    Oms,
}

impl Scenario {
    /// The vehicle that the backseat is given: the declared one, wrong by `backseat.wrong_share`, with the sound speed
    /// of the place and the depth of the ship's transducer.
    pub fn declared_vehicle(&self) -> VehicleFile {
        let backseat = &self.settings.backseat;
        let seed = backseat.wrong_seed.unwrap_or(self.settings.seed);
        let parameters = perturbed(&self.vehicle.parameters, backseat.wrong_share, seed);
        let installation = Installation {
            sound_speed_mps: self.settings.environment.sound_speed_mps,
            ship_transducer_depth_m: self.settings.ship.transducer_depth_m,
            ..self.vehicle.installation
        };
        VehicleFile { parameters, installation, ..self.vehicle.clone() }
    }
}

/// A vehicle declared wrong: inertia, drag, fins and thrust each too high or too low by `share`, as the seed has it.
#[must_use]
pub fn perturbed(parameters: &VehicleParameters, share: f64, seed: u64) -> VehicleParameters {
    let mut wrong = *parameters;
    let mut random = Stream::new(seed, Source::Disturbance);
    let plant = wrong.m_diag.iter_mut().chain(&mut wrong.quadratic_diag);
    let actuators = wrong.cd.iter_mut().chain(&mut wrong.cl).chain(std::iter::once(&mut wrong.beta5_n_s2_per_rad2));
    for value in plant.chain(actuators) {
        *value *= 1.0 - share * random.sign();
    }
    wrong
}

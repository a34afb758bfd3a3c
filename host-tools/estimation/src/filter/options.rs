//! What of a log the filter uses, and how.

use backseat_core::navigation::{
    Declared, EffectStates, InitialShip, InitialState, Learnt, NavigationConfig, ProcessModel, ProcessNoise,
    StateParameter, SurfaceNoise,
};
use backseat_logs::VehicleFile;

/// Where the ship's state at time of launch comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShipSource {
    /// Ship GNSS at full rate; the ship is a state of the filter, cloned at time of launch.
    Centralized,
    /// `ship_x_m`, `ship_y_m` as a packet would bring them; their error is taken as independent.
    /// The packet's velocity is the slope of the ship's fixes about the launch.
    Packet,
}

/// A state to start from at the first row of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Vehicle.
    pub vehicle: InitialState,
    /// Ship; `None`: from its first fix.
    pub ship: Option<InitialShip>,
}

/// What of a log the filter uses, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterOptions {
    /// Models and noise.
    pub navigation: NavigationConfig,
    /// Fuse DVL bottom track.
    pub use_dvl: bool,
    /// Fuse body rates.
    pub use_rates: bool,
    /// Fuse acoustic ranges.
    pub use_range: bool,
    /// Fuse acoustic range rates.
    pub use_range_rate: bool,
    /// The ship's end of the acoustic paths.
    pub ship: ShipSource,
    /// Where it starts from; `None`: from the log's first fix of the vehicle and what its sensors
    /// say then (2.3.1.2).
    pub start: Option<Start>,
    /// What the robust filter starts from.
    pub learnt: Learnt,
    /// Least time between samples of the track, µs; 0: at every row.
    pub track_interval_us: u64,
    /// Smooth the track as well.
    pub smooth: bool,
    /// State protection levels, under what is declared of water and receivers.
    pub level: Option<Declared>,
}

impl FilterOptions {
    /// Current states when they are asked for: up to tides of 0.5 m/s, which turn in hours.
    #[must_use]
    pub fn water_current() -> EffectStates {
        EffectStates::water_current(0.3, 1.0e-4)
    }

    /// [`Self::new`] of the dynamic model that also estimates what is usually not known of the vehicle, its compass and
    /// the current.
    #[must_use]
    pub fn robust(vehicle: &VehicleFile) -> Self {
        let mut options = Self::new(vehicle, ProcessModel::Dynamic);
        options.navigation.make_robust();
        options
    }

    /// Whether parameters of the vehicle are estimated.
    pub fn is_robust(&self) -> bool {
        let mut states = self.navigation.effect_states.iter();
        states.any(|state| matches!(state.parameter, StateParameter::LogFactor(_)))
    }

    /// Every sensor, centralized, with the noise of the vehicle file (the kinematic model has its
    /// own process noise: it must cover the manoeuvres).
    pub fn new(vehicle: &VehicleFile, model: ProcessModel) -> Self {
        let (process_noise, surface) = match model {
            ProcessModel::Dynamic => (vehicle.noise, SurfaceNoise::DYNAMIC),
            ProcessModel::Kinematic => (ProcessNoise::KINEMATIC, SurfaceNoise::KINEMATIC),
        };
        Self {
            navigation: NavigationConfig {
                process_model: model,
                process_noise,
                surface: Some(surface),
                sensors: vehicle.sensors,
                priors: vehicle.priors,
                effects: vehicle.effects.set,
                sound_speed_mps: vehicle.installation.sound_speed_mps,
                ship_transducer_depth_m: vehicle.installation.ship_transducer_depth_m,
                ..NavigationConfig::REFERENCE
            },
            use_dvl: true,
            use_rates: true,
            use_range: true,
            use_range_rate: true,
            ship: ShipSource::Centralized,
            start: None,
            learnt: vehicle.learnt,
            track_interval_us: 1_000_000,
            smooth: false,
            level: None,
        }
    }
}

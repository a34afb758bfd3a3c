//! From the declared vehicle and the scenario to the parameters of the simulated one.

use super::effects::{AcousticChannel, Instruments};
use super::{Physics, Scenario};
use crate::truth::{Fin, Parameters, State, Undeclared};

impl Scenario {
    /// The simulated world: what is declared, `[plant]` and `[environment]` on top, then the effects.
    pub fn physics(&self) -> Physics {
        let settings = &self.settings;
        let mut physics = Physics {
            vehicle: self.vehicle_parameters(),
            undeclared: Undeclared {
                no_surface: !settings.plant.surface,
                round_hull: settings.plant.round_hull,
                disturbance_colour: settings.noise.disturbance(),
                ..Undeclared::default()
            },
            currents: vec![settings.environment.current],
            waves: None,
            instruments: Instruments::default(),
            installation: settings.installation,
            channel: AcousticChannel::default(),
        };
        settings.effects.apply(&mut physics);
        physics
    }

    /// The simulated vehicle as the effects leave it.
    pub fn truth_parameters(&self) -> Parameters {
        self.physics().vehicle
    }

    fn vehicle_parameters(&self) -> Parameters {
        let (declared, plant) = (&self.vehicle.parameters, &self.settings.plant);
        let (noise, factor) = (&self.vehicle.noise, self.settings.noise.factor());
        let [n1, n2, n3] = noise.linear_mps2_per_sqrt_hz;
        let [n4, n5, n6] = noise.angular_radps2_per_sqrt_hz;
        Parameters {
            mass_kg: declared.mass_kg,
            displaced_mass_kg: declared.displaced_mass_kg,
            rho_kg_per_m3: declared.rho_kg_per_m3,
            g_mps2: declared.g_mps2,
            length_m: declared.length_m,
            hull_radius_m: 0.5 * declared.diameter_m,
            cb_to_cg_m: core::array::from_fn(|i| declared.b_cb_to_cg_m[i] + plant.cg_offset_m[i]),
            inertia: declared.m_diag,
            quadratic_drag: declared.quadratic_diag,
            d26: declared.d26,
            d35: declared.d35,
            linear_surge_ns_per_m: declared.linear_surge_ns_per_m,
            moment_uu: declared.moment_uu,
            z_uw: declared.z_uw,
            fins: core::array::from_fn(|i| Fin {
                phi_rad: declared.fins[i].phi_rad,
                cp_m: declared.fins[i].cp_m,
                gain: declared.fins[i].gain,
                area_m2: declared.fin_area_m2 * plant.fin_area_factor[i],
                cd: declared.cd,
                cl: declared.cl,
                stall_rad: declared.stall_rad,
            }),
            fin_max_rad: declared.delta_max_rad,
            servo_rate_radps: plant.servo_rate_radps,
            thrust_n_s2_per_rad2: declared.beta5_n_s2_per_rad2,
            advance_n_s2_per_rad_m: declared.advance_n_s2_per_rad_m,
            torque_arm_m: declared.torque_arm_m,
            propeller_max_radps: declared.omega_max_radps,
            propeller_lag_s: plant.propeller_lag_s,
            disturbance_per_sqrt_hz: [n1, n2, n3, n4, n5, n6]
                .map(|density| density * plant.process_noise_factor * factor),
        }
    }

    /// The simulated vehicle at time zero: level, on its heading.
    pub fn initial_state(&self) -> State {
        let start = &self.settings.start;
        State::new(
            [start.x_m, start.y_m, start.depth_m],
            [0.0, 0.0, start.heading_rad],
            [start.speed_mps, 0.0, 0.0],
            [0.0; 3],
        )
    }
}

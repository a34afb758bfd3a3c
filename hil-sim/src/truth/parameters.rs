//! What the simulated vehicle is made of.

/// One fin of the tail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fin {
    /// Angle of the outboard direction about body x, from starboard towards down, rad.
    pub phi_rad: f64,
    /// Centre of pressure from the centre of gravity, m.
    pub cp_m: [f64; 3],
    /// Its angle over that of its servo.
    pub gain: f64,
    /// Planform area, m².
    pub area_m2: f64,
    /// β1, β2 of the drag coefficient β1 + β2 α².
    pub cd: [f64; 2],
    /// β3, β4 of the lift coefficient β3 α + β4 α³.
    pub cl: [f64; 2],
    /// Incidence beyond which both keep their values, rad.
    pub stall_rad: f64,
}

/// The whole vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Dry mass, kg.
    pub mass_kg: f64,
    /// Mass of the water it displaces when submerged, kg.
    pub displaced_mass_kg: f64,
    /// Water density, kg/m³.
    pub rho_kg_per_m3: f64,
    /// Gravity, m/s².
    pub g_mps2: f64,
    /// Length of the hull, m.
    pub length_m: f64,
    /// Radius of the hull, m: over this much above and below z = 0 the hull, whose axis holds the
    /// centre of buoyancy, leaves the water.
    pub hull_radius_m: f64,
    /// From the centre of buoyancy to the centre of gravity, m.
    pub cb_to_cg_m: [f64; 3],
    /// Rigid-body plus added mass and inertia about the body axes, kg and kg m².
    pub inertia: [f64; 6],
    /// Quadratic drag per axis, N s²/m² and N m s²/rad².
    pub quadratic_drag: [f64; 6],
    /// Cross drag: |r| r on sway and |v| v on yaw.
    pub d26: f64,
    /// Cross drag: |q| q on heave and |w| w on pitch.
    pub d35: f64,
    /// Linear drag in surge, N s/m.
    pub linear_surge_ns_per_m: f64,
    /// Moments about x, y, z per u|u|, N s²/m.
    pub moment_uu: [f64; 3],
    /// Force down per |u| w, kg/m.
    pub z_uw: f64,
    /// Top, bottom, port, starboard.
    pub fins: [Fin; 4],
    /// Stop of the fins, rad.
    pub fin_max_rad: f64,
    /// Fastest a servo turns, rad/s.
    pub servo_rate_radps: f64,
    /// Thrust per squared propeller speed, N s²/rad².
    pub thrust_n_s2_per_rad2: f64,
    /// Thrust lost per propeller speed and speed ahead, N s²/(rad m).
    pub advance_n_s2_per_rad_m: f64,
    /// Reaction torque over thrust, m; positive rolls to port going ahead.
    pub torque_arm_m: f64,
    /// Fastest the propeller turns, rad/s.
    pub propeller_max_radps: f64,
    /// Time constant of the propeller's speed, s.
    pub propeller_lag_s: f64,
    /// Disturbance u, v, w, p, q, r: square root of the acceleration power spectral density,
    /// m/s²/√Hz and rad/s²/√Hz.
    pub disturbance_per_sqrt_hz: [f64; 6],
}

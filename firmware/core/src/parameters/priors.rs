//! How well the declared vehicle and its water are known.

crate::declared! {
    /// Section `[prior]` of the vehicle file: one sigma of what the declaration leaves open. Zero means known,
    /// 1 of a parameter a factor of e: a prior wider than that is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Priors;
    /// Parameters 10 %, a current of some tenths of a metre per second, a compass of 2 degrees after calibration, fins
    /// set by eye, ballast by scale. 2 mm of the reference vehicle's 15 mm lever are 0.13 rad of pitch trim.
    const DEFAULT;
    /// Rows of the table of parameters.
    const ROWS {
        [vector[0, 3 of 3] "prior.mass", "", "1", [0.0, 1.0]] "Relative sigma of m_11, m_22, m_33." mass: [f64; 3] = [0.1; 3],
        [vector[0, 2 of 2] "prior.drag", "", "1", [0.0, 1.0]] "Relative sigma of d_11, d_66." drag: [f64; 2] = [0.1; 2],
        [vector[0, 3 of 3] "prior.actuators", "", "1", [0.0, 1.0]] "Relative sigma of beta_1, beta_3, beta_5." actuators: [f64; 3] = [0.1; 3],
        [real "prior.walk_per_sqrt_s", "", "1/sqrt(s)", [0.0, 0.01]] "Random walk of these parameters." walk_per_sqrt_s: f64 = 3.0e-5,
        [real "prior.current_mps", "", "m/s", [0.0, 5.0]] "Sigma of the water current at the start, per axis." current_mps: f64 = 0.3,
        [real "prior.current_walk_mps_per_sqrt_s", "", "m/s/sqrt(s)", [0.0, 0.1]] "Random walk of the current, per axis." current_walk_mps_per_sqrt_s: f64 = 5.0e-5,
        [real "prior.heading_rad", "", "rad", [0.0, 0.5]] "Sigma of the constant part of the compass error." heading_rad: f64 = 0.035,
        [real "prior.hard_iron_rad", "", "rad", [0.0, 0.5]] "Sigma of the sine and of the cosine part of the compass error." hard_iron_rad: f64 = 0.0175,
        [real "prior.fin_trim_rad", "", "rad", [0.0, 0.3]] "Sigma of the angle by which both rudders, or both elevators, stand off their commands." fin_trim_rad: f64 = 0.0175,
        [real "prior.buoyancy_kg", "", "kg", [0.0, 2.0]] "Sigma of the displaced mass." buoyancy_kg: f64 = 0.1,
        [real "prior.pitch_trim_rad", "", "rad", [0.0, 0.5]] "Sigma of the angle of b, from the vertical, in pitch." pitch_trim_rad: f64 = 0.133,
        [real "prior.fin_lag_s", "", "s", [0.0, 2.0]] "Sigma of the lag of the fins." fin_lag_s: f64 = 0.15,

    }
}

impl Priors {
    /// Everything known.
    pub(crate) const KNOWN: Self = Self {
        mass: [0.0; 3],
        drag: [0.0; 2],
        actuators: [0.0; 3],
        walk_per_sqrt_s: 0.0,
        current_mps: 0.0,
        current_walk_mps_per_sqrt_s: 0.0,
        heading_rad: 0.0,
        hard_iron_rad: 0.0,
        fin_trim_rad: 0.0,
        buoyancy_kg: 0.0,
        pitch_trim_rad: 0.0,
        fin_lag_s: 0.0,
    };
}

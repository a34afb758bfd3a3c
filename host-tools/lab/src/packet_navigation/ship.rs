//! The ship's filter and its packets.

use super::information::{Information, NotPositive, Step, cholesky, root};
use backseat_core::navigation::{InitialShip, NavigationConfig};
use nalgebra::{Matrix2, SMatrix};

/// States of one axis: position and velocity at the origin, position and velocity at the launch.
pub const STATES: usize = 4;

/// Numbers that a packet carries: the upper triangle of Λ and the two columns of η.
pub const NUMBERS: usize = STATES * (STATES + 1) / 2 + 2 * STATES;

/// Information between the ship's states at two launches. North and east have the same noise and
/// share Λ; they are the columns of η.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delta {
    /// The launch it starts from, µs; `None`: the beginning, of which nothing needs to be known.
    pub origin_us: Option<u64>,
    /// The launch of the packet that carries it, µs.
    pub launch_us: u64,
    /// Over [origin position, origin velocity, position, velocity] of one axis.
    pub information: Information<STATES, 2>,
}

impl Delta {
    /// The same, rounded to the 32-bit floats that are sent.
    #[must_use]
    pub fn rounded(&self) -> Self {
        let round = |number: f64| f64::from(number as f32);
        let Information { lambda, eta } = &self.information;
        Self { information: Information { lambda: lambda.map(round), eta: eta.map(round) }, ..*self }
    }
}

/// Information gathered since a launch (or the beginning).
#[derive(Clone, Copy)]
struct Gathering {
    origin_us: Option<u64>,
    time_us: u64,
    /// `None` at the origin itself, where both states are one and Λ has no bound.
    information: Option<Information<STATES, 2>>,
}

impl Gathering {
    /// To a later time under white acceleration of PSD `q`.
    fn advance(&mut self, to_us: u64, q: f64) -> Result<(), NotPositive> {
        let h = to_us.saturating_sub(self.time_us) as f64 * 1e-6;
        if h == 0.0 {
            return Ok(());
        }
        self.time_us = to_us;
        let transition = Matrix2::new(1.0, h, 0.0, 1.0);
        let noise = Matrix2::new(h * h * h / 3.0, h * h / 2.0, h * h / 2.0, h) * q;
        match &mut self.information {
            Some(information) => {
                let mut step = Step {
                    inverse: SMatrix::identity(),
                    shift: SMatrix::zeros(),
                    noise: SMatrix::<f64, STATES, 2>::zeros(),
                };
                step.inverse[(2, 3)] = -h;
                step.noise.fixed_view_mut::<2, 2>(2, 0).copy_from(&root(noise)?);
                information.predict(&step)?;
            }
            None => {
                // s − Φ s_origin = w.
                let mut residual = SMatrix::<f64, 2, STATES>::zeros();
                residual.fixed_view_mut::<2, 2>(0, 0).copy_from(&-transition);
                residual.fixed_view_mut::<2, 2>(0, 2).copy_from(&Matrix2::identity());
                let lambda = residual.tr_mul(&cholesky(noise)?.solve(&residual));
                self.information = Some(Information { lambda, ..Information::none() });
            }
        }
        Ok(())
    }
}

/// The ship's own small information filter. It never hears of a range.
pub struct ShipInformation {
    acceleration_psd: f64,
    fix_sigma_m: f64,
    /// Since the last launch known to have been received.
    unacknowledged: Gathering,
    /// Since the last launch.
    fresh: Option<Gathering>,
}

impl ShipInformation {
    /// From its prior; both axes have the first one's sigma.
    #[must_use]
    pub fn new(time_us: u64, prior: &InitialShip, config: &NavigationConfig) -> Self {
        let [x, y, _, x_dot, y_dot, _] = prior.state;
        let mut information = Information::none();
        information.know(2, [x, y], prior.sigma[0]);
        information.know(3, [x_dot, y_dot], prior.sigma[3]);
        Self {
            acceleration_psd: config.ship_noise.linear_mps2_per_sqrt_hz.powi(2),
            fix_sigma_m: config.sensors.ship_gnss_m,
            unacknowledged: Gathering { origin_us: None, time_us, information: Some(information) },
            fresh: None,
        }
    }

    /// A fix; one at the time of a launch comes before it.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn fix(&mut self, time_us: u64, position_m: [f64; 2]) -> Result<(), NotPositive> {
        for gathering in std::iter::once(&mut self.unacknowledged).chain(&mut self.fresh) {
            gathering.advance(time_us, self.acceleration_psd)?;
            let information = gathering.information.as_mut().ok_or(NotPositive)?;
            information.know(2, position_m, self.fix_sigma_m);
        }
        Ok(())
    }

    /// The delta of the packet that leaves now.
    ///
    /// # Errors
    /// Numbers that are not finite, or a second launch at one time.
    pub fn launch(&mut self, launch_us: u64) -> Result<Delta, NotPositive> {
        let gathering = &mut self.unacknowledged;
        gathering.advance(launch_us, self.acceleration_psd)?;
        self.fresh = Some(Gathering { origin_us: Some(launch_us), time_us: launch_us, information: None });
        let information = gathering.information.ok_or(NotPositive)?;
        Ok(Delta { origin_us: gathering.origin_us, launch_us, information })
    }

    /// The vehicle has received the last packet.
    pub fn acknowledged(&mut self) {
        if let Some(fresh) = self.fresh.take() {
            self.unacknowledged = fresh;
        }
    }
}

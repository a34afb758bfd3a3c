//! The two ends of an acoustic path: where they were, how fast, and how a scalar of them depends
//! on the state.

use super::models::{self, Distance, distance};
use crate::dynamics::Attitude;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::layout::{CLONE_VELOCITY, CloneKind, SHIP_VELOCITY};
use crate::navigation::algebra::observation::{Observation, Refused};
use crate::navigation::algebra::row::Row;
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::{
    AcousticPath, FusionOutcome, PeerReport, ShipEnd, ShipReport, VehicleEnd,
};
use crate::state::{PHI, U, X};
use nalgebra::{Matrix2, Vector3};

/// No other vehicle is believed to know its place better than this per axis, m: arms, and the step of its pulse.
const PEER_SIGMA_M: f64 = 1.0;

/// Covariance of another vehicle's statement, m².
pub(crate) fn stated(peer: &PeerReport) -> Matrix2<f64> {
    let ([north, cross, east], least) = (peer.covariance_m2, PEER_SIGMA_M * PEER_SIGMA_M);
    Matrix2::new(north.max(least), cross, cross, east.max(least))
}

/// Both ends, resolved against the state.
pub(crate) struct Path<'a> {
    vehicle: Vehicle,
    ship: Ship<'a>,
    /// p_vehicle − p_ship, m.
    pub(crate) dp: Vector3<f64>,
    /// |dp|, m.
    pub(crate) distance_m: f64,
    /// Unit vector from the ship to the vehicle: ∂|dp|/∂dp.
    pub(crate) direction: Vector3<f64>,
}

enum Vehicle {
    Now,
    Delayed { at: usize, bridge_s: f64, acceleration_psd: f64 },
}

enum Ship<'a> {
    State {
        at: usize,
    },
    Reported(&'a ShipReport),
    Transponder,
    /// Its statement, and where the states of its error stand.
    Peer(&'a PeerReport, Option<usize>),
}

/// A scalar's gradient by an end's position and velocity.
#[derive(Clone, Copy)]
pub(crate) struct Gradient {
    /// By dp, in the scalar's unit per m.
    pub(crate) position: Vector3<f64>,
    /// By dv, in the scalar's unit per m/s.
    pub(crate) velocity: Vector3<f64>,
}

impl<'a> Path<'a> {
    pub(crate) fn new(x: &Estimate, path: &'a AcousticPath, config: &NavigationConfig) -> Result<Self, Refused> {
        let (vehicle, p_vehicle) = match path.vehicle {
            VehicleEnd::Now => (Vehicle::Now, Vector3::from(x.block::<3>(X))),
            VehicleEnd::Delayed { clone, bridge_s } => {
                let at = x.clone_at(clone, CloneKind::Vehicle).ok_or(FusionOutcome::StaleClone)?;
                let p = Vector3::from(x.block::<3>(at));
                let v = Vector3::from(x.block::<3>(at + CLONE_VELOCITY));
                (Vehicle::Delayed { at, bridge_s, acceleration_psd: acceleration_psd(config) }, p + v * bridge_s)
            }
        };
        let at_depth = |[north, east]: [f64; 2]| Vector3::new(north, east, config.ship_transducer_depth_m);
        let ship_state = |at: usize| (Ship::State { at }, at_depth(x.block::<2>(at)));
        let (ship, p_ship) = match &path.ship {
            ShipEnd::Now => ship_state(x.layout.ship().ok_or(FusionOutcome::Invalid)?),
            ShipEnd::Delayed(id) => ship_state(x.clone_at(*id, CloneKind::Ship).ok_or(FusionOutcome::StaleClone)?),
            ShipEnd::Reported(report) => (Ship::Reported(report), at_depth(report.position_m)),
            ShipEnd::Transponder(place_m) => (Ship::Transponder, Vector3::from(*place_m)),
            ShipEnd::Peer(report) => {
                let at = x.layout.peer(report.address);
                let [north, east] = at.map_or([0.0; 2], |at| x.block::<2>(at));
                (Ship::Peer(report, at), Vector3::from(report.position_m) - Vector3::new(north, east, 0.0))
            }
        };
        let dp = p_vehicle - p_ship;
        let Distance { distance_m, direction } = distance(&dp).ok_or(FusionOutcome::Invalid)?;
        Ok(Self { vehicle, ship, dp, distance_m, direction })
    }

    /// Whether the ship's end is one and the same: a reported ship is where it replied, a transponder does not move.
    pub(crate) fn shares_ship(&self, other: &Self) -> bool {
        match (&self.ship, &other.ship) {
            (Ship::State { at }, Ship::State { at: other }) => at == other,
            (Ship::Reported(_), Ship::Reported(_)) | (Ship::Transponder, Ship::Transponder) => true,
            _ => false,
        }
    }

    /// dv = v_vehicle − v_ship over ground, NED, m/s; `attitude` is the present one.
    pub(crate) fn relative_velocity(&self, x: &Estimate, attitude: &Attitude) -> Vector3<f64> {
        let vehicle = match self.vehicle {
            Vehicle::Now => ground_velocity(x, attitude),
            Vehicle::Delayed { at, .. } => Vector3::from(x.block::<3>(at + CLONE_VELOCITY)),
        };
        let [north, east] = match self.ship {
            Ship::State { at } => x.block::<2>(at + SHIP_VELOCITY),
            Ship::Reported(report) => report.velocity_mps,
            Ship::Transponder | Ship::Peer(..) => [0.0; 2],
        };
        vehicle - Vector3::new(north, east, 0.0)
    }

    /// Adds what the vehicle contributes to h and, by its bridge, to R; `attitude` is the present one where the
    /// velocity matters.
    pub(crate) fn add_vehicle(&self, x: &Estimate, attitude: Option<&Attitude>, by: &Gradient, out: &mut Observation) {
        let row = &mut out.row;
        match self.vehicle {
            Vehicle::Now => {
                row.push_vector(X, &by.position);
                if let Some(attitude) = attitude {
                    push_ground_velocity(x, attitude, &by.velocity, row);
                }
            }
            Vehicle::Delayed { at, bridge_s: b, acceleration_psd: q } => {
                let velocity = by.position * b + by.velocity;
                row.push_vector(at, &by.position);
                row.push_vector(at + CLONE_VELOCITY, &velocity);
                // White acceleration over the bridge, either way in time.
                let (gap, pp) = (b.abs(), by.position.dot(&by.position));
                let (pv, vv) = (by.position.dot(&by.velocity), by.velocity.dot(&by.velocity));
                out.variance += q * (pp * gap * gap * gap / 3.0 + pv * b * gap + vv * gap);
            }
        }
    }

    /// Adds what the ship contributes: to h, or to R by h_s P_s h_sᵀ where it was reported. The ship subtracts, what
    /// another vehicle states too much adds.
    pub(crate) fn add_ship(&self, by: &Gradient, out: &mut Observation) {
        let row = &mut out.row;
        match self.ship {
            Ship::State { at } => {
                row.push(at, -by.position.x);
                row.push(at + 1, -by.position.y);
                if by.velocity.x != 0.0 || by.velocity.y != 0.0 {
                    row.push(at + SHIP_VELOCITY, -by.velocity.x);
                    row.push(at + SHIP_VELOCITY + 1, -by.velocity.y);
                }
            }
            Ship::Reported(report) => {
                let horizontal = |a: &Vector3<f64>| a.x * a.x + a.y * a.y;
                out.variance += horizontal(&by.position) * report.position_sigma_m * report.position_sigma_m
                    + horizontal(&by.velocity) * report.velocity_sigma_mps * report.velocity_sigma_mps;
            }
            Ship::Transponder => {}
            Ship::Peer(_, Some(at)) => {
                row.push(at, by.position.x);
                row.push(at + 1, by.position.y);
            }
            Ship::Peer(report, None) => {
                let by = by.position.xy();
                out.variance += by.dot(&(stated(report) * by));
            }
        }
    }
}

/// Row of a scalar that depends on the vehicle's velocity over ground R ν + c by `by`.
pub(crate) fn push_ground_velocity(x: &Estimate, attitude: &Attitude, by: &Vector3<f64>, row: &mut Row) {
    let nu = Vector3::from(x.block::<3>(U));
    let ground = models::ground_velocity(attitude, &nu, &x.current());
    row.push_vector(PHI, &ground.by_attitude.tr_mul(by));
    row.push_vector(U, &ground.rotation.tr_mul(by));
    if let Some(at) = x.layout.current() {
        row.push(at, by.x);
        row.push(at + 1, by.y);
    }
}

/// PSD of the acceleration over ground in any direction, (m/s²)²/Hz: the largest of the body axes,
/// because the attitude at the clone is not kept, and the current's walk.
fn acceleration_psd(config: &NavigationConfig) -> f64 {
    let roots = config.process_noise.linear_mps2_per_sqrt_hz.iter().zip(config.noise_factor);
    let largest = roots.fold(0.0, |most: f64, (root, factor)| most.max(root * factor));
    let walk = config.effect_states.current().map_or(0.0, |current| current.random_walk_per_sqrt_s);
    largest * largest + walk * walk
}

/// A gradient by position only.
pub(crate) fn by_position(position: Vector3<f64>) -> Gradient {
    Gradient { position, velocity: Vector3::zeros() }
}

/// Velocity over ground of the vehicle, R ν + c.
pub(crate) fn ground_velocity(x: &Estimate, attitude: &Attitude) -> Vector3<f64> {
    models::ground_velocity(attitude, &Vector3::from(x.block::<3>(U)), &x.current()).velocity_mps
}

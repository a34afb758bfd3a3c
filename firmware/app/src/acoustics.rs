//! From the modem's sentences to ranges: one packet at a time.
//!
//! A packet is announced at its start (`$CARXP`), but its data (`$CARXD`) and its time of arrival
//! (`$CACST`) come seconds later, in either order. At the start the filter clones the vehicle; when
//! both halves are there, range = sound speed · (time of arrival − transmit second), with the
//! remainder from the clone to the time of arrival bridged. Packets that are lost, late, repeated,
//! out of order or absurd leave no trace but a count by [`Loss`].

use crate::event::AcousticEvent;
use crate::geodesy::LocalFrame;
use crate::held::Held;
use crate::parameters::AppSettings;
use crate::time::{UtcClock, day_difference_us};
use backseat_core::navigation::{AcousticPath, CloneId, Measurement, Navigator, ShipEnd, ShipReport, VehicleEnd};
use backseat_core::state::{PHI, PSI, THETA, VehicleState, X, Y, Z};
use backseat_wire::ship_state::ShipState;

/// The start of a packet is reported within this of its time of arrival, µs; statistics further off belong to another.
const BRIDGE_MAX_US: i64 = 2_000_000;
/// A transmit second up to this much before the last one used is no news, s: more than the longest flight, 20 km at
/// 1300 m/s.
const REPLAY_S: u32 = 16;
/// A ship further away than this is absurd, m: the local plane ends there.
const SHIP_MAX_M: f64 = 1.0e5;
/// A faster ship is absurd, m/s.
const SHIP_MAX_MPS: f64 = 20.0;

/// Why a packet gave no range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Loss {
    /// Its start came while the filter was not initialised.
    NotReady,
    /// It was a cycle initialisation, without data.
    Cycle,
    /// Another packet began before its data and statistics were complete.
    Replaced,
    /// Data or statistics did not come in time.
    TimedOut,
    /// Data or statistics without a start.
    Unannounced,
    /// The modem reports it as bad, or it holds no ship state.
    Bad,
    /// From another ship.
    Stranger,
    /// The modem's clock was not on an external pulse.
    NotSynchronous,
    /// The board does not know UTC.
    NoTime,
    /// Its time of arrival does not belong to its start.
    Arrival,
    /// Its transmit second, or a later one, was already used.
    Repeated,
    /// Range, or the ship's position or velocity, is impossible.
    Absurd,
}

impl Loss {
    const COUNT: usize = Self::Absurd as usize + 1;
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Arrival {
    toa_us: u64,
    synchronous: bool,
    range_rate_mps: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    clone: CloneId,
    start_us: u64,
    ship: Option<ShipState>,
    arrival: Option<Arrival>,
}

/// One complete packet as measurements at the filter's present time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcousticFix {
    /// Range, if wanted.
    pub range: Option<Measurement>,
    /// Range rate, if wanted and reported.
    pub range_rate: Option<Measurement>,
    /// What it says of the ship.
    pub ship: ShipReport,
    /// Depth of the ship's transducer, m.
    pub transducer_depth_m: f64,
    /// To be dropped after fusion.
    pub clone: CloneId,
}

/// The packet under way.
#[derive(Debug)]
pub struct Acoustics {
    pending: Held<Pending>,
    last_transmit_s: Option<u32>,
    losses: [u32; Loss::COUNT],
}

impl Acoustics {
    pub const fn new() -> Self {
        Self { pending: Held::none(), last_transmit_s: None, losses: [0; Loss::COUNT] }
    }

    /// Packets lost for one cause.
    pub fn losses(&self, loss: Loss) -> u32 {
        self.losses[loss as usize]
    }

    /// Forgets the packet under way; its clone went with the filter.
    pub fn reset(&mut self) {
        self.pending.clear();
        self.last_transmit_s = None;
    }

    fn count(&mut self, loss: Loss) {
        let count = &mut self.losses[loss as usize];
        *count = count.saturating_add(1);
    }

    fn abandon(&mut self, navigator: &mut Navigator, loss: Loss) {
        if let Some(pending) = self.pending.take() {
            navigator.drop_clone(pending.clone);
        }
        self.count(loss);
    }

    /// Gives up a packet whose rest has not come by `now_us`.
    pub fn expire(&mut self, now_us: u64, navigator: &mut Navigator, settings: &AppSettings) {
        let timeout_us = (settings.packet_timeout_s * 1e6) as u64;
        if self.pending.get().is_some_and(|pending| now_us.saturating_sub(pending.start_us) > timeout_us) {
            self.abandon(navigator, Loss::TimedOut);
        }
    }

    /// Takes one event, at the filter's present time; the last one of a packet completes it.
    pub fn take(
        &mut self,
        event: &AcousticEvent,
        navigator: &mut Navigator,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Option<AcousticFix> {
        match *event {
            AcousticEvent::Begins => {
                if self.pending.get().is_some() {
                    self.abandon(navigator, Loss::Replaced);
                }
                match navigator.clone_vehicle() {
                    Ok(clone) => {
                        let start_us = navigator.time_us();
                        self.pending.set(Pending { clone, start_us, ship: None, arrival: None });
                    }
                    Err(_) => self.count(Loss::NotReady),
                }
            }
            AcousticEvent::Cycle => self.abandon(navigator, Loss::Cycle),
            AcousticEvent::BadData => self.abandon(navigator, Loss::Bad),
            AcousticEvent::Ship(ship) => match self.pending.get_mut() {
                _ if ship.source != settings.ship_address => self.abandon(navigator, Loss::Stranger),
                Some(pending) => pending.ship = Some(ship),
                None => self.count(Loss::Unannounced),
            },
            AcousticEvent::Statistics { good, synchronous, arrival, range_rate_mps } => {
                let Some(pending) = self.pending.get_mut() else {
                    self.count(Loss::Unannounced);
                    return None;
                };
                let Some(start_utc_us) = clock.utc_us(pending.start_us) else {
                    self.abandon(navigator, Loss::NoTime);
                    return None;
                };
                if !good {
                    self.abandon(navigator, Loss::Bad);
                    return None;
                }
                let toa_us = arrival.unix_us(start_utc_us);
                pending.arrival = Some(Arrival { toa_us, synchronous, range_rate_mps });
            }
        }
        self.complete(navigator, clock, settings)
    }

    /// The packet as measurements, once data and statistics are there.
    fn complete(&mut self, navigator: &mut Navigator, clock: &UtcClock, settings: &AppSettings) -> Option<AcousticFix> {
        let pending = *self.pending.get()?;
        let (ship, arrival) = (pending.ship?, pending.arrival?);
        match self.evaluate(&pending, &ship, &arrival, navigator.state(), clock, settings) {
            Ok(fix) => {
                self.pending.clear();
                self.last_transmit_s = Some(ship.transmit_s);
                Some(fix)
            }
            Err(loss) => {
                self.abandon(navigator, loss);
                None
            }
        }
    }

    fn evaluate(
        &self,
        pending: &Pending,
        ship: &ShipState,
        arrival: &Arrival,
        x: &VehicleState,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Result<AcousticFix, Loss> {
        if !arrival.synchronous {
            return Err(Loss::NotSynchronous);
        }
        // A packet that fits the board's own clock was sent within the longest flight: an older one is a repetition of
        // what was used, one ahead of which many seconds were used was sent by a clock that has been set back.
        if self.last_transmit_s.is_some_and(|last_s| last_s.wrapping_sub(ship.transmit_s) < REPLAY_S) {
            return Err(Loss::Repeated);
        }
        let start_utc_us = clock.utc_us(pending.start_us).ok_or(Loss::NoTime)?;
        let bridge_us = day_difference_us(arrival.toa_us, start_utc_us);
        if bridge_us.abs() > BRIDGE_MAX_US {
            return Err(Loss::Arrival);
        }
        let flight_us = day_difference_us(arrival.toa_us, u64::from(ship.transmit_s) * 1_000_000);
        let range_m = settings.installation.sound_speed_mps
            * (flight_us as f64 * 1e-6 - settings.installation.transducer_delay_s);
        let position_m = LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg)
            .to_local(ship.position_deg[0], ship.position_deg[1]);
        let plausible = (0.0..=settings.range_max_m).contains(&range_m)
            && position_m.iter().all(|x| x.abs() <= SHIP_MAX_M)
            && ship.velocity_mps.iter().all(|v| v.abs() <= SHIP_MAX_MPS);
        if !plausible {
            return Err(Loss::Absurd);
        }
        let report = ShipReport {
            position_m,
            velocity_mps: ship.velocity_mps,
            position_sigma_m: ship.position_sigma_m,
            velocity_sigma_mps: ship.velocity_sigma_mps,
        };
        let path = AcousticPath {
            vehicle: VehicleEnd::Delayed { clone: pending.clone, bridge_s: bridge_us as f64 * 1e-6 },
            ship: ShipEnd::Reported(report),
        };
        let range_m =
            range_m - arm_along_path_m(x, &settings.installation.transducer_arm_m, position_m, ship.transducer_depth_m);
        Ok(AcousticFix {
            range: settings.use_range.then_some(Measurement::Range { path, range_m }),
            range_rate: arrival
                .range_rate_mps
                .filter(|_| settings.use_range_rate)
                .map(|range_rate_mps| Measurement::RangeRate { path, range_rate_mps }),
            ship: report,
            transducer_depth_m: ship.transducer_depth_m,
            clone: pending.clone,
        })
    }
}

/// How much further from the ship the transducer is than the centre of gravity, m, at the present
/// attitude: the path turns little within a packet.
fn arm_along_path_m(x: &VehicleState, arm_m: &[f64; 3], ship_m: [f64; 2], transducer_depth_m: f64) -> f64 {
    let d = [x[X] - ship_m[0], x[Y] - ship_m[1], x[Z] - transducer_depth_m];
    let distance_m = libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    let arm_ned_m = body_to_ned(x, arm_m);
    if distance_m > 1.0 { (d[0] * arm_ned_m[0] + d[1] * arm_ned_m[1] + d[2] * arm_ned_m[2]) / distance_m } else { 0.0 }
}

/// R(φ, θ, ψ) a.
pub fn body_to_ned(x: &VehicleState, a: &[f64; 3]) -> [f64; 3] {
    let (sf, cf) = libm::sincos(x[PHI]);
    let (st, ct) = libm::sincos(x[THETA]);
    let (sp, cp) = libm::sincos(x[PSI]);
    let level = [ct * a[0] + st * (sf * a[1] + cf * a[2]), cf * a[1] - sf * a[2]];
    [cp * level[0] - sp * level[1], sp * level[0] + cp * level[1], -st * a[0] + ct * (sf * a[1] + cf * a[2])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arms_rotate_into_the_world() {
        let mut x = VehicleState::zeros();
        x[PSI] = core::f64::consts::FRAC_PI_2;
        let ned = body_to_ned(&x, &[1.0, 0.0, 0.2]);
        assert!((ned[0]).abs() < 1e-15 && (ned[1] - 1.0).abs() < 1e-15 && (ned[2] - 0.2).abs() < 1e-15);
        // the ship lies west, so a transducer ahead of the centre of gravity is further away
        let further = arm_along_path_m(&x, &[1.0, 0.0, 0.0], [0.0, -100.0], 0.0);
        assert!((further - 1.0).abs() < 1e-12, "{further}");
    }
}

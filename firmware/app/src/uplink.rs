//! The vehicle's part of the acoustic cycle: its state uplink and its pings, each in its slot.
//!
//! A cycle starts at whole multiples of its period since 1970. Nothing is sent without UTC, and nothing unless a period
//! is set. A data packet is commanded ahead of its second; the modem then asks for the frame, which leaves on its next
//! pulse.

use crate::consequences::SURE;
use crate::estimator::Estimator;
use crate::geodesy::LocalFrame;
use crate::held::Held;
use crate::inputs::installation::body_to_ned;
use crate::parameters::AppSettings;
use crate::time::UtcClock;
use backseat_core::navigation::naming::Statement;
use backseat_core::state::{PSI, U, V, W, X, Y, Z};
use backseat_wire::ellipse::Ellipse;
use backseat_wire::modem::{Addresses, Cycle, Data, DataRequest, Payload, ToModem};
use backseat_wire::named::{NONE_OF_THESE, Named};
use backseat_wire::vehicle_state::{AUTHENTIC_LENGTH, VehicleState};
use core::f64::consts::TAU;

/// No second of any cycle.
pub const NEVER: u8 = 255;
/// From the command of a cycle to the launch of its data, µs: its packet takes 0.9 s, a step 0.1 s each way.
const LEAD_US: u64 = 1_500_000;
/// A slot is missed if it could not begin within this of its time, µs.
const LATE_US: u64 = 300_000;
const SECOND_US: u64 = 1_000_000;

/// An uplink on its way out.
#[derive(Clone, Copy, Debug)]
struct Outgoing {
    transmit_s: u32,
}

/// What was sent in this cycle.
#[derive(Debug, Default)]
pub struct Uplink {
    /// The last slot that was begun or missed: uplink, ping; s since 1970.
    begun_s: [u64; 2],
    /// Frames that were sent: of two causes that are named they carry one each by turns.
    frames: u32,
    outgoing: Held<Outgoing>,
}

impl Uplink {
    pub const fn new() -> Self {
        Self { begun_s: [0; 2], frames: 0, outgoing: Held::none() }
    }

    /// The sentence whose time has come, if any.
    pub fn due<'b>(
        &mut self,
        now_us: u64,
        clock: &UtcClock,
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let utc_us = clock.utc_us(now_us).filter(|_| settings.cycle_period_s > 0)?;
        let (source, destination) = (settings.modem_address, settings.ship_address);
        let addresses = Addresses { source, destination };
        if let Some(transmit_s) = self.slot(0, settings.uplink_at_s, LEAD_US, utc_us, settings) {
            self.outgoing.set(Outgoing { transmit_s });
            return ToModem::Cycle(Cycle { addresses, rate: 0, acknowledge: false, frames: 1 }).emit(buffer).ok();
        }
        self.slot(1, settings.ping_at_s, 0, utc_us, settings)?;
        ToModem::Ping(addresses).emit(buffer).ok()
    }

    /// The second of a slot that begins now.
    fn slot(&mut self, which: usize, at_s: u8, lead_us: u64, utc_us: u64, settings: &AppSettings) -> Option<u32> {
        let period_s = u64::from(settings.cycle_period_s);
        if at_s == NEVER || u64::from(at_s) >= period_s {
            return None;
        }
        // the last launch that could have begun by now
        let latest_s = utc_us.saturating_add(lead_us) / SECOND_US;
        let launch_s = latest_s.checked_sub((latest_s + period_s - u64::from(at_s)) % period_s)?;
        let begun_s = self.begun_s.get_mut(which)?;
        if launch_s <= *begun_s {
            return None;
        }
        *begun_s = launch_s;
        let begins_us = (launch_s * SECOND_US).saturating_sub(lead_us);
        (utc_us <= begins_us + LATE_US).then_some(u32::try_from(launch_s).ok()?)
    }

    /// The frame that the modem asks for, if it leaves at the second of its slot.
    pub fn answer<'b>(
        &mut self,
        request: &DataRequest,
        now_us: u64,
        (clock, synchronous, mode): (&UtcClock, bool, u8),
        estimator: &Estimator,
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let Outgoing { transmit_s } = *self.outgoing.get()?;
        self.outgoing.clear();
        let slot_us = u64::from(transmit_s) * SECOND_US;
        let leaves_s = request.time.nearest(slot_us) / SECOND_US + 1;
        if request.addresses.source != settings.modem_address || leaves_s != u64::from(transmit_s) {
            return None;
        }
        let ahead_us = slot_us.checked_sub(clock.utc_us(now_us)?)?;
        self.frames = self.frames.wrapping_add(1);
        let state = self.state(transmit_s, ahead_us as f64 * 1e-6, synchronous, mode, estimator, settings)?;
        let mut payload = [0; AUTHENTIC_LENGTH];
        let payload = state.emit(&settings.acoustic_key, &mut payload).ok()?;
        let addresses = request.addresses;
        ToModem::Data(Data { addresses, acknowledge: false, payload: Payload::new(payload) }).emit(buffer).ok()
    }

    /// The transducer in `ahead_s`; `None` while the filter does not run.
    fn state(
        &self,
        transmit_s: u32,
        ahead_s: f64,
        synchronous: bool,
        mode: u8,
        estimator: &Estimator,
        settings: &AppSettings,
    ) -> Option<VehicleState> {
        let navigator = estimator.navigator();
        if !navigator.is_initialised() {
            return None;
        }
        let x = &estimator.output;
        let water = body_to_ned(x, &[x[U], x[V], x[W]]);
        let [north, east] = navigator.current();
        let velocity_mps = [water[0] + north, water[1] + east];
        let arm = body_to_ned(x, &settings.installation.transducer_arm_m);
        let position_m = [x[X] + arm[0] + velocity_mps[0] * ahead_s, x[Y] + arm[1] + velocity_mps[1] * ahead_s];
        let frame = LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg);
        let (latitude, longitude) = frame.to_geodetic(position_m);
        let root = |index: usize| libm::sqrt(navigator.variance(index));
        let (position_sigma_m, ellipse) =
            Ellipse::of([estimator.stated_variance(X), navigator.covariance(X, Y), estimator.stated_variance(Y)]);
        Some(VehicleState {
            source: settings.modem_address,
            transmit_s,
            position_deg: [latitude, longitude],
            velocity_mps,
            depth_m: (x[Z] + arm[2]).max(0.0),
            position_sigma_m,
            ellipse,
            leans: navigator.leans(),
            velocity_sigma_mps: root(U).max(root(V)),
            heading_rad: x[PSI] - libm::floor(x[PSI] / TAU) * TAU,
            level_m: estimator.level().map_or([None; 2], |level| [level.horizontal_m, level.vertical_m].map(bounded)),
            mode,
            synchronous,
            named: estimator.naming().statement().map_or(Named::NOTHING, |told| named(&told, self.frames)),
        })
    }
}

/// What the frame of this number tells of a statement.
fn named(statement: &Statement, frame: u32) -> Named {
    let [first, second] = &statement.named;
    if statement.unexplained {
        let nearest = first.map_or(Named::NOTHING, |nearest| coarse(&nearest));
        return Named { cause: NONE_OF_THESE, rival: nearest.cause, is_sure: false, ..nearest };
    }
    match (first, second) {
        (Some(_), Some(second)) if frame.is_multiple_of(2) => Named { beside: true, ..coarse(second) },
        (Some(first), _) => coarse(first),
        (None, _) => Named::NOTHING,
    }
}

fn coarse(named: &backseat_core::navigation::naming::Named) -> Named {
    Named {
        cause: named.cause.number(),
        rival: named.rival.map_or(0, |rival| rival.number()),
        beside: false,
        is_sure: named.probability >= SURE,
        size: named.cause.steps(named.size),
    }
}

/// A level that bounds anything.
fn bounded(level_m: f64) -> Option<f64> {
    Some(level_m).filter(|level_m| level_m.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    /// 12:00:00 UTC of a day, a multiple of 30 s.
    const NOON_US: u64 = 1_748_952_000 * SECOND_US;

    fn sent(settings: &AppSettings, seconds: u64) -> Vec<(u64, String)> {
        let clock = UtcClock::synchronised(0, NOON_US);
        let mut uplink = Uplink::new();
        let mut sent = Vec::new();
        for step in 1..seconds * 10 {
            let mut buffer = [0; 96];
            if let Some(bytes) = uplink.due(step * 100_000, &clock, settings, &mut buffer) {
                sent.push((step, core::str::from_utf8(bytes).unwrap().split('*').next().unwrap().to_string()));
            }
        }
        sent
    }

    #[test]
    fn each_slot_begins_once_a_cycle_at_its_time() {
        let settings = AppSettings { cycle_period_s: 30, uplink_at_s: 0, ping_at_s: 20, ..AppSettings::DEFAULT };
        let ping = "$CCMPC,2,1";
        let cycle = "$CCCYC,0,2,1,0,0,1";
        // tenths of a second: pings at 20 and 50 s, cycles 1.5 s before 30 and 60 s
        let expected = [(200, ping), (285, cycle), (500, ping), (585, cycle)];
        assert_eq!(sent(&settings, 61), expected.map(|(step, text)| (step, text.to_string())));
        assert!(sent(&AppSettings::DEFAULT, 100).is_empty(), "off unless it is set");
        let off = AppSettings { uplink_at_s: NEVER, ping_at_s: 40, ..settings };
        assert!(sent(&off, 100).is_empty(), "a second outside the cycle is none");
    }

    #[test]
    fn two_causes_are_told_by_turns_and_none_of_these_with_the_nearest() {
        use backseat_core::navigation::naming::{Cause, Named as Own};
        let own = |cause, size, probability, rival| {
            Some(Own { cause, size: [size, 0.0], sigma: [0.1; 2], since_us: 1, probability, rival })
        };
        let first = own(Cause::FinLost(1), 0.5, 0.95, None);
        let second = own(Cause::ThrustLost, 0.15, 0.6, Some(Cause::DragGrown));
        let both = Statement { time_us: 1, named: [first, second], unexplained: false };
        let fin = Named { cause: 2, rival: 0, beside: false, is_sure: true, size: [26, 0] };
        let thrust = Named { cause: 13, rival: 15, beside: true, is_sure: false, size: [19, 0] };
        assert_eq!([1, 2, 3].map(|frame| named(&both, frame)), [fin, thrust, fin]);
        let alone = Statement { named: [first, None], ..both };
        assert_eq!([1, 2].map(|frame| named(&alone, frame)), [fin, fin]);
        let unknown = Statement { unexplained: true, ..alone };
        assert_eq!(named(&unknown, 2), Named { cause: NONE_OF_THESE, rival: 2, is_sure: false, ..fin });
        assert_eq!(named(&Statement { named: [None; 2], ..both }, 2), Named::NOTHING);
    }

    #[test]
    fn without_utc_nothing_is_sent() {
        let settings = AppSettings { cycle_period_s: 30, uplink_at_s: 0, ..AppSettings::DEFAULT };
        let mut buffer = [0; 96];
        assert!(
            (1..1000)
                .all(|step| { Uplink::new().due(step * 100_000, &UtcClock::new(), &settings, &mut buffer).is_none() })
        );
    }
}

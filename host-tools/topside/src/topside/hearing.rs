//! What arrives: uplinks with their times of flight, pings and their answers.

use super::{SECOND_US, Topside};
use crate::event::Event;
use crate::modem::Report;
use backseat_wire::modem::{PingReply, ReceptionStatistics};

impl Topside {
    pub(super) fn hear(&mut self, time_us: u64, report: &Report) {
        match report {
            Report::Asks(request) => self.answer(request),
            Report::Left(left_us) => self.left(*left_us),
            Report::Uplink(state) if self.config.vehicles.contains(&state.source) => {
                if self.uplink.is_some() {
                    self.take_uplink(None);
                }
                self.uplink = Some((time_us, *state));
                self.pair();
            }
            Report::Uplink(state) => self.note(Event::Refused { source: state.source, forged: false }),
            Report::Refused { source, forged } => self.note(Event::Refused { source: *source, forged: *forged }),
            Report::Arrived(statistics) => {
                self.arrival = Some((time_us, *statistics));
                self.pair();
            }
            Report::PingSent => {
                if let (Some((_, sent_us)), Some(utc_us)) = (&mut self.ping, self.clock.utc_us(time_us)) {
                    *sent_us = utc_us;
                }
            }
            Report::PingHeard { vehicle } => self.note(Event::PingHeard { vehicle: *vehicle }),
            Report::Minipacket { source, bits } => self.note(Event::Minipacket { source: *source, bits: *bits }),
            Report::PingReply(reply) => self.ping_answered(reply),
            Report::Restarted => {
                self.outgoing = None;
                self.note(Event::ModemRestarted);
            }
        }
    }

    /// Joins a vehicle's frame with the time of its arrival.
    fn pair(&mut self) {
        let (Some((_, state)), Some((_, statistics))) = (&self.uplink, &self.arrival) else { return };
        let launch_us = u64::from(state.transmit_s) * SECOND_US;
        let flight_us = statistics.arrival.unix_us(launch_us) as i64 - launch_us as i64;
        let longest_us = (self.config.range_max_m / self.config.sound_speed_mps * 1.0e6) as i64;
        // the cycle before it arrived earlier: not its time
        if !(-50_000..=longest_us).contains(&flight_us) {
            return;
        }
        let good = statistics.mode == ReceptionStatistics::GOOD;
        let synchronous = statistics.clock.is_synchronous(self.config.clock_encoding);
        self.arrival = None;
        self.take_uplink(Some(flight_us).filter(|_| good && synchronous));
    }

    /// A vehicle's report, with its time of flight if that is a range.
    pub(super) fn take_uplink(&mut self, flight_us: Option<i64>) {
        let (Some((_, state)), Some(frame)) = (self.uplink.take(), self.frame) else { return };
        let launch_us = u64::from(state.transmit_s) * SECOND_US;
        let [latitude, longitude] = state.position_deg;
        let position_m = frame.to_local(latitude, longitude);
        let delay_s = self.config.transducer_delay_s;
        let flight_us = flight_us.filter(|_| state.synchronous);
        let range_m = flight_us.map(|us| self.config.sound_speed_mps * (us as f64 * 1.0e-6 - delay_s));
        self.note(Event::Uplink { state, range_m });
        let ship = flight_us.and_then(|us| self.ship_at(launch_us.saturating_add_signed(us)));
        let Some(track) = self.tracks.iter_mut().find(|track| track.vehicle == state.source) else { return };
        let names_others = track.report_heard(&state, position_m);
        if let (Some(range_m), Some(ship)) = (range_m, ship) {
            let (sigma_m, depth_m) = (self.config.range_sigma_m, self.config.transducer_depth_m);
            let ranging = track.range_measured(launch_us, range_m, sigma_m, &ship, depth_m, false);
            self.note(Event::Range(ranging));
        }
        if names_others {
            self.note(Event::Named { vehicle: state.source, named: state.named });
        }
    }

    fn ping_answered(&mut self, reply: &PingReply) {
        let Some((vehicle, sent_us)) = self.ping.filter(|(vehicle, _)| *vehicle == reply.addresses.source) else {
            return;
        };
        self.ping = None;
        let Some(travel_s) = reply.travel_s.map(|travel| travel.to_f64()) else { return };
        let range_m = self.config.sound_speed_mps * (travel_s - self.config.transducer_delay_s);
        // The vehicle turned it round about now; the ship was at both ends of the round trip.
        let there_us = sent_us.saturating_add((travel_s * 1.0e6) as u64);
        let turnaround_us = (self.config.slots.airtime().turnaround_s * 0.5e6) as u64;
        let middle_us = there_us.saturating_add(turnaround_us);
        let Some(ship) = self.ship_at(middle_us) else { return };
        let (sigma_m, depth_m) = (self.config.range_sigma_m, self.config.transducer_depth_m);
        let Some(track) = self.tracks.iter_mut().find(|track| track.vehicle == vehicle) else { return };
        let ranging = track.range_measured(middle_us, range_m, sigma_m, &ship, depth_m, true);
        self.note(Event::Range(ranging));
    }
}

//! Sentences and frames that are right in form, whatever they say.

use arbitrary::Arbitrary;
use backseat_wire::Decimal;
use backseat_wire::ahrs::gx3;
use backseat_wire::calendar::DateTime;
use backseat_wire::gps::Rmc;
use backseat_wire::hostlink::{MAX_FRAME, Port, ToBoard, encode};
use backseat_wire::iver::{Compass, FromFrontseat, Units};
use backseat_wire::modem::{Addresses, ClockMode, FromModem, ModemTime, Payload, Received, ReceptionStatistics};
use backseat_wire::ship_state::{Key, ShipState};
use std::f64::consts::{FRAC_PI_2, PI};

/// The key that a host sets, who may be anybody while there is none.
pub(crate) const HOST_KEY: [u8; 16] = [7; 16];

/// What a device or a PC may say in good form; numbers are shares of their ranges.
#[derive(Arbitrary, Debug)]
pub(crate) enum FalseInput {
    /// A fix anywhere, near the mission or not, at any time.
    Fix { near: bool, at: [i16; 2], utc_s: u32 },
    /// Attitude and depth of the frontseat's compass.
    Compass { euler: [i16; 3], depth: i16 },
    /// Attitude and rates of the AHRS.
    Ahrs { euler: [i16; 3], rates: [i16; 3], ticks: u32 },
    /// A packet of the ship, from anywhere, sent at any time.
    Packet { at: [i16; 2], velocity: [i16; 2], sent_s: u32, flight_ms: u16, doppler: i16 },
    /// One parameter, anywhere in its range.
    Parameter { index: u16, value: u16 },
    /// A mission, or the end of one; fins moving; parameters kept, or unlocked; a key.
    Request { which: u8 },
}

fn share(value: i16, limit: f64) -> f64 {
    f64::from(value) / 32_768.0 * limit
}

fn place(near: bool, [north, east]: [i16; 2]) -> [f64; 2] {
    if near { [41.5 + share(north, 0.1), -70.7 + share(east, 0.1)] } else { [share(north, 90.0), share(east, 180.0)] }
}

fn utc(seconds: u32) -> DateTime {
    DateTime::from_unix_us(u64::from(seconds) * 1_000_000).expect("a date before 2400")
}

impl FalseInput {
    /// On which port, and the bytes.
    pub(crate) fn on_port(&self) -> (Port, Vec<u8>) {
        let units = Units::remote_helm(5);
        let buffer = &mut [0; MAX_FRAME];
        let frontseat = |said: FromFrontseat<'_>| {
            said.emit(&units, &mut [0; MAX_FRAME]).expect("within the sentence's ranges").to_vec()
        };
        match *self {
            Self::Fix { near, at, utc_s } => {
                let (speed_mps, course_rad) = (Some(0.5), Some(1.0));
                let (utc, position_deg) = (Some(utc(utc_s)), Some(place(near, at)));
                let fix = Rmc { utc, valid: true, position_deg, speed_mps, course_rad, variation_rad: None };
                (Port::Frontseat, frontseat(FromFrontseat::Rmc(fix)))
            }
            Self::Compass { euler: [roll, pitch, heading], depth } => {
                let compass = Compass {
                    heading_rad: share(heading, PI) + PI,
                    pitch_rad: share(pitch, FRAC_PI_2),
                    roll_rad: share(roll, PI),
                    temperature_degc: None,
                    depth_m: Some(share(depth, 1_000.0)),
                };
                (Port::Frontseat, frontseat(FromFrontseat::Compass(compass)))
            }
            Self::Ahrs { euler: [roll, pitch, yaw], rates, ticks } => {
                let euler = [share(roll, PI), share(pitch, FRAC_PI_2), share(yaw, PI)].map(|angle| angle as f32);
                let rates = rates.map(|rate| share(rate, 20.0) as f32);
                let reply = gx3::Reply::euler_rate(euler, rates, ticks);
                (Port::Ahrs, reply.emit(buffer).expect("room").to_vec())
            }
            Self::Packet { at, velocity, sent_s, flight_ms, doppler } => {
                let state = ShipState {
                    source: 1,
                    sequence: sent_s as u8,
                    transmit_s: sent_s,
                    position_deg: place(true, at),
                    velocity_mps: velocity.map(|speed| share(speed, 30.0)),
                    position_sigma_m: 1.0,
                    velocity_sigma_mps: 0.1,
                    transducer_depth_m: 2.0,
                };
                let mut frame = [0; 32];
                let payload = state.emit().expect("within its ranges");
                frame[..payload.len()].copy_from_slice(&payload);
                let addresses = Addresses { source: 1, destination: 2 };
                let payload = Payload::new(&frame);
                let arrival_us = u64::from(sent_s) * 1_000_000 + u64::from(flight_ms) * 1_000;
                let arrival = ModemTime::Full(DateTime::from_unix_us(arrival_us).expect("a date before 2400"));
                let statistics = ReceptionStatistics {
                    source: Some(1),
                    destination: Some(2),
                    doppler_mps: Decimal::from_f64(share(doppler, 10.0), 2).ok(),
                    // user clock, external pulse
                    ..ReceptionStatistics::complete(Some(8), ReceptionStatistics::GOOD, arrival, ClockMode(0b01110))
                };
                let said = [
                    FromModem::ReceiveBegins { psk: false },
                    FromModem::Received(Received { addresses, acknowledge: false, frame: 1, payload }),
                    FromModem::Statistics(statistics),
                ];
                let bytes = said.iter().flat_map(|sentence| sentence.emit(buffer).expect("room").to_vec()).collect();
                (Port::Modem, bytes)
            }
            Self::Parameter { index, value } => {
                let parameters = backseat_app::parameters::PARAMETERS;
                let parameter = &parameters[usize::from(index) % parameters.len()];
                let value = parameter.min + (parameter.max - parameter.min) * f64::from(value) / 65_535.0;
                let set = ToBoard::ParameterSet { name: parameter.name, value };
                let messages = [ToBoard::ParameterBegin, set, ToBoard::ParameterCommit];
                let bytes =
                    messages.iter().flat_map(|message| encode(message, buffer).expect("room").to_vec()).collect();
                (Port::Host, bytes)
            }
            Self::Request { which } => {
                let requests = [
                    ToBoard::MissionStart,
                    ToBoard::MissionStop,
                    ToBoard::FinWiggle,
                    ToBoard::ParameterStore,
                    ToBoard::Hello,
                    ToBoard::Unlock,
                    ToBoard::KeyBegin,
                    ToBoard::KeySet(Key::new(HOST_KEY)),
                    ToBoard::Helm { heading_rad: 2.0, depth_m: 3.0, speed_mps: 1.0 },
                    ToBoard::DropWeight { release: true },
                ];
                let request = &requests[usize::from(which) % requests.len()];
                (Port::Host, encode(request, buffer).expect("room").to_vec())
            }
        }
    }
}

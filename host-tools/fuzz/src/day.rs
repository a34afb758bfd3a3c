//! A lab's day: missions uploaded, started, stopped, flown among honest devices, or with a frontseat that lies.

use crate::false_inputs::FalseInput;
use crate::flight::{self, Board, Trial};
use arbitrary::{Arbitrary, Unstructured};
use backseat_wire::hostlink::{Port, ToBoard, Waypoint};
use backseat_wire::iver::{
    Acknowledge, Battery, FromFrontseat, FrontseatError, FrontseatMode, Power, ServoBytes, State,
};
use backseat_wire::nmea::MAX_SENTENCE;

/// What an operator does.
#[derive(Arbitrary, Debug)]
enum Act {
    /// A mission, its legs around the origin, and a fence of so many corners; the rest of the input has the numbers.
    Mission { legs: u8, corners: u8 },
    /// The mission is started.
    Start,
    /// It is stopped.
    Stop,
    /// A request of any kind, or a parameter.
    Ask(Ask),
    /// Devices and ship go on for so many seconds.
    Fly { seconds: u8 },
    /// One port is silent for so many seconds.
    Silent { port: u8, seconds: u8 },
}

#[derive(Arbitrary, Debug)]
enum Ask {
    Parameter { index: u16, value: u16 },
    Request { which: u8 },
}

/// What one input may cost, s.
const MOST_SECONDS: u32 = 60;

/// A lab's day: whatever an operator does in whatever order, commands stay within limits and rates, a stop ends the
/// mission within a second, and in the end the board flies the mission of the `app` target.
pub fn day(data: &[u8]) {
    let mut trial = Trial::new();
    let mut rest = Unstructured::new(data);
    let mut seconds = 0;
    while !rest.is_empty()
        && seconds < MOST_SECONDS
        && let Ok(act) = Act::arbitrary(&mut rest)
    {
        match act {
            Act::Mission { legs, corners } => upload(&mut trial.board, legs % 8, corners % 40, &mut rest),
            Act::Start => drop(trial.board.request(&ToBoard::MissionStart)),
            Act::Stop => {
                trial.board.request(&ToBoard::MissionStop).expect("a stop is never refused");
                seconds += 1;
                let telemetry = trial.second(|_, _, _| ());
                assert!(telemetry.leg.is_none(), "{telemetry:?}");
            }
            Act::Ask(ask) => {
                let input = match ask {
                    Ask::Parameter { index, value } => FalseInput::Parameter { index, value },
                    Ask::Request { which } => FalseInput::Request { which },
                };
                let (port, bytes) = input.on_port();
                trial.board.receive(port, &bytes);
                trial.board.drain();
            }
            Act::Fly { seconds: more } => {
                for _ in 0..more % 16 {
                    seconds += 1;
                    trial.second(|_, _, _| ());
                }
            }
            Act::Silent { port, seconds: more } => {
                let silent = Port::DEVICES[usize::from(port) % Port::DEVICES.len()];
                for _ in 0..more % 8 {
                    seconds += 1;
                    trial.second(|_, port, bytes| {
                        if port == silent {
                            bytes.clear();
                        }
                    });
                }
            }
        }
    }
    flight::fly(&mut trial.board);
}

/// Uploads a mission; refusals are answers as well.
fn upload(board: &mut Board, legs: u8, corners: u8, rest: &mut Unstructured<'_>) {
    let mut number = |limit: f64| f64::from(i16::arbitrary(rest).unwrap_or(0)) / 32_768.0 * limit;
    let _ = board.request(&ToBoard::MissionBegin { count: u16::from(legs) });
    for index in 0..u16::from(legs) {
        let [x_m, y_m, depth_m, speed_mps] = [number(300.0), number(300.0), number(20.0) + 5.0, number(2.0) + 1.0];
        let waypoint = Waypoint { x_m, y_m, depth_m, speed_mps };
        let _ = board.request(&ToBoard::MissionItem { index, waypoint });
    }
    for index in 0..corners {
        let corner_m = [number(2000.0), number(2000.0)];
        let _ = board.request(&ToBoard::FenceCorner { index, count: corners, corner_m });
    }
    let _ = board.request(&ToBoard::MissionCommit);
}

/// What a frontseat says that is not so.
#[derive(Arbitrary, Debug)]
enum Word {
    /// Nothing for a second.
    Silence,
    /// Any bytes.
    Bytes {
        length: u8,
    },
    /// A fix or a compass that is somewhere else.
    Fix {
        near: bool,
        at: [i16; 2],
        utc_s: u32,
    },
    Compass {
        euler: [i16; 3],
        depth: i16,
    },
    /// It takes commands or not, or says so of ones that were never sent.
    Answer {
        command: u8,
        accepted: bool,
        error: u8,
    },
    /// Its mode, error and echo.
    State {
        mode: u8,
        error: u8,
        fins: [u8; 4],
        motor: u8,
        altitude: u16,
    },
    /// Its battery and leak.
    Power {
        percent: u8,
        leak: bool,
    },
}

impl Word {
    fn bytes(&self, rest: &mut Unstructured<'_>) -> Vec<u8> {
        let emitted = |said: FromFrontseat<'_>| {
            said.emit(&flight::units(), &mut [0; MAX_SENTENCE]).map(<[u8]>::to_vec).unwrap_or_default()
        };
        match *self {
            Self::Silence => Vec::new(),
            Self::Bytes { length } => {
                rest.bytes(rest.len().min(usize::from(length))).map(<[u8]>::to_vec).unwrap_or_default()
            }
            Self::Fix { near, at, utc_s } => FalseInput::Fix { near, at, utc_s }.on_port().1,
            Self::Compass { euler, depth } => FalseInput::Compass { euler, depth }.on_port().1,
            Self::Answer { command, accepted, error } => {
                emitted(FromFrontseat::Acknowledge(Acknowledge { command: command % 16, accepted, error }))
            }
            Self::State { mode, error, fins, motor, altitude } => {
                let modes = [
                    FrontseatMode::Normal,
                    FrontseatMode::Stopped,
                    FrontseatMode::Parking,
                    FrontseatMode::ManualOverride,
                    FrontseatMode::Servo,
                ];
                let errors = [FrontseatError::None, FrontseatError::Leak, FrontseatError::DepthExceeded];
                emitted(FromFrontseat::State(State {
                    servo: ServoBytes { fins, motor },
                    mode: modes[usize::from(mode) % modes.len()],
                    next_waypoint: 1,
                    position_deg: [41.5, -70.7],
                    speed_mps: 1.0,
                    distance_to_next_m: 0.0,
                    error: errors[usize::from(error) % errors.len()],
                    altitude_m: Some(f64::from(altitude) / 256.0),
                    park_time_s: None,
                    declination_rad: None,
                    mission: "TEST",
                    remaining_time: "0",
                    heading_rad: 1.0,
                    depth_m: 3.0,
                }))
            }
            Self::Power { percent, leak } => emitted(FromFrontseat::Power(Power {
                percent: f64::from(percent % 101),
                remaining_wh: 600.0,
                power_w: 60.0,
                voltage_v: 25.0,
                current_a: -2.0,
                minutes: 600,
                battery: Battery::Discharging,
                leak,
            })),
        }
    }
}

/// A frontseat that lies under way, beside what it honestly says or instead of it: commands stay within limits and
/// rates, telemetry finite, and in the end the board flies.
pub fn frontseat(data: &[u8]) {
    let mut trial = Trial::new();
    trial.board.prepare();
    for _ in 0..6 {
        trial.second(|_, _, _| ());
    }
    let _ = trial.board.request(&ToBoard::MissionStart);
    let mut rest = Unstructured::new(data);
    for _ in 0..MOST_SECONDS {
        let Ok((instead, word)) = <(bool, Word)>::arbitrary(&mut rest) else { break };
        let said = word.bytes(&mut rest);
        trial.second(|tenth, port, bytes| {
            if port == Port::Frontseat {
                if instead {
                    bytes.clear();
                }
                if tenth == 5 {
                    bytes.extend_from_slice(&said);
                }
            }
        });
        if rest.is_empty() {
            break;
        }
    }
    flight::fly(&mut trial.board);
}

//! Bytes of a fixed voyage: ten seconds at the surface, then north at 1 m/s and 3 m deep, with every
//! sensor at 10 Hz and an acoustic packet every 20 s. The vehicle does not listen.

use backseat_app::{App, LocalFrame, STEP_US};
use backseat_wire::ahrs::gx3;
use backseat_wire::calendar::DateTime;
use backseat_wire::dvl::{Coordinates, DvlSample, pd0};
use backseat_wire::gps::Rmc;
use backseat_wire::hostlink::{self, Port, ToBoard, Waypoint};
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{Compass, FromFrontseat, FrontseatError, FrontseatMode, State, Units};
use backseat_wire::modem::{Addresses, ClockMode, FromModem, ModemTime, Payload, Received, ReceptionStatistics};
use backseat_wire::ship_state::ShipState;

/// UTC when the board starts, s: 2026-11-20 12:00:00.
const START_S: u64 = 1_795_176_000;
/// Steps at the surface.
const SURFACE_STEPS: u64 = 100;
/// Steps between two packets.
const PACKET_STEPS: u64 = 200;
/// The mission is started here, with navigation valid.
pub const START_STEP: u64 = 90;
/// A step with everything: all sensors, the frontseat's state, a packet that completes, and the identifier adapting,
/// which it does from a minute and some seconds on after the dive.
pub const WORST_STEP: u64 = PACKET_STEPS * 5 + 10;
const SHIP_M: [f64; 2] = [250.0, -150.0];
const ORIGIN: LocalFrame = LocalFrame::new(41.5, -70.7);
const SOUND_SPEED_MPS: f64 = 1500.0;

/// What the devices say in one step.
pub struct Frames {
    ports: [Buffer; 4],
}

struct Buffer {
    bytes: [u8; 1024],
    len: usize,
}

impl Buffer {
    /// Appends what `emit` writes; nothing when it does not fit.
    fn add<E>(&mut self, emit: impl FnOnce(&mut [u8]) -> Result<usize, E>) {
        let rest = self.bytes.get_mut(self.len..).unwrap_or_default();
        self.len += emit(rest).unwrap_or(0);
    }
}

impl Frames {
    pub const fn new() -> Self {
        Self { ports: [const { Buffer { bytes: [0; 1024], len: 0 } }; 4] }
    }

    pub fn port(&self, port: Port) -> &[u8] {
        self.ports.get(port as usize).and_then(|buffer| buffer.bytes.get(..buffer.len)).unwrap_or_default()
    }

    /// What the devices say in step `k`.
    pub fn prepare(&mut self, k: u64) {
        for buffer in &mut self.ports {
            buffer.len = 0;
        }
        let [frontseat, dvl, ahrs, modem] = &mut self.ports;
        let (north_m, depth_m, speed_mps) = pose(k);
        say_frontseat(frontseat, k, north_m, depth_m, speed_mps);
        let sample = DvlSample {
            bottom_mps: Some([speed_mps, 0.01, -0.02]),
            water_mps: Some([speed_mps, 0.0, 0.0]),
            altitude_m: Some(20.0),
            frame: Coordinates::Instrument,
            ..DvlSample::default()
        };
        dvl.add(|bytes| pd0::Ensemble::from_sample(&sample, k as u32, 0.0).emit(bytes).map(<[u8]>::len));
        let wiggle = if k.is_multiple_of(2) { 0.002 } else { -0.002 };
        let reply = gx3::Reply::euler_rate([wiggle, -wiggle, wiggle], [wiggle; 3], (k * 6_250) as u32);
        ahrs.add(|bytes| reply.emit(bytes).map(<[u8]>::len));
        say_modem(modem, k);
    }
}

/// North, depth (m) and speed (m/s) at the end of step `k`.
fn pose(k: u64) -> (f64, f64, f64) {
    let under_way_s = k.saturating_sub(SURFACE_STEPS) as f64 * 0.1;
    let speed_mps = if k < SURFACE_STEPS { 0.0 } else { 1.0 };
    (under_way_s, (0.1 * under_way_s).min(3.0), speed_mps)
}

fn date_time(board_us: u64) -> Option<DateTime> {
    DateTime::from_unix_us(START_S * 1_000_000 + board_us).ok()
}

fn say_frontseat(out: &mut Buffer, k: u64, north_m: f64, depth_m: f64, speed_mps: f64) {
    let units = Units::remote_helm(5);
    let compass = FromFrontseat::Compass(Compass {
        heading_rad: 0.0,
        pitch_rad: 0.0,
        roll_rad: 0.0,
        temperature_degc: Some(12.5),
        depth_m: Some(depth_m),
    });
    out.add(|bytes| compass.emit(&units, bytes).map(<[u8]>::len));
    if !k.is_multiple_of(10) {
        return;
    }
    let calibration = ServoCalibration::NOMINAL;
    let state = FromFrontseat::State(State {
        servo: calibration.bytes([0.0; 4], 100.0 * speed_mps),
        mode: FrontseatMode::Normal,
        next_waypoint: 1,
        position_deg: [41.5, -70.7],
        speed_mps,
        distance_to_next_m: 100.0,
        error: FrontseatError::None,
        altitude_m: Some(20.0),
        park_time_s: None,
        declination_rad: None,
        mission: "TEST",
        remaining_time: "0",
        heading_rad: 0.0,
        depth_m,
    });
    out.add(|bytes| state.emit(&units, bytes).map(<[u8]>::len));
    if k < SURFACE_STEPS {
        let (lat_deg, lon_deg) = ORIGIN.to_geodetic([north_m, 0.0]);
        let fix = FromFrontseat::Rmc(Rmc {
            utc: date_time(k * STEP_US),
            valid: true,
            position_deg: Some([lat_deg, lon_deg]),
            speed_mps: Some(speed_mps),
            course_rad: Some(0.0),
            variation_rad: None,
        });
        out.add(|bytes| fix.emit(&units, bytes).map(<[u8]>::len));
    }
}

/// A packet is announced at every 200th step, and delivered ten steps later.
fn say_modem(out: &mut Buffer, k: u64) {
    if k >= PACKET_STEPS && k.is_multiple_of(PACKET_STEPS) {
        out.add(|bytes| FromModem::ReceiveBegins { psk: false }.emit(bytes).map(<[u8]>::len));
    }
    let launch = k.saturating_sub(10);
    if launch < PACKET_STEPS || !launch.is_multiple_of(PACKET_STEPS) {
        return;
    }
    let (north_m, depth_m, _) = pose(launch);
    let d = [north_m - SHIP_M[0], -SHIP_M[1], depth_m - 2.0];
    let range_m = libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    let launch_us = launch * STEP_US;
    let (lat_deg, lon_deg) = ORIGIN.to_geodetic(SHIP_M);
    let ship = ShipState {
        source: 1,
        sequence: 0,
        transmit_s: (START_S + launch_us / 1_000_000) as u32,
        position_deg: [lat_deg, lon_deg],
        velocity_mps: [0.0, 0.0],
        position_sigma_m: 0.5,
        velocity_sigma_mps: 0.05,
        transducer_depth_m: 2.0,
    };
    let mut frame = [0; 32];
    if let Ok(payload) = ship.emit() {
        frame[..payload.len()].copy_from_slice(&payload);
    }
    let received = FromModem::Received(Received {
        addresses: Addresses { source: 1, destination: 2 },
        acknowledge: false,
        frame: 1,
        payload: Payload::new(&frame),
    });
    out.add(|bytes| received.emit(bytes).map(<[u8]>::len));
    let Some(arrival) = date_time(launch_us + (range_m / SOUND_SPEED_MPS * 1e6) as u64) else { return };
    let (time, clock) = (ModemTime::Full(arrival), ClockMode(3));
    let statistics = ReceptionStatistics::complete(Some(8), ReceptionStatistics::GOOD, time, clock);
    out.add(|bytes| FromModem::Statistics(statistics).emit(bytes).map(<[u8]>::len));
}

/// Takes what the app says on a port; how many bytes that is.
pub fn drain(app: &mut App, port: Port) -> usize {
    let mut sum = 0;
    while !app.transmit(port).is_empty() {
        let count = app.transmit(port).len();
        app.transmitted(port, count);
        sum += count;
    }
    sum
}

/// One request over the host link; its answer is dropped.
pub fn request(app: &mut App, message: &ToBoard<'_>) {
    let mut buffer = [0; hostlink::MAX_FRAME];
    if let Ok(frame) = hostlink::encode(message, &mut buffer) {
        app.receive(Port::Host, 0, frame);
    }
    drain(app, Port::Host);
}

/// A set of parameters by name.
pub fn set(app: &mut App, values: &[(&str, f64)]) {
    request(app, &ToBoard::ParameterBegin);
    for &(name, value) in values {
        request(app, &ToBoard::ParameterSet { name, value });
    }
    request(app, &ToBoard::ParameterCommit);
}

/// The mission: due north, then back.
pub fn start(app: &mut App) {
    let waypoints = [0.0, 400.0, 0.0].map(|x_m| Waypoint { x_m, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 });
    request(app, &ToBoard::MissionBegin { count: 3 });
    for (index, waypoint) in (0..).zip(waypoints) {
        request(app, &ToBoard::MissionItem { index, waypoint });
    }
    request(app, &ToBoard::MissionCommit);
    request(app, &ToBoard::MissionStart);
}

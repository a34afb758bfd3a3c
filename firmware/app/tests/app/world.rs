//! A small world at the other end of the device ports. Its vehicle is the filter's own model: what
//! is tested here is the app around the filter; the simulator has a truth of its own.

use crate::board::{Arrival, Board, Random};
use backseat_app::LocalFrame;
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, X, Y, Z, wrap_angle};
use backseat_wire::ahrs::gx3;
use backseat_wire::calendar::DateTime;
use backseat_wire::dvl::pd0::{Ensemble, MAX_ENSEMBLE};
use backseat_wire::dvl::{Coordinates, DvlSample};
use backseat_wire::gps::Rmc;
use backseat_wire::hostlink::{Port, Telemetry};
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{
    Acknowledge, Battery, Compass, FromFrontseat, FrontseatError, FrontseatMode, Power, ServoBytes, State, Steer,
    ToFrontseat, Units,
};
use backseat_wire::modem::{
    Addresses, ClockMode, Cycle, FromModem, ModemTime, Payload, Received, ReceptionStatistics, Revision, ToModem,
};
use backseat_wire::nmea::{Checksum, Framer, MAX_SENTENCE};
use backseat_wire::ship_state::{Key, ShipState};
use std::cell::Cell;

pub const STEP_US: u64 = 100_000;
/// 2026-11-20 12:00:00 UTC.
pub const START_S: u64 = 1_795_176_000;
/// UTC seconds begin this long after the board's.
pub const PHASE_US: u64 = 250_000;
pub const SOUND_SPEED_MPS: f64 = 1500.0;
pub const UNITS: Units = Units::remote_helm(5);
const TRANSDUCER_DEPTH_M: f64 = 2.0;
/// Mass in heave, added mass included, kg.
const HEAVE_KG: f64 = 74.0;

pub struct World {
    pub x: VehicleState,
    /// Of the ship's packets.
    pub key: Key,
    pub ship_m: [f64; 2],
    /// Ports that say nothing.
    pub silent: [bool; 4],
    /// The frontseat's mode; it refuses commands when the mode does.
    pub mode: FrontseatMode,
    pub last_servo: ServoBytes,
    pub last_steer: Option<Steer>,
    pub servos: u32,
    pub stops: u32,
    pub settings: Vec<String>,
    /// A DVL with bottom lock is fitted.
    pub dvl: bool,
    /// Depth of the bottom, for the DVL and the frontseat's altimeter; NaN: out of sight.
    pub bottom_m: f64,
    /// The pressure sensor is off by so much, m.
    pub depth_error_m: f64,
    /// What it says is a multiple of depth.
    pub depth_factor: f64,
    /// What the frontseat says of its power.
    pub charge_percent: f64,
    pub leak: bool,
    /// Pulse edges reach the board.
    pub pps: bool,
    /// Weight of water in the hull, N.
    pub flooding_n: f64,
    pub model: VehicleModel,
    pub input: ActuatorInput,
    now_us: u64,
    random: Random,
    from_backseat: Framer,
    from_backseat_modem: Framer,
    /// Transmit second of the packet under way.
    flying_s: Option<u64>,
    agenda: Vec<Arrival>,
}

thread_local! {
    /// Board time from which on UTC is a second behind what it would be without its leap second, µs.
    pub static LEAP_SECOND_US: Cell<u64> = const { Cell::new(u64::MAX) };
}

pub fn date_time(board_us: u64) -> DateTime {
    let inserted_us = if board_us >= LEAP_SECOND_US.get() { 1_000_000 } else { 0 };
    DateTime::from_unix_us(START_S * 1_000_000 + board_us - PHASE_US - inserted_us).unwrap()
}

pub fn frontseat(message: &FromFrontseat<'_>) -> Vec<u8> {
    message.emit(&UNITS, &mut [0; MAX_SENTENCE]).unwrap().to_vec()
}

pub fn modem(message: &FromModem<'_>) -> Vec<u8> {
    message.emit(&mut [0; MAX_SENTENCE]).unwrap().to_vec()
}

pub fn frame() -> LocalFrame {
    LocalFrame::new(41.5, -70.7)
}

pub const SHIP_STATE: ShipState = ShipState {
    source: 1,
    sequence: 0,
    transmit_s: 0,
    position_deg: [0.0; 2],
    velocity_mps: [0.0; 2],
    position_sigma_m: 0.5,
    velocity_sigma_mps: 0.05,
    transducer_depth_m: TRANSDUCER_DEPTH_M,
};

pub fn ship_frame(ship_m: [f64; 2], transmit_s: u64) -> [u8; 32] {
    authentic_frame(ship_m, transmit_s, &Key::NONE)
}

fn authentic_frame(ship_m: [f64; 2], transmit_s: u64, key: &Key) -> [u8; 32] {
    let (lat_deg, lon_deg) = frame().to_geodetic(ship_m);
    let state = ShipState { transmit_s: transmit_s as u32, position_deg: [lat_deg, lon_deg], ..SHIP_STATE };
    let mut bytes = [0; 32];
    bytes[..24].copy_from_slice(&state.emit().unwrap());
    if key.is_set() {
        bytes[..28].copy_from_slice(&state.emit_authentic(key).unwrap());
    }
    bytes
}

pub fn received(frame: &[u8]) -> Vec<u8> {
    let addresses = Addresses { source: 1, destination: 2 };
    modem(&FromModem::Received(Received { addresses, acknowledge: false, frame: 1, payload: Payload::new(frame) }))
}

pub fn statistics(toa_us: u64, clock: ClockMode) -> Vec<u8> {
    let time = ModemTime::Full(date_time(toa_us));
    modem(&FromModem::Statistics(ReceptionStatistics::complete(Some(8), ReceptionStatistics::GOOD, time, clock)))
}

/// Mean 0, variance 1, never an outlier: the sum of twelve uniform numbers.
fn noise(random: &mut Random) -> f64 {
    (0..12).map(|_| random.word() as f64 / u64::MAX as f64).sum::<f64>() - 6.0
}

impl World {
    pub fn new() -> Self {
        let mut x = VehicleState::zeros();
        (x[X], x[Y]) = (-30.0, 5.0);
        Self {
            x,
            key: Key::NONE,
            ship_m: [250.0, -150.0],
            silent: [false; 4],
            mode: FrontseatMode::Normal,
            last_servo: ServoBytes::NEUTRAL,
            last_steer: None,
            servos: 0,
            stops: 0,
            settings: Vec::new(),
            dvl: false,
            bottom_m: f64::NAN,
            depth_error_m: 0.0,
            depth_factor: 1.0,
            charge_percent: 90.0,
            leak: false,
            pps: true,
            flooding_n: 0.0,
            model: VehicleModel::new(&VehicleParameters::IVER3).unwrap(),
            input: ActuatorInput::default(),
            now_us: 0,
            random: Random(7),
            from_backseat: Framer::new(Checksum::Required),
            from_backseat_modem: Framer::new(Checksum::Required),
            flying_s: None,
            agenda: Vec::new(),
        }
    }

    /// Another 0.1 s: the world moves, its devices speak, the board answers.
    pub fn advance(&mut self, board: &mut dyn Board) {
        let from_us = self.now_us;
        self.now_us += STEP_US;
        self.move_vehicle();
        self.measure(from_us);
        self.track_bottom(from_us);
        self.sound(from_us);
        let mut arrivals: Vec<Arrival> = self.agenda.extract_if(.., |arrival| arrival.time_us <= self.now_us).collect();
        arrivals.retain(|arrival| !self.silent[arrival.port as usize]);
        arrivals.sort_by_key(|arrival| arrival.time_us);
        let edge_us = from_us / 1_000_000 * 1_000_000 + PHASE_US;
        let edges: &[u64] = if self.pps && from_us < edge_us && edge_us <= self.now_us { &[edge_us] } else { &[] };
        let [to_frontseat, _, _, to_modem] = board.step(self.now_us, edges, &arrivals);
        self.obey(&to_frontseat);
        self.note_settings(&to_modem);
    }

    /// Some seconds of it.
    pub fn run(&mut self, board: &mut dyn Board, seconds: u64) {
        for _ in 0..seconds * 1_000_000 / STEP_US {
            self.advance(board);
        }
    }

    pub fn say(&mut self, port: Port, time_us: u64, bytes: Vec<u8>) {
        self.agenda.push(Arrival { port, time_us, bytes });
    }

    /// Time passes without anything happening.
    pub fn leap(&mut self, us: u64) {
        self.now_us += us;
        self.agenda.clear();
    }

    /// Back at the surface, at rest and level.
    pub fn surface(&mut self) {
        let (x, y, heading) = (self.x[X], self.x[Y], self.x[PSI]);
        self.x = VehicleState::zeros();
        (self.x[X], self.x[Y], self.x[PSI]) = (x, y, heading);
    }

    /// Two midpoint steps; at the surface the hull leaves the water instead of rising.
    fn move_vehicle(&mut self) {
        for _ in 0..2 {
            let half = self.x + self.model.derivative(&self.x, &self.input) * 0.025;
            self.x += self.model.derivative(&half, &self.input) * 0.05;
            self.x[W] += self.flooding_n / HEAVE_KG * 0.05;
            if self.x[Z] < 0.0 {
                (self.x[Z], self.x[W]) = (0.0, self.x[W].max(0.0));
            }
        }
    }

    /// AHRS at 10 Hz, noise 0.3° and 0.2°/s.
    fn measure(&mut self, from_us: u64) {
        let mut noise = |sigma: f64| (sigma * noise(&mut self.random)) as f32;
        let euler = [PHI, THETA, PSI].map(|i| wrap_angle(self.x[i]) as f32 + noise(0.005));
        let rates = [P, Q, R].map(|i| self.x[i] as f32 + noise(0.0035));
        let ticks = (from_us / 16) as u32;
        let reply = gx3::Reply::euler_rate(euler, rates, ticks);
        let bytes = reply.emit(&mut [0; 64]).unwrap().to_vec();
        self.say(Port::Ahrs, self.now_us, bytes);
    }

    /// DVL at 5 Hz, at the centre of gravity, noise 1 cm/s.
    fn track_bottom(&mut self, from_us: u64) {
        if !self.dvl || !from_us.is_multiple_of(2 * STEP_US) {
            return;
        }
        let velocity_mps = [U, V, W].map(|i| self.x[i] + 0.01 * noise(&mut self.random));
        let sample = DvlSample {
            bottom_mps: Some(velocity_mps),
            altitude_m: self.altitude_m(),
            frame: Coordinates::Instrument,
            ..DvlSample::default()
        };
        let ensemble = Ensemble::from_sample(&sample, (from_us / STEP_US) as u32, 0.0);
        let bytes = ensemble.emit(&mut [0; MAX_ENSEMBLE]).unwrap().to_vec();
        self.say(Port::Dvl, self.now_us, bytes);
    }

    /// A downlink every 20 s, announced 50 ms after its arrival, delivered 4 s later; each is preceded
    /// by its cycle initialisation.
    fn sound(&mut self, from_us: u64) {
        let second = from_us.saturating_sub(PHASE_US) / 1_000_000;
        let begins = from_us > PHASE_US && (from_us - PHASE_US) % 1_000_000 < STEP_US;
        if begins && second % 20 == 14 {
            self.say(Port::Modem, self.now_us, modem(&FromModem::ReceiveBegins { psk: false }));
            let addresses = Addresses { source: 1, destination: 2 };
            let cycle = Cycle { addresses, rate: 0, acknowledge: false, frames: 1 };
            self.say(Port::Modem, self.now_us + 900_000, modem(&FromModem::Cycle(cycle)));
            self.say(Port::Modem, self.now_us + 910_000, statistics(self.now_us, ClockMode(3)));
        }
        if begins && second.is_multiple_of(20) {
            self.flying_s = Some(second);
        }
        let Some(launch_s) = self.flying_s else { return };
        let launch_us = launch_s * 1_000_000 + PHASE_US;
        let flight_us = (self.range_m() / SOUND_SPEED_MPS * 1e6) as u64;
        if launch_us + flight_us > self.now_us {
            return;
        }
        self.flying_s = None;
        let toa_us = launch_us + flight_us;
        self.say(Port::Modem, toa_us + 50_000, modem(&FromModem::ReceiveBegins { psk: false }));
        let frame = authentic_frame(self.ship_m, date_time(launch_us).unix_us() / 1_000_000, &self.key);
        self.say(Port::Modem, toa_us + 4_000_000, received(&frame));
        self.say(Port::Modem, toa_us + 4_050_000, statistics(toa_us, ClockMode(3)));
    }

    pub fn range_m(&self) -> f64 {
        let d = [self.x[X] - self.ship_m[0], self.x[Y] - self.ship_m[1], self.x[Z] - TRANSDUCER_DEPTH_M];
        libm::sqrt(d.iter().map(|d| d * d).sum())
    }

    /// Horizontal distance of an estimate from the truth, m.
    pub fn error_m(&self, record: &Telemetry) -> f64 {
        libm::hypot(record.state[X] - self.x[X], record.state[Y] - self.x[Y])
    }

    /// In [0, 2π).
    fn heading_rad(&self) -> f64 {
        let heading_rad = wrap_angle(self.x[PSI]);
        if heading_rad < 0.0 { heading_rad + std::f64::consts::TAU } else { heading_rad }
    }

    /// The frontseat answers.
    fn obey(&mut self, bytes: &[u8]) {
        let mut framer = std::mem::replace(&mut self.from_backseat, Framer::new(Checksum::Required));
        let mut rest = bytes;
        let soon_us = self.now_us + 20_000;
        while let Some(sentence) = framer.feed(&mut rest) {
            let accepts = self.mode.accepts_commands();
            let acknowledge = |command, accepted| {
                let error = if accepted { 0 } else { Acknowledge::SAFETY_RULE };
                frontseat(&FromFrontseat::Acknowledge(Acknowledge { command, accepted, error }))
            };
            match ToFrontseat::parse(&sentence.unwrap(), &UNITS).unwrap() {
                ToFrontseat::Request(request) => {
                    if request.compass {
                        let compass = self.compass();
                        self.say(Port::Frontseat, soon_us, compass);
                    }
                    if request.state {
                        let state = self.state();
                        self.say(Port::Frontseat, soon_us, state);
                    }
                    if request.power {
                        let power = self.power();
                        self.say(Port::Frontseat, soon_us, power);
                    }
                    if request.gps && self.x[Z] < 0.3 {
                        let fix = self.fix();
                        self.say(Port::Frontseat, fix.0, fix.1);
                    }
                }
                ToFrontseat::Servo(servo) => {
                    self.servos += 1;
                    if accepts {
                        self.last_servo = servo.servo;
                        let calibration = ServoCalibration::NOMINAL;
                        self.input = ActuatorInput {
                            propeller_radps: calibration.propeller_radps(&servo.servo),
                            fins_rad: calibration.fins_rad(&servo.servo),
                        };
                    }
                    self.say(Port::Frontseat, soon_us, acknowledge(Acknowledge::SERVO, accepts));
                }
                ToFrontseat::Steer(steer) => {
                    self.last_steer = Some(steer);
                    self.say(Port::Frontseat, soon_us, acknowledge(Acknowledge::STEER, accepts));
                }
                ToFrontseat::Stop => {
                    self.stops += 1;
                    self.input = ActuatorInput::default();
                    self.say(Port::Frontseat, soon_us, acknowledge(Acknowledge::STOP, true));
                }
                other => panic!("the backseat never sends {other:?}"),
            }
        }
        self.from_backseat = framer;
    }

    fn note_settings(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while let Some(sentence) = self.from_backseat_modem.feed(&mut rest) {
            match ToModem::parse(&sentence.unwrap()).unwrap() {
                ToModem::Configure(setting) => {
                    self.settings.push(format!("{} {}", setting.name, setting.value));
                    let bytes = modem(&FromModem::Setting(setting));
                    self.agenda.push(Arrival { port: Port::Modem, time_us: self.now_us + 50_000, bytes });
                }
                other => panic!("the backseat never sends {other:?}"),
            }
        }
    }

    /// The modem starts anew.
    pub fn reboot_modem(&mut self) {
        let time = date_time(self.now_us).time;
        let bytes = modem(&FromModem::Revision(Revision { time, identifier: "INIT", version: "2.0" }));
        self.say(Port::Modem, self.now_us + 10_000, bytes);
    }

    fn altitude_m(&self) -> Option<f64> {
        Some(self.bottom_m - self.x[Z]).filter(|altitude_m| !altitude_m.is_nan())
    }

    fn pressure_m(&mut self) -> f64 {
        (self.depth_factor * self.x[Z] + self.depth_error_m + 0.03 * noise(&mut self.random)).max(0.0)
    }

    fn power(&self) -> Vec<u8> {
        frontseat(&FromFrontseat::Power(Power {
            percent: self.charge_percent,
            remaining_wh: 600.0,
            power_w: 60.0,
            voltage_v: 25.0,
            current_a: -2.0,
            minutes: 600,
            battery: Battery::Discharging,
            leak: self.leak,
        }))
    }

    fn compass(&mut self) -> Vec<u8> {
        frontseat(&FromFrontseat::Compass(Compass {
            heading_rad: self.heading_rad(),
            pitch_rad: self.x[THETA],
            roll_rad: self.x[PHI],
            temperature_degc: None,
            depth_m: Some(self.pressure_m()),
        }))
    }

    fn state(&self) -> Vec<u8> {
        frontseat(&FromFrontseat::State(State {
            servo: self.last_servo,
            mode: self.mode,
            next_waypoint: 1,
            position_deg: [41.5, -70.7],
            speed_mps: self.x[U].max(0.0),
            distance_to_next_m: 0.0,
            error: FrontseatError::None,
            altitude_m: self.altitude_m(),
            park_time_s: None,
            declination_rad: None,
            mission: "TEST",
            remaining_time: "0",
            heading_rad: self.heading_rad(),
            depth_m: self.x[Z].max(0.0),
        }))
    }

    /// The fix of the last UTC second, sent 0.3 s after it (or at once, when that is past).
    fn fix(&mut self) -> (u64, Vec<u8>) {
        let second_us = (self.now_us.saturating_sub(PHASE_US)) / 1_000_000 * 1_000_000 + PHASE_US;
        let (lat_deg, lon_deg) =
            frame().to_geodetic([self.x[X] + 0.5 * noise(&mut self.random), self.x[Y] + 0.5 * noise(&mut self.random)]);
        let bytes = frontseat(&FromFrontseat::Rmc(Rmc {
            utc: Some(date_time(second_us)),
            valid: true,
            position_deg: Some([lat_deg, lon_deg]),
            speed_mps: Some(0.0),
            course_rad: Some(0.0),
            variation_rad: None,
        }));
        ((second_us + 300_000).max(self.now_us + 10_000), bytes)
    }
}

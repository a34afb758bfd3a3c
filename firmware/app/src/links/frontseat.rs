//! Frontseat port: compass and depth, state, GPS, acknowledgements; and the requests for them.

use crate::geodesy::LocalFrame;
use crate::inputs::{Latest, SensorSample, Stamp};
use crate::parameters::{AppSettings, AttitudeSource, DvlSource};
use crate::time::{UtcClock, micros};
use backseat_core::state::wrap_angle;
use backseat_wire::gps::Rmc;
use backseat_wire::iver::{
    Acknowledge, Compass, FromFrontseat, FrontseatError, FrontseatMode, Request, ServoBytes, ToFrontseat,
};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::{Counts, Error};

/// A fix labelled by a fine clock is believed when it is this much older than its sentence at most, µs.
const FIX_AGE_US: u64 = 3_000_000;
/// Power is asked for in a step without another request, unless none comes for this long, µs.
const POWER_WAIT_US: u64 = 2_000_000;

/// State of the frontseat as received.
pub struct FrontseatLink {
    framer: Framer,
    counts: Counts,
    pub status: Status,
    /// When compass, state and GPS are asked for next.
    due_us: [u64; 3],
    /// When power is.
    power_due_us: u64,
}

/// The frontseat's own reports: mode, refusals, acknowledgements, echo.
pub struct Status {
    /// Any good sentence.
    pub last_us: Option<u64>,
    mode: Option<FrontseatMode>,
    /// Commands are refused since then.
    pub refused_since_us: Option<u64>,
    /// `$OMSTOP` was last acknowledged.
    pub stop_acknowledged_us: Option<u64>,
    /// Fins and motor as the frontseat last echoed them, and when.
    pub echo: Option<(u64, ServoBytes)>,
    /// What it says of leaks: in its power sentence, and as the error of its state.
    leaks: [bool; 2],
    /// Its state names too little power as its error.
    flat: bool,
    charge_percent: Option<f64>,
    /// Of its altimeter or its DVL, over the bottom, and its arrival, µs.
    pub altitude_m: Latest<f64>,
    /// Horizontal dilution of precision of the last `$GPGGA`.
    pub hdop: Option<f64>,
}

impl FrontseatLink {
    pub const fn new() -> Self {
        Self {
            framer: Framer::new(Checksum::Required),
            counts: Counts::new(),
            status: Status {
                last_us: None,
                mode: None,
                refused_since_us: None,
                stop_acknowledged_us: None,
                echo: None,
                leaks: [false; 2],
                flat: false,
                charge_percent: None,
                altitude_m: None,
                hdop: None,
            },
            due_us: [0; 3],
            power_due_us: 0,
        }
    }

    /// Decodes what came in at `time_us`.
    pub fn receive(
        &mut self,
        time_us: u64,
        bytes: &[u8],
        settings: &AppSettings,
        clock: &mut UtcClock,
        sink: &mut impl FnMut(Stamp, SensorSample),
    ) {
        let mut rest = bytes;
        while let Some(outcome) = self.framer.feed(&mut rest) {
            let Ok(sentence) = outcome else { continue };
            let Ok(message) = self.counts.note(FromFrontseat::parse(&sentence, &settings.units)) else { continue };
            self.status.last_us = Some(time_us);
            match message {
                FromFrontseat::Compass(compass) => push_compass(time_us, &compass, settings, sink),
                FromFrontseat::Rmc(rmc) => push_fix(time_us, &rmc, settings, clock, sink),
                FromFrontseat::Dvl(dvl) => {
                    self.status.note_altitude(time_us, dvl.altitude_m);
                    if let (Some(velocity_mps), DvlSource::Frontseat) = (dvl.velocity_mps, settings.dvl_source) {
                        sink(Stamp::Arrival(time_us), SensorSample::BottomTrack { velocity_mps });
                    }
                }
                FromFrontseat::State(state) => {
                    self.status.mode = Some(state.mode);
                    self.status.echo = Some((time_us, state.servo));
                    self.status.note_acceptance(time_us, state.mode.accepts_commands());
                    self.status.note_altitude(time_us, state.altitude_m);
                    self.status.leaks[1] = state.error == FrontseatError::Leak;
                    self.status.flat = state.error == FrontseatError::MinimumPower;
                }
                FromFrontseat::Acknowledge(acknowledge) => self.status.acknowledge(time_us, &acknowledge),
                FromFrontseat::Power(power) => {
                    self.status.leaks[0] = power.leak;
                    self.status.charge_percent = Some(power.percent);
                }
                FromFrontseat::Gga(gga) => self.status.hdop = gga.hdop,
            }
        }
    }

    /// The request that is due, if any.
    pub fn request<'b>(
        &mut self,
        now_us: u64,
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Result<Option<&'b [u8]>, Error> {
        let rates_hz = [settings.compass_rate_hz, settings.status_rate_hz, settings.gps_rate_hz];
        let mut due = [false; 3];
        for ((due, next_us), rate_hz) in due.iter_mut().zip(&mut self.due_us).zip(rates_hz) {
            if rate_hz <= 0.0 || now_us < *next_us {
                continue;
            }
            *due = true;
            let period_us = micros(1.0 / rate_hz);
            // Keeps the mean rate; after a pause it starts from here.
            *next_us = next_us.saturating_add(period_us).max(now_us.saturating_sub(period_us));
        }
        let [compass, state, gps] = due;
        let other = compass || state || gps;
        let waited = now_us >= self.power_due_us.saturating_add(POWER_WAIT_US);
        let power = settings.power_rate_hz > 0.0 && now_us >= self.power_due_us && (!other || waited);
        if !(other || power) {
            return Ok(None);
        }
        if power {
            self.power_due_us = now_us.saturating_add(micros(1.0 / settings.power_rate_hz));
        }
        let dvl = compass && settings.dvl_source == DvlSource::Frontseat;
        let request = Request { gps, compass, state, power, dvl, ..Request::default() };
        ToFrontseat::Request(request).emit(&settings.units, buffer).map(Some)
    }

    /// Whether it reports water in the hull.
    pub fn leaks(&self) -> bool {
        self.status.leaks.contains(&true)
    }

    /// Charge of its battery, %; `None` while it has not said.
    pub fn charge_percent(&self) -> Option<f64> {
        if self.status.flat { Some(0.0) } else { self.status.charge_percent }
    }

    /// Starts counting refusals afresh.
    pub fn forget_refusal(&mut self) {
        self.status.refused_since_us = None;
    }

    /// Frames accepted and rejected by cause: the framer's, and beyond it.
    pub fn counts(&self) -> [&Counts; 2] {
        [self.framer.counts(), &self.counts]
    }
}

impl Status {
    fn acknowledge(&mut self, time_us: u64, acknowledge: &Acknowledge) {
        match acknowledge.command {
            Acknowledge::STOP if acknowledge.accepted => self.stop_acknowledged_us = Some(time_us),
            Acknowledge::SERVO | Acknowledge::STEER => {
                // A mode that takes no commands refuses whatever the acknowledgement says.
                let takes = self.mode.is_none_or(FrontseatMode::accepts_commands);
                self.note_acceptance(time_us, acknowledge.accepted && takes);
            }
            _ => {}
        }
    }

    /// An altimeter that sees no bottom says zero.
    fn note_altitude(&mut self, time_us: u64, altitude_m: Option<f64>) {
        if let Some(altitude_m) = altitude_m.filter(|m| *m > 0.0) {
            self.altitude_m = Some((time_us, altitude_m));
        }
    }

    fn note_acceptance(&mut self, time_us: u64, accepted: bool) {
        self.refused_since_us = if accepted { None } else { self.refused_since_us.or(Some(time_us)) };
    }
}

fn push_compass(time_us: u64, compass: &Compass, settings: &AppSettings, sink: &mut impl FnMut(Stamp, SensorSample)) {
    if let Some(depth_m) = compass.depth_m {
        sink(Stamp::Arrival(time_us), SensorSample::Depth { depth_m });
    }
    if settings.attitude_source == AttitudeSource::Frontseat {
        let heading_rad = wrap_angle(compass.heading_rad + settings.declination_rad);
        let euler_rad = [compass.roll_rad, compass.pitch_rad, heading_rad];
        sink(Stamp::Arrival(time_us), SensorSample::Attitude { euler_rad });
    }
}

fn push_fix(
    time_us: u64,
    rmc: &Rmc,
    settings: &AppSettings,
    clock: &mut UtcClock,
    sink: &mut impl FnMut(Stamp, SensorSample),
) {
    let Some(utc) = rmc.utc else { return };
    // An invalid fix may carry the receiver's free-running clock.
    if !rmc.valid {
        return;
    }
    clock.label(time_us, utc.unix_us(), micros(settings.installation.gnss_delay_s));
    let Some([lat_deg, lon_deg]) = rmc.position_deg else { return };
    let own_us = clock.local_us(utc.unix_us()).filter(|&us| clock.fine && us <= time_us && time_us - us <= FIX_AGE_US);
    let position_m = LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg).to_local(lat_deg, lon_deg);
    sink(own_us.map_or(Stamp::Arrival(time_us), Stamp::Own), SensorSample::Fix { position_m });
}

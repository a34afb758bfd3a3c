//! The device ports, as the board's own settings have them.

use backseat_app::parameters::{AhrsProtocol, AppSettings, AttitudeSource, DvlSource};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::wrap_angle;
use backseat_data::{Column, LogRow};
use backseat_wire::ahrs::{AhrsSample, gx3, mip, os5000::Os5000};
use backseat_wire::dvl::{DvlSample, pd0, pd4, pd6};
use backseat_wire::iver::FromFrontseat;
use backseat_wire::modem::{FromModem, ModemTime, ReceptionStatistics};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::ShipState;

/// Largest frame of any rate, bytes.
const MAX_FRAME: usize = 256;

/// When something was measured that came at `time_us`.
pub fn valid_us(time_us: u64, delay_s: f64) -> u64 {
    time_us.saturating_sub((delay_s * 1e6).round() as u64)
}

/// The DVL port.
pub struct Dvl {
    pd0: pd0::Decoder,
    pd4: pd4::Decoder,
    pd6: pd6::Decoder,
}

impl Dvl {
    pub fn new(settings: &AppSettings) -> Self {
        let pd6 = pd6::Decoder::new(settings.dvl_mounting_rad);
        Self { pd0: pd0::Decoder::new(), pd4: pd4::Decoder::new(), pd6 }
    }

    pub fn receive(&mut self, time_us: u64, mut bytes: &[u8], settings: &AppSettings, mut row: impl FnMut(LogRow)) {
        while let Some(sample) = self.next(&mut bytes, settings) {
            let Some(velocity_mps) = sample.and_then(|sample| sample.bottom_mps) else { continue };
            let mut measured = LogRow::new(valid_us(time_us, settings.installation.dvl_delay_s));
            measured.set_all(Column::DvlU, &velocity_mps);
            row(measured);
        }
    }

    /// The next frame; `None` in it when it is broken.
    fn next(&mut self, bytes: &mut &[u8], settings: &AppSettings) -> Option<Option<DvlSample>> {
        let mounting_rad = settings.dvl_mounting_rad;
        match settings.dvl_source {
            DvlSource::Pd0 => Some(self.pd0.feed(bytes)?.ok().map(|ensemble| ensemble.sample(mounting_rad))),
            DvlSource::Pd4 => Some(self.pd4.feed(bytes)?.ok().map(|record| record.sample(mounting_rad))),
            DvlSource::Pd6 => Some(self.pd6.feed(bytes)?.ok()),
            DvlSource::Frontseat => None,
        }
    }
}

/// The AHRS port.
pub struct Ahrs {
    gx3: gx3::Decoder,
    mip: mip::Decoder,
    os5000: Framer,
}

impl Ahrs {
    pub fn new() -> Self {
        Self { gx3: gx3::Decoder::new(), mip: mip::Decoder::new(), os5000: Framer::new(Checksum::Required) }
    }

    pub fn receive(&mut self, time_us: u64, mut bytes: &[u8], settings: &AppSettings, mut row: impl FnMut(LogRow)) {
        while let Some(sample) = self.next(&mut bytes, settings.ahrs_protocol) {
            let Some(sample) = sample else { continue };
            let mut measured = LogRow::new(valid_us(time_us, settings.installation.ahrs_delay_s));
            if let (Some(euler_rad), AttitudeSource::Ahrs) = (sample.euler_rad, settings.attitude_source) {
                measured.set_all(Column::Roll, &euler_rad);
                measured.set(Column::Heading, wrap_angle(euler_rad[2] + settings.declination_rad));
            }
            if let Some(rates_radps) = sample.rates_radps {
                measured.set_all(Column::P, &rates_radps);
            }
            row(measured);
        }
    }

    /// The next frame; `None` in it when it is broken, or no sample.
    fn next(&mut self, bytes: &mut &[u8], protocol: AhrsProtocol) -> Option<Option<AhrsSample>> {
        Some(match protocol {
            AhrsProtocol::Gx3 => match self.gx3.feed(bytes)? {
                Ok(gx3::FromGx3::Data(sample, _)) => Some(sample),
                _ => None,
            },
            AhrsProtocol::Mip => self.mip.feed(bytes)?.and_then(|packet| packet.sample()).ok().flatten(),
            AhrsProtocol::Os5000 => {
                let compass = self.os5000.feed(bytes)?.and_then(|sentence| Os5000::parse(&sentence));
                compass.ok().map(|compass| compass.sample())
            }
        })
    }
}

/// What the frontseat says.
#[expect(clippy::large_enum_variant, reason = "handed over one by one, never kept")]
pub enum FrontseatSaid {
    /// A measurement.
    Row(LogRow),
    /// Fins and motor as it drives them.
    Echo(ActuatorInput),
    /// A position, and the time of its own.
    Fix { utc_us: u64, position_deg: [f64; 2] },
}

/// The frontseat port.
pub struct Frontseat(Framer);

impl Frontseat {
    pub fn new() -> Self {
        Self(Framer::new(Checksum::Required))
    }

    pub fn receive(
        &mut self,
        time_us: u64,
        mut bytes: &[u8],
        settings: &AppSettings,
        mut say: impl FnMut(FrontseatSaid),
    ) {
        while let Some(sentence) = self.0.feed(&mut bytes) {
            match sentence.and_then(|sentence| FromFrontseat::parse(&sentence, &settings.units)) {
                Ok(FromFrontseat::Compass(compass)) => {
                    if let Some(depth_m) = compass.depth_m {
                        let mut row = LogRow::new(valid_us(time_us, settings.installation.depth_delay_s));
                        row.set(Column::Depth, depth_m);
                        say(FrontseatSaid::Row(row));
                    }
                    if settings.attitude_source == AttitudeSource::Frontseat {
                        let heading_rad = wrap_angle(compass.heading_rad + settings.declination_rad);
                        let mut row = LogRow::new(valid_us(time_us, settings.installation.ahrs_delay_s));
                        row.set_all(Column::Roll, &[compass.roll_rad, compass.pitch_rad, heading_rad]);
                        say(FrontseatSaid::Row(row));
                    }
                }
                Ok(FromFrontseat::Dvl(dvl)) if settings.dvl_source == DvlSource::Frontseat => {
                    if let Some(velocity_mps) = dvl.velocity_mps {
                        let mut row = LogRow::new(valid_us(time_us, settings.installation.dvl_delay_s));
                        row.set_all(Column::DvlU, &velocity_mps);
                        say(FrontseatSaid::Row(row));
                    }
                }
                Ok(FromFrontseat::State(state)) => say(FrontseatSaid::Echo(ActuatorInput {
                    propeller_radps: settings.servo.propeller_radps(&state.servo),
                    fins_rad: settings.servo.fins_rad(&state.servo),
                })),
                Ok(FromFrontseat::Rmc(rmc)) if rmc.valid => {
                    if let (Some(utc), Some(position_deg)) = (rmc.utc, rmc.position_deg) {
                        say(FrontseatSaid::Fix { utc_us: utc.unix_us(), position_deg });
                    }
                }
                _ => {}
            }
        }
    }
}

/// What the modem says about a packet.
pub enum ModemSaid {
    /// One begins.
    Begins,
    /// The ship's state in it.
    Ship(ShipState),
    /// Its statistics, good and synchronous: when it arrived, and its range rate.
    Arrival(ModemTime, Option<f64>),
    /// It is of no use.
    Bad,
}

/// The modem port.
pub struct Modem(Framer);

impl Modem {
    pub fn new() -> Self {
        Self(Framer::new(Checksum::Required))
    }

    pub fn receive(&mut self, mut bytes: &[u8], settings: &AppSettings, mut say: impl FnMut(ModemSaid)) {
        while let Some(sentence) = self.0.feed(&mut bytes) {
            match sentence.and_then(|sentence| FromModem::parse(&sentence)) {
                Ok(FromModem::ReceiveBegins { .. }) => say(ModemSaid::Begins),
                Ok(FromModem::Received(received)) if received.frame == 1 => {
                    let mut frame = [0; MAX_FRAME];
                    let ship = received.payload.copy_to(&mut frame).and_then(ShipState::parse);
                    say(ship.map_or(ModemSaid::Bad, ModemSaid::Ship));
                }
                Ok(FromModem::Statistics(statistics)) => {
                    let good = statistics.mode == ReceptionStatistics::GOOD
                        && statistics.clock.is_synchronous(settings.clock_encoding);
                    let sign = settings.doppler_sign;
                    let range_rate_mps = statistics.doppler_mps.map(|mps| sign.range_rate_mps(mps.to_f64()));
                    say(if good { ModemSaid::Arrival(statistics.arrival, range_rate_mps) } else { ModemSaid::Bad });
                }
                _ => {}
            }
        }
    }
}

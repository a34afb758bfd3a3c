//! Why nothing is sent: one reason at a time, the one to be mended first.

use core::fmt;

/// What keeps the ship from sending its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// Nothing arrives on the GNSS port.
    GnssSilent,
    /// Bytes arrive on the GNSS port, but no sentences.
    GnssNoise,
    /// The modem's sentences arrive on the GNSS port.
    GnssIsModem,
    /// Sentences arrive, but no `$GPRMC`, the only one with a date.
    GnssNoRmc,
    /// The receiver has no fix.
    GnssNoFix,
    /// The ship's position is too uncertain.
    ShipUncertain {
        /// One sigma, m.
        sigma_m: f64,
    },
    /// Nothing arrives on the modem port.
    ModemSilent,
    /// Bytes arrive on the modem port, but no sentences.
    ModemNoise,
    /// The GNSS receiver's sentences arrive on the modem port.
    ModemIsGnss,
    /// The modem has not confirmed its settings.
    ModemUnconfigured,
    /// The modem has not said what its clock runs on.
    ModemClockUnknown,
    /// The modem's clock was set by nobody.
    ModemClockUnset,
    /// The modem has no pulse per second.
    NoPulse,
    /// The modem's clock and the GNSS time differ.
    ClockDiffers {
        /// Modem less GNSS, s.
        by_s: i64,
    },
    /// A packet left at another time than it says.
    OffPulse {
        /// Late by, s.
        by_s: f64,
    },
}

impl Hold {
    /// One word for files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::GnssSilent => "gnss_silent",
            Self::GnssNoise => "gnss_noise",
            Self::GnssIsModem => "gnss_is_modem",
            Self::GnssNoRmc => "gnss_no_rmc",
            Self::GnssNoFix => "gnss_no_fix",
            Self::ShipUncertain { .. } => "ship_uncertain",
            Self::ModemSilent => "modem_silent",
            Self::ModemNoise => "modem_noise",
            Self::ModemIsGnss => "modem_is_gnss",
            Self::ModemUnconfigured => "modem_unconfigured",
            Self::ModemClockUnknown => "modem_clock_unknown",
            Self::ModemClockUnset => "modem_clock_unset",
            Self::NoPulse => "no_pulse",
            Self::ClockDiffers { .. } => "clock_differs",
            Self::OffPulse { .. } => "off_pulse",
        }
    }

    /// Whether pings, which need no common clock, are sent all the same.
    #[must_use]
    pub const fn permits_pings(&self) -> bool {
        !matches!(
            self,
            Self::ModemSilent | Self::ModemNoise | Self::ModemIsGnss | Self::GnssIsModem | Self::ModemUnconfigured
        )
    }
}

impl fmt::Display for Hold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GnssSilent => f.write_str("GNSS port: nothing arrives; check its cable and its path"),
            Self::GnssNoise => f.write_str("GNSS port: bytes but no NMEA sentences; check its baud rate"),
            Self::GnssIsModem => f.write_str("GNSS port: a modem's sentences ($CA...); are the two ports swapped?"),
            Self::GnssNoRmc => f.write_str("GNSS port: sentences but no RMC, which has the date; switch RMC on in the receiver"),
            Self::GnssNoFix => f.write_str("GNSS: no fix; check the antenna"),
            Self::ShipUncertain { sigma_m } => write!(f, "the ship's position is known to {sigma_m:.0} m only; waiting for GNSS"),
            Self::ModemSilent => f.write_str("modem port: nothing arrives; check its cable, its path and its power"),
            Self::ModemNoise => f.write_str("modem port: bytes but no sentences; check its baud rate (19200 from the factory)"),
            Self::ModemIsGnss => f.write_str("modem port: a GNSS receiver's sentences; are the two ports swapped?"),
            Self::ModemUnconfigured => f.write_str("modem: it has not confirmed SRC, SNV, CST, RXP, TXP and XST yet"),
            Self::ModemClockUnknown => f.write_str("modem: it has not said what its clock runs on ($CCTMQ) yet"),
            Self::ModemClockUnset => f.write_str("modem: its clock is not set; connect GNSS to it, or allow set_clock"),
            Self::NoPulse => f.write_str(
                "modem: no external pulse per second, so no range can be measured; connect the GNSS receiver's PPS to the modem",
            ),
            Self::ClockDiffers { by_s } => write!(f, "modem: its clock is {by_s} s ahead of GNSS; set it again"),
            Self::OffPulse { by_s } => write!(f, "modem: a packet left {by_s:.3} s after the second that it names; is SNV 1?"),
        }
    }
}

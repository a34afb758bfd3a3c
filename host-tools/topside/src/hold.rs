//! Why nothing is sent: one reason at a time, the one to be mended first.

/// What keeps the ship from sending its state.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Hold {
    /// Nothing arrives on the GNSS port.
    #[error("GNSS port: nothing arrives; check its cable and its path")]
    GnssSilent,
    /// Bytes arrive on the GNSS port, but no sentences.
    #[error("GNSS port: bytes but no NMEA sentences; check its baud rate")]
    GnssNoise,
    /// The modem's sentences arrive on the GNSS port.
    #[error("GNSS port: a modem's sentences ($CA...); are the two ports swapped?")]
    GnssIsModem,
    /// Sentences arrive, but no `$GPRMC`, the only one with a date.
    #[error("GNSS port: sentences but no RMC, which has the date; switch RMC on in the receiver")]
    GnssNoRmc,
    /// The receiver has no fix.
    #[error("GNSS: no fix; check the antenna")]
    GnssNoFix,
    /// The ship's position is too uncertain.
    #[error("the ship's position is known to {sigma_m:.0} m only; waiting for GNSS")]
    ShipUncertain {
        /// One sigma, m.
        sigma_m: f64,
    },
    /// Nothing arrives on the modem port.
    #[error("modem port: nothing arrives; check its cable, its path and its power")]
    ModemSilent,
    /// Bytes arrive on the modem port, but no sentences.
    #[error("modem port: bytes but no sentences; check its baud rate (19200 from the factory)")]
    ModemNoise,
    /// The GNSS receiver's sentences arrive on the modem port.
    #[error("modem port: a GNSS receiver's sentences; are the two ports swapped?")]
    ModemIsGnss,
    /// The modem has not confirmed its settings.
    #[error("modem: it has not confirmed SRC, SNV, CST, RXP, TXP and XST yet")]
    ModemUnconfigured,
    /// The modem has not said what its clock runs on.
    #[error("modem: it has not said what its clock runs on ($CCTMQ) yet")]
    ModemClockUnknown,
    /// The modem's clock was set by nobody.
    #[error("modem: its clock is not set; connect GNSS to it, or allow set_clock")]
    ModemClockUnset,
    /// The modem has no pulse per second.
    #[error(
        "modem: no external pulse per second, so no range can be measured; connect the GNSS receiver's PPS to the modem"
    )]
    NoPulse,
    /// The modem's clock and the GNSS time differ.
    #[error("modem: its clock is {by_s} s ahead of GNSS; set it again")]
    ClockDiffers {
        /// Modem less GNSS, s.
        by_s: i64,
    },
    /// A packet left at another time than it says.
    #[error("modem: a packet left {by_s:.3} s after the second that it names; is SNV 1?")]
    OffPulse {
        /// Late by, s.
        by_s: f64,
    },
}

impl Hold {
    /// One word for files.
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
    pub const fn permits_pings(&self) -> bool {
        !matches!(
            self,
            Self::ModemSilent | Self::ModemNoise | Self::ModemIsGnss | Self::GnssIsModem | Self::ModemUnconfigured
        )
    }
}

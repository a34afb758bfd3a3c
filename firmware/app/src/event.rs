//! What the decoders hand to the estimator: measurements and acoustic events, in SI units.

use backseat_wire::modem::ModemTime;
use backseat_wire::ship_state::ShipState;

/// Something that is valid at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Depth of the pressure sensor, m.
    Depth { depth_m: f64 },
    /// Roll, pitch, true heading, rad.
    Attitude { euler_rad: [f64; 3] },
    /// p, q, r, rad/s.
    Rates { rates_radps: [f64; 3] },
    /// DVL velocity over ground at the instrument, body axes, m/s.
    BottomTrack { velocity_mps: [f64; 3] },
    /// DVL velocity through the water at the instrument, body axes, m/s.
    WaterTrack { velocity_mps: [f64; 3] },
    /// Position of the antenna, north and east, m.
    Fix { position_m: [f64; 2] },
    /// From the modem.
    Acoustic(AcousticEvent),
}

/// What the modem says about packets, one sentence each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AcousticEvent {
    /// `$CARXP`: a packet begins to arrive.
    Begins,
    /// `$CACYC`: the packet was a cycle initialisation, without data.
    Cycle,
    /// `$CARXD` with a good ship state.
    Ship(ShipState),
    /// `$CARXD` with anything else, or `$CAMSG,BAD_CRC`.
    BadData,
    /// `$CACST`.
    Statistics {
        /// The packet was good.
        good: bool,
        /// Clock and pulse were external.
        synchronous: bool,
        /// Time of arrival by the modem's clock.
        arrival: ModemTime,
        /// Range rate from the Doppler, positive opening, m/s.
        range_rate_mps: Option<f64>,
    },
}

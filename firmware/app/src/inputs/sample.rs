//! Output of the links: samples in SI units, in the axes of their sensors.

use backseat_wire::modem::ModemTime;
use backseat_wire::ship_state::ShipState;

/// Time stamp of a sample, µs of the board's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stamp {
    /// Arrival of its last byte; the declared delay of the sensor has still to be subtracted.
    Arrival(u64),
    /// Time of validity as given by the device.
    Own(u64),
}

/// One sample of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorSample {
    /// Depth of the pressure sensor.
    Depth {
        /// Down, m.
        depth_m: f64,
    },
    /// Attitude.
    Attitude {
        /// Roll, pitch, true heading, rad.
        euler_rad: [f64; 3],
    },
    /// Angular velocity.
    Rates {
        /// p, q, r, rad/s.
        rates_radps: [f64; 3],
    },
    /// DVL velocity over ground at the instrument.
    BottomTrack {
        /// Along the instrument's axes, m/s.
        velocity_mps: [f64; 3],
    },
    /// DVL velocity through the water at the instrument.
    WaterTrack {
        /// Along the instrument's axes, m/s.
        velocity_mps: [f64; 3],
    },
    /// Position of the vehicle's GNSS antenna.
    Fix {
        /// North and east, m.
        position_m: [f64; 2],
    },
    /// From the modem.
    Acoustic(AcousticReport),
}

/// What a packet of another vehicle says that is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeardVehicle {
    /// Its modem address.
    pub source: u8,
    /// Time of launch, s since 1970 UTC.
    pub transmit_s: u32,
    /// It left on a pulse by a clock that is set.
    pub synchronous: bool,
    /// Latitude and longitude, degrees.
    pub position_deg: [f64; 2],
    /// Depth of its transducer, m.
    pub depth_m: f64,
    /// Variance of the position north, covariance, variance east, m².
    pub covariance_m2: [f64; 3],
    /// That position leans on other vehicles.
    pub leans: bool,
}

/// Reports of the modem about packets, one sentence each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AcousticReport {
    /// `$CARXP`: a packet begins to arrive.
    Begins,
    /// `$CACYC`: the packet was a cycle initialisation, without data.
    Cycle,
    /// `$CARXD` with a good ship state.
    Ship(ShipState),
    /// `$CARXD` with the good state of another vehicle.
    Vehicle(HeardVehicle),
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
    /// `$CAMPC`: our own ping leaves.
    PingSent,
    /// `$CAMPR`: the ship has answered it.
    PingReply {
        /// One-way travel time of the round trip, s; `None` when it was missed.
        travel_s: Option<f64>,
    },
}

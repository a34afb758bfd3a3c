//! Sentences of the ship's GNSS receiver.

use backseat_wire::Error;
use backseat_wire::gps::{Gga, Gst, Hdt, Rmc};
use backseat_wire::nmea::{Checksum, Framer};

/// Accuracy and heading older than this are not used, µs.
const FRESH_US: u64 = 3_000_000;

/// A fix with its date.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fix {
    /// UTC, µs since 1970.
    pub utc_us: u64,
    /// Latitude and longitude, degrees; `None` while the receiver has no fix.
    pub position_deg: Option<[f64; 2]>,
    /// One sigma north and east, m, if the receiver says it.
    pub sigma_m: Option<[f64; 2]>,
    /// Over ground, north and east, m/s.
    pub velocity_mps: Option<[f64; 2]>,
}

/// What came in on a port, to tell a wrong device from a dead one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Traffic {
    /// The last byte, caller's time, µs.
    pub byte_us: Option<u64>,
    /// The last good sentence of any kind.
    pub sentence_us: Option<u64>,
    /// The last sentence of the other port's device.
    pub stranger_us: Option<u64>,
}

/// The receiver.
pub(crate) struct GnssLink {
    framer: Framer,
    pub traffic: Traffic,
    /// The last `$GPRMC`, with or without a fix.
    pub rmc_us: Option<u64>,
    accuracy: Option<(u64, [f64; 2])>,
    heading: Option<(u64, f64)>,
    /// Of the last `$GPGGA`.
    pub quality: Option<u8>,
    pub satellites: u8,
}

impl GnssLink {
    pub const fn new() -> Self {
        Self {
            framer: Framer::new(Checksum::Required),
            traffic: Traffic { byte_us: None, sentence_us: None, stranger_us: None },
            rmc_us: None,
            accuracy: None,
            heading: None,
            quality: None,
            satellites: 0,
        }
    }

    /// Decodes what came in at `time_us`; each `$GPRMC` with a date goes to `sink`.
    pub fn receive(&mut self, time_us: u64, bytes: &[u8], sink: &mut impl FnMut(Fix)) {
        if !bytes.is_empty() {
            self.traffic.byte_us = Some(time_us);
        }
        let mut rest = bytes;
        while let Some(outcome) = self.framer.feed(&mut rest) {
            let Ok(sentence) = outcome else { continue };
            self.traffic.sentence_us = Some(time_us);
            if is_modems(sentence.id()) {
                self.traffic.stranger_us = Some(time_us);
                continue;
            }
            if let Ok(gst) = Gst::parse(&sentence) {
                self.accuracy = gst.sigma_m.map(|sigma_m| (time_us, sigma_m));
            } else if let Ok(hdt) = Hdt::parse(&sentence) {
                self.heading = hdt.heading_rad.map(|heading_rad| (time_us, heading_rad));
            } else if let Ok(gga) = Gga::parse(&sentence) {
                (self.quality, self.satellites) = (Some(gga.quality), gga.satellites);
            } else {
                match Rmc::parse(&sentence) {
                    Ok(rmc) => {
                        self.rmc_us = Some(time_us);
                        if let Some(utc) = rmc.utc {
                            let valid = rmc.valid && self.quality != Some(0);
                            let polar = rmc.speed_mps.zip(rmc.course_rad);
                            let velocity =
                                |(speed, course): (f64, f64)| [speed * libm::cos(course), speed * libm::sin(course)];
                            sink(Fix {
                                utc_us: utc.unix_us(),
                                position_deg: rmc.position_deg.filter(|_| valid),
                                sigma_m: fresh(self.accuracy, time_us),
                                velocity_mps: polar.filter(|_| valid).map(velocity),
                            });
                        }
                    }
                    // a receiver without a fix may leave the time out
                    Err(Error::Missing) => self.rmc_us = Some(time_us),
                    Err(_) => {}
                }
            }
        }
    }

    /// True heading, rad, if it is fresh.
    pub fn heading_rad(&self, now_us: u64) -> Option<f64> {
        fresh(self.heading, now_us)
    }
}

fn fresh<T: Copy>(held: Option<(u64, T)>, now_us: u64) -> Option<T> {
    held.filter(|(time_us, _)| now_us.saturating_sub(*time_us) <= FRESH_US).map(|(_, value)| value)
}

/// A Micro-Modem's sentence.
fn is_modems(id: &[u8]) -> bool {
    matches!(id, [b'C', b'A', _, _, _, ..] | [b'S', b'N', b'T', b'T', b'A'])
}

/// A GNSS receiver's sentence.
pub(crate) fn is_receivers(id: &[u8]) -> bool {
    matches!(id, [b'G', b'P' | b'N' | b'L' | b'A' | b'B', _, _, _])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn heard(link: &mut GnssLink, time_us: u64, text: &str) -> Vec<Fix> {
        let mut fixes = Vec::new();
        link.receive(time_us, text.as_bytes(), &mut |fix| fixes.push(fix));
        fixes
    }

    /// 123519 on 23 March 1994, 48°07.038' N 11°31.000' E, 22.4 kn along 84.4°: the example of every manual.
    #[test]
    fn val_a_fix_has_the_receivers_own_accuracy() {
        let mut link = GnssLink::new();
        let rmc = "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n";
        heard(&mut link, 0, "$GPGST,123519,,,,,5.8,5.6,*54\r\n");
        let fix = heard(&mut link, 100_000, rmc)[0];
        assert_eq!(fix.sigma_m, Some([5.8, 5.6]));
        let [latitude, longitude] = fix.position_deg.unwrap();
        assert!((latitude - 48.1173).abs() < 1e-9 && (longitude - 11.516_666_666_7).abs() < 1e-9);
        let [north, east] = fix.velocity_mps.unwrap();
        // 22.4 kn are 11.5236 m/s
        assert!((north - 11.5236 * 84.4_f64.to_radians().cos()).abs() < 1e-3);
        assert!((east - 11.5236 * 84.4_f64.to_radians().sin()).abs() < 1e-3);
        // of four seconds ago it is not
        assert_eq!(heard(&mut link, 4_100_000, rmc)[0].sigma_m, None);
        // a fix that $GPGGA calls none is none
        heard(&mut link, 4_200_000, "$GPGGA,123519,,,,,0,00,,,M,,M,,*6B\r\n");
        assert_eq!(heard(&mut link, 4_300_000, rmc)[0].position_deg, None);
    }

    #[test]
    fn a_modem_on_this_port_is_noticed() {
        let mut link = GnssLink::new();
        heard(&mut link, 5, "$CAREV,123456,AUV,2.0.35490*00\r\n$CADQF,234,1*55\r\n");
        assert!(link.traffic.byte_us == Some(5) && link.rmc_us.is_none());
        assert_eq!(link.traffic.stranger_us, Some(5), "{:?}", link.traffic);
    }
}

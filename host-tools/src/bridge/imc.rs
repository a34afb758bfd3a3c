//! IMC over UDP: who the vehicle is, that it lives, and where it believes to be
//! (Inter-Module Communication, LSTS; message numbers and fields of its XML, version 5.4).

use super::Place;
use super::counts::Counts;
use anyhow::Context;
use std::net::{SocketAddr, UdpSocket};

const SYNC: u16 = 0xFE54;
const ANNOUNCE: u16 = 151;
const HEARTBEAT: u16 = 150;
const ESTIMATED_STATE: u16 = 350;
/// Announce, `sys_type`: UUV.
const UUV: u8 = 2;
/// Neptus takes a system for lost after some seconds. With `--rate 1` each record is a beat, on a busy computer as well,
/// where they come 0.7 to 1.3 s apart.
const HEARTBEAT_S: f64 = 0.5;
const ANNOUNCE_S: f64 = 10.0;

/// Sends to one address.
pub struct Sender {
    socket: UdpSocket,
    to: SocketAddr,
    name: String,
    id: u16,
    announced_s: f64,
    beaten_s: f64,
    pub counts: Counts,
}

impl Sender {
    /// A socket that never waits.
    pub fn open(to: SocketAddr, name: &str, id: u16) -> anyhow::Result<Self> {
        let any = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any).with_context(|| format!("{to}: no socket for IMC"))?;
        socket.set_nonblocking(true)?;
        let [announced_s, beaten_s] = [f64::NEG_INFINITY; 2];
        Ok(Self { socket, to, name: name.to_owned(), id, announced_s, beaten_s, counts: Counts::default() })
    }

    /// A record, and from time to time who sends it.
    pub fn send(&mut self, place: &Place<'_>) {
        let now_s = place.utc_s();
        if (now_s - self.announced_s).abs() >= ANNOUNCE_S {
            self.announced_s = now_s;
            self.put(place, ANNOUNCE, &announce(&self.name, place));
        }
        if (now_s - self.beaten_s).abs() >= HEARTBEAT_S {
            self.beaten_s = now_s;
            self.put(place, HEARTBEAT, &[]);
        }
        self.put(place, ESTIMATED_STATE, &estimated_state(place));
    }

    fn put(&self, place: &Place<'_>, message: u16, payload: &[u8]) {
        let sent = self.socket.send_to(&packet(place.utc_s(), self.id, message, payload), self.to);
        self.counts.note(sent.is_ok().then_some(place.arrived));
    }
}

/// Header, payload, footer; little-endian, as the synchronisation number says.
fn packet(utc_s: f64, source: u16, message: u16, payload: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(22 + payload.len());
    out.extend(SYNC.to_le_bytes());
    out.extend(message.to_le_bytes());
    out.extend((payload.len() as u16).to_le_bytes());
    out.extend(utc_s.to_le_bytes());
    out.extend(source.to_le_bytes());
    out.push(0xFF); // source entity: none
    out.extend(0xFFFF_u16.to_le_bytes()); // to all
    out.push(0xFF);
    out.extend_from_slice(payload);
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_ARC).checksum(&out);
    out.extend(crc.to_le_bytes());
    out
}

fn text(out: &mut Vec<u8>, text: &str) {
    let bytes = &text.as_bytes()[..text.len().min(usize::from(u16::MAX))];
    out.extend((bytes.len() as u16).to_le_bytes());
    out.extend_from_slice(bytes);
}

fn announce(name: &str, place: &Place<'_>) -> Vec<u8> {
    let mut out = Vec::new();
    text(&mut out, name);
    out.push(UUV);
    out.extend(0xFFFF_u16.to_le_bytes()); // owner: none
    place.position_deg.iter().for_each(|degrees| out.extend(degrees.to_radians().to_le_bytes()));
    out.extend((-place.telemetry.state[2] as f32).to_le_bytes());
    text(&mut out, ""); // services: none
    out
}

/// Offsets x, y, z from a geodetic reference at the surface, attitude, velocity through the water in the body's axes and
/// over ground in the world's, rates, depth, altitude.
fn estimated_state(place: &Place<'_>) -> Vec<u8> {
    let Place { telemetry, origin_deg, .. } = place;
    let [x, y, z, roll, pitch, heading, u, v, w, p, q, r] = telemetry.state;
    let [north, east] = telemetry.current_mps;
    let ned = nalgebra::Rotation3::from_euler_angles(roll, pitch, heading) * nalgebra::Vector3::new(u, v, w);
    let mut out = Vec::with_capacity(96);
    origin_deg.iter().for_each(|degrees| out.extend(degrees.to_radians().to_le_bytes()));
    let unknown_altitude = -1.0;
    let singles = [
        0.0,
        x,
        y,
        z,
        roll,
        pitch,
        heading,
        u,
        v,
        w,
        ned[0] + north,
        ned[1] + east,
        ned[2],
        p,
        q,
        r,
        z,
        unknown_altitude,
    ];
    singles.iter().for_each(|value| out.extend((*value as f32).to_le_bytes()));
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::{place, telemetry};
    use super::*;

    /// Offsets of EstimatedState's fields by IMC's XML; heading of 90 degrees, so that ahead is east.
    #[test]
    fn an_estimated_state_has_its_fields_where_imc_has_them() {
        let telemetry = telemetry();
        let place = place(&telemetry);
        let payload = estimated_state(&place);
        let packet = packet(place.utc_s(), 0x2001, ESTIMATED_STATE, &payload);
        assert_eq!((packet.len(), payload.len()), (20 + 88 + 2, 88));
        assert_eq!(packet[..6], [0x54, 0xFE, 0x5E, 0x01, 88, 0]);
        let double = |at: usize| f64::from_le_bytes(packet[at..at + 8].try_into().unwrap());
        let single = |at: usize| f32::from_le_bytes(packet[at..at + 4].try_into().unwrap());
        assert_eq!((double(6), double(20)), (1.5, std::f64::consts::FRAC_PI_4));
        let close = |field: usize, expected: f32| {
            let found = single(36 + 4 * field);
            assert!((found - expected).abs() < 1e-6, "{field}: {found}, not {expected}");
        };
        // height, x, y, z; psi; u; over ground north, east, down; depth
        for (field, expected) in [
            (0, 0.0),
            (1, 10.0),
            (2, 20.0),
            (3, 5.0),
            (6, 1.570_796_4),
            (7, 1.2),
            (10, 0.1),
            (11, 1.2),
            (12, 0.0),
            (16, 5.0),
        ] {
            close(field, expected);
        }
    }

    /// The check value of CRC-16/ARC, which IMC calls CRC-16-IBM, is 0xBB3D for the digits one to nine.
    #[test]
    fn val_the_footer_is_the_crc_of_all_before_it() {
        assert_eq!(crc::Crc::<u16>::new(&crc::CRC_16_ARC).checksum(b"123456789"), 0xBB3D);
        let packet = packet(0.0, 1, HEARTBEAT, &[]);
        let crc = crc::Crc::<u16>::new(&crc::CRC_16_ARC).checksum(&packet[..20]);
        assert_eq!(packet[20..], crc.to_le_bytes());
    }

    /// As `--rate 1` lets records through: none of them comes without a beat, so that nobody waits two seconds for one.
    #[test]
    fn a_record_a_second_is_a_beat_a_second() {
        let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
        receiver.set_read_timeout(Some(std::time::Duration::from_secs(600))).unwrap();
        let mut sender = Sender::open(receiver.local_addr().unwrap(), "auv", 1).unwrap();
        let telemetry = telemetry();
        for utc_us in [0, 900_000, 2_000_000, 2_706_000, 4_000_000_u64] {
            sender.send(&Place { utc_us, ..place(&telemetry) });
        }
        let mut packet = [0; 512];
        let mut numbers = Vec::new();
        while numbers.iter().filter(|number| **number == ESTIMATED_STATE).count() < 5 {
            receiver.recv(&mut packet).unwrap();
            numbers.push(u16::from_le_bytes([packet[2], packet[3]]));
        }
        assert_eq!(numbers.iter().filter(|number| **number == HEARTBEAT).count(), 5, "{numbers:?}");
    }
}

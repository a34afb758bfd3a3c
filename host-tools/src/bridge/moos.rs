//! A client of MOOSDB, as the board's navigation (themoos/core-moos, `CMOOSCommPkt`, `CMOOSMsg`): synchronous, it sends
//! and registers for nothing.

use super::{Counts, Place};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// What a client says first, in 32 bytes.
const PROTOCOL: &[u8] = b"ELKS CAN'T DANCE 2/8/10";
/// Packets that may wait: some five seconds.
const QUEUE: usize = 50;
/// How long the database may take for an answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Until it is looked for again.
const RETRY: Duration = Duration::from_secs(1);
/// Longest answer, bytes.
const LONGEST: usize = 1 << 20;

/// Value of a variable.
enum Value {
    Real(f64),
    Text(String),
}

/// Sends from a thread of its own, so that a database that stalls holds nothing up.
pub struct Client {
    queue: SyncSender<Vec<u8>>,
    name: String,
    pub counts: Arc<Counts>,
}

impl Client {
    /// Looks for the database until it is there.
    pub fn open(to: SocketAddr, name: &str) -> Self {
        let (queue, packets) = sync_channel(QUEUE);
        let counts = Arc::<Counts>::default();
        let (theirs, own) = (name.to_owned(), Arc::clone(&counts));
        std::thread::spawn(move || serve(to, &theirs, &packets, &own));
        Self { queue, name: name.to_owned(), counts }
    }

    /// A record, as MOOS' variables: x east, y north, headings in degrees, yaw counter-clockwise from north, rad.
    pub fn send(&mut self, place: &Place<'_>) {
        let Place { telemetry, position_deg, utc_s, .. } = place;
        let [north, east, depth, roll, pitch, heading, u, v, ..] = telemetry.state;
        let [latitude, longitude] = *position_deg;
        let [level_m, _] = telemetry.level_m;
        let values = [
            ("NAV_X", Value::Real(east)),
            ("NAV_Y", Value::Real(north)),
            ("NAV_LAT", Value::Real(latitude)),
            ("NAV_LONG", Value::Real(longitude)),
            ("NAV_DEPTH", Value::Real(depth)),
            ("NAV_SPEED", Value::Real(u.hypot(v))),
            ("NAV_HEADING", Value::Real(heading.to_degrees().rem_euclid(360.0))),
            ("NAV_YAW", Value::Real(-heading)),
            ("NAV_PITCH", Value::Real(pitch)),
            ("NAV_ROLL", Value::Real(roll)),
            ("BACKSEAT_SIGMA_M", Value::Real(telemetry.sigma[0].hypot(telemetry.sigma[1]))),
            ("BACKSEAT_LEVEL_M", Value::Real(level_m.into())),
            ("BACKSEAT_MODE", Value::Text(crate::monitor::words::mode_name(telemetry.mode).to_owned())),
        ];
        let messages: Vec<_> =
            values.iter().map(|(key, value)| message(b'N', &self.name, key, *utc_s, value)).collect();
        if self.queue.try_send(packet(&messages)).is_err() {
            self.counts.note(false);
        }
    }
}

fn serve(to: SocketAddr, name: &str, packets: &Receiver<Vec<u8>>, counts: &Counts) {
    let mut known = None;
    loop {
        let outcome = connect(to, name).and_then(|mut socket| {
            if known.replace(true) != Some(true) {
                eprintln!("bridge: MOOSDB at {to}");
            }
            loop {
                let Ok(packet) = packets.recv() else { return Ok(()) };
                socket.write_all(&packet)?;
                answer(&mut socket)?;
                counts.note(true);
            }
        });
        let Err(error) = outcome else { return };
        if known.replace(false) != Some(false) {
            eprintln!("bridge: MOOSDB at {to}: {error}; looking for it again");
        }
        std::thread::sleep(RETRY);
    }
}

/// Connects and says who this is.
fn connect(to: SocketAddr, name: &str) -> io::Result<TcpStream> {
    let mut socket = TcpStream::connect_timeout(&to, PATIENCE)?;
    socket.set_read_timeout(Some(PATIENCE))?;
    socket.set_write_timeout(Some(PATIENCE))?;
    socket.set_nodelay(true)?;
    let mut greeting = [0; 32];
    greeting[..PROTOCOL.len()].copy_from_slice(PROTOCOL);
    socket.write_all(&greeting)?;
    socket.write_all(&packet(&[message(b'i', "", "", 0.0, &Value::Text(name.to_owned()))]))?;
    let welcome = answer(&mut socket)?;
    // length and count of the packet, its flag; length and number of the message; its kind
    match welcome.get(4 + 1 + 4 + 4) {
        Some(b'W') => Ok(socket),
        _ => Err(io::Error::other("it does not welcome us; is the name taken?")),
    }
}

/// Reads one packet: what follows its length.
fn answer(socket: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut length = [0; 4];
    socket.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length) as usize;
    if !(9..=LONGEST).contains(&length) {
        return Err(io::Error::other("not a packet of MOOS"));
    }
    let mut rest = vec![0; length - 4];
    socket.read_exact(&mut rest)?;
    Ok(rest)
}

/// Length, number of messages, not compressed, messages.
fn packet(messages: &[Vec<u8>]) -> Vec<u8> {
    let length = 9 + messages.iter().map(Vec::len).sum::<usize>();
    let mut out = Vec::with_capacity(length);
    out.extend((length as u32).to_le_bytes());
    out.extend((messages.len() as u32).to_le_bytes());
    out.push(0);
    messages.iter().for_each(|message| out.extend_from_slice(message));
    out
}

/// Length, number, kind, kind of data, source and what adds to it, community, key, time, two numbers, text.
fn message(kind: u8, source: &str, key: &str, utc_s: f64, value: &Value) -> Vec<u8> {
    let (data, real, written) = match value {
        Value::Real(real) => (b'D', *real, ""),
        Value::Text(written) => (b'S', -1.0, written.as_str()),
    };
    let mut out = vec![0; 4];
    out.extend((-1_i32).to_le_bytes());
    out.extend([kind, data]);
    for text in [source, "", "", key] {
        out.extend((text.len() as u32).to_le_bytes());
        out.extend_from_slice(text.as_bytes());
    }
    [utc_s, real, -1.0].iter().for_each(|number| out.extend(number.to_le_bytes()));
    out.extend((written.len() as u32).to_le_bytes());
    out.extend_from_slice(written.as_bytes());
    let length = out.len() as u32;
    out[..4].copy_from_slice(&length.to_le_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::telemetry;
    use super::*;
    use std::net::TcpListener;

    fn read_packet(socket: &mut TcpStream) -> Vec<u8> {
        answer(socket).unwrap()
    }

    /// A database that welcomes, takes a packet and goes; the client comes back.
    #[test]
    fn a_client_survives_a_database_that_goes() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = Client::open(listener.local_addr().unwrap(), "auv");
        let telemetry = telemetry();
        let place = Place { telemetry: &telemetry, utc_s: 1.5, position_deg: [41.0, 2.0], origin_deg: [0.0; 2] };
        for connection in 0..2 {
            let (mut socket, _) = listener.accept().unwrap();
            let mut greeting = [0; 32];
            socket.read_exact(&mut greeting).unwrap();
            assert!(greeting.starts_with(PROTOCOL));
            let name = read_packet(&mut socket);
            assert!(name.ends_with(b"\x03\0\0\0auv"), "{name:?}");
            let welcome = packet(&[message(b'W', "", "", 0.0, &Value::Text("asynchronous".to_owned()))]);
            socket.write_all(&welcome).unwrap();
            client.send(&place);
            let packet = read_packet(&mut socket);
            assert_eq!(packet[..5], [13, 0, 0, 0, 0], "connection {connection}: thirteen variables");
            // NAV_X is east: its value lies behind key and time
            let key = packet.windows(5).position(|part| part == b"NAV_X").unwrap();
            assert_eq!(packet[key + 13..key + 21], 20.0_f64.to_le_bytes());
        }
    }

    /// As core-moos writes it: `CMOOSMsg(MOOS_NOTIFY, "K", 2.0, 3.0)`, length first.
    #[test]
    fn val_a_message_has_the_layout_of_core_moos() {
        let expected: [&[u8]; 12] = [
            &[0; 4],
            &[0xFF; 4],
            b"ND",
            &[1, 0, 0, 0],
            b"a",
            &[0; 8],
            &[1, 0, 0, 0],
            b"K",
            &3.0_f64.to_le_bytes(),
            &2.0_f64.to_le_bytes(),
            &(-1.0_f64).to_le_bytes(),
            &[0; 4],
        ];
        let expected = expected.concat();
        let found = message(b'N', "a", "K", 3.0, &Value::Real(2.0));
        assert_eq!(found[4..], expected[4..]);
        assert_eq!(found[..4], (expected.len() as u32).to_le_bytes());
    }
}

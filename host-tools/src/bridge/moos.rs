//! A client of MOOSDB, as the board's navigation (themoos/core-moos, `CMOOSCommPkt`, `CMOOSMsg`): synchronous, it
//! sends, and registers for [`MISSION`] and what a helm wants where that is accepted.

use super::Place;
use super::commands::Commands;
use super::counts::Counts;
use super::helm::{DESIRED, Desired};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

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
/// The variable that holds what is asked of the board, and the one that says what became of it.
const MISSION: &str = "BACKSEAT_MISSION";
const ANSWER: &str = "BACKSEAT_ANSWER";
/// Mail comes as the answer to a packet: while there is nothing to send, an empty one goes this often.
const LOOK: Duration = Duration::from_millis(200);
/// Where nothing comes back, nothing is looked for.
const FOR_EVER: Duration = Duration::MAX;

/// Value of a variable.
enum Value {
    Real(f64),
    Text(String),
}

/// Sends from a thread of its own, so that a database that stalls holds nothing up.
pub struct Client {
    queue: SyncSender<(Vec<u8>, Instant)>,
    name: String,
    pub counts: Arc<Counts>,
}

impl Client {
    /// Looks for the database until it is there; hands on what is asked.
    pub fn open(to: SocketAddr, name: &str, commands: Option<Commands>) -> Self {
        let (queue, packets) = sync_channel(QUEUE);
        let counts = Arc::<Counts>::default();
        let (theirs, own) = (name.to_owned(), Arc::clone(&counts));
        std::thread::spawn(move || serve(to, &theirs, &packets, commands.as_ref(), &own));
        Self { queue, name: name.to_owned(), counts }
    }

    /// A record, as MOOS' variables: x east, y north, headings in degrees, yaw counter-clockwise from north, rad.
    pub fn send(&mut self, place: &Place<'_>) {
        let Place { telemetry, position_deg, .. } = place;
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
            values.iter().map(|(key, value)| message(b'N', &self.name, key, place.utc_s(), value)).collect();
        self.put(&messages, place.arrived);
    }

    /// What became of what was asked.
    pub fn answer(&self, text: &str, utc_s: f64) {
        self.put(&[message(b'N', &self.name, ANSWER, utc_s, &Value::Text(text.to_owned()))], Instant::now());
    }

    fn put(&self, messages: &[Vec<u8>], arrived: Instant) {
        if self.queue.try_send((packet(messages), arrived)).is_err() {
            self.counts.note(None);
        }
    }
}

fn serve(
    to: SocketAddr,
    name: &str,
    packets: &Receiver<(Vec<u8>, Instant)>,
    commands: Option<&Commands>,
    counts: &Counts,
) {
    let mut known = None;
    loop {
        let connected = connect(to, name).and_then(|mut socket| {
            if commands.is_some() {
                register(&mut socket, name)?;
            }
            Ok(socket)
        });
        let outcome = connected.and_then(|mut socket| {
            if known.replace(true) != Some(true) {
                eprintln!("bridge: MOOSDB at {to}");
            }
            let mut desired = Desired::default();
            loop {
                let next = packets.recv_timeout(if commands.is_some() { LOOK } else { FOR_EVER });
                let (packet, arrived) = match next {
                    Ok((packet, arrived)) => (packet, Some(arrived)),
                    Err(RecvTimeoutError::Timeout) => {
                        (packet(&[message(b'.', name, "", 0.0, &Value::Real(0.0))]), None)
                    }
                    Err(RecvTimeoutError::Disconnected) => return Ok(()),
                };
                let answered = socket.write_all(&packet).and_then(|()| answer(&mut socket));
                if let Some(arrived) = arrived {
                    counts.note(answered.is_ok().then_some(arrived));
                }
                let answered = answered.inspect_err(|error| {
                    if error.kind() == io::ErrorKind::InvalidData {
                        counts.refuse();
                    }
                })?;
                let Some(commands) = commands else { continue };
                let now = Instant::now();
                for mail in mail(&answered).inspect_err(|_| counts.refuse())? {
                    let taken = match mail {
                        Mail::Mission(text) => commands.offer("MOOS", text),
                        Mail::Desired(variable, value) => {
                            desired.take(variable, value, now);
                            value.is_some()
                        }
                    };
                    if !taken {
                        counts.refuse();
                    }
                }
                if let Some(order) = desired.due(now) {
                    commands.steer(order);
                }
            }
        });
        let Err(error) = outcome else { return };
        if known.replace(false) != Some(false) {
            eprintln!("bridge: MOOSDB at {to}: {error}; looking for it again");
        }
        std::thread::sleep(RETRY);
    }
}

/// Asks for what others want of the board. The answer holds what was wanted before, perhaps by a start of yesterday:
/// that is passed over.
fn register(socket: &mut TcpStream, name: &str) -> io::Result<()> {
    let registers = |variable| message(b'R', name, variable, 0.0, &Value::Real(0.0));
    let [heading, depth, speed] = DESIRED.map(registers);
    socket.write_all(&packet(&[registers(MISSION), heading, depth, speed]))?;
    answer(socket).map(drop)
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
        return Err(no_packet());
    }
    let mut rest = vec![0; length - 4];
    socket.read_exact(&mut rest)?;
    Ok(rest)
}

fn no_packet() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "not a packet of MOOS")
}

/// What may be asked of the board.
enum Mail<'a> {
    /// A mission, its start or its stop.
    Mission(&'a [u8]),
    /// A value of the variable of [`DESIRED`] at this place; none: it is no number.
    Desired(usize, Option<f64>),
}

/// What of a packet is asked of the board.
fn mail(packet: &[u8]) -> io::Result<Vec<Mail<'_>>> {
    read_mail(packet).ok_or_else(no_packet)
}

/// As written by [`packet`] and [`message`], but for the packet's length.
fn read_mail(packet: &[u8]) -> Option<Vec<Mail<'_>>> {
    fn number(from: &mut &[u8]) -> Option<usize> {
        let (number, rest) = from.split_first_chunk()?;
        *from = rest;
        usize::try_from(u32::from_le_bytes(*number)).ok()
    }
    fn text<'a>(from: &mut &'a [u8]) -> Option<&'a [u8]> {
        let length = number(from)?;
        let (text, rest) = from.split_at_checked(length)?;
        *from = rest;
        Some(text)
    }
    let mut rest = packet;
    let count = number(&mut rest)?;
    rest = rest.get(1..)?;
    let mut asked = Vec::new();
    for _ in 0..count {
        let (mut message, others) = rest.split_at_checked(u32::from_le_bytes(*rest.first_chunk()?) as usize)?;
        rest = others;
        let [kind, data] = *message.get(8..10)?.first_chunk()?;
        message = &message[10..];
        let [_source, _aux, _community, key] =
            [text(&mut message)?, text(&mut message)?, text(&mut message)?, text(&mut message)?];
        let (numbers, mut message) = message.split_at_checked(24)?;
        let value = f64::from_le_bytes(*numbers.get(8..)?.first_chunk()?);
        if kind != b'N' {
            continue;
        }
        if let Some(variable) = DESIRED.iter().position(|desired| desired.as_bytes() == key) {
            asked.push(Mail::Desired(variable, Some(value).filter(|value| data == b'D' && value.is_finite())));
        } else if (data, key) == (b'S', MISSION.as_bytes()) {
            asked.push(Mail::Mission(text(&mut message)?));
        }
    }
    Some(asked)
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
    use super::super::helm::Wish;
    use super::super::tests::{place, telemetry};
    use super::*;
    use std::net::TcpListener;

    fn read_packet(socket: &mut TcpStream) -> Vec<u8> {
        answer(socket).unwrap()
    }

    /// The database's side of the greeting.
    fn welcome(listener: &TcpListener) -> TcpStream {
        let (mut socket, _) = listener.accept().unwrap();
        let mut greeting = [0; 32];
        socket.read_exact(&mut greeting).unwrap();
        assert!(greeting.starts_with(PROTOCOL));
        let name = read_packet(&mut socket);
        assert!(name.ends_with(b"\x03\0\0\0auv"), "{name:?}");
        socket.write_all(&packet(&[message(b'W', "", "", 0.0, &Value::Text("asynchronous".to_owned()))])).unwrap();
        socket
    }

    /// A database that welcomes, takes a packet and goes; the client comes back.
    #[test]
    fn a_client_survives_a_database_that_goes() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = Client::open(listener.local_addr().unwrap(), "auv", None);
        let telemetry = telemetry();
        let place = place(&telemetry);
        for connection in 0..2 {
            let mut socket = welcome(&listener);
            client.send(&place);
            let packet = read_packet(&mut socket);
            assert_eq!(packet[..5], [13, 0, 0, 0, 0], "connection {connection}: thirteen variables");
            // NAV_X is east: its value lies behind key and time
            let key = packet.windows(5).position(|part| part == b"NAV_X").unwrap();
            assert_eq!(packet[key + 13..key + 21], 20.0_f64.to_le_bytes());
        }
    }

    #[test]
    fn what_is_asked_is_handed_on_once_and_never_what_was_asked_before() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (commands, asked) = Commands::kept();
        let client = Client::open(listener.local_addr().unwrap(), "auv", Some(commands));
        let mut socket = welcome(&listener);
        let mail = |text: &str| message(b'N', "pHelm", MISSION, 0.0, &Value::Text(text.to_owned()));
        let registered = read_packet(&mut socket);
        assert_eq!((registered[13], registered.ends_with(&[0; 4])), (b'R', true));
        socket.write_all(&packet(&[mail("start")])).unwrap();
        read_packet(&mut socket);
        let other = message(b'N', "pHelm", "DESIRED_SPEED", 0.0, &Value::Real(1.0));
        let number = message(b'N', "pHelm", MISSION, 0.0, &Value::Real(1.0));
        let too_long = mail(&"x".repeat(70_000));
        socket.write_all(&packet(&[other, number, too_long, mail("stop")])).unwrap();
        assert_eq!(asked.recv().unwrap(), ("MOOS", "stop".to_owned()));
        read_packet(&mut socket);
        assert_eq!((asked.try_recv().is_err(), client.counts.read()), (true, [0, 0, 1]));
    }

    #[test]
    fn what_a_helm_wants_is_handed_on_while_it_says_it_and_never_what_it_wanted_before() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (commands, _asked) = Commands::kept();
        let client = Client::open(listener.local_addr().unwrap(), "auv", Some(commands.clone()));
        let mut socket = welcome(&listener);
        let wants = |variable: usize, value| message(b'N', "pHelmIvP", DESIRED[variable], 0.0, &Value::Real(value));
        let all = |values: [f64; 3]| packet(&[0, 1, 2].map(|variable| wants(variable, values[variable])));
        let registered = read_packet(&mut socket);
        for variable in DESIRED {
            assert!(registered.windows(variable.len()).any(|part| part == variable.as_bytes()), "{variable}");
        }
        let mut say = |packet: &[u8]| {
            socket.write_all(packet).unwrap();
            read_packet(&mut socket);
        };
        say(&all([10.0, 5.0, 1.0]));
        say(&packet(&[]));
        assert_eq!(commands.order(), None, "wanted before the bridge was there");
        say(&packet(&[wants(0, 180.0), wants(2, 1.5)]));
        assert_eq!(commands.order(), None, "no depth");
        say(&packet(&[wants(1, 4.0), wants(0, 90.0)]));
        let wish = Wish::Hold { heading_rad: 90.0_f64.to_radians(), depth_m: 4.0, speed_mps: 1.5 };
        assert_eq!(commands.order().map(|order| order.wish), Some(wish));
        std::thread::sleep(Duration::from_millis(600));
        let word = message(b'N', "pHelmIvP", DESIRED[1], 0.0, &Value::Text("deep".to_owned()));
        say(&packet(&[word, wants(2, f64::NAN)]));
        say(&packet(&[]));
        assert_eq!((commands.order(), client.counts.read()), (None, [0, 0, 2]), "no numbers");
        say(&all([0.0, 3.0, 1.0]));
        assert!(commands.order().is_some());
    }

    /// Lengths and counts that are not so, a packet that is cut off, bytes at random: each is counted, and the client
    /// comes back.
    #[test]
    fn a_database_that_lies_is_left_and_looked_for_again() {
        let good = packet(&[message(b'N', "a", MISSION, 0.0, &Value::Text("stop".to_owned()))]);
        let lie = |at: usize, bytes: [u8; 4]| {
            let mut packet = good.clone();
            packet[at..at + 4].copy_from_slice(&bytes);
            packet
        };
        let huge = u32::MAX.to_le_bytes();
        let text_length = good.len() - 8;
        let lies = [
            lie(0, huge),
            lie(0, [0; 4]),
            lie(4, huge),
            lie(9, huge),
            lie(19, huge),
            lie(text_length, huge),
            vec![7; 64],
        ];
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (commands, asked) = Commands::kept();
        let client = Client::open(listener.local_addr().unwrap(), "auv", Some(commands));
        for lie in &lies {
            let mut socket = welcome(&listener);
            read_packet(&mut socket);
            socket.write_all(&packet(&[])).unwrap();
            read_packet(&mut socket);
            socket.write_all(lie).unwrap();
        }
        welcome(&listener);
        assert_eq!((client.counts.read(), asked.try_recv().is_err()), ([0, 0, lies.len() as u64], true));
    }

    #[test]
    fn a_database_that_does_not_read_holds_nothing_up() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = Client::open(listener.local_addr().unwrap(), "auv", None);
        let _stalls = welcome(&listener);
        let telemetry = telemetry();
        let begun = Instant::now();
        (0..200).for_each(|_| client.send(&place(&telemetry)));
        // far less than it waits for an answer
        assert!(begun.elapsed() < PATIENCE / 2);
        let [sent, dropped, _] = client.counts.read();
        assert_eq!((sent, dropped >= 200 - QUEUE as u64 - 1), (0, true));
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

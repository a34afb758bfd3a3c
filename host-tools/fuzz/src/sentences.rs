//! Text: the framer, and the sentences of frontseat, GNSS, compass and modem.

use crate::finite;
use crate::streams::anywhere_cut;
use backseat_wire::Error;
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::gps::{Gga, Rmc};
use backseat_wire::iver::{FromFrontseat, ToFrontseat, Units};
use backseat_wire::modem::{FromModem, ToModem};
use backseat_wire::nmea::{Checksum, Framer, MAX_SENTENCE, Sentence};

/// Reads each line and writes it; what is written then reads, with its checksum, and writes as itself.
macro_rules! settles {
    ($line:expr, |$sentence:ident| $parse:expr, |$message:ident, $buffer:ident| $emit:expr) => {{
        let once = |line: &[u8], checksum: Checksum| -> Result<Vec<u8>, Error> {
            let $sentence = &Sentence::from_line(line, checksum)?;
            let $message = $parse?;
            finite(&$message);
            let $buffer = &mut [0; MAX_SENTENCE];
            let written = $emit.map(<[u8]>::to_vec);
            // of what can be read only absurd numbers, and texts with a `*` in them, are not written
            let absurd = written == Err(Error::OutOfRange) || line.iter().filter(|byte| **byte == b'*').count() > 1;
            assert!(written.is_ok() || absurd, "{written:?}: {}", line.escape_ascii());
            written
        };
        if let Ok(written) = once($line, Checksum::Optional) {
            let line = written.strip_suffix(b"\r\n").expect("a line end");
            assert_eq!(once(line, Checksum::Required).as_ref(), Ok(&written), "{}", written.escape_ascii());
        }
    }};
}

fn lines(data: &[u8]) -> impl Iterator<Item = &[u8]> {
    data.split(|byte| *byte == b'\n')
}

/// The frontseat's sentences, and those to it, in either set of units.
pub fn iver(data: &[u8]) {
    for line in lines(data) {
        for units in [4, 5].map(Units::remote_helm) {
            settles!(line, |s| FromFrontseat::parse(s, &units), |m, b| m.emit(&units, b));
            settles!(line, |s| ToFrontseat::parse(s, &units), |m, b| m.emit(&units, b));
        }
    }
}

/// The modem's sentences, and those to it.
pub fn modem(data: &[u8]) {
    for line in lines(data) {
        settles!(line, |s| FromModem::parse(s), |m, b| m.emit(b));
        settles!(line, |s| ToModem::parse(s), |m, b| m.emit(b));
    }
}

/// Sentences of a GNSS receiver.
pub fn gps(data: &[u8]) {
    for line in lines(data) {
        settles!(line, |s| Rmc::parse(s), |m, b| m.emit(b));
        settles!(line, |s| Gga::parse(s), |m, b| m.emit(b));
    }
}

/// Sentences of the OS5000 compass, and the attitude they become.
pub fn os5000(data: &[u8]) {
    for line in lines(data) {
        settles!(line, |s| Os5000::parse(s).inspect(|compass| finite(&compass.sample())), |m, b| m.emit(b));
    }
}

/// The framer of text: a sentence that was found is found again in its own line, and the next one after any noise.
pub fn framer(data: &[u8]) {
    for checksum in [Checksum::Optional, Checksum::Required] {
        let run = |parts: &[&[u8]]| {
            let (mut framer, mut found) = (Framer::new(checksum), Vec::new());
            for mut part in parts.iter().copied() {
                while let Some(outcome) = framer.feed(&mut part) {
                    found.push(outcome.map(|sentence| sentence.body().to_vec()));
                }
                assert!(part.is_empty());
            }
            found
        };
        let found = anywhere_cut(data, b"\r\n$ACK,8,0,0*5D\r\n", run);
        assert_eq!(found.last(), Some(&Ok(b"ACK,8,0,0".to_vec())));
        for body in found.into_iter().flatten() {
            let line = [b"$", &body[..], b"\r\n"].concat();
            // without its checksum a `*` in the body would be taken for one
            if !body.contains(&b'*') {
                let again = Sentence::from_line(&line, Checksum::Optional);
                assert_eq!(again.map(|sentence| sentence.body()), Ok(body.trim_ascii_end()));
            }
        }
    }
}

use backseat_wire::Error;
use backseat_wire::abort::{Abort, EVERYBODY, LENGTH};
use backseat_wire::ship_state::{Key, ShipState};

fn key() -> Key {
    Key::new(core::array::from_fn(|i| i as u8))
}

const ABORT: Abort = Abort { destination: 2, transmit_s: 1_795_176_001 };

#[test]
fn val_payload_is_these_bytes() {
    // Written by hand from the table; the code is by a SipHash-2-4 of its own in another language, which gives the
    // vectors of Aumasson and Bernstein.
    let wanted = [0xab, 0x02, 0x41, 0x36, 0x00, 0x6b, 0xdc, 0x8f, 0x0a, 0x4b, 0xd3, 0x2f, 0xcb, 0x4e];
    assert_eq!(ABORT.emit_authentic(&key()), Ok(wanted));
    assert_eq!(Abort::parse_authentic(&wanted, &key()), Ok(ABORT));
    // as it stands in its frame
    let mut frame = [0x55; 32];
    frame[..LENGTH].copy_from_slice(&wanted);
    assert_eq!(Abort::parse_authentic(&frame, &key()), Ok(ABORT));
}

#[test]
fn only_with_the_key_and_only_unchanged() {
    let payload = ABORT.emit_authentic(&key()).unwrap();
    for bit in 0..8 * LENGTH {
        let mut flipped = payload;
        flipped[bit / 8] ^= 1 << (bit % 8);
        let expected = if bit < 8 { Error::Unknown } else { Error::Forged };
        assert_eq!(Abort::parse_authentic(&flipped, &key()), Err(expected), "bit {bit}");
    }
    assert_eq!(Abort::parse_authentic(&payload, &Key::new([7; 16])), Err(Error::Forged));
    assert_eq!(Abort::parse_authentic(&payload, &Key::NONE), Err(Error::Forged), "no key, no abort");
    assert_eq!(ABORT.emit_authentic(&Key::NONE), Err(Error::Forged));
    for length in 0..LENGTH {
        assert!(Abort::parse_authentic(&payload[..length], &key()).is_err(), "{length}");
    }
}

#[test]
fn an_abort_is_no_ship_state_and_has_one_address_or_all() {
    assert!(ShipState::parse(&ABORT.emit_authentic(&key()).unwrap()).is_err());
    assert!(ABORT.is_for(2) && !ABORT.is_for(3));
    assert!(Abort { destination: EVERYBODY, ..ABORT }.is_for(3));
}

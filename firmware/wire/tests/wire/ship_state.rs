use backseat_wire::Error;
use backseat_wire::ship_state::{LENGTH, ShipState};

const SHIP: ShipState = ShipState {
    source: 1,
    sequence: 200,
    transmit_s: 1_795_176_001,
    position_deg: [41.524_2, -70.671_1],
    velocity_mps: [1.5, -1.25],
    position_sigma_m: 0.5,
    velocity_sigma_mps: 0.05,
    transducer_depth_m: 2.0,
};

#[test]
fn val_payload_is_these_bytes() {
    // Built by hand from the table; CRC by an independent bitwise implementation.
    let mut wanted = vec![1, 1, 200];
    wanted.extend(1_795_176_001_u32.to_le_bytes());
    wanted.extend(415_242_000_i32.to_le_bytes());
    wanted.extend((-706_711_000_i32).to_le_bytes());
    wanted.extend(1_500_i16.to_le_bytes());
    wanted.extend((-1_250_i16).to_le_bytes());
    wanted.extend([5, 5, 20]);
    let mut crc = 0xFFFF_u16;
    for byte in &wanted {
        crc ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            crc = if crc & 0x8000 != 0 { crc << 1 ^ 0x1021 } else { crc << 1 };
        }
    }
    wanted.extend(crc.to_le_bytes());
    assert_eq!(SHIP.emit().unwrap().to_vec(), wanted);
    // Leaves eight bytes of the 32-byte frame.
    const { assert!(LENGTH + 8 <= 32) }
}

#[test]
fn survives_within_its_resolution() {
    let payload = SHIP.emit().unwrap();
    assert_eq!(ShipState::parse(&payload), Ok(SHIP));
    let mut frame = [0xFF; 32];
    frame[..LENGTH].copy_from_slice(&payload);
    assert_eq!(ShipState::parse(&frame), Ok(SHIP));
    let fine = ShipState { position_deg: [-89.123_456_78, 179.999_999_99], velocity_mps: [-0.000_6, 32.0], ..SHIP };
    let again = ShipState::parse(&fine.emit().unwrap()).unwrap();
    assert_eq!((again.position_deg, again.velocity_mps), ([-89.123_456_8, 180.0], [-0.001, 32.0]));
    // Accuracies are never overstated, and saturate.
    let vague = ShipState { position_sigma_m: 0.51, velocity_sigma_mps: 1e9, ..SHIP };
    let again = ShipState::parse(&vague.emit().unwrap()).unwrap();
    assert_eq!((again.position_sigma_m, again.velocity_sigma_mps), (0.6, 2.55));
}

#[test]
fn refused_by_cause() {
    let payload = SHIP.emit().unwrap();
    assert_eq!(ShipState::parse(&payload[..23]), Err(Error::Length));
    for bit in 0..8 * LENGTH {
        let mut flipped = payload;
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(ShipState::parse(&flipped), Err(Error::Checksum), "bit {bit}");
    }
    assert_eq!(ShipState::parse(&[0; 32]), Err(Error::Checksum));
    for wrong in [
        ShipState { position_deg: [90.1, 0.0], ..SHIP },
        ShipState { position_deg: [0.0, f64::NAN], ..SHIP },
        ShipState { velocity_mps: [40.0, 0.0], ..SHIP },
        ShipState { position_sigma_m: -1.0, ..SHIP },
        ShipState { transducer_depth_m: 30.0, ..SHIP },
    ] {
        assert_eq!(wrong.emit(), Err(Error::OutOfRange));
    }
}

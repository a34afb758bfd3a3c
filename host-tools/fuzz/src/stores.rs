//! What memory and sound may hold: the parameter store, the restart record, the acoustic payload.

use crate::finite;
use backseat_app::App;
use backseat_app::parameters::{PARAMETERS, Settings};
use backseat_app::store::{ParameterFlash, RestartRecord, WORD, newest};
use backseat_wire::hostlink::{self, ResetCause};
use backseat_wire::ship_state::{Key, LENGTH, ShipState, VERSION};
use backseat_wire::vehicle_state::{self, VehicleState};
use crc::{CRC_16_IBM_3740, Crc};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// The acoustic payloads, as they came and with a right CRC; only the right authentication code makes it authentic.
pub fn ship_state(data: &[u8]) {
    const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
    let key = Key::new(*b"of sixteen bytes");
    uplink(data, &key);
    let (covered, rest) = data.split_at(data.len().min(LENGTH - 2));
    let repaired = [covered, &CRC.checksum(covered).to_le_bytes(), rest].concat();
    for payload in [data, &repaired] {
        let Ok(state) = ShipState::parse(payload) else {
            assert!(ShipState::parse_authentic(payload, &key).is_err());
            continue;
        };
        finite(&state);
        assert!(state.position_sigma_m >= 0.0 && state.velocity_sigma_mps >= 0.0 && state.transducer_depth_m >= 0.0);
        assert_eq!(ShipState::parse_authentic(payload, &Key::NONE), Ok(state));
        // a speed of 32.7 m/s and more is read, but no ship has it to send
        let (Ok(plain), Ok(authentic)) = (state.emit(), state.emit_authentic(&key)) else { continue };
        let version = payload[0];
        assert_eq!(payload[..LENGTH], if version == VERSION { plain } else { *authentic.first_chunk().unwrap() });
        let is_authentic = payload.starts_with(&authentic);
        assert_eq!(ShipState::parse_authentic(payload, &key).is_ok(), is_authentic);
        assert_eq!(ShipState::parse_authentic(&authentic, &key), Ok(state));
    }
}

/// The same of a vehicle's uplink.
fn uplink(data: &[u8], key: &Key) {
    const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
    let (covered, rest) = data.split_at(data.len().min(vehicle_state::LENGTH - 2));
    let repaired = [covered, &CRC.checksum(covered).to_le_bytes(), rest].concat();
    for payload in [data, &repaired] {
        let Ok(state) = VehicleState::parse(payload) else {
            assert!(VehicleState::parse_authentic(payload, key).is_err());
            continue;
        };
        finite(&state);
        let (mut plain, mut signed) = Default::default();
        // as above
        let (Ok(plain), Ok(signed)) = (state.emit(&Key::NONE, &mut plain), state.emit(key, &mut signed)) else {
            continue;
        };
        let expected = if payload[0] == vehicle_state::VERSION { plain } else { &signed[..vehicle_state::LENGTH] };
        assert_eq!(&payload[..vehicle_state::LENGTH], expected);
        assert_eq!(VehicleState::parse_authentic(payload, key).is_ok(), payload.starts_with(signed));
        assert_eq!(VehicleState::parse_authentic(signed, key), Ok(state));
    }
}

/// The parameter store: whatever its flash holds, a set is valid or refused, the app starts, and a set can be stored.
///
/// The first byte says what the rest is: bytes of both halves, or patches of a store that was in order (place, eight
/// bytes), and whether the CRCs are right after that.
pub fn parameter_store(data: &[u8]) {
    let Some((how, data)) = data.split_first() else { return };
    let mut flash = if how & 1 == 0 { Flash::holding(data) } else { Flash::patched(data) };
    if how & 2 != 0 {
        flash.repair();
    }
    let mut store = ParameterFlash::new(flash).expect("two sectors");
    let mut found = Settings::DEFAULT;
    if store.load(&mut found).is_ok() {
        for parameter in PARAMETERS {
            let value = parameter.get(&found);
            assert!(value >= parameter.min && value <= parameter.max, "{} = {value}", parameter.name);
        }
    }
    let mut app = Box::new(App::new());
    app.restore(Some(&found));
    app.step(100_000);
    store.save(&Settings::DEFAULT).expect("flash without faults takes a set");
    let mut again = found;
    assert!(store.load(&mut again).is_ok() && again == Settings::DEFAULT);
}

/// The restart record: whatever its two slots hold, the app starts and steps, and its own record comes back.
///
/// The first byte says why the board started, and whether the slots' CRCs are right.
pub fn restart_record(data: &[u8]) {
    let Some((how, slots)) = data.split_first() else { return };
    let causes =
        [ResetCause::PowerOn, ResetCause::Pin, ResetCause::BrownOut, ResetCause::Watchdog, ResetCause::Software];
    let cause = causes[usize::from(how >> 1) % causes.len()];
    let (first, second) = slots.split_at(slots.len() / 2);
    let slots = [first, second].map(|slot| if how & 1 == 0 { slot.to_vec() } else { with_crc(slot) });
    let found = newest([&slots[0], &slots[1]]);
    if let Some(found) = found {
        finite(&found);
        assert_eq!(RestartRecord::decode(&found.encode()), Some(found));
    }
    let (response, next) = RestartRecord::respond(cause, found.as_ref());
    assert_eq!(RestartRecord::decode(&next.encode()), Some(next));
    let mut app = Box::new(App::new());
    app.resume(next.report(cause, None), &response);
    for step in 1..4 {
        app.step(step * 100_000);
    }
    let kept = app.restart_record(&next, 300_000);
    assert_eq!(RestartRecord::decode(&kept.encode()), Some(kept));
}

/// A record with the CRC that it has to have, if these bytes begin with one.
fn with_crc(bytes: &[u8]) -> Vec<u8> {
    let Ok((_, rest)) = postcard::take_from_bytes::<(u16, RestartRecord)>(bytes) else { return bytes.to_vec() };
    let record = &bytes[..bytes.len() - rest.len()];
    [record, &hostlink::CRC.checksum(record).to_le_bytes()].concat()
}

const SECTOR: usize = 8192;

/// NOR flash of two sectors.
#[derive(Debug)]
struct Flash(Vec<u8>);

impl Flash {
    /// With this at the beginning of each sector, half and half.
    fn holding(content: &[u8]) -> Self {
        let mut bytes = vec![0xFF; 2 * SECTOR];
        let (first, second) = content.split_at(content.len() / 2);
        for (sector, content) in bytes.chunks_mut(SECTOR).zip([first, second]) {
            let length = content.len().min(SECTOR);
            sector[..length].copy_from_slice(&content[..length]);
        }
        Self(bytes)
    }

    /// With two sets as they were stored, and then eight bytes at a time over either.
    fn patched(patches: &[u8]) -> Self {
        let mut store = ParameterFlash::new(Self::holding(&[])).expect("two sectors");
        for _ in 0..2 {
            store.save(&Settings::DEFAULT).expect("flash without faults");
        }
        let mut flash = store.release();
        for (at, bytes) in patches.chunks(10).filter_map(|patch| patch.split_first_chunk::<2>()) {
            let at = usize::from(u16::from_le_bytes(*at)) % flash.0.len();
            let end = flash.0.len().min(at + bytes.len());
            flash.0[at..end].copy_from_slice(&bytes[..end - at]);
        }
        flash
    }

    /// Gives both halves the CRC that they have to have.
    fn repair(&mut self) {
        for half in self.0.chunks_mut(SECTOR) {
            let count = usize::from(u16::from_le_bytes([half[6], half[7]]));
            let end = WORD * (1 + count.div_ceil(WORD / 8));
            if end <= half.len() {
                let mut crc = hostlink::CRC.digest();
                crc.update(&half[..28]);
                crc.update(&half[WORD..end]);
                half[28..WORD].copy_from_slice(&crc.finalize().to_le_bytes());
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (place, byte) in self.0[offset as usize..].iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}

//! Files of PD0 ensembles, as a DVL or an ADCP of Teledyne RDI records them.

use super::Imported;
use super::messages::Gathering;
use super::sentences::dvl_samples;
use crate::DataError;
use crate::log::{Column, table};
use backseat_core::dynamics::Attitude;
use backseat_wire::calendar::{Date, DateTime, TimeOfDay};
use backseat_wire::dvl::Coordinates;
use backseat_wire::dvl::pd0::{Decoder, Ensemble, FixedLeader};
use nalgebra::Vector3;
use std::io::Read;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "PD0 ensembles";

/// Whether the beginning of a file is that of an ensemble.
pub(super) fn is_pd0(beginning: &[u8]) -> bool {
    beginning.starts_with(&[0x7F, 0x7F])
}

/// Reads a file of ensembles.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let mut file = table::open_bytes(path)?;
    let (mut gathering, mut decoder) = (Gathering::default(), Decoder::new());
    let (mut ensembles, mut locked, mut frames) = (0, 0, Vec::new());
    let (mut bytes, mut rest) = (vec![0; 1 << 16], 0..0);
    loop {
        let mut unread = &bytes[rest.clone()];
        let outcome = decoder.feed(&mut unread);
        rest.start = rest.end - unread.len();
        let Some(outcome) = outcome else {
            rest = 0..file.read(&mut bytes).map_err(|e| DataError::io(path, &e))?;
            if rest.is_empty() {
                break;
            }
            continue;
        };
        table::check_rows(path, 0, ensembles + 1)?;
        let Ok(ensemble) = outcome else {
            gathering.leave_out("bytes", "no whole ensemble with its checksum");
            continue;
        };
        ensembles += 1;
        let Some(time_us) = time_us(&ensemble) else {
            gathering.leave_out("ensembles", "no time: the clock of the instrument was never set");
            continue;
        };
        let mut sample = ensemble.sample(0.0);
        match body_mps(&ensemble) {
            Ok(velocity_mps) => sample.bottom_mps = velocity_mps,
            Err(reason) if ensemble.bottom.is_some() => {
                sample.bottom_mps = None;
                gathering.leave_out("velocities", reason);
            }
            Err(_) => {}
        }
        locked += usize::from(sample.bottom_mps.is_some());
        if !frames.contains(&sample.frame) {
            frames.push(sample.frame);
        }
        let samples = dvl_samples(&sample);
        // an instrument without a pressure sensor states zero
        let is_at_zero = |(column, value): &(Column, f64)| *column == Column::Depth && *value == 0.0;
        let samples: Vec<(Column, f64)> = samples.into_iter().filter(|sample| !is_at_zero(sample)).collect();
        gathering.add(time_us, &samples);
    }
    let notes = vec![
        format!("{NAME}; {ensembles} ensembles, {locked} with a velocity over ground, frame {frames:?}"),
        "times are the instrument's clock; attitude is its own, its heading magnetic unless it was corrected; in \
         instrument axes beam 3 points where EA says, with EA0 forward; velocities that it levelled are turned back by \
         its own pitch and roll"
            .to_owned(),
    ];
    Ok(Imported { format: NAME, log: gathering.finish(path, notes)? })
}

/// Velocity over ground in the vehicle's axes, whatever EX says, m/s; `None` without bottom lock, and why not where the
/// ensemble does not tell how the axes of the velocity stand in the vehicle.
fn body_mps(ensemble: &Ensemble) -> Result<Option<[f64; 3]>, &'static str> {
    /// Bit of the system configuration: the beams look up.
    const LOOKS_UP: u16 = 0x80;
    /// Bit of the coordinate byte: levelled by the tilts.
    const TILTS: u8 = 0b100;
    let Some(fixed) = ensemble.fixed else { return Err("an ensemble without its fixed leader: axes unknown") };
    let of_ship = |ensemble: &Ensemble| ensemble.sample(0.0).bottom_mps;
    match fixed.frame() {
        Coordinates::Beam => Err("along the beams: set EX to instrument or ship axes"),
        Coordinates::Earth => Err("of the earth, by the instrument's own compass: set EX to instrument or ship axes"),
        _ if fixed.configuration & LOOKS_UP != 0 => Err("of an instrument that looks up"),
        // EA, the direction of beam 3 in the vehicle, is used by the instrument for the other frames alone
        Coordinates::Instrument => {
            Ok(ensemble.sample((f64::from(fixed.heading_alignment_cdeg) / 100.0).to_radians()).bottom_mps)
        }
        Coordinates::Ship => Ok(of_ship(ensemble)),
        Coordinates::ShipLevelled if fixed.heading_alignment_cdeg != 0 => {
            // in whose axes pitch and roll are differs from make to make
            Err("levelled by the instrument beside an EA: set EX to instrument or ship axes without tilts")
        }
        Coordinates::ShipLevelled => {
            let Some(leader) = ensemble.variable else { return Err("levelled by tilts that are not in the ensemble") };
            let [roll, tilt] = [leader.roll_cdeg, leader.pitch_cdeg].map(|cdeg| (f64::from(cdeg) / 100.0).to_radians());
            // the first sensor's axis is fixed to the instrument: RDI, ADCP Coordinate Transformation
            let pitch = (tilt.tan() * roll.cos()).atan();
            let mut as_ship = *ensemble;
            as_ship.fixed = Some(FixedLeader { coordinates: fixed.coordinates & !TILTS, ..fixed });
            let turn = Attitude::new(&Vector3::new(roll, pitch, 0.0)).rotation();
            Ok(of_ship(&as_ship).map(|level| (turn.transpose() * Vector3::from(level)).into()))
        }
    }
}

/// µs since 1970 by the instrument's clock: year of this century, month, day, hour, minute, second, hundredths.
fn time_us(ensemble: &Ensemble) -> Option<i64> {
    let [year, month, day, hour, minute, second, hundredths] = ensemble.variable.as_ref()?.clock;
    let date = Date::new(2000 + u16::from(year), month, day).ok()?;
    let [hour, minute, second, hundredths] = [hour, minute, second, hundredths].map(u64::from);
    let time = TimeOfDay::from_us(((hour * 60 + minute) * 60 + second) * 1_000_000 + hundredths * 10_000);
    Some(DateTime { date, time }.unix_us() as i64)
}

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    /// A vector of the wire's tests.
    fn vector(name: &str) -> Vec<u8> {
        let vectors = include_str!("../../../../firmware/wire/tests/vectors/pd0.hex");
        let line = vectors.lines().find(|line| line.starts_with(name)).unwrap();
        let digits = line.rsplit('\t').next().unwrap();
        (0..digits.len() / 2).map(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).unwrap()).collect()
    }

    /// Recorded and built ensembles whose coordinate byte, alignment and direction are written over. The velocities of
    /// the vectors, bottom past the instrument in mm/s, are (50, 61, 22) and (-12, -1250, 4); the levelled ones were
    /// turned back, outside this program, by the matrix of RDI's booklet for roll 26.33 and tilt -27.38 degrees.
    #[test]
    fn val_velocities_are_the_bodys_whatever_ex_says() {
        let (ship, ship_levelled, instrument, earth, beam) = (0x13, 0x17, 0x0F, 0x1F, 0x07);
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        let explorer = [(1.25 - 0.012) * diagonal, (1.25 + 0.012) * diagonal, 0.004];
        for (name, ex, ea_cdeg, looks_up, expected) in [
            ("wh_bt_3beam", ship, 0, false, Ok([-0.061, -0.050, 0.022])),
            ("wh_bt_3beam", ship, 4500, false, Ok([-0.061, -0.050, 0.022])),
            // tilts play no part in the instrument's axes
            ("wh_bt_3beam", instrument, 0, false, Ok([-0.061, -0.050, 0.022])),
            ("wh_bt_3beam", instrument, 9000, false, Ok([0.050, -0.061, 0.022])),
            ("synth_explorer_fwd", instrument, 4500, false, Ok(explorer)),
            ("wh_bt_3beam", ship_levelled, 0, false, Ok([-0.046_067_170, -0.024_570_468, 0.063_080_171])),
            ("wh_bt_3beam", ship_levelled, 4500, false, Err("levelled by the instrument beside an EA")),
            ("wh_bt_3beam", earth, 0, false, Err("of the earth")),
            ("wh_bt_3beam", beam, 0, false, Err("along the beams")),
            ("wh_bt_3beam", instrument, 0, true, Err("of an instrument that looks up")),
        ] {
            let mut bytes = vector(name);
            let fixed = usize::from(u16::from_le_bytes([bytes[6], bytes[7]]));
            assert_eq!(bytes[fixed..fixed + 2], [0, 0], "the fixed leader");
            bytes[fixed + 4] |= if looks_up { 0x80 } else { 0 };
            bytes[fixed + 25] = ex;
            bytes[fixed + 26..fixed + 28].copy_from_slice(&i16::to_le_bytes(ea_cdeg));
            let end = bytes.len() - 2;
            let sum = bytes[..end].iter().fold(0_u16, |sum, byte| sum.wrapping_add(u16::from(*byte)));
            bytes[end..].copy_from_slice(&sum.to_le_bytes());
            let log = import(&bytes).unwrap().log;
            let (found, notes) = (log.rows[0].dvl_mps(), log.notes.join("\n"));
            match expected {
                Ok(expected) => {
                    let found = found.unwrap_or_else(|| panic!("{name} {ex:#x} {ea_cdeg}: {notes}"));
                    let is_near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6);
                    assert!(is_near, "{name} {ex:#x} {ea_cdeg}: {found:?} {expected:?}");
                    assert!(!notes.contains("left out"), "{notes}");
                }
                Err(reason) => {
                    assert_eq!(found, None, "{ex:#x}");
                    assert!(notes.contains(&format!("left out velocities (1): {reason}")), "{notes}");
                }
            }
            assert!(log.rows[0].attitude_rad().is_some(), "{name}");
        }
    }

    #[test]
    fn val_recorded_ensembles() {
        // two ensembles of a WorkHorse with bottom lock, and one cut off
        let mut bytes = [vector("wh_bt_good_a"), vector("wh_bt_good_b")].concat();
        let cut: Vec<u8> = bytes[..200].to_vec();
        bytes.extend(cut);
        let log = import(&bytes).unwrap().log;
        assert_eq!(log.rows.len(), 2, "{log:?}");
        let expected: serde_json::Value =
            serde_json::from_str(include_str!("../../../../firmware/wire/tests/vectors/pd0_expected.json")).unwrap();
        for (row, name) in log.rows.iter().zip(["wh_bt_good_a", "wh_bt_good_b"]) {
            let heading = expected[name]["variable"]["heading_cdeg"].as_f64().unwrap() / 100.0;
            let found = row.get(Column::Heading).unwrap().to_degrees().rem_euclid(360.0);
            assert!((found - heading).abs() < 1e-9, "{name}: {found} {heading}");
        }
    }
}

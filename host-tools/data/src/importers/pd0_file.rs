//! Files of PD0 ensembles, as a DVL or an ADCP of Teledyne RDI records them.

use super::Imported;
use super::messages::Gathering;
use super::sentences::dvl_samples;
use crate::DataError;
use crate::log::{Column, table};
use backseat_wire::calendar::{Date, DateTime, TimeOfDay};
use backseat_wire::dvl::Coordinates;
use backseat_wire::dvl::pd0::{Decoder, Ensemble};
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
    let mut bytes = Vec::new();
    table::open(path)?.read_to_end(&mut bytes).map_err(|e| DataError::io(path, &e))?;
    let (mut gathering, mut decoder, mut rest) = (Gathering::default(), Decoder::new(), &bytes[..]);
    let (mut ensembles, mut locked, mut frames) = (0, 0, Vec::new());
    while let Some(outcome) = decoder.feed(&mut rest) {
        let Ok(ensemble) = outcome else {
            gathering.leave_out("bytes", "no whole ensemble with its checksum");
            continue;
        };
        ensembles += 1;
        let Some(time_us) = time_us(&ensemble) else {
            gathering.leave_out("ensembles", "no time: the clock of the instrument was never set");
            continue;
        };
        let sample = ensemble.sample(0.0);
        let is_fixed = matches!(sample.frame, Coordinates::Instrument | Coordinates::Ship);
        if ensemble.bottom.is_some() && !is_fixed {
            gathering.leave_out(
                "velocities",
                "along the beams, levelled, or of the earth: set EX to instrument or ship axes",
            );
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
        "times are the instrument's clock; attitude is its own, its heading magnetic unless it was corrected; in instrument \
         axes beam 3 is taken to point forward"
            .to_owned(),
    ];
    Ok(Imported { format: NAME, log: gathering.finish(path, notes)? })
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
    use super::*;

    #[test]
    fn val_recorded_ensembles() {
        let mut bytes = Vec::new();
        let vectors = include_str!("../../../../firmware/wire/tests/vectors/pd0.hex");
        // two ensembles of a WorkHorse with bottom lock, and one cut off
        for name in ["wh_bt_good_a", "wh_bt_good_b"] {
            let line = vectors.lines().find(|line| line.starts_with(name)).unwrap();
            let digits = line.rsplit('\t').next().unwrap();
            bytes.extend((0..digits.len() / 2).map(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).unwrap()));
        }
        let cut: Vec<u8> = bytes[..200].to_vec();
        bytes.extend(cut);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("RDI.000");
        std::fs::write(&path, bytes).unwrap();
        let log = super::super::read(&path).unwrap().log;
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

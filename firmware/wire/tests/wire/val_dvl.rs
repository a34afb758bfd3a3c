use crate::random::Random;
use crate::vectors::{bytes, fed_at, lines};
use backseat_wire::Error;
use backseat_wire::dvl::{Coordinates, DvlSample, pd0, pd4, pd6};
use serde_json::Value;

const PD0: &str = include_str!("../vectors/pd0.hex");
const PD0_EXPECTED: &str = include_str!("../vectors/pd0_expected.json");
const PD4: &str = include_str!("../vectors/pd4.hex");
const PD4_EXPECTED: &str = include_str!("../vectors/pd4_expected.json");
const PD6: &str = include_str!("../vectors/pd6.txt");

fn vector(file: &'static str, name: &str) -> Vec<u8> {
    let columns = lines(file).find(|columns| columns[0] == name).unwrap();
    bytes(columns[3])
}

fn integers(value: &Value) -> Vec<i64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_i64().unwrap()).collect()
}

fn same<T: Copy + Into<i64>>(ours: &[T], expected: &Value, what: &str) {
    let ours: Vec<i64> = ours.iter().map(|value| (*value).into()).collect();
    assert_eq!(ours, integers(expected), "{what}");
}

#[test]
fn val_pd0_every_vector() {
    let expected: Value = serde_json::from_str(PD0_EXPECTED).unwrap();
    let (mut taken, mut bottoms) = (0, 0);
    for columns in lines(PD0) {
        let (name, frame) = (columns[0], bytes(columns[3]));
        let want = &expected[name];
        match name {
            "glider_LB180210_corrupt" => assert_eq!(pd0::Ensemble::parse(&frame), Err(Error::Checksum)),
            "synth_bad_offset" => assert_eq!(pd0::Ensemble::parse(&frame), Err(Error::Offset)),
            "synth_zero_types" => assert_eq!(pd0::Ensemble::parse(&frame), Ok(pd0::Ensemble::default())),
            _ => {
                let ensemble = pd0::Ensemble::parse(&frame).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
                bottoms += usize::from(ensemble.bottom.is_some());
                assert_pd0(name, &ensemble, want);
                // The blocks we know survive being written in an Explorer's sizes.
                let mut buffer = [0; 512];
                let written = ensemble.emit(&mut buffer).unwrap();
                assert_eq!(pd0::Ensemble::parse(written), Ok(ensemble), "{name}");
                taken += 1;
            }
        }
    }
    assert_eq!((taken, bottoms), (12, 7));
}

fn assert_pd0(name: &str, ensemble: &pd0::Ensemble, want: &Value) {
    let (fixed, variable) = (ensemble.fixed.unwrap(), ensemble.variable.unwrap());
    same(&fixed.firmware, &want["fixed"]["fw"], name);
    for (ours, key) in [
        (i64::from(fixed.configuration), "sysconfig"),
        (fixed.beams.into(), "beams"),
        (fixed.cells.into(), "cells"),
        (fixed.pings.into(), "pings"),
        (fixed.cell_cm.into(), "cell_cm"),
        (fixed.coordinates.into(), "coord_byte"),
        (fixed.heading_alignment_cdeg.into(), "heading_align_cdeg"),
    ] {
        assert_eq!(ours, want["fixed"][key].as_i64().unwrap(), "{name} {key}");
    }
    same(&variable.clock, &want["variable"]["rtc"], name);
    for (ours, key) in [
        (i64::from(variable.ensemble), "ensemble"),
        (variable.built_in_test.into(), "bit"),
        (variable.sound_speed_mps.into(), "sound_speed_mps"),
        (variable.depth_dm.into(), "depth_dm"),
        (variable.heading_cdeg.into(), "heading_cdeg"),
        (variable.pitch_cdeg.into(), "pitch_cdeg"),
        (variable.roll_cdeg.into(), "roll_cdeg"),
        (variable.salinity_ppt.into(), "salinity_ppt"),
        (variable.temperature_cdegc.into(), "temp_cdegC"),
    ] {
        assert_eq!(ours, want["variable"][key].as_i64().unwrap(), "{name} {key}");
    }
    same(&ensemble.first_cell_mmps.unwrap(), &want["first_cell_vel_mmps"], name);
    assert_eq!(ensemble.bottom.is_some(), want.get("bottom").is_some(), "{name}");
    let Some(bottom) = ensemble.bottom else { return };
    let want = &want["bottom"];
    same(&bottom.range_cm, &want["range_cm"], name);
    same(&bottom.velocity_mmps, &want["vel_mmps"], name);
    same(&bottom.correlation, &want["corr"], name);
    same(&bottom.amplitude, &want["eval"], name);
    same(&bottom.percent_good, &want["pct_good"], name);
    same(&bottom.layer_velocity_mmps, &want["ref_vel_mmps"], name);
    assert_eq!(i64::from(bottom.max_depth_dm), want["max_depth_dm"].as_i64().unwrap());
}

#[test]
fn val_pd0_and_pd4_agree_on_the_vehicle_in_spite_of_their_signs() {
    let pd0 = pd0::Ensemble::parse(&vector(PD0, "synth_explorer_fwd")).unwrap().sample(0.0);
    let pd4 = pd4::Record::parse(&vector(PD4, "pd4_fwd")).unwrap().sample(0.0);
    // 1.250 m/s along beam 3, 12 mm/s to starboard, and z on the wire is away from the bottom.
    assert_eq!(pd0.bottom_mps, Some([1.250, 0.012, 0.004]));
    assert_eq!(pd4.bottom_mps, Some([1.250, 0.012, 0.004]));
    assert_eq!(pd4.water_mps, Some([1.198, 0.011, 0.003]));
    assert_eq!((pd0.water_mps, pd0.frame), (None, Coordinates::Instrument));
    assert_eq!(pd0.error_mps, Some(0.001));
    assert!((pd0.altitude_m.unwrap() - 12.1875).abs() < 1e-12);
    assert_eq!((pd0.depth_m, pd0.sound_speed_mps), (Some(3.2), Some(1506.0)));
    let [roll, pitch, heading] = pd0.attitude_rad.unwrap().map(f64::to_degrees);
    assert!((roll + 0.40).abs() < 1e-9 && (pitch - 1.25).abs() < 1e-9 && (heading - 310.2).abs() < 1e-9);
    assert_eq!(pd0.time_of_day_s, Some(43_201.0));
}

#[test]
fn val_pd0_lost_far_and_other_frames() {
    let lost = pd0::Ensemble::parse(&vector(PD0, "synth_explorer_lost")).unwrap().sample(0.0);
    assert_eq!((lost.bottom_mps, lost.altitude_m, lost.error_mps), (None, None, None));
    let far = pd0::Ensemble::parse(&vector(PD0, "synth_explorer_range_msb")).unwrap().sample(0.0);
    assert_eq!(far.altitude_m, Some(700.0));
    // The recorded WorkHorse was set up for earth coordinates: no body velocity, but an altitude.
    let three = pd0::Ensemble::parse(&vector(PD0, "wh_bt_3beam")).unwrap().sample(0.0);
    assert_eq!((three.frame, three.bottom_mps, three.error_mps), (Coordinates::Earth, None, None));
    assert!((three.altitude_m.unwrap() - (12.93 + 10.35 + 7.80) / 3.0).abs() < 1e-12);
    assert_eq!(pd0::Ensemble::default().sample(0.0), DvlSample { frame: Coordinates::Beam, ..DvlSample::default() });
}

#[test]
fn pd0_blocks_in_any_order_too_short_or_unknown() {
    let good = vector(PD0, "synth_explorer_fwd");
    let sealed = |mut frame: Vec<u8>| {
        let covered = frame.len() - 2;
        let sum = frame[..covered].iter().fold(0_u16, |sum, byte| sum.wrapping_add(u16::from(*byte)));
        frame[covered..].copy_from_slice(&sum.to_le_bytes());
        frame
    };
    let mut swapped = good.clone();
    swapped.copy_within(6..8, 12);
    swapped[6..8].copy_from_slice(&good[12..14]);
    assert_eq!(pd0::Ensemble::parse(&sealed(swapped)), pd0::Ensemble::parse(&good));
    // The bottom track block begins 20 bytes before the end.
    let mut short = good.clone();
    let offset = (good.len() - 2 - 20) as u16;
    short[12..14].copy_from_slice(&offset.to_le_bytes());
    short[usize::from(offset)..][..2].copy_from_slice(&[0x00, 0x06]);
    assert_eq!(pd0::Ensemble::parse(&sealed(short)), Err(Error::Offset));
    let mut other = good.clone();
    other[148..150].copy_from_slice(&[0x03, 0x58]);
    assert_eq!(pd0::Ensemble::parse(&sealed(other)).unwrap().bottom, None);
    assert_eq!(pd0::Ensemble::parse(&good[..100]), Err(Error::Length));
    assert_eq!(pd0::Ensemble::parse(&good[1..]), Err(Error::Framing));
    assert_eq!(pd0::Ensemble::parse(&[0x7F, 0x7F, 3, 0, 0, 0]), Err(Error::Length));
    assert_eq!(pd0::Ensemble::parse(&[]), Err(Error::Length));
}

#[test]
fn val_pd0_stream_finds_the_next_ensemble_after_corrupt_ones() {
    let mut stream = Vec::new();
    for (index, columns) in lines(PD0).enumerate() {
        stream.extend(b"\x7F\x7Fnoise\x7F");
        let frame = bytes(columns[3]);
        // Every second ensemble is preceded by its own first half.
        if index % 2 == 1 {
            stream.extend(&frame[..frame.len() / 2]);
        }
        stream.extend(&frame);
    }
    // A false start may make the decoder wait for more than is left.
    stream.extend([0; pd0::MAX_ENSEMBLE]);
    let feed = |split| fed_at(pd0::Decoder::new(), &stream, split, pd0::Decoder::feed, |decoder| *decoder.counts());
    let (found, counts) = feed(0);
    assert_eq!((found.len(), counts.accepted()), (13, 13));
    assert!(counts.of(Error::Checksum) >= 1 && counts.of(Error::Offset) >= 1 && counts.of(Error::Length) >= 1);
    for split in (0..=stream.len()).step_by(2) {
        assert_eq!(feed(split), (found.clone(), counts), "split at {split}");
    }
}

#[test]
fn val_pd4_every_vector() {
    let expected: Value = serde_json::from_str(PD4_EXPECTED).unwrap();
    for columns in lines(PD4) {
        let (name, frame) = (columns[0], bytes(columns[3]));
        match name {
            "pd4_badsum" => assert_eq!(pd4::Record::parse(&frame), Err(Error::Checksum)),
            "pd4_truncated" => assert_eq!(pd4::Record::parse(&frame), Err(Error::Length)),
            "pd4_sync_in_noise" => {
                let (found, counts) =
                    fed_at(pd4::Decoder::new(), &frame, 5, pd4::Decoder::feed, |decoder| *decoder.counts());
                assert_eq!((found.len(), counts.of(Error::Length)), (1, 1));
            }
            _ => {
                let record = pd4::Record::parse(&frame).unwrap_or_else(|cause| panic!("{name}: {cause:?}"));
                let want = &expected[name];
                same(&record.bottom_mmps, &want["vel_mmps"], name);
                same(&record.range_cm, &want["range_cm"], name);
                same(&record.water_mmps, &want["water_mmps"], name);
                assert_eq!(i64::from(record.bottom_status), want["bottom_status"].as_i64().unwrap());
                assert_eq!(record.extended.is_some(), name == "pd5_fwd");
                assert_eq!(record.emit(&mut [0; pd4::MAX_RECORD]).unwrap(), frame, "{name}");
            }
        }
    }
    let sample = |name| pd4::Record::parse(&vector(PD4, name)).unwrap().sample(0.0);
    assert_eq!(sample("pd4_lost").bottom_mps, None);
    // A three-beam solution is a solution.
    let three = sample("pd4_3beam");
    assert_eq!((three.bottom_mps, three.error_mps, three.water_mps), (Some([0.9, 0.005, 0.0]), None, None));
    assert!((three.altitude_m.unwrap() - (10.40 + 10.50 + 10.42) / 3.0).abs() < 1e-12);
    let attitude = sample("pd5_fwd").attitude_rad.unwrap().map(f64::to_degrees);
    assert!(
        (attitude[0] + 0.40).abs() < 1e-9 && (attitude[1] - 1.25).abs() < 1e-9 && (attitude[2] - 310.2).abs() < 1e-9
    );
    assert_eq!(sample("pd5_fwd").depth_m, Some(3.2));
}

#[test]
fn pd4_stream_at_every_split() {
    let stream: Vec<u8> = lines(PD4).flat_map(|columns| bytes(columns[3])).chain([0; pd4::MAX_RECORD]).collect();
    let feed = |split| fed_at(pd4::Decoder::new(), &stream, split, pd4::Decoder::feed, |decoder| *decoder.counts());
    let (found, counts) = feed(0);
    assert_eq!(found.len(), 5);
    assert!(counts.of(Error::Checksum) >= 1);
    for split in 0..=stream.len() {
        assert_eq!(feed(split), (found.clone(), counts), "split at {split}");
    }
}

/// The lines of the blocks whose heading begins with one of `kinds`.
fn pd6_blocks(kind: &str) -> Vec<String> {
    PD6.split("## ")
        .skip(1)
        .filter(|block| block.starts_with(kind))
        .map(|block| block.lines().skip(1).map(|line| format!("{line}\r\n")).collect())
        .collect()
}

fn pd6_samples(text: &str, split: usize) -> (Vec<DvlSample>, backseat_wire::Counts) {
    fed_at(pd6::Decoder::new(0.0), text.as_bytes(), split, pd6::Decoder::feed, |decoder| *decoder.counts())
}

#[test]
fn val_pd6_recorded_frames() {
    let blocks = pd6_blocks("real");
    let (lost, counts) = pd6_samples(&blocks[0], 0);
    assert_eq!((lost.len(), counts.of(Error::Unhandled), counts.rejected()), (1, 1, 0));
    assert_eq!((lost[0].bottom_mps, lost[0].altitude_m), (None, None));
    assert_eq!((lost[0].depth_m, lost[0].sound_speed_mps), (Some(0.2), Some(1524.2)));
    assert!((lost[0].time_of_day_s.unwrap() - (18.0 * 3600.0 + 8.0 * 60.0 + 32.69)).abs() < 1e-9);
    let (still, counts) = pd6_samples(&blocks[1], 0);
    assert_eq!((still.len(), counts.rejected()), (1, 0));
    assert_eq!((still[0].bottom_mps, still[0].error_mps), (Some([0.0; 3]), None));
    assert_eq!((still[0].altitude_m, still[0].sound_speed_mps), (Some(0.55), Some(1505.4)));
    let attitude = still[0].attitude_rad.unwrap().map(f64::to_degrees);
    assert!((attitude[0] - 4.35).abs() < 1e-9 && (attitude[1] + 5.91).abs() < 1e-9 && attitude[2] == 0.0);
    let (partial, counts) = pd6_samples(&blocks[2], 0);
    assert_eq!((partial.len(), counts.rejected()), (1, 0));
    assert_eq!((partial[0].bottom_mps, partial[0].altitude_m), (Some([-2.345, 0.0, 0.439]), Some(0.4)));
}

#[test]
fn val_pd6_synth_sets() {
    let blocks = pd6_blocks("synth");
    let (full, counts) = pd6_samples(&blocks[0], 0);
    assert_eq!((full.len(), counts.rejected()), (1, 0));
    assert_eq!((full[0].bottom_mps, full[0].water_mps), (Some([1.250, 0.012, 0.004]), Some([1.198, 0.011, 0.003])));
    assert_eq!((full[0].altitude_m, full[0].depth_m, full[0].frame), (Some(10.4), Some(3.2), Coordinates::Instrument));
    let (lost, _) = pd6_samples(&blocks[1], 0);
    assert_eq!((lost[0].bottom_mps, lost[0].altitude_m), (None, None));
    assert_eq!(lost[0].water_mps, Some([1.198, 0.011, 0.003]));
}

#[test]
fn val_pd6_malformed_lines_are_refused_by_cause() {
    let malformed = &pd6_blocks("synth")[2];
    let causes: Vec<Error> = malformed
        .lines()
        .filter(|line| line.starts_with(':'))
        .map(|line| {
            let mut decoder = pd6::Decoder::new(0.0);
            let line = format!("{line}\r\n");
            decoder.feed(&mut line.as_bytes()).unwrap().unwrap_err()
        })
        .collect();
    assert_eq!(
        causes,
        [Error::Length, Error::Length, Error::OutOfRange, Error::Length, Error::Unknown, Error::Malformed]
    );
    // The line without its colon is noise.
    let (samples, counts) = pd6_samples(malformed, 0);
    assert_eq!((samples.len(), counts.rejected()), (0, 6));
    assert!(counts.skipped_bytes() >= 16);
}

#[test]
fn pd6_without_instrument_axes_or_distance_lines() {
    let set = ":SA,0.0,0.0,0.0\r\n:BS,+9,+1250,-4,A\r\n:BE,+1,+2,+3,A\r\n";
    let (samples, _) = pd6_samples(&format!("{set}{set}"), 0);
    assert_eq!(samples.len(), 1);
    assert_eq!((samples[0].bottom_mps, samples[0].frame), (Some([1.250, 0.009, 0.004]), Coordinates::Ship));
}

#[test]
fn pd6_at_every_split() {
    let text: String = pd6_blocks("").concat();
    let (found, counts) = pd6_samples(&text, 0);
    assert_eq!(found.len(), 5);
    for split in 0..=text.len() {
        assert_eq!(pd6_samples(&text, split), (found.clone(), counts), "split at {split}");
    }
}

#[test]
fn mounting_angle_turns_beam_3_to_starboard() {
    // Mounted with beam 3 at 45 degrees to starboard and moving forward: beam 3 and beam 1 (port of it) lead alike.
    let mounting = std::f64::consts::FRAC_PI_4;
    let [x, y, z] = Coordinates::Instrument.from_body([1.0, 0.0, 0.0], mounting).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!((x + half).abs() < 1e-15 && (y - half).abs() < 1e-15 && z == 0.0);
    let body = Coordinates::Instrument.to_body([0.0, 1.0, 0.0], mounting).unwrap();
    assert!((body[0] - half).abs() < 1e-15 && (body[1] - half).abs() < 1e-15);
    assert_eq!(Coordinates::Ship.to_body([0.1, 1.0, 0.2], mounting), Some([1.0, 0.1, -0.2]));
    for frame in [Coordinates::Beam, Coordinates::Earth, Coordinates::ShipLevelled] {
        assert_eq!(frame.to_body([0.0; 3], 0.0), None);
    }
}

#[test]
fn emulated_instruments_say_what_they_measured() {
    let mut noise = Random(1);
    for _ in 0..200 {
        let mut part = |scale: f64| noise.within(scale);
        let sample = DvlSample {
            bottom_mps: Some([part(2.0), part(0.5), part(0.3)]),
            water_mps: Some([part(2.0) + 3.0, part(0.5), part(0.3)]),
            altitude_m: Some(part(20.0) + 25.0),
            error_mps: Some(part(0.02)),
            attitude_rad: Some([part(0.3), part(0.3), part(3.0) + 3.1]),
            depth_m: Some(part(50.0) + 51.0),
            sound_speed_mps: Some(1_500.0),
            time_of_day_s: Some(43_201.25),
            frame: Coordinates::Instrument,
        };
        let mounting = part(3.0);
        let mut buffer = [0; 512];
        let pd0 = pd0::Ensemble::from_sample(&sample, 70_000, mounting);
        let pd0 = pd0::Ensemble::parse(pd0.emit(&mut buffer).unwrap()).unwrap();
        assert_eq!(pd0.variable.unwrap().ensemble, 70_000);
        assert_near(&pd0.sample(mounting), &sample);
        let pd5 = pd4::Record::from_sample(&sample, true, mounting);
        assert_near(&pd4::Record::parse(pd5.emit(&mut buffer).unwrap()).unwrap().sample(mounting), &sample);
        let mut decoder = pd6::Decoder::new(mounting);
        let mut text = pd6::emit(&sample, mounting, &mut buffer).unwrap();
        assert_near(&decoder.feed(&mut text).unwrap().unwrap(), &sample);
        assert_eq!(decoder.counts().rejected(), 0);
    }
    let lost = DvlSample::default();
    let mut buffer = [0; 512];
    let pd0 = pd0::Ensemble::from_sample(&lost, 1, 0.3).sample(0.3);
    let pd4 = pd4::Record::from_sample(&lost, false, 0.3).sample(0.3);
    let pd6 = pd6::Decoder::new(0.3).feed(&mut pd6::emit(&lost, 0.3, &mut buffer).unwrap()).unwrap().unwrap();
    for sample in [pd0, pd4, pd6] {
        assert_eq!((sample.bottom_mps, sample.water_mps, sample.altitude_m), (None, None, None));
    }
    // Absurd values saturate instead of becoming "invalid" or wrapping.
    let absurd = DvlSample { bottom_mps: Some([1e9, -1e9, f64::NAN]), ..lost };
    pd0::Ensemble::from_sample(&absurd, 1, f64::NAN).emit(&mut buffer).unwrap();
    assert_eq!(pd6::emit(&absurd, 0.0, &mut [0; 10]), Err(Error::BufferFull));
}

/// Velocities are sent to 1 mm/s each of two axes that a mounting angle mixes, angles to 0.01 degree, depth to 0.1 m.
fn assert_near(ours: &DvlSample, wanted: &DvlSample) {
    let near = |a: [f64; 3], b: [f64; 3], tolerance: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(near(ours.bottom_mps.unwrap(), wanted.bottom_mps.unwrap(), 0.000_72), "{ours:?} {wanted:?}");
    assert!(near(ours.water_mps.unwrap(), wanted.water_mps.unwrap(), 0.000_72), "{ours:?} {wanted:?}");
    assert!(near(ours.attitude_rad.unwrap(), wanted.attitude_rad.unwrap(), 0.000_088), "{ours:?} {wanted:?}");
    assert!((ours.altitude_m.unwrap() - wanted.altitude_m.unwrap()).abs() <= 0.005_01);
    assert!((ours.depth_m.unwrap() - wanted.depth_m.unwrap()).abs() <= 0.050_01);
    assert!((ours.error_mps.unwrap() - wanted.error_mps.unwrap()).abs() <= 0.000_501);
    assert_eq!((ours.sound_speed_mps, ours.frame), (wanted.sound_speed_mps, wanted.frame));
    assert!((ours.time_of_day_s.unwrap() - wanted.time_of_day_s.unwrap()).abs() < 1e-9);
}

//! Binary frames: integers and IEEE numbers, so that everything comes back to the bit.

use backseat_wire::ahrs::gx3::{self, Command, FromGx3, Reply, ToGx3};
use backseat_wire::ahrs::mip::{self, Field, Packet};
use backseat_wire::dvl::pd0::{BottomTrack, Ensemble, FixedLeader, MAX_ENSEMBLE, VariableLeader};
use backseat_wire::dvl::pd4::{Extended, MAX_RECORD, Record};
use backseat_wire::ship_state::{Key, ShipState};
use proptest::array::{uniform3, uniform4, uniform9};
use proptest::option;
use proptest::prelude::*;
use proptest::sample::Index;

fn fixed_leader() -> impl Strategy<Value = FixedLeader> {
    any::<([u8; 2], u16, u8, u8, u16, u16, u8, i16)>().prop_map(
        |(firmware, configuration, beams, cells, pings, cell_cm, coordinates, heading_alignment_cdeg)| FixedLeader {
            firmware,
            configuration,
            beams,
            cells,
            pings,
            cell_cm,
            coordinates,
            heading_alignment_cdeg,
        },
    )
}

fn variable_leader() -> impl Strategy<Value = VariableLeader> {
    let numbers = (0..1_u32 << 24, any::<[u8; 7]>(), any::<[u16; 3]>());
    (numbers, any::<(u16, i16, i16, u16, i16)>()).prop_map(
        |(
            (ensemble, clock, [built_in_test, sound_speed_mps, depth_dm]),
            (heading_cdeg, pitch_cdeg, roll_cdeg, salinity_ppt, temperature_cdegc),
        )| VariableLeader {
            ensemble,
            clock,
            built_in_test,
            sound_speed_mps,
            depth_dm,
            heading_cdeg,
            pitch_cdeg,
            roll_cdeg,
            salinity_ppt,
            temperature_cdegc,
        },
    )
}

fn bottom_track() -> impl Strategy<Value = BottomTrack> {
    let ranges = uniform4(0..1_u32 << 24);
    (ranges, any::<([i16; 4], [u8; 4], [u8; 4], [u8; 4], [i16; 4], u16)>()).prop_map(
        |(range_cm, (velocity_mmps, correlation, amplitude, percent_good, layer_velocity_mmps, max_depth_dm))| {
            BottomTrack {
                range_cm,
                velocity_mmps,
                correlation,
                amplitude,
                percent_good,
                layer_velocity_mmps,
                max_depth_dm,
            }
        },
    )
}

fn record() -> impl Strategy<Value = Record> {
    let extended = any::<(u8, u16, i16, i16, u16, [i32; 4], [i32; 4])>().prop_map(
        |(salinity_ppt, depth_dm, pitch_cdeg, roll_cdeg, heading_cdeg, bottom_distance_dm, water_distance_dm)| {
            Extended {
                salinity_ppt,
                depth_dm,
                pitch_cdeg,
                roll_cdeg,
                heading_cdeg,
                bottom_distance_dm,
                water_distance_dm,
            }
        },
    );
    let velocities = any::<(u8, [i16; 4], [u16; 4], u8, [i16; 4])>();
    (velocities, any::<([u16; 2], u8, [u8; 4], u16, u16, i16)>(), option::of(extended)).prop_map(
        |(
            (configuration, bottom_mmps, range_cm, bottom_status, water_mmps),
            (layer_dm, water_status, clock, built_in_test, sound_speed_mps, temperature_cdegc),
            extended,
        )| Record {
            configuration,
            bottom_mmps,
            range_cm,
            bottom_status,
            water_mmps,
            layer_dm,
            water_status,
            clock,
            built_in_test,
            sound_speed_mps,
            temperature_cdegc,
            extended,
        },
    )
}

const COMMANDS: [Command; 8] = [
    Command::AccelRate,
    Command::Matrix,
    Command::AccelRateMatrix,
    Command::AccelRateMag,
    Command::AccelRateMagMatrix,
    Command::Euler,
    Command::EulerRate,
    Command::Stabilised,
];

/// Numbers that a sensor can give.
fn reply() -> impl Strategy<Value = Reply> {
    let three = || uniform3(-1.5_f32..1.5);
    (0..COMMANDS.len(), [three(), three(), three(), three()], uniform9(-1.0_f32..1.0), any::<u32>()).prop_map(
        |(command, [accel, rate, mag, euler], matrix, ticks)| {
            let command = COMMANDS[command];
            let has = |list: &[Command]| list.contains(&command);
            Reply {
                command,
                accel_g: (!has(&[Command::Matrix, Command::Euler, Command::EulerRate])).then_some(accel),
                rate_radps: (!has(&[Command::Matrix, Command::Euler])).then_some(rate),
                mag_gauss: has(&[Command::AccelRateMag, Command::AccelRateMagMatrix, Command::Stabilised])
                    .then_some(mag),
                matrix: has(&[Command::Matrix, Command::AccelRateMatrix, Command::AccelRateMagMatrix])
                    .then_some(matrix),
                euler_rad: has(&[Command::Euler, Command::EulerRate]).then_some(euler),
                ticks,
            }
        },
    )
}

proptest! {
    #[test]
    fn pd0(
        fixed in option::of(fixed_leader()),
        variable in option::of(variable_leader()),
        bottom in option::of(bottom_track()),
        first_cell_mmps in option::of(any::<[i16; 4]>()),
    ) {
        let ensemble = Ensemble { fixed, variable, bottom, first_cell_mmps };
        let mut buffer = [0; MAX_ENSEMBLE];
        let frame = ensemble.emit(&mut buffer).unwrap();
        prop_assert_eq!(Ensemble::parse(frame), Ok(ensemble));
    }

    #[test]
    fn pd4_and_pd5(record in record()) {
        let mut buffer = [0; MAX_RECORD];
        let frame = record.emit(&mut buffer).unwrap();
        prop_assert_eq!(Record::parse(frame), Ok(record));
    }

    #[test]
    fn gx3(reply in reply()) {
        let mut buffer = [0; 96];
        let frame = reply.emit(&mut buffer).unwrap();
        prop_assert_eq!(Reply::parse(frame), Ok(reply));
        // and out of a stream, behind what is none
        let stream = [b"\x00\x7F".as_slice(), frame].concat();
        let (mut decoder, mut rest, mut found) = (gx3::Decoder::new(), stream.as_slice(), None);
        while let Some(outcome) = decoder.feed(&mut rest) {
            found = outcome.ok().or(found);
        }
        prop_assert!(matches!(found, Some(FromGx3::Data(_, command)) if command == reply.command));
    }

    #[test]
    fn gx3_commands(command in 0..COMMANDS.len(), kind in 0..3) {
        let command = COMMANDS[command];
        let command = [ToGx3::Poll(command), ToGx3::Continuous(command), ToGx3::Stop][kind as usize];
        let mut buffer = [0; 8];
        let bytes = command.emit(&mut buffer).unwrap();
        prop_assert_eq!(ToGx3::parse(bytes), Ok(Some((command, bytes.len()))));
    }

    #[test]
    fn mip(set in any::<u8>(), fields in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 0..40)), 0..6)) {
        let fields: Vec<Field<'_>> = fields.iter().map(|(descriptor, data)| Field { descriptor: *descriptor, data }).collect();
        let mut buffer = [0; mip::MAX_PACKET];
        let frame = mip::emit(set, &fields, &mut buffer).unwrap();
        let packet = Packet::parse(frame).unwrap();
        prop_assert_eq!(packet.set, set);
        prop_assert_eq!(packet.fields().collect::<Result<Vec<_>, _>>(), Ok(fields));
    }

    #[test]
    fn ship_state(
        (source, sequence, transmit_s) in any::<(u8, u8, u32)>(),
        position in (-900_000_000..=900_000_000_i64, -1_800_000_000..=1_800_000_000_i64),
        velocity in uniform3(-32_700..=32_700_i64),
        (position_sigma, velocity_sigma, depth) in any::<(u8, u8, u8)>(),
        (key, bit) in any::<([u8; 16], Index)>(),
    ) {
        let state = ShipState {
            source,
            sequence,
            transmit_s,
            position_deg: [position.0 as f64 / 1e7, position.1 as f64 / 1e7],
            velocity_mps: [velocity[0] as f64 / 1e3, velocity[1] as f64 / 1e3],
            position_sigma_m: f64::from(position_sigma) / 10.0,
            velocity_sigma_mps: f64::from(velocity_sigma) / 100.0,
            transducer_depth_m: f64::from(depth) / 10.0,
        };
        prop_assert_eq!(ShipState::parse(&state.emit().unwrap()), Ok(state));
        let key = Key::new(key);
        let whole = state.emit_authentic(&key).unwrap();
        prop_assert_eq!(ShipState::parse_authentic(&whole, &key), Ok(state));
        prop_assert_eq!(ShipState::parse(&whole), Ok(state));
        if key.is_set() {
            // one wrong bit anywhere, in payload or code
            let mut wrong = whole;
            wrong[bit.index(8 * whole.len()) / 8] ^= 1 << (bit.index(8 * whole.len()) % 8);
            prop_assert!(ShipState::parse_authentic(&wrong, &key).is_err());
            prop_assert!(ShipState::parse_authentic(&state.emit().unwrap(), &key).is_err());
        }
    }
}

//! A flight whose lines are disturbed, on any board that is reached over its ports: the app in this process and
//! the ARM image in QEMU have to do the same, bit for bit.

use crate::false_inputs::{FalseInput, HOST_KEY};
use crate::flight::{self, STEP_US, swim};
use arbitrary::{Arbitrary, Unstructured};
use backseat_link::{Arrival, BackseatError, Client, Ports, StepOutput};
use backseat_wire::hostlink::{MAX_CHUNKS, Port};
use backseat_wire::ship_state::Key;
use hil_sim::devices::Devices;
use hil_sim::flight::board_parameters;
use hil_sim::world::World;

const SECOND_US: u64 = 1_000_000;
/// What one input may cost, steps.
const MOST_STEPS: usize = 600;
/// A board whose filter has started.
const READY_US: u64 = 15 * SECOND_US;
/// Bytes of one step on one port: what the ARM image's queues hold.
const MOST_BYTES: usize = 1500;

/// What is done to the lines, for so many tenths of a second.
#[derive(Arbitrary, Debug)]
enum Disturbance {
    /// Nothing.
    Honest,
    /// A byte of every frame of a port is changed.
    Changed { port: u8, at: u16, xor: u8 },
    /// Every frame of a port loses its end.
    Cut { port: u8, length: u8 },
    /// Every frame of a port comes twice.
    Twice { port: u8 },
    /// Nothing comes from a port.
    Silent { port: u8 },
    /// Bytes of the input are added to a port.
    Bytes { port: u8, length: u8 },
    /// Something right in form is added to its port.
    False(FalseInput),
}

impl Disturbance {
    fn disturb(&self, arrivals: &mut Vec<(Port, Arrival)>, now_us: u64, rest: &mut Unstructured<'_>) {
        let device = |port: u8| Port::DEVICES[usize::from(port) % Port::DEVICES.len()];
        let frames = |arrivals: &mut Vec<(Port, Arrival)>, of: u8, change: &dyn Fn(&mut Vec<u8>)| {
            arrivals
                .iter_mut()
                .filter(|(port, _)| *port == device(of))
                .for_each(|(_, arrival)| change(&mut arrival.bytes));
        };
        match *self {
            Self::Honest => {}
            Self::Changed { port, at, xor } => frames(arrivals, port, &|bytes| {
                let at = usize::from(at) % bytes.len().max(1);
                bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= xor);
            }),
            Self::Cut { port, length } => frames(arrivals, port, &|bytes| bytes.truncate(usize::from(length))),
            Self::Twice { port } => frames(arrivals, port, &|bytes| bytes.extend_from_within(..)),
            Self::Silent { port } => arrivals.retain(|(of, _)| *of != device(port)),
            Self::Bytes { port, length } => {
                let bytes = rest.bytes(rest.len().min(usize::from(length))).unwrap_or_default().to_vec();
                arrivals.push((device(port), Arrival { time_us: now_us, bytes }));
            }
            Self::False(ref input) => {
                let (port, bytes) = input.on_port();
                arrivals.push((port, Arrival { time_us: now_us, bytes }));
            }
        }
    }
}

/// Flies a mission on the board behind `client` while `data` says what is done to its lines, at most a minute; what the
/// board did in each step.
///
/// # Errors
/// When the board is gone, or silent.
pub fn fly_disturbed<P: Ports>(client: &mut Client<P>, data: &[u8]) -> Result<Vec<StepOutput>, BackseatError> {
    let scenario = flight::scenario();
    client.hello()?;
    client.sign_with(Key::new(HOST_KEY));
    client.set_parameters(&board_parameters(scenario))?;
    client.set_mission(&flight::legs())?;
    client.step(0, &[], &[])?;
    let (mut world, mut devices) = (World::new(scenario), Devices::new(scenario));
    let mut rest = Unstructured::new(data);
    let (mut disturbance, mut left) = (Disturbance::Honest, READY_US / STEP_US);
    let mut outputs = Vec::new();
    let mut now_us = 0;
    while outputs.len() < MOST_STEPS {
        if left == 0 {
            let next = u8::arbitrary(&mut rest).and_then(|steps| Ok((steps, Disturbance::arbitrary(&mut rest)?)));
            let Ok((steps, next)) = next else { break };
            if rest.is_empty() {
                break;
            }
            (disturbance, left) = (next, u64::from(steps % 64));
        }
        left = left.saturating_sub(1);
        now_us += STEP_US;
        swim(&mut world, &mut devices, now_us);
        let mut arrivals = devices.arrivals(now_us);
        disturbance.disturb(&mut arrivals, now_us, &mut rest);
        for (_, said) in arrivals.iter().filter(|(port, _)| *port == Port::Host) {
            client.ports().write(Port::Host, &said.bytes)?;
        }
        let mut room = Port::DEVICES.map(|_| MOST_BYTES);
        arrivals.retain(|(port, arrival)| {
            let fits = room.get(*port as usize).is_some_and(|room| (1..=*room).contains(&arrival.bytes.len()));
            if fits {
                room[*port as usize] -= arrival.bytes.len();
            }
            fits
        });
        arrivals.truncate(MAX_CHUNKS);
        let edges: &[u64] = if now_us.is_multiple_of(SECOND_US) { &[now_us] } else { &[] };
        let output = client.step(now_us, edges, &arrivals)?;
        for (port, bytes) in Port::DEVICES.into_iter().zip(&output.sent) {
            devices.sent_by_backseat(port, now_us, bytes);
        }
        outputs.push(output);
        if now_us == READY_US {
            // refused by a board that was not ready, on either side
            let _ = client.start_mission();
        }
    }
    Ok(outputs)
}

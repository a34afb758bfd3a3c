//! One-way ranges need a clock that is worth them. The internal oscillator alone is none.

use crate::board::{Arrival, Board, Direct, Heard};
use crate::flight::start;
use crate::world::World;
use backseat_app::{App, Loss};
use backseat_wire::hostlink::{Health, Oscillator, ToBoard};

/// A board whose pulse per second can be cut.
struct Wired {
    board: Direct,
    pulse: bool,
}

impl Board for Wired {
    fn request(&mut self, message: &ToBoard<'_>) {
        self.board.request(message);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        self.board.step(time_us, if self.pulse { pps_us } else { &[] }, arrivals)
    }

    fn heard(&mut self) -> &mut Heard {
        self.board.heard()
    }

    fn app(&self) -> &App {
        self.board.app()
    }
}

impl Wired {
    /// Under way, with a packet every 20 s.
    fn under_way(oscillator: Oscillator, pulse: bool) -> (World, Self) {
        let (mut world, mut board) = (World::new(), Self { board: Direct::new(None), pulse });
        board.board.app_mut().set_oscillator(oscillator);
        world.run(&mut board, 10);
        start(&mut board);
        (world, board)
    }

    /// Flies 65 s: ranges fused and packets refused for want of a clock meanwhile, and what the board says of its
    /// clock.
    fn fly(&mut self, world: &mut World) -> (usize, u32, Health) {
        let refused = self.app().health().lost_packets(Loss::Undisciplined);
        self.heard().fusions.clear();
        world.run(self, 65);
        assert!(self.app().is_under_way());
        self.request(&ToBoard::HealthGet);
        let health = self.heard().health.take().expect("an answer");
        let ranges = self.heard().fusions.iter().filter(|fusion| fusion.sensor == 7 && fusion.outcome == 0).count();
        (ranges, self.app().health().lost_packets(Loss::Undisciplined) - refused, health)
    }
}

#[test]
fn the_internal_oscillator_alone_carries_no_one_way_range() {
    let (mut world, mut board) = Wired::under_way(Oscillator::Internal, false);
    let (ranges, refused, health) = board.fly(&mut world);
    assert_eq!(ranges, 0);
    assert!(refused >= 3, "{refused} packets refused");
    assert_eq!((health.oscillator, health.synchronised), (Oscillator::Internal, false));
}

#[test]
fn pulse_edges_make_it_worth_them_as_long_as_they_come() {
    let (mut world, mut board) = Wired::under_way(Oscillator::Internal, true);
    let (ranges, refused, health) = board.fly(&mut world);
    assert!(ranges >= 3 && refused == 0, "{ranges} ranges, {refused} packets refused");
    assert_eq!((health.oscillator, health.synchronised), (Oscillator::Internal, true));
    board.pulse = false;
    let (ranges, refused, _) = board.fly(&mut world);
    assert!(ranges == 0 && refused >= 3, "{ranges} ranges, {refused} packets refused");
    // the clock at HSE comes after all: UTC goes on from the last edge, by a crystal
    board.board.app_mut().set_oscillator(Oscillator::Crystal);
    let (ranges, refused, health) = board.fly(&mut world);
    assert!(ranges >= 3 && refused == 0, "{ranges} ranges, {refused} packets refused");
    assert_eq!(health.oscillator, Oscillator::Crystal);
}

#[test]
fn a_crystal_bridges_a_packet_without_the_boards_pulse() {
    // The range itself is timed by the modem, which has a pulse of its own, or the packet is refused.
    let (mut world, mut board) = Wired::under_way(Oscillator::Crystal, false);
    let (ranges, refused, health) = board.fly(&mut world);
    assert!(ranges >= 3 && refused == 0, "{ranges} ranges, {refused} packets refused");
    assert!(!health.synchronised);
}

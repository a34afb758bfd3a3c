//! Gain, laws and fin allocation.

use crate::measure::{Worst, count};
use crate::random::Random;
use crate::row;
use backseat_core::control::allocation::{AllocationMethod, Datum, Moments, allocate};
use backseat_core::control::lqr::Lqr;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{ControlConfig, ControlLaw, Controller};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::state::VehicleState;
use core::hint::black_box;

/// Everything.
pub fn measure(controller: &mut Controller) {
    let Ok(model) = VehicleModel::new(&VehicleParameters::IVER3) else { return };
    gain(&model);
    for (name, law) in [
        ("command, PD", ControlLaw::Pd),
        ("command, LQR", ControlLaw::Lqr),
        ("command, LQR on the reference trajectory", ControlLaw::LqrOnReference),
    ] {
        command(controller, &model, name, law);
    }
    for (name, method) in [
        ("fin allocation, decoupled", AllocationMethod::Decoupled),
        ("fin allocation, 6-DOF", AllocationMethod::SixDof),
    ] {
        allocation(&model, name, method);
    }
}

#[inline(never)]
fn gain(model: &VehicleModel) {
    let mut lqr = Lqr::new();
    let whole = count(|| black_box(&mut lqr).configure(model, 1.0).is_ok()).1;
    row("control", "LQR gain, at once", 0, 0, whole, 0);
    let mut slice = Worst(0);
    let mut slices = 0;
    while lqr.trim().surge_mps < 1.2 && slices < 200 {
        slice.count(|| black_box(&mut lqr).advance(model, black_box(1.3)));
        slices += 1;
    }
    row("control", "LQR gain, largest slice", 0, slices, slice.0, 0);
}

/// The dearest of 300 commands: around a corner to a leg with another speed, and so another gain.
fn command(controller: &mut Controller, model: &VehicleModel, name: &str, law: ControlLaw) {
    let mut mission = Mission::new();
    for (x_m, y_m, speed_mps) in [(0.0, 0.0, 1.0), (20.0, 0.0, 1.0), (20.0, 50.0, 1.3)] {
        assert!(mission.push(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps }).is_ok());
    }
    assert!(controller.configure(&ControlConfig { law, ..ControlConfig::REFERENCE }, model).is_ok());
    controller.set_mission(&mission);
    let mut x = VehicleState::zeros();
    (x[0], x[2], x[6]) = (5.0, 2.8, 1.0);
    assert!(controller.start(&x).is_ok());
    let mut worst = Worst(0);
    for k in 0..300 {
        let command = worst.count(|| black_box(&mut *controller).command(k * 100_000, black_box(&x), [0.05, -0.05]));
        let half = x + model.derivative(&x, &command.input) * 0.05;
        x += model.derivative(&half, &command.input) * 0.1;
    }
    row("control", name, 0, 0, worst.0, 0);
}

/// The dearest of 50, from gentle ones to such as the fins cannot give.
fn allocation(model: &VehicleModel, name: &str, method: AllocationMethod) {
    let (mut random, mut worst) = (Random(6), Worst(0));
    for k in 0..50 {
        let mut velocity = random.array::<6>(0.2);
        velocity[0] += 1.0;
        let [pitch_nm, yaw_nm, roll_nm] = random.array(0.2 * f64::from(k));
        let moments = Moments { roll_nm: 0.05 * roll_nm, pitch_nm, yaw_nm };
        let datum = Datum::Above([0.0; 4]);
        worst.count(|| allocate(black_box(method), model, &velocity.into(), black_box(&moments), &datum, 0.35));
    }
    row("control", name, 0, 0, worst.0, 0);
}

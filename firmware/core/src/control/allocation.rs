//! Fin allocation: moments to fin angles on the nonlinear fin model, with the inflow at each fin.

use crate::dynamics::{ActuatorInput, FINS, VehicleModel};
use nalgebra::{Matrix4, SMatrix, SVector, Vector4, Vector6};

/// How moments become fin angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AllocationMethod {
    /// (3.1.4), for cruciform fins: yaw by top = −bottom, pitch by port = −starboard, roll by all four alike. If one
    /// fin of a pair has lost its effect, the other gives the whole force. The restoring moment holds the roll that
    /// this causes.
    Decoupled,
    /// All four fins for the whole wrench, in the sense of least squares; any arrangement of fins.
    SixDof,
}

/// Moments about the body axes, N m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// K, always on top of the fins' own moment in the inflow: their damping is the only roll damping.
    pub roll_nm: f64,
    /// M.
    pub pitch_nm: f64,
    /// N.
    pub yaw_nm: f64,
}

/// What the moments are relative to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Datum {
    /// Zero: the moments are the total of the fins. The part due to the inflow is cancelled, its damping included.
    Total,
    /// The moments of the fins at these angles in the present inflow: damping stays.
    Above([f64; FINS]),
}

/// Slowest surge for which fins are used, m/s: force grows with its square, and below it the fins would only flap.
const MIN_SURGE_MPS: f64 = 0.1;
/// Iterations of the pair solution; safeguarded Newton takes 4 to 6.
const PAIR_STEPS: usize = 16;
/// Gauss-Newton steps of the least squares; it takes 3 to 5.
const WRENCH_STEPS: usize = 8;
/// Forces count a tenth of moments in the least squares: they follow from the moments on a stern with one
/// lever, and where they do not, moments matter.
const FORCE_WEIGHT: f64 = 0.1;
/// Relative weight that keeps the fins near the datum in the direction that changes no force; small enough to
/// bias the others by less than 1e-5.
const REGULARISATION: f64 = 1e-6;

/// Lever x_fin of the fins that turn the vehicle in yaw (top, bottom), m; negative at the stern.
#[must_use]
pub fn yaw_lever_m(model: &VehicleModel) -> f64 {
    let [top, bottom, ..] = &model.parameters().fins;
    0.5 * (top.cp_m[0] + bottom.cp_m[0])
}

/// Lever x_fin of the fins that turn the vehicle in pitch (port, starboard), m; negative at the stern.
#[must_use]
pub fn pitch_lever_m(model: &VehicleModel) -> f64 {
    let [.., port, starboard] = &model.parameters().fins;
    0.5 * (port.cp_m[0] + starboard.cp_m[0])
}

/// Fin angles within ±`limit_rad` that give the moments at body velocity `v`; the nearest when out of reach.
///
/// The side forces Y = N/x_fin and Z = −M/x_fin that come with moments from the stern are accepted, as the LQR's B
/// has them. Without way on the fins stay neutral.
#[must_use]
pub fn allocate(
    method: AllocationMethod,
    model: &VehicleModel,
    v: &Vector6<f64>,
    moments: &Moments,
    datum: &Datum,
    limit_rad: f64,
) -> [f64; FINS] {
    if !has_way(v) {
        return [0.0; FINS];
    }
    let target = target_wrench(model, v, moments, datum);
    match method {
        AllocationMethod::Decoupled => decoupled(model, v, &target, moments.roll_nm, datum, limit_rad),
        AllocationMethod::SixDof => least_squares(model, v, &target, datum, limit_rad),
    }
}

/// [`allocate`] where fins are broken: what those of `model`, which are whole, would give is asked of the fins as they are
/// in `actual`, in the sense of least squares. A fin that gives nothing stays at the datum; the others take its part,
/// its damping included, so that the gains stay right.
#[must_use]
pub fn allocate_to(
    actual: &VehicleModel,
    model: &VehicleModel,
    v: &Vector6<f64>,
    moments: &Moments,
    datum: &Datum,
    limit_rad: f64,
) -> [f64; FINS] {
    if !has_way(v) {
        return [0.0; FINS];
    }
    least_squares(actual, v, &target_wrench(model, v, moments, datum), datum, limit_rad)
}

/// Whether fins have an effect at body velocity `v`.
fn has_way(v: &Vector6<f64>) -> bool {
    v[0] >= MIN_SURGE_MPS && v.iter().all(|x| x.is_finite())
}

/// Wanted sum of the fin wrenches.
fn target_wrench(model: &VehicleModel, v: &Vector6<f64>, moments: &Moments, datum: &Datum) -> Vector6<f64> {
    let present = |fins: &[f64; FINS]| model.fin_wrenches(v, fins).iter().sum::<Vector6<f64>>();
    let mut target = match datum {
        Datum::Above(fins) => present(fins),
        Datum::Total => Vector6::new(0.0, 0.0, 0.0, present(&[0.0; FINS])[3], 0.0, 0.0),
    };
    target[1] += moments.yaw_nm / yaw_lever_m(model);
    target[2] -= moments.pitch_nm / pitch_lever_m(model);
    target[3] += moments.roll_nm;
    target[4] += moments.pitch_nm;
    target[5] += moments.yaw_nm;
    target
}

fn decoupled(
    model: &VehicleModel,
    v: &Vector6<f64>,
    target: &Vector6<f64>,
    roll_nm: f64,
    datum: &Datum,
    limit_rad: f64,
) -> [f64; FINS] {
    let mut fins = match datum {
        Datum::Total => [0.0; FINS],
        Datum::Above(fins) => *fins,
    };
    if roll_nm != 0.0 {
        let by_input = model.wrench_by_input(v, &ActuatorInput { propeller_radps: 0.0, fins_rad: fins });
        let roll_by_all: f64 = (1..=FINS).map(|column| by_input[(3, column)]).sum();
        let common = (roll_nm / roll_by_all).max(-limit_rad).min(limit_rad);
        fins = fins.map(|fin| fin + common);
    }
    // Y falls with +top (nose to starboard: the stern goes to port), Z grows with +port (nose up: the stern goes down).
    let across = libm::atan2(v[1] + yaw_lever_m(model) * v[5], v[0]);
    let upward = libm::atan2(v[2] - pitch_lever_m(model) * v[4], v[0]);
    solve_pair::<0, 1>(model, v, &mut fins, &Pair { sign: -1.0, inflow: across }, target[1], limit_rad);
    solve_pair::<2, 2>(model, v, &mut fins, &Pair { sign: 1.0, inflow: -upward }, target[2], limit_rad);
    fins
}

/// Two opposite fins, turned against each other.
struct Pair {
    /// Sign of ∂force/∂δ.
    sign: f64,
    /// Incidence of the first fin at δ = 0, rad.
    inflow: f64,
}

/// Turns fins FIRST and FIRST + 1 by ±δ about where they stand until row ROW of the wrench is `target`: Newton within
/// a bracket that excludes stall, where more angle gives less force.
fn solve_pair<const FIRST: usize, const ROW: usize>(
    model: &VehicleModel,
    v: &Vector6<f64>,
    fins: &mut [f64; FINS],
    pair: &Pair,
    target: f64,
    limit_rad: f64,
) {
    // The common angle of the two fins makes roll and is kept.
    let common = 0.5 * (fins[FIRST] + fins[FIRST + 1]);
    let start = 0.5 * (fins[FIRST] - fins[FIRST + 1]);
    let mut turn = |delta: f64| {
        fins[FIRST] = (common + delta).max(-limit_rad).min(limit_rad);
        fins[FIRST + 1] = (common - delta).max(-limit_rad).min(limit_rad);
        *fins
    };
    let excess = |fins: &[f64; FINS]| {
        let force: f64 = model.fin_wrenches(v, fins).iter().map(|wrench| wrench[ROW]).sum();
        pair.sign * (force - target)
    };
    let stall = stall_rad(model);
    let mut low = (-limit_rad).max((-stall - pair.inflow).min(limit_rad));
    let mut high = limit_rad.min((stall - pair.inflow).max(-limit_rad));
    if excess(&turn(low)) >= 0.0 || excess(&turn(high)) <= 0.0 {
        // Out of reach: the end of the bracket that was tried last is the nearest.
        return;
    }
    let mut delta = start.max(low).min(high);
    for _ in 0..PAIR_STEPS {
        let now = turn(delta);
        let error = excess(&now);
        if error > 0.0 {
            high = delta
        } else {
            low = delta
        }
        let by_input = model.wrench_by_input(v, &ActuatorInput { propeller_radps: 0.0, fins_rad: now });
        let slope = pair.sign * (by_input[(ROW, 1 + FIRST)] - by_input[(ROW, 2 + FIRST)]);
        let newton = delta - error / slope;
        // NaN fails the comparison and is replaced too.
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - delta).abs() < 1e-13 {
            break;
        }
        delta = next;
    }
}

/// Incidence of the largest lift, rad.
fn stall_rad(model: &VehicleModel) -> f64 {
    let [beta3, beta4] = model.parameters().cl;
    let square = -beta3 / (3.0 * beta4);
    if square > 0.0 { libm::sqrt(square) } else { core::f64::consts::FRAC_PI_2 }
}

/// Gauss-Newton on [Y Z K M N], moments divided by their levers, inside the box of the limits.
fn least_squares(
    model: &VehicleModel,
    v: &Vector6<f64>,
    target: &Vector6<f64>,
    datum: &Datum,
    limit_rad: f64,
) -> [f64; FINS] {
    let datum_fins = match datum {
        Datum::Total => [0.0; FINS],
        Datum::Above(fins) => *fins,
    };
    let [top, .., starboard] = &model.parameters().fins;
    let roll_lever = libm::hypot(top.cp_m[1], top.cp_m[2]).max(libm::hypot(starboard.cp_m[1], starboard.cp_m[2]));
    let scale = [FORCE_WEIGHT, FORCE_WEIGHT, 1.0 / roll_lever, 1.0 / pitch_lever_m(model), 1.0 / yaw_lever_m(model)];

    let target = within_reach(model, v, target, limit_rad);
    let mut fins = datum_fins.map(|fin| fin.max(-limit_rad).min(limit_rad));
    for _ in 0..WRENCH_STEPS {
        let wrench: Vector6<f64> = model.fin_wrenches(v, &fins).iter().sum();
        let by_input = model.wrench_by_input(v, &ActuatorInput { propeller_radps: 0.0, fins_rad: fins });
        let mut jacobian = SMatrix::<f64, 5, FINS>::zeros();
        let mut residual = SVector::<f64, 5>::zeros();
        for row in 0..5 {
            residual[row] = scale[row] * (wrench[row + 1] - target[row + 1]);
            for column in 0..FINS {
                jacobian[(row, column)] = scale[row] * by_input[(row + 1, column + 1)];
            }
        }
        let Some(step) = bounded_step(&jacobian, &residual, &fins, &datum_fins, limit_rad) else { break };
        for (fin, change) in fins.iter_mut().zip(step.iter()) {
            *fin = (*fin + change).max(-limit_rad).min(limit_rad);
        }
        if step.amax() < 1e-12 {
            break;
        }
    }
    fins
}

/// Cuts pitch and yaw, with the forces that come with them, to what fins at their limits give: the least squares would
/// otherwise turn every fin for the sake of its drag and roll the vehicle.
fn within_reach(model: &VehicleModel, v: &Vector6<f64>, target: &Vector6<f64>, limit_rad: f64) -> Vector6<f64> {
    let by_input = model.wrench_by_input(v, &ActuatorInput::default());
    let extreme = |row: usize, sign: f64| {
        let slopes = [1, 2, 3, 4].map(|column| by_input[(row, column)]);
        let largest = slopes.iter().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        let fins = slopes.map(|slope| {
            // Fins that would act by their drag alone are left out.
            if slope.abs() > 0.1 * largest { limit_rad.copysign(sign * slope) } else { 0.0 }
        });
        model.fin_wrenches(v, &fins).iter().map(|wrench| wrench[row]).sum::<f64>()
    };
    let change = |row: usize| target[row].min(extreme(row, 1.0)).max(extreme(row, -1.0)) - target[row];
    let (pitch, yaw) = (change(4), change(5));
    let mut target = *target;
    target[1] += yaw / yaw_lever_m(model);
    target[2] -= pitch / pitch_lever_m(model);
    target[4] += pitch;
    target[5] += yaw;
    target
}

/// Step of the normal equations; fins that would leave the box stay on its edge and the others make up for it.
fn bounded_step(
    jacobian: &SMatrix<f64, 5, FINS>,
    residual: &SVector<f64, 5>,
    fins: &[f64; FINS],
    datum: &[f64; FINS],
    limit_rad: f64,
) -> Option<Vector4<f64>> {
    let mut held = [None; FINS];
    let mut step = Vector4::zeros();
    // Each pass holds at least one more fin, so there are at most FINS + 1.
    for _ in 0..=FINS {
        let mut normal: Matrix4<f64> = jacobian.tr_mul(jacobian);
        let weight = REGULARISATION * normal.trace();
        let mut right: Vector4<f64> = -jacobian.tr_mul(residual);
        for i in 0..FINS {
            normal[(i, i)] += weight;
            right[i] += weight * (datum[i] - fins[i]);
        }
        for i in 0..FINS {
            if let Some(fixed) = held[i] {
                for j in 0..FINS {
                    if j != i {
                        right[j] -= normal[(j, i)] * fixed;
                        normal[(j, i)] = 0.0;
                        normal[(i, j)] = 0.0;
                    }
                }
                normal[(i, i)] = 1.0;
                right[i] = fixed;
            }
        }
        step = nalgebra::Cholesky::new(normal)?.solve(&right);
        let mut changed = false;
        for i in 0..FINS {
            let wanted = fins[i] + step[i];
            if held[i].is_none() && wanted.abs() > limit_rad {
                held[i] = Some(limit_rad.copysign(wanted) - fins[i]);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    step.iter().all(|x| x.is_finite()).then_some(step)
}

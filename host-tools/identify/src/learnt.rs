//! What an identification has learnt of the vehicle, as the prior of the robust filter.

use crate::{Estimate, Options};
use backseat_core::navigation::{Learnt, Priors, StateParameter};
use backseat_core::parameters::HANDLING;

/// Section `[learnt]` of the identified vehicle: the estimate's covariance, about the identified values. Without one
/// (the adaptive and nullspace methods give none) nothing is learnt, and `[prior]` holds for the identified vehicle.
///
/// In logarithms the covariance of θ_i and θ_j is that of their errors over θ_i θ_j. A log holds no forces, so that one
/// parameter was taken as known and gives the scale of all others: its sigma in `[prior]` is an error common to all.
/// And the vehicle is handled before it dives ([`HANDLING`]).
#[must_use]
pub fn learnt(estimate: &Estimate, options: &Options, priors: &Priors) -> Learnt {
    let Some(covariance) = &estimate.covariance else { return Learnt::NONE };
    let scale = options.scale.parameter();
    let declared = |place: usize| {
        let all = priors.mass.iter().chain(&priors.drag).chain(&priors.actuators);
        all.copied().nth(place).unwrap_or(0.0)
    };
    let parameters = || {
        (0..backseat_core::identification::theta::PARAMETERS)
            .filter_map(|j| Some((j, Learnt::place(StateParameter::LogFactor(u8::try_from(j).ok()?))?)))
    };
    let common = parameters().find(|(j, _)| *j == scale).map_or(0.0, |(_, place)| declared(place));
    let value = |j: usize| estimate.parameters[j].value;
    let variance = |i: usize, j: usize| covariance[(i, j)] / (value(i) * value(j)) + common * common;
    let known = |j: usize| j == scale || covariance[(j, j)] > 0.0;
    let of_its_own = |j: usize, place: usize| variance(j, j) + (HANDLING * declared(place)).powi(2);
    let mut learnt = Learnt::NONE;
    for (j, place) in parameters().filter(|(j, _)| known(*j)) {
        // what the log shows badly is no worse known than before
        learnt.sigma[place] = of_its_own(j, place).sqrt().min(declared(place));
        for (i, earlier) in parameters().filter(|(i, earlier)| *earlier < place && known(*i)) {
            let product = of_its_own(i, earlier) * of_its_own(j, place);
            if product > 0.0 {
                learnt.set_correlation(place, earlier, variance(i, j) / product.sqrt());
            }
        }
    }
    if learnt.check().is_ok() { learnt } else { Learnt::NONE }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EstimatedParameter, Method};
    use backseat_core::dynamics::VehicleParameters;
    use backseat_core::identification::Visibility;
    use nalgebra::DMatrix;

    /// d11 known to 3 % and beta5 to 4 % beside a known m11, their errors correlated by 0.5; nothing else was
    /// identified.
    #[test]
    fn val_the_covariance_of_logarithms_with_the_common_scale() {
        let values = crate::parameters::of(&VehicleParameters::IVER3);
        let (d11, beta5) = (6, 20);
        let mut covariance = DMatrix::zeros(values.len(), values.len());
        covariance[(d11, d11)] = (0.03 * values[d11]).powi(2);
        covariance[(beta5, beta5)] = (0.04 * values[beta5]).powi(2);
        covariance[(beta5, d11)] = 0.5 * 0.03 * 0.04 * values[d11] * values[beta5];
        covariance[(d11, beta5)] = covariance[(beta5, d11)];
        let parameter = |j: usize| EstimatedParameter {
            name: crate::parameters::name(j),
            unit: "",
            value: values[j],
            ci95: None,
            prior: values[j],
            visibility: Visibility::Separate,
        };
        let estimate = Estimate {
            method: Method::OutputError,
            parameters: (0..values.len()).map(parameter).collect(),
            vehicle: VehicleParameters::IVER3,
            covariance: Some(covariance),
            collinear: Vec::new(),
            unseen: Vec::new(),
            steps: Vec::new(),
            notes: Vec::new(),
        };
        let priors = Priors { mass: [0.02; 3], ..Priors::DEFAULT };
        let learnt = learnt(&estimate, &Options::DEFAULT, &priors);
        assert_eq!(learnt.mean, Learnt::NONE.mean);
        // m11 (its prior, capped), d11, beta5: scale 2 %, own error, handling 1 %
        let sigma = |own: f64| (own * own + 0.02_f64.powi(2) + 0.01_f64.powi(2)).sqrt();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(
            near(learnt.sigma[0], 0.02) && near(learnt.sigma[3], sigma(0.03)) && near(learnt.sigma[7], sigma(0.04))
        );
        assert!(near(learnt.correlation(7, 3), (0.5 * 0.03 * 0.04 + 0.02 * 0.02) / (sigma(0.03) * sigma(0.04))));
        assert_eq!((learnt.sigma[1], learnt.sigma[5], learnt.check()), (0.0, 0.0, Ok(())));
    }
}

//! The tables.

use super::{Args, ConsistencyRow, QUANTITIES, SEEDS_PER_MODEL, SETTLED_S};
use crate::consistency::{Block, Inside, measurement_names};
use backseat_report::markdown::markdown_table;
use std::fmt::Write as _;

/// Least share of times inside the pointwise band.
const ASKED: f64 = 0.9;

pub(super) fn markdown(arguments: &Args, declared: &[ConsistencyRow], flights: &[ConsistencyRow]) -> String {
    let Args { runs, first_seed, minutes, .. } = arguments;
    let mut text = format!(
        "# Is the filter's covariance right?\n\n\
         Made by `cargo lab consistency --runs {runs} --minutes {minutes} --first-seed {first_seed}` (version {}): {runs} flights of {minutes} minutes for each row, seeds from\n\
         {first_seed} on for the first row, {SEEDS_PER_MODEL} more for each next one. Everything counts from {SETTLED_S} s on.\n\n\
         *ANEES* is eᵀ P⁻¹ e of the estimate's error e and the filter's own covariance P, averaged over the flights at each second and\n\
         divided by its degrees of freedom: 1 if the covariance is right, above 1 where the filter is overconfident, below where it is\n\
         too careful. In brackets the share of seconds at which it lies inside its pointwise 95 % band (χ² of flights times degrees of\n\
         freedom); below 90 % the side is given. Positions and effects change slowly, so that a quarter of an hour holds few\n\
         independent ones: their shares scatter from seed to seed. *ANIS* is the same of the innovations, ν²/S, with the 95 % band of the\n\
         mean over all flights and times.\n\n\
         ## Worlds that behave as declared\n\n\
         Vehicle and ship start from the prior that the filter is given; accelerations, the ship's course, the walks of the effects and\n\
         every sensor have the declared noise; effects are drawn from their priors. The vehicle moves by the simulator's equations and\n\
         integrator. Lines, turns, ranges every 30 s. The kinematic model's world is a vehicle that only its declared noise\n\
         moves, on a wide circle; its q is small (5, 5, 2 e-3 m/s²/√Hz; 1.5, 1.5, 3 e-5 rad/s²/√Hz), or it would tumble. Currents have\n\
         the filter's default prior of 0.3 m/s, drag 0.3 N s/m (a tenth), the clock 1 ms.\n\n",
        env!("CARGO_PKG_VERSION")
    );
    errors(&mut text, declared);
    let _ = writeln!(
        text,
        "\n{}`ranges to first order` is the filter of the thesis: where a current of 0.3 m/s is unknown, the position across a range is soon\n\
         10 m off, the circle departs from its tangent, and the filter is overconfident. The filter of this project takes a\n\
         range to second order from where it matters (`range_curvature` of its configuration).\n",
        arguments.picture.shown("ANEES of the vehicle over time and its band")
    );
    measurements(&mut text, declared);
    bounds(&mut text, declared);
    text += "\n## Real flights\n\n\
             The backseat in closed loop over four lines of 150 m from the surface and up again, as in the survey: servos and propeller lag,\n\
             the hull loses buoyancy at the surface, the ship sails a circle, the filters start from a fix. Nothing but the sensors is as\n\
             declared, so no filter can stay within the band; it must not be above it. In the last row the current is drawn from its prior.\n\n";
    errors(&mut text, flights);
    let _ = writeln!(text);
    measurements(&mut text, flights);
    text += "\nThe kinematic model's loose Q has to cover turns and the dive, which no constant velocity predicts; everywhere else it is too careful, and so is every model at the surface, where its noise covers waves and the hull out\n\
             of the water. The dynamic models are above the band for some seconds where fins move: presumably the lag of\n\
             the servos, which is not declared; that was not tested separately. The ship sails more smoothly than its own estimator allows for (a circle, not white acceleration of\n\
             0.02 m/s²/√Hz): its position in the packets is a little better than stated (`ship in packets`), its velocity too, and\n\
             ranges and range rates fused with it lie a little below 1. The row `ship from packets` of [navigation.md](navigation.md) is\n\
             lower for another reason: it takes the position in the packet, which the ship has filtered, for a raw fix of 0.5 m. Where it is\n\
             one, in the declared worlds above, the ranges are consistent.\n";
    text
}

/// ANEES by block.
fn errors(text: &mut String, rows: &[ConsistencyRow]) {
    let names: Vec<&str> = Block::ALL.iter().map(|block| block.name()).collect();
    let mut table = markdown_table(["ANEES"].iter().chain(&names).copied().chain(["vehicle's band"]));
    for row in rows {
        let cells = names.iter().map(|name| match row.blocks.iter().find(|block| block.name == *name) {
            Some(block) => {
                let [inside, below, above] = block.shares;
                // A conservative filter is no danger; an overconfident one is.
                let side = if inside >= ASKED {
                    ""
                } else if above > below {
                    ", above"
                } else {
                    ", below"
                };
                format!("{:.2} ({:.1} %{side})", block.mean, 100.0 * inside)
            }
            None => "-".to_owned(),
        });
        let band = row.blocks.iter().find(|block| block.degrees == 12);
        let band = band.map_or("-".to_owned(), |block| format!("{:.2} to {:.2}", block.band.low, block.band.high));
        table.add_row([row.name.clone()].into_iter().chain(cells).chain([band]));
    }
    let _ = writeln!(text, "{table}");
}

/// ANIS by kind of measurement.
fn measurements(text: &mut String, rows: &[ConsistencyRow]) {
    let present = |name: &&str| rows.iter().flat_map(|row| &row.innovations).any(|inside| inside.name == *name);
    let names: Vec<&str> = measurement_names().filter(present).collect();
    let cell = |inside: &Inside| {
        let band = inside.mean_band.map_or(String::new(), |band| format!("; {:.3} to {:.3}", band.low, band.high));
        format!("{:.3} ({:.0} %{band})", inside.mean, 100.0 * inside.shares[0])
    };
    let mut table = markdown_table(["ANIS"].iter().chain(&names).copied().chain(["refused"]));
    for row in rows {
        let cells = names
            .iter()
            .map(|name| row.innovations.iter().find(|inside| inside.name == *name).map_or("-".to_owned(), cell));
        table.add_row([row.name.clone()].into_iter().chain(cells).chain([row.rejected.to_string()]));
    }
    let _ = writeln!(text, "{table}");
}

fn bounds(text: &mut String, rows: &[ConsistencyRow]) {
    text.push_str(
        "\n## The posterior Cramér-Rao bound\n\n\
         Root mean squared error over the flights against the bound (Tichavský, Muravchik and Nehorai 1998), computed apart from the\n\
         filter: Jacobians by differences of the simulator's integrator at the true states, dense matrices, the ship at each launch as a\n\
         delayed state. *Along each track*: the recursion for every true track by itself, then averaged; what an estimator reaches\n\
         that loses nothing by linearisation. *Ensemble*: expectations over all tracks first, below which no estimator can be; it is loose\n\
         where the tracks differ much (with an unknown current the bearings to the ship do, we take it, and their average informs about both axes).\n\
         Median over time, and range; with a finite number of flights the error itself is uncertain (100 flights: about 5 to 7 %).\n\n",
    );
    let each = ["RMSE / bound", "position, each track", "attitude", "velocity"];
    let mut table = markdown_table(each.into_iter().chain(["position, ensemble", "attitude", "velocity"]));
    for row in rows {
        let Some(compared) = &row.bound else { continue };
        let cells = (0..2).flat_map(|bound| (0..QUANTITIES.len()).map(move |quantity| (bound, quantity)));
        let cells = cells.map(|(bound, quantity)| {
            let ratio = compared.ratio(bound, quantity);
            format!("{:.2} ({:.2} to {:.2})", ratio.median, ratio.least, ratio.greatest)
        });
        table.add_row([row.name.clone()].into_iter().chain(cells));
    }
    let _ = writeln!(text, "{table}");
}

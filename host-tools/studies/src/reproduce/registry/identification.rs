//! Chapter 4: identification.

use crate::reproduce::item::{Column, Curves, Item, Reported, claim, column, figures, tables};
use crate::reproduce::studies::{ADAPTIVE, CONVERGENCE, GAINS, LEAST_SQUARES, NULLSPACE};

/// The thesis' eight columns.
const ERRORS: &[Column] = &[
    column("roll_deg", "roll [deg]"),
    column("pitch_deg", "pitch [deg]"),
    column("p_degps", "p [deg/s]"),
    column("q_degps", "q [deg/s]"),
    column("r_degps", "r [deg/s]"),
    column("u_mps", "u [m/s]"),
    column("v_mps", "v [m/s]"),
    column("w_mps", "w [m/s]"),
];

const ERRORS_INSIDE: &[Column] = &[
    ERRORS[0],
    ERRORS[1],
    ERRORS[2],
    ERRORS[3],
    ERRORS[4],
    ERRORS[5],
    ERRORS[6],
    ERRORS[7],
    claim("inside", "no parameter at its limit [runs]"),
];

const THESIS: Reported =
    Reported { name: "thesis, Table 4.15", values: &[0.78, 0.43, 0.53, 0.13, 0.15, 0.0055, 0.0024, 0.0022] };

const EXPERIMENT: &str = "5000 s open loop at 10 Hz (sums of sines: Table 4.14 is not at hand), Table 4.13's noise of attitude \
     (0.25 degrees) and rates (0.01 deg/s), the noise of linear velocity as named; prior wrong by up to 30 % in every parameter \
     but m11, which is known. Judged by the mean absolute error of a 1000 s free run on other inputs against the truth.";

pub const ITEMS: &[Item] = &[
    Item {
        id: "table-4.8",
        title: "NBLS: parameters",
        covers: &[tables(4, [8, 8])],
        taken_as: "the parameters that NBLS finds in simulated data, as errors relative to the truth",
        conditions: EXPERIMENT,
        study: &NULLSPACE,
        rows: &[
            "m22", "m33", "m44", "m55", "m66", "d11", "d22", "d33", "d44", "d55", "d66", "w", "B3", "beta1", "beta2",
            "beta3", "beta4", "beta5",
        ],
        columns: &[
            column("at_0", "0 cm/s [%]"),
            column("at_03", "0.3 cm/s [%]"),
            column("at_06", "0.6 cm/s [%]"),
            column("at_14", "1.4 cm/s [%]"),
        ],
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "NBLS as printed, 0.3 Hz cut-off, d26 and d35 among its columns; a parameter that leaves 0.3 to 3 times its prior is \
                  put back to that limit. Without noise what is left is the filter's distortion of |v| v, which the \
                  parameters that the motion hardly shows apart (m44 and d44; d11 and beta1; beta4) magnify.",
    },
    Item {
        id: "tables-4.10-4.12",
        title: "NBLS: cross-validation against the noise of velocity",
        covers: &[tables(4, [10, 12])],
        taken_as: "errors in cross-validation of NBLS as the noise of linear velocity grows, with and without cross drag; beside it \
                   the noise-whitened form (GTLS)",
        conditions: EXPERIMENT,
        study: &NULLSPACE,
        rows: &[
            "NBLS, 0 cm/s",
            "NBLS, 0.3 cm/s",
            "NBLS, 0.6 cm/s",
            "NBLS, 1.4 cm/s",
            "NBLS, 0 cm/s, d26 = 8, d35 = −8",
            "GTLS, 0 cm/s",
            "GTLS, 0.3 cm/s",
            "GTLS, 0.6 cm/s",
            "GTLS, 1.4 cm/s",
        ],
        columns: ERRORS_INSIDE,
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "The independent implementation's NBLS survives 0.6 cm/s and fails at 0.65 at this cut-off; noise biases total least \
                  squares until drags leave their range. Taking the known noise out of the normal equations mends that.",
    },
    Item {
        id: "least-squares-4.3.2.3",
        title: "OLS, TLS and NBLS in one degree of freedom (4.3.2.3)",
        covers: &[],
        taken_as: "surge alone: m u̇ + d |u| u = β ω |ω| by ordinary, total and nullspace least squares, scale by m",
        conditions: "2000 s at 10 Hz, propeller speed a sum of two sines, noise of u as named, two sliding means of 2.1 s and central \
                     differences. OLS: only u̇ is in error. TLS: all three columns, as they stand in SI units. NBLS: columns scaled to \
                     unit length first.",
        study: &LEAST_SQUARES,
        rows: &[
            "OLS, 0 cm/s",
            "TLS, 0 cm/s",
            "NBLS, 0 cm/s",
            "OLS, 0.3 cm/s",
            "TLS, 0.3 cm/s",
            "NBLS, 0.3 cm/s",
            "OLS, 0.6 cm/s",
            "TLS, 0.6 cm/s",
            "NBLS, 0.6 cm/s",
            "OLS, 1.4 cm/s",
            "TLS, 1.4 cm/s",
            "NBLS, 1.4 cm/s",
        ],
        columns: &[column("drag_percent", "error of d/m [%]"), column("thrust_percent", "error of β/m [%]")],
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "Only u̇, a difference, is noisy to speak of; where its error is all there is, OLS is the right estimator. Unscaled TLS \
                  takes the column of ω|ω| (1e4 rad²/s²) for as exact as it is large and comes close to OLS; NBLS' scaling spreads \
                  the error over the columns, which costs a bias that grows with the noise.",
    },
    Item {
        id: "table-4.15",
        title: "AID: cross-validation",
        covers: &[tables(4, [15, 15])],
        taken_as: "errors in cross-validation of the adaptive identification",
        conditions: EXPERIMENT,
        study: &ADAPTIVE,
        rows: &[
            "AID, 0 cm/s",
            "AID, 1.2 cm/s",
            "AID, 1.4 cm/s",
            "AID online, 0 cm/s",
            "AID online, 1.2 cm/s",
            "AID online, 1.4 cm/s",
            "prior, 30 % wrong",
        ],
        columns: ERRORS,
        printed: &[THESIS],
        independent: &[
            Reported { name: "AID, 0 cm/s", values: &[0.015, 0.077, 0.012, 0.005, 0.007, 0.0006, 0.0001, 0.0001] },
            Reported { name: "AID, 1.2 cm/s", values: &[0.017, 0.038, 0.011, 0.006, 0.007, 0.0011, 0.0001, 0.0002] },
            Reported { name: "AID, 1.4 cm/s", values: &[0.017, 0.039, 0.014, 0.006, 0.008, 0.0012, 0.0001, 0.0002] },
        ],
        curves: &[],
        differs: "Corrected laws, Heun's step, diagonal gains from prior and data, averaging, and offline several passes in which only \
                  what the model leaves unexplained is filtered. The online rows are the board's code, causal.",
    },
    Item {
        id: "tables-4.16-4.19",
        title: "AID: unmodelled terms and a worse prior",
        covers: &[tables(4, [16, 19])],
        taken_as: "cross-validation under terms that the model lacks (d26 = 8, d35 = −8 of the true vehicle) and from a worse prior",
        conditions: EXPERIMENT,
        study: &ADAPTIVE,
        rows: &["AID, 1.4 cm/s", "AID, undeclared d26, d35", "AID, prior 50 % wrong"],
        columns: ERRORS,
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "Undeclared cross drag is absorbed by the other parameters as far as they can. The methods \
                  after AID, which find it, are no part of the thesis: `backseat studies identification`, docs/results/identification.md.",
    },
    Item {
        id: "figures-4.7-4.15",
        title: "AID: parameters over time",
        covers: &[figures(4, [7, 15])],
        taken_as: "convergence of the estimates: inertia, drag, weight and righting moment, fins and propeller",
        conditions: "As table-4.15 at 1.3 cm/s, by the board's identifier as it runs. Root mean square of the relative errors of a \
                     group; B1 and B2, which are zero, in units of B3.",
        study: &CONVERGENCE,
        rows: &["inertia", "drag", "weight and righting", "fins and propeller"],
        columns: &[
            column("prior_percent", "prior [%]"),
            column("fifth_percent", "after 1000 s [%]"),
            column("online_percent", "after 5000 s [%]"),
            column("aid_percent", "offline AID [%]"),
        ],
        printed: &[],
        independent: &[],
        curves: &[Curves { prefix: "parameters", y_label: "RMS relative error, median of the runs [%]", is_log: true }],
        differs: "m44 and beta1 do not converge: the motion shows them only together with others. What it does show, the predicted \
                  motion, converges (next table).",
    },
    Item {
        id: "figures-4.7-4.15-prediction",
        title: "AID: predicted motion over time",
        covers: &[figures(4, [7, 15])],
        taken_as: "predicted against true motion with the parameters of each time",
        conditions: "As table-4.15 at 1.3 cm/s, by the board's identifier as it runs: mean absolute error in cross-validation; in the \
                     plot as a share of the prior's.",
        study: &CONVERGENCE,
        rows: &["roll_deg", "pitch_deg", "p_degps", "q_degps", "r_degps", "u_mps", "v_mps", "w_mps"],
        columns: &[column("prior", "prior"), column("fifth", "after 1000 s"), column("end", "after 5000 s")],
        printed: &[],
        independent: &[],
        curves: &[Curves {
            prefix: "prediction",
            y_label: "error / error of the prior, median of the runs",
            is_log: true,
        }],
        differs: "The thesis shows single runs.",
    },
    Item {
        id: "aid-gains",
        title: "AID: scalar against diagonal gains",
        covers: &[],
        taken_as: "one adaptation gain for all parameters, against one each in proportion to what the data show of it",
        conditions: "As table-4.15 at 1.3 cm/s, zero-phase filtering, one pass, the same schedule of gains and the same limit of \
                     stability. Scalar: Γ = γ I in SI units with the same trace of M⁻¹ Y Γ Yᵀ as the diagonal one.",
        study: &GAINS,
        rows: &["prior", "scalar gain", "diagonal gains"],
        columns: &[
            ERRORS[0],
            ERRORS[1],
            ERRORS[2],
            ERRORS[3],
            ERRORS[4],
            ERRORS[5],
            ERRORS[6],
            ERRORS[7],
            column("closer_percent", "parameters at half their error or less [%]"),
        ],
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "In SI units the regressor's columns differ by many orders of magnitude: a scalar gain that is stable for the largest \
                  leaves most parameters where they were.",
    },
];

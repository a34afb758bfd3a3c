//! Chapter 4: identification.

use super::navigation::{CURVES, ERRORS as POSITION};
use crate::reproduce::item::{Column, Covers, Curves, Item, Printed, Reported, claim, column, figures, tables};
use crate::reproduce::studies::{
    AID_COARSE_RATES, AID_FINE_RATES, FIRST_NBLS, GAINS, LEAST_SQUARES, N_NAV, NBLS, NBLS_CUT_OFFS, Study,
};

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

const ERRORS_COMPLETE: &[Column] = &[
    ERRORS[0],
    ERRORS[1],
    ERRORS[2],
    ERRORS[3],
    ERRORS[4],
    ERRORS[5],
    ERRORS[6],
    ERRORS[7],
    claim("completes", "simulation completes [runs]"),
];

/// Rows of a statistic at some noises of linear velocity.
macro_rules! rows {
    ($statistic:literal: $($noise:literal)*) => { &[$(concat!($statistic, ", ", $noise, " cm/s")),*] };
}

const NBLS_CONDITIONS: &str = "References of Table 4.6 (surge 1 + 0.2 sin 0.40 t m/s, pitch -30 sin 0.30 t, heading 30 sin 0.35 t degrees) \
     followed by PD, 30 minutes; noise of angular rates 0.01 deg/s, of linear velocity as named; velocities differentiated and \
     low-passed without phase. [10 Hz; 0.2 Hz cut-off; PD on the true state; roll and pitch 0.25 degrees; scale by m11; no bounds on \
     the parameters; cross-validation by 1000 s of Table 4.14's CROSSIM against the truth, because errors as large as the printed ones \
     cannot be of a lawnmower's straight lines.]";

const NBLS_DIFFERS: &str = "A simulation completes if its states stay finite; no bounds or checks of the parameters hide a failure. Noise of a \
     differentiated velocity grows with the power 3/2 of the cut-off: where NBLS fails is a matter of the filter (item nbls-cut-off).";

const AID_CONDITIONS: &str = "Inputs of Table 4.14, open loop: IDSIM of 5000 s at 10 Hz, then CROSSIM; noise of roll and pitch 0.25 degrees, \
     of angular rates and linear velocity as named. [Prior wrong by up to 30 % in every parameter but m11, which is known; CROSSIM of \
     1000 s from the true state, against the truth.]";

/// An error table of AID: all but names, rows and numbers is the same.
const fn aid_table(
    id: &'static str,
    title: &'static str,
    covers: &'static [Covers],
    study: &'static Study,
    rows: &'static [&'static str],
    table: &'static str,
) -> Item {
    Item {
        id,
        title,
        covers,
        thesis: "Errors in cross-validation grow slowly with the noise of linear velocity, up to 1.4 cm/s; ten times the noise of angular \
                 rates has a small net effect.",
        conditions: AID_CONDITIONS,
        study,
        rows,
        columns: ERRORS,
        printed: Printed::Errors(table),
        independent: &[],
        curves: &[],
        differs: AID_DIFFERS,
    }
}

const AID_DIFFERS: &str = "The laws are the corrected ones, with Heun's step, diagonal gains from prior and data, averaging, and several \
     passes in which only what the model leaves unexplained is filtered. The thesis gives neither gains nor prior nor filters.";

/// The thesis' six columns of Table 4.8, and what it prints.
const VELOCITIES: &[Column] = &[
    column("u_mps", "u [m/s]"),
    column("v_mps", "v [m/s]"),
    column("w_mps", "w [m/s]"),
    column("p_degps", "p [deg/s]"),
    column("q_degps", "q [deg/s]"),
    column("r_degps", "r [deg/s]"),
];
const TABLE_4_8: &[f64] = &[0.0074, 1.6e-5, 4.5e-4, 1.3e-6, 1.8e-4, 1.2e-5];

const FIRST_NBLS_CONDITIONS: &str = "NBLS on the references of Table 4.6, 30 minutes, noise of Table 4.7 (attitude 0.1 degrees, velocity 0.05 m/s, rates \
     0.36 deg/s, measured accelerations 0.001 m/s² and 0.05 deg/s²), low-passed without phase [0.3 Hz]; then a lawnmower with packets \
     every 30 s and the sensors of Table 4.9 (gyrocompass), no DVL, by the CEKF on the dynamic model. [Lawnmower and ship of 3.2.1; \
     constant depth instead of altitude; errors while deeper than 2 m.]";

pub const ITEMS: &[Item] = &[
    Item {
        id: "table-4.8",
        title: "First NBLS study: errors of the six velocities",
        covers: &[tables(4, [8, 8])],
        thesis: "Mean absolute errors on a lawnmower, with states of the CEKF on the identified model. Rate errors of 1e-6 deg/s cannot be \
                 of a filter fed with rates of 0.36 deg/s and more; they are plausible of the model alone on straight lines without noise.",
        conditions: FIRST_NBLS_CONDITIONS,
        study: &N_NAV,
        rows: &[
            "identified by NBLS",
            "identified by NBLS, alone",
            "identified by output error",
            "identified by output error, alone",
            "true parameters",
        ],
        columns: VELOCITIES,
        printed: Printed::Values(&[
            Reported { name: "identified by NBLS", values: TABLE_4_8 },
            Reported { name: "identified by NBLS, alone", values: TABLE_4_8 },
            Reported { name: "identified by output error, alone", values: TABLE_4_8 },
        ]),
        independent: &[],
        curves: &[],
        differs: "Not reproduced by NBLS, and why: nbls-table-4.7. Rows *alone* have no filter: the identified vehicle under the same \
                  controller along the same lines, without noise, which rate errors of 1e-6 deg/s can be of at best. The last row, the \
                  filter on the true parameters, shows what the gyrocompass leaves.",
    },
    Item {
        id: "figures-4.7-4.8",
        title: "Navigation on true, identified and wrong parameters",
        covers: &[figures(4, [7, 8])],
        thesis: "Identified about as good as true (caption: slightly worse), both far better than 10 % wrong. No numbers.",
        conditions: FIRST_NBLS_CONDITIONS,
        study: &N_NAV,
        rows: &["true parameters", "identified by NBLS", "identified by output error", "10 % wrong"],
        columns: POSITION,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "Not reproduced for NBLS' vehicle, which the filter refuses (nbls-table-4.7). The one that output error identifies from the \
                  same log navigates about as well as the true one, which is the thesis' statement. Every run has its own wrong vehicle, each \
                  parameter 10 % too high or too low.",
    },
    Item {
        id: "nbls-table-4.7",
        title: "First NBLS study: which of Table 4.7's noises NBLS bears",
        covers: &[],
        thesis: "NBLS bears the noise of Table 4.7 (Table 4.8); later, with differentiated velocities, 0.5 cm/s of noise in them.",
        conditions: "The experiment of table-4.8 with some of its noises; then the identified vehicle alone along the lines, as there. \
                     [Signs and errors of the 18 parameters beside the scale that are not zero. Output error: from a prior that is wrong by \
                     up to 30 %, velocities, rates and attitude of the same log, not its accelerations.]",
        study: &FIRST_NBLS,
        rows: &[
            "no noise",
            "accelerations alone",
            "attitude alone",
            "rates alone",
            "velocity alone",
            "velocity alone, a tenth",
            "all",
            "all, velocity a tenth",
            "all, rates a tenth",
            "all, velocity and rates a tenth",
            "all, by output error",
        ],
        columns: &[
            column("wrong_sign", "parameters of the wrong sign"),
            column("median_percent", "median error of a parameter [%]"),
            claim("completes", "simulation completes [runs]"),
            VELOCITIES[0],
            VELOCITIES[2],
            VELOCITIES[4],
        ],
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "The noise of velocity is what NBLS does not bear, whether or not accelerations are measured: it is total least squares, \
                  and noise in the velocities' columns is taken for motion. That contradicts Table 4.8, and agrees with the 0.5 cm/s that \
                  the thesis finds later: at a tenth of the noise ours is below Table 4.8 in u, w and q, which alone can be compared. \
                  Output error, which has no noise in its regressors, bears all of Table 4.7.",
    },
    Item {
        id: "table-4.10",
        title: "NBLS without noise of linear velocity",
        covers: &[tables(4, [10, 10])],
        thesis: "Errors in cross-validation; another run than the first rows of Tables 4.11 and 4.12.",
        conditions: NBLS_CONDITIONS,
        study: &NBLS,
        rows: &["RMS, 0 cm/s", "MAE, 0 cm/s"],
        columns: ERRORS_COMPLETE,
        printed: Printed::Errors("4.10"),
        independent: &[],
        curves: &[],
        differs: NBLS_DIFFERS,
    },
    Item {
        id: "table-4.11",
        title: "NBLS, mean absolute errors against the noise of linear velocity",
        covers: &[tables(4, [11, 11]), figures(4, [9, 9])],
        thesis: "Nearly immune up to about 0.5 cm/s, fast degradation beyond; at 0.7 cm/s a simulation of the result does not complete.",
        conditions: NBLS_CONDITIONS,
        study: &NBLS,
        rows: rows!("MAE": "0" "0.01" "0.1" "0.2" "0.4" "0.5" "0.6" "0.65" "0.7"),
        columns: ERRORS_COMPLETE,
        printed: Printed::Errors("4.11"),
        independent: &[],
        curves: &[],
        differs: NBLS_DIFFERS,
    },
    Item {
        id: "table-4.12",
        title: "NBLS, root mean square errors against the noise of linear velocity",
        covers: &[tables(4, [12, 12]), figures(4, [10, 10])],
        thesis: "As Table 4.11.",
        conditions: NBLS_CONDITIONS,
        study: &NBLS,
        rows: rows!("RMS": "0" "0.01" "0.1" "0.2" "0.4" "0.5" "0.6" "0.65" "0.7"),
        columns: ERRORS_COMPLETE,
        printed: Printed::Errors("4.12"),
        independent: &[],
        curves: &[],
        differs: NBLS_DIFFERS,
    },
    Item {
        id: "least-squares-4.3.2.3",
        title: "OLS, TLS and NBLS in one degree of freedom (4.3.2.3)",
        covers: &[],
        thesis: "In a pilot study in one degree of freedom NBLS was like total least squares and better than ordinary least squares; no \
                 numbers.",
        conditions: "Surge alone, m u̇ + d |u| u = β ω |ω|, scale by m. [2000 s at 10 Hz, propeller speed a sum of two sines, noise of u as named, two sliding means of 2.1 s and central \
                     differences. OLS: only u̇ is in error. TLS: all three columns, as they stand in SI units. NBLS: columns scaled to \
                     unit length first.]",
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
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "Only u̇, a difference, is noisy to speak of; where its error is all there is, OLS is the right estimator. Unscaled TLS \
                  takes the column of ω|ω| (1e4 rad²/s²) for as exact as it is large and comes close to OLS; NBLS' scaling spreads \
                  the error over the columns, which costs a bias that grows with the noise.",
    },
    Item {
        id: "nbls-cut-off",
        title: "NBLS: where it fails, by the cut-off of the filter",
        covers: &[],
        thesis: "It holds to 0.5 cm/s, and fails at 0.7; the cut-off is not given.",
        conditions: "As table-4.11 with other cut-offs: the number of runs whose simulation completes, by the noise of linear velocity.",
        study: &NBLS_CUT_OFFS,
        rows: &["0.1 Hz", "0.15 Hz", "0.2 Hz", "0.25 Hz", "0.3 Hz", "0.5 Hz"],
        columns: &[
            claim("at_0.2", "0.2 cm/s"),
            claim("at_0.4", "0.4 cm/s"),
            claim("at_0.5", "0.5 cm/s"),
            claim("at_0.6", "0.6 cm/s"),
            claim("at_0.65", "0.65 cm/s"),
            claim("at_0.7", "0.7 cm/s"),
            claim("at_1", "1 cm/s"),
        ],
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "The fastest reference has 0.40 rad/s, 0.064 Hz; what the filter takes of its harmonics is error too.",
    },
    Item {
        id: "table-4.15",
        title: "AID, noise of angular rates 0.01 deg/s",
        covers: &[tables(4, [15, 15])],
        thesis: "Errors in cross-validation. The noise of linear velocity is not printed; by comparison with Tables 4.16 and 4.17 it is zero.",
        conditions: AID_CONDITIONS,
        study: &AID_FINE_RATES,
        rows: &["RMS, 0 cm/s", "MAE, 0 cm/s"],
        columns: ERRORS,
        printed: Printed::Errors("4.15"),
        independent: &[Reported {
            name: "AID, MAE, 0 cm/s",
            values: &[0.015, 0.077, 0.012, 0.005, 0.007, 0.0006, 0.0001, 0.0001],
        }],
        curves: &[],
        differs: AID_DIFFERS,
    },
    Item {
        id: "figure-4.11",
        title: "AID, errors of velocity over the cross-validation",
        covers: &[figures(4, [11, 11])],
        thesis: "Truth less the identified plant in six degrees of freedom: close in most, best in the translations; no numbers.",
        conditions: AID_CONDITIONS,
        study: &AID_FINE_RATES,
        rows: &["u [m/s]", "v [m/s]", "w [m/s]", "p [deg/s]", "q [deg/s]", "r [deg/s]"],
        columns: &[column("mean_absolute", "MAE"), column("root_mean_square", "RMS"), column("largest", "largest")],
        printed: Printed::Nothing,
        independent: &[],
        curves: &[Curves { prefix: "crossim", y_label: "error, median of the runs [m/s, deg/s]", is_log: false }],
        differs: "Noise of linear velocity as in Table 4.13, 1.3 cm/s.",
    },
    aid_table(
        "table-4.16",
        "AID, mean absolute errors, noise of angular rates 0.01 deg/s",
        &[tables(4, [16, 16]), figures(4, [12, 12])],
        &AID_FINE_RATES,
        rows!("MAE": "0" "0.1" "0.2" "0.4" "0.6" "0.8" "1" "1.2" "1.4"),
        "4.16",
    ),
    aid_table(
        "table-4.17",
        "AID, root mean square errors, noise of angular rates 0.01 deg/s",
        &[tables(4, [17, 17]), figures(4, [13, 13])],
        &AID_FINE_RATES,
        rows!("RMS": "0" "0.1" "0.2" "0.4" "0.6" "0.8" "1" "1.2" "1.4"),
        "4.17",
    ),
    aid_table(
        "table-4.18",
        "AID, mean absolute errors, noise of angular rates 0.1 deg/s",
        &[tables(4, [18, 18]), figures(4, [14, 14])],
        &AID_COARSE_RATES,
        rows!("MAE": "0" "0.2" "0.4" "0.6" "0.8" "1" "1.2" "1.4"),
        "4.18",
    ),
    aid_table(
        "table-4.19",
        "AID, root mean square errors, noise of angular rates 0.1 deg/s",
        &[tables(4, [19, 19]), figures(4, [15, 15])],
        &AID_COARSE_RATES,
        rows!("RMS": "0" "0.2" "0.4" "0.6" "0.8" "1" "1.2" "1.4"),
        "4.19",
    ),
    Item {
        id: "aid-gains",
        title: "AID: scalar against diagonal gains",
        covers: &[],
        thesis: "4.4: with one scalar gain the estimates converge poorly, diagonal gains are needed; no numbers.",
        conditions: "As table-4.15 at 1.3 cm/s [zero-phase filtering, one pass, the same schedule of gains and the same limit of \
                     stability. Scalar: Γ = γ I in SI units with the same trace of M⁻¹ Y Γ Yᵀ as the diagonal one; mean absolute errors].",
        study: &GAINS,
        rows: &["MAE, prior", "MAE, scalar gain", "MAE, diagonal gains"],
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
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "In SI units the regressor's columns differ by many orders of magnitude: a scalar gain that is stable for the largest \
                  leaves most parameters where they were.",
    },
];

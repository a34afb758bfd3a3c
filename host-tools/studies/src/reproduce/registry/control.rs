//! Chapter 5: trackline following, and the thesis' future work.

use crate::reproduce::item::{Column, Curves, Item, Reported, claim, column, figures};
use crate::reproduce::studies::STEERING;

const TRACK: &[Column] = &[
    column("cross_median_m", "cross-track, median [m]"),
    column("cross_p95_m", "cross-track, 95 % [m]"),
    column("cross_max_m", "cross-track, max [m]"),
    column("depth_p95_m", "depth, 95 % [m]"),
    column("fins_deg", "fins, RMS [deg]"),
    column("fin_steps_deg", "fin steps, RMS [deg]"),
    column("navigation_median_m", "navigation, median [m]"),
    column("navigation_p95_m", "navigation, 95 % [m]"),
    claim("finished", "mission finished [runs]"),
];

const CURVES: &[Curves] = &[Curves {
    prefix: "navigation",
    y_label: "the backseat's horizontal error, median of the runs [m]",
    is_log: true,
}];

const FLOWN: &str = "The default survey flown in lock-step by the app itself: ten 1 km lines 100 m apart at 1 m/s and 3 m depth, ship's \
     packets every 30 s with range and range rate, attitude with rates, servo and propeller lag that the model lacks, still water. \
     Judged is the true track on the lines, 50 m from the turns on.";

pub const ITEMS: &[Item] = &[
    Item {
        id: "figures-5.1-5.2",
        title: "LQR on the filter's estimate",
        covers: &[figures(5, [1, 2])],
        taken_as: "the survey's lines followed by the LQR, about the line itself and about the reference trajectory of 5.1",
        conditions: FLOWN,
        study: &STEERING,
        rows: &["LQR, dynamic, no DVL", "LQR on reference, dynamic, no DVL"],
        columns: TRACK,
        printed: &[],
        independent: &[Reported { name: "LQR, dynamic, no DVL (median, 95 %)", values: &[0.32, 0.81] }],
        curves: CURVES,
        differs: "The track can be no better than the estimate it is steered by: cross-track and navigation error are of one size.",
    },
    Item {
        id: "pd-lqr",
        title: "PD against LQR",
        covers: &[],
        taken_as: "the same survey by PD with kappa guidance and by the LQR, both on the same filter",
        conditions: FLOWN,
        study: &STEERING,
        rows: &["PD, dynamic, no DVL", "LQR, dynamic, no DVL"],
        columns: TRACK,
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "Both are limited by navigation, not by control; compare what the fins have to do for it.",
    },
    Item {
        id: "closed-loop-models",
        title: "Closed loop on the kinematic model with and without a DVL, and on the dynamic model",
        covers: &[],
        taken_as: "the comparison that the thesis leaves to future work: the estimate that steers comes from each filter",
        conditions: "As figures-5.1-5.2; kinematic process noise (2, 1, 1) e-1 m/s²/√Hz and (1, 2, 2) e-1 rad/s²/√Hz, 4 to 20 times looser than \
                     in the filter studies: the fins follow a noisier estimate, and what they make the vehicle do must pass for noise. \
                     Dynamic: (3, 2, 2) e-3 and (3, 1, 1) e-3.",
        study: &STEERING,
        rows: &["LQR, kinematic + DVL", "LQR, kinematic, no DVL", "LQR, dynamic, no DVL"],
        columns: TRACK,
        printed: &[],
        independent: &[],
        curves: CURVES,
        differs: "In closed loop an estimate that is off takes the vehicle with it: without a DVL the kinematic filter does not keep the \
                  lines. With one it does, but its noise goes to the fins.",
    },
];

//! Chapter 5: trackline following, and the thesis' future work.

use crate::reproduce::item::{Column, Curves, Item, Printed, Reported, claim, column, figures};
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

const FLOWN: &str = "Ten 1 km lines 100 m apart at 1 m/s and 3 m depth; ship on a circle of 600 m at 2 m/s; packets every 30 s from 60 s on. \
     Table 5.1: gyrocompass 0.05 degrees of roll and pitch, 0.10 of heading, rates 0.5 deg/s at 3 Hz, depth 6 cm at 7 Hz, range 1 m, \
     range rate 0.1 m/s, no DVL; dynamic model in the loop; LQR about a trajectory that the model flew with the PD. [Flown by the app \
     itself; the reference runs beside the vehicle; servo and propeller lag that the model lacks, still water; the true track is measured \
     on the lines, 50 m from the turns on.]";

pub const ITEMS: &[Item] = &[
    Item {
        id: "figures-5.1-5.2",
        title: "LQR on the filter's estimate",
        covers: &[figures(5, [1, 2])],
        thesis: "Map, and error of the estimate over time: feasible, and the error low. No numbers.",
        conditions: FLOWN,
        study: &STEERING,
        rows: &["LQR on reference, dynamic, no DVL", "LQR on line, dynamic, no DVL", "PD, dynamic, no DVL"],
        columns: TRACK,
        printed: Printed::Nothing,
        independent: &[Reported {
            name: "LQR, dynamic, no DVL, compass of 1 degree (median, 95 %)",
            values: &[0.32, 0.81],
        }],
        curves: CURVES,
        differs: "Not done: the Riccati differential equation about the current state (5.2). Our gains solve the algebraic equation about \
                  straight flight, renewed with the speed. Results of the PD, which the introduction announces, the thesis does not \
                  give; ours stand here. The track can be no better than the estimate it is steered by.",
    },
    Item {
        id: "closed-loop-models",
        title: "Closed loop on the kinematic model with and without a DVL, and on the dynamic model",
        covers: &[],
        thesis: "Left to future work (5.2): which estimate steers best.",
        conditions: "As figures-5.1-5.2. [Kinematic process noise (2, 1, 1) e-1 m/s²/√Hz and (1, 2, 2) e-1 rad/s²/√Hz, 4 to 20 times looser \
                     than in the filter studies: the fins follow a noisier estimate, and what they make the vehicle do must pass for noise.]",
        study: &STEERING,
        rows: &[
            "LQR on reference, kinematic + DVL",
            "LQR on reference, kinematic, no DVL",
            "LQR on reference, dynamic, no DVL",
        ],
        columns: TRACK,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "In closed loop an estimate that is off takes the vehicle with it; the noise of the kinematic filter goes to the fins.",
    },
];

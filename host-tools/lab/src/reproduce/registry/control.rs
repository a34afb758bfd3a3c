//! Chapter 5: trackline following, and the thesis' future work.

use crate::reproduce::item::{Column, Curves, Item, Printed, Reported, claim, column, figures};
use crate::reproduce::studies::{RICCATI, STEERING};

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

const RICCATI_DIFFERS: &str = "No difference worth the equation: even in its turns this vehicle is so near to straight flight at one speed that the two \
     gains steer alike. That is why the board solves for the speed alone.";

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
        differs: "Our gains solve the algebraic equation about straight flight, renewed with the speed; about the current state: \
                  riccati-5.2. Results of the PD, which the introduction announces, the thesis does not \
                  give; ours stand here. The track can be no better than the estimate it is steered by.",
    },
    Item {
        id: "riccati-5.2",
        title: "LQR by the Riccati equation about the current state (5.2)",
        covers: &[],
        thesis: "The gain follows from the Riccati equation of the vehicle linearised about the current state, with a cross term in the \
                 cost and the control held between steps. No numbers of its own.",
        conditions: "As figures-5.1-5.2. [Steered without a board, from under way at depth. Both gains are of the same weights and steer \
                     about the same kind of reference. About the current state: the discrete equation of a control held for 0.1 s, \
                     solved for all time to go, its cross term from the motion within a step.]",
        study: &RICCATI,
        rows: &["about straight flight", "about the current state, each second"],
        columns: &[
            TRACK[0],
            TRACK[1],
            TRACK[2],
            TRACK[3],
            column("reference_p95_m", "estimate to reference, turns too, 95 % [m]"),
            column("reference_max_m", "the same, max [m]"),
            TRACK[4],
            TRACK[5],
            TRACK[6],
            TRACK[7],
            column("unsolved", "states without a gain"),
            TRACK[8],
        ],
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: RICCATI_DIFFERS,
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

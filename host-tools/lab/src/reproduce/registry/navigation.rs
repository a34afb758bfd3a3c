//! Chapters 2 and 3: cooperative navigation on the kinematic and on the dynamic model.

use crate::reproduce::item::{Column, Curves, Item, Printed, Reported, claim, column, figures};
use crate::reproduce::studies::{ALLOCATION, D_SEA, D_SURVEY, K_COMPASS, K_DVL, K_FOG};

pub const ERRORS: &[Column] = &[
    column("median_m", "median [m]"),
    column("p95_m", "95 % [m]"),
    column("max_m", "max [m]"),
    column("drms_m", "own DRMS [m]"),
    column("rms_over_drms", "RMS / own DRMS"),
];

const MOMENTS: &[Column] = &[
    column("mean_north_m", "north: mean [m]"),
    column("sigma_north_m", "standard deviation [m]"),
    column("skewness_north", "skewness"),
    column("kurtosis_north", "kurtosis"),
    column("mean_east_m", "east: mean [m]"),
    column("sigma_east_m", "standard deviation [m]"),
    column("skewness_east", "skewness"),
    column("kurtosis_east", "kurtosis"),
];

const OVER_TIME: &[Column] = &[
    column("median_m", "median [m]"),
    column("p95_m", "95 % [m]"),
    column("max_m", "max [m]"),
    column("first_quarter_m", "median, first quarter [m]"),
    column("last_quarter_m", "median, last quarter [m]"),
];

const SINCE_START: &[Column] = &[
    column("transient_m", "median of the first 10 min [m]"),
    column("median_m", "median [m]"),
    column("p95_m", "95 % [m]"),
    column("converged_s", "within 10 m for good after [s]"),
];

const TRANSIENT: &[Column] = &[
    column("transient_m", "median of the first 10 min [m]"),
    column("median_m", "median [m]"),
    column("p95_m", "95 % [m]"),
    column("max_m", "max [m]"),
];

const DISTANCES: &[Column] = &[
    column("to_reference_m", "largest distance to kinematic + DVL [m]"),
    column("median_m", "error: median [m]"),
    column("max_m", "error: max [m]"),
    column("first_quarter_m", "error: median, first quarter [m]"),
    column("last_quarter_m", "error: median, last quarter [m]"),
];

pub const CURVES: &[Curves] =
    &[Curves { prefix: "error", y_label: "horizontal error, median of the runs [m]", is_log: true }];
const WITH_SIGMA: &[Curves] = &[
    Curves { prefix: "error", y_label: "horizontal error, median of the runs [m]", is_log: true },
    Curves { prefix: "sigma", y_label: "the filter's own DRMS, median of the runs [m]", is_log: true },
];

const KINEMATIC_DVL: &str = "Ten 1 km lines 100 m apart at 2 knots and 3 m depth; ship on a circle of 300 m at 1.5 knots; a one-way packet \
     every 60 s. Table 2.1: gyrocompass 0.05 degrees of roll and pitch, 0.10 of heading, rates 0.5 deg/s at 3 Hz, depth 6 cm at 7 Hz, \
     DVL 0.01 m/s at 5 Hz, range 1 m, range rate 0.1 m/s. [Circle about the middle of the lines, clockwise; GNSS of ship and vehicle 0.5 \
     and 1.5 m; process noise (1, 2, 1) e-2 m/s²/√Hz and (2, 2, 5) e-2 rad/s²/√Hz; steered by PD.]";

const KINEMATIC_FOG: &str = "Ten 1 km lines 100 m apart at 1 m/s and 3 m depth; ship on a circle of 800 m at 2 m/s; a one-way packet every \
     10 s. Table 2.2: as Table 2.1 without the DVL; range 1 m unless said. [The rest as for Figures 2.2 to 2.6. Rows \"ours\": the project's filter, \
     with gates, ranges to second order and range rates near the position alone; the others as in the thesis.]";

const SURVEYED: &str = "Ten 1 km lines 100 m apart at 1 m/s and 3 m depth; ship on a circle of 600 m at 2 m/s; packets every 30 s from 60 s \
     on. Table 3.1: compass 1 degree at 3 Hz without rates, depth 6 cm at 7 Hz, DVL 0.01 m/s at 5 Hz when used, range 1 m; no current; \
     P on surge, PD with kappa guidance, decoupled allocation. [GNSS of ship and vehicle 0.5 and 1.5 m; truth and filter share the parameters; kinematic process \
     noise (1, 2, 1) e-2 m/s²/√Hz and (2, 2, 5) e-2 rad/s²/√Hz, dynamic (3, 2, 2) e-3 and (3, 1, 1) e-3, as in the simulated water.]";

const AT_SEA: &str = "Six 300 m lines 50 m apart at 1.3 m/s and 2.5 m depth; the three downlinks of Table 3.3's cycle of 30 s. Table 3.2: \
     compass 1 degree at 1 Hz, depth 0.1 m at 1 Hz, DVL 0.01 m/s at 5 Hz, range 1 m. Distances as the thesis measures them, to the \
     kinematic filter with DVL, and to the truth. [Simulated, while the thesis is at sea: parameters are right, where its own were tuned \
     by hand, water and sensors are as declared. Ship on a circle of 200 m at 1 m/s; steered by the LQR; kinematic \
     process noise (2, 1, 1) e-1 m/s²/√Hz and (1, 2, 2) e-1 rad/s²/√Hz, because with a compass at 1 Hz less loses the turns.]";

pub const ITEMS: &[Item] = &[
    Item {
        id: "figures-2.2-2.6",
        title: "Kinematic model with gyrocompass and DVL",
        covers: &[figures(2, [2, 3]), figures(2, [6, 6])],
        thesis: "Maps, histograms and errors over time, with range and with range and range rate: the range rate gives no significant \
                 gain. No numbers.",
        conditions: KINEMATIC_DVL,
        study: &K_DVL,
        rows: &["range", "range + range rate"],
        columns: ERRORS,
        printed: Printed::Nothing,
        independent: &[],
        curves: WITH_SIGMA,
        differs: "The DVL says three hundred times between two packets what a range rate of 0.1 m/s says once.",
    },
    Item {
        id: "figures-2.4-2.5",
        title: "Histograms of the errors with a DVL",
        covers: &[figures(2, [4, 5])],
        thesis: "X perhaps not unimodal, Y perhaps not zero-mean; one realisation, from which nothing is concluded; unchanged by the range rate.",
        conditions: KINEMATIC_DVL,
        study: &K_DVL,
        rows: &["range", "range + range rate"],
        columns: MOMENTS,
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "A Gaussian has skewness 0 and kurtosis 3. The errors of one run follow each other slowly: its mean is not zero, those of ten runs are on either side.",
    },
    Item {
        id: "figures-2.7-2.11",
        title: "Kinematic model with gyrocompass, no DVL",
        covers: &[figures(2, [7, 8]), figures(2, [11, 11])],
        thesis: "The range rate gives no significant gain; errors about zero-mean and Gaussian. No numbers.",
        conditions: KINEMATIC_FOG,
        study: &K_FOG,
        rows: &["range", "range + range rate", "ours, range", "ours, range + range rate"],
        columns: ERRORS,
        printed: Printed::Nothing,
        independent: &[],
        curves: WITH_SIGMA,
        differs: "Without a DVL velocity comes from the ranges. To first order and without gates the filter becomes sure of a wrong bearing; \
                  how often depends on the process noise, which the thesis does not give.",
    },
    Item {
        id: "figures-2.9-2.10",
        title: "Histograms of the errors without a DVL",
        covers: &[figures(2, [9, 10])],
        thesis: "About zero-mean and Gaussian, with the range rate as without.",
        conditions: KINEMATIC_FOG,
        study: &K_FOG,
        rows: &["range", "range + range rate"],
        columns: MOMENTS,
        printed: Printed::Nothing,
        independent: &[],
        curves: &[],
        differs: "Kurtosis above 3 and means of tens of metres: with our process noise the filter is lost now and then, which the printed histograms do not show.",
    },
    Item {
        id: "figure-2.12",
        title: "The same with ranges of 20 m",
        covers: &[figures(2, [12, 12])],
        thesis: "With the range rate a modestly better steady state, a much smaller error in the transient, perhaps faster convergence: \
                 the one positive result on range rate. No numbers.",
        conditions: KINEMATIC_FOG,
        study: &K_FOG,
        rows: &["20 m, range", "20 m, range + range rate", "ours, 20 m, range", "ours, 20 m, range + range rate"],
        columns: TRANSIENT,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "The thesis shows one run; the interval says how far single runs differ.",
    },
    Item {
        id: "start-150m",
        title: "The same, started 150 m off (2.6.2)",
        covers: &[],
        thesis: "No significant change of convergence time, transient or steady state by the range rate; times not given.",
        conditions: KINEMATIC_FOG,
        study: &K_FOG,
        rows: &[
            "150 m off, range",
            "150 m off, range + range rate",
            "ours, 150 m off, range",
            "ours, 150 m off, range + range rate",
        ],
        columns: SINCE_START,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "How soon the position is found depends on where on its circle the ship is, which a single run cannot show.",
    },
    Item {
        id: "compass-2.6.2",
        title: "The same with a compass of 1 degree (2.6.2)",
        covers: &[],
        thesis: "With a low-end compass and no DVL the filter can go unstable, which is put down to the model of constant velocity. No \
                 numbers.",
        conditions: KINEMATIC_FOG,
        study: &K_COMPASS,
        rows: &["range", "range + range rate", "range, q = 1e-3"],
        columns: ERRORS,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "The third row has the same model with 1e-3 m/s²/√Hz in surge and sway: whether the vehicle is lost is a matter of process \
                  noise, which the thesis does not give, more than of the model.",
    },
    Item {
        id: "figures-3.1-3.3",
        title: "Dynamic model without DVL against kinematic + DVL and dead reckoning",
        covers: &[figures(3, [1, 3])],
        thesis: "Kinematic + DVL and dynamic without DVL stay below 5 m; kinematic without DVL is very poor; the dynamic model may outdo \
                 dead reckoning, the more so the longer the mission.",
        conditions: SURVEYED,
        study: &D_SURVEY,
        rows: &[
            "dynamic, no DVL",
            "kinematic + DVL",
            "kinematic, no DVL",
            "compass + DVL dead reckoning",
            "ours, dynamic, no DVL",
        ],
        columns: OVER_TIME,
        printed: Printed::Below(&[
            Reported { name: "dynamic, no DVL", values: &[f64::NAN, f64::NAN, 5.0] },
            Reported { name: "kinematic + DVL", values: &[f64::NAN, f64::NAN, 5.0] },
        ]),
        independent: &[
            Reported { name: "dynamic, no DVL", values: &[0.46, 0.98] },
            Reported { name: "kinematic + DVL", values: &[0.34, 0.82] },
            Reported { name: "kinematic, no DVL", values: &[204.0, 728.0] },
        ],
        curves: WITH_SIGMA,
        differs: "Truth and filter share the parameters and the water is still; docs/results/navigation.md says what undeclared effects cost. \
                  The vehicle starts at the surface, where the simulated water is not the model's: the thesis' filter is off by most there, \
                  and \"ours\" has more process noise above 1 m.",
    },
    Item {
        id: "figures-3.5-3.8",
        title: "The sea trial's mission: dynamic without DVL against kinematic + DVL",
        covers: &[figures(3, [5, 8])],
        thesis: "Dynamic without DVL stays within 8 m of kinematic + DVL; kinematic without DVL is unstable; the vehicle's dead reckoning \
                 grows without bound.",
        conditions: AT_SEA,
        study: &D_SEA,
        rows: &["dynamic, no DVL", "kinematic + DVL", "kinematic, no DVL", "compass + DVL dead reckoning"],
        columns: DISTANCES,
        printed: Printed::Below(&[Reported { name: "dynamic, no DVL", values: &[8.0] }]),
        independent: &[],
        curves: CURVES,
        differs: "That the printed number is reached in a simulation of the mission says that its geometry and sensors allow it, not what the \
                  sea would do.",
    },
    Item {
        id: "figures-3.9-3.11",
        title: "The sea trial's mission: range rate, doubled process noise, 5 % parameters",
        covers: &[figures(3, [9, 11])],
        thesis: "Range and range + range rate are indistinguishable, also with the process noise doubled (3.10) and with errors of 5 %, one \
                 sigma, in mass and quadratic drag (3.11), whose effect is poor for so small an error of the model. No numbers.",
        conditions: AT_SEA,
        study: &D_SEA,
        rows: &[
            "dynamic, no DVL",
            "dynamic, no DVL, range rate",
            "doubled noise",
            "doubled noise, range rate",
            "mass and drag 5 % wrong",
            "mass and drag 5 % wrong, range rate",
        ],
        columns: DISTANCES,
        printed: Printed::Nothing,
        independent: &[],
        curves: CURVES,
        differs: "Range rates come with every packet. Each of the twelve masses and drags has an error of its own, so that runs differ.",
    },
    Item {
        id: "claims-3.2.4",
        title: "Velocity covariances (3.2.4)",
        covers: &[],
        thesis: "Without fixes of position or velocity the kinematic model's velocity covariance grows without bound, that of the dynamic \
                 model settles; the ship's must be below the vehicle's, or a range rate corrects the ship. No numbers.",
        conditions: "As Figures 3.1 to 3.3. [One sigma of the horizontal velocity (root of the summed variances) of each filter while the vehicle is deeper \
                     than 2 m. Bounded: its 95th percentile in the second half of the dive is less than 10 % above that in the first half.]",
        study: &D_SURVEY,
        rows: &[
            "velocity: kinematic + DVL",
            "velocity: kinematic, no DVL",
            "velocity: dynamic, no DVL",
            "velocity: kinematic, no DVL, no ranges",
            "velocity: dynamic, no DVL, no ranges",
        ],
        columns: &[
            column("vehicle_mps", "vehicle, median [m/s]"),
            column("ship_mps", "ship, median [m/s]"),
            claim("ship_below", "ship below vehicle [runs]"),
            column("rms_over_sigma", "vehicle, RMS error / own sigma"),
            column("largest_mps", "vehicle, largest [m/s]"),
            column("growth", "second half / first half"),
            claim("bounded", "bounded [runs]"),
        ],
        printed: Printed::Nothing,
        independent: &[],
        curves: &[Curves {
            prefix: "velocity",
            y_label: "one sigma of velocity, median of the runs [m/s]",
            is_log: true,
        }],
        differs: "The dynamic model's boundedness is physical: drag pulls its velocity back. The kinematic model's velocity is a random \
                  walk, which depth and noisy attitude seem to stop even without ranges; that covariance is not to be believed, as \
                  its error shows. Whether the ship's is below the vehicle's depends on the filter: fixes of 0.5 m know velocity better than \
                  a kinematic model without a DVL, and worse than a DVL or a good dynamic model.",
    },
    Item {
        id: "allocation-3.1.4",
        title: "Allocation of moments to fins: six degrees of freedom against decoupled (3.1.4)",
        covers: &[],
        thesis: "Allocation in six degrees of freedom makes a simulation 2 to 10 times slower for marginally better performance.",
        conditions: "Plant and PD, on the true state, along the first two lines of 3.2.1. [Time of the machine that ran this, the least of \
                     three; the plant takes 50 steps a second.]",
        study: &ALLOCATION,
        rows: &["decoupled", "6-DOF"],
        columns: &[
            column("time_ratio", "time / decoupled"),
            column("time_ms", "time [ms]"),
            column("cross_m", "across the line, RMS [m]"),
            column("depth_m", "depth, RMS [m]"),
            column("roll_deg", "roll, RMS [deg]"),
        ],
        printed: Printed::Values(&[Reported { name: "6-DOF", values: &[2.0] }]),
        independent: &[],
        curves: &[],
        differs: "Both solve on the nonlinear fin model: decoupled by a safeguarded Newton for a pair of fins, 6-DOF by Gauss-Newton for all \
                  four. The thesis does not name its solver; printed is the lower end of its range, and less is better.",
    },
];

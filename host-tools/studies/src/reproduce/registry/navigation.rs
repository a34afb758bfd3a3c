//! Chapters 2 and 3: cooperative navigation on the kinematic and on the dynamic model.

use crate::reproduce::item::{Column, Curves, Item, Reported, claim, column, figures};
use crate::reproduce::studies::{ALLOCATION, SURVEY};

const ERRORS: &[Column] = &[
    column("median_m", "median [m]"),
    column("p95_m", "95 % [m]"),
    column("max_m", "max [m]"),
    column("drms_m", "own DRMS [m]"),
    column("rms_over_drms", "RMS / own DRMS"),
];

const SINCE_START: &[Column] = &[
    column("converged_s", "within 10 m after [s]"),
    column("median_m", "median, second half [m]"),
    column("p95_m", "95 %, second half [m]"),
    column("rejected", "ranges refused"),
];

const CURVES: &[Curves] =
    &[Curves { prefix: "error", y_label: "horizontal error, median of the runs [m]", is_log: true }];
const WITH_SIGMA: &[Curves] = &[
    Curves { prefix: "error", y_label: "horizontal error, median of the runs [m]", is_log: true },
    Curves { prefix: "sigma", y_label: "the filter's own DRMS, median of the runs [m]", is_log: true },
];

const SURVEYED: &str = "The default survey: ten 1 km lines 100 m apart at 1 m/s and 3 m depth, 3 h, closed loop; depth 7 Hz 0.06 m, \
     attitude 3 Hz 1 degree without rates, ranges every 30 s with 1 m and no range rate, ship on a 600 m circle at 2 m/s with \
     GNSS of 0.5 m at 1 Hz, GNSS of the vehicle only while surfaced at either end; truth and filter share the parameters. \
     One flight a seed, its measurements through every filter. Process noise of the kinematic model (1, 2, 1) e-2 m/s²/√Hz and \
     (2, 2, 5) e-2 rad/s²/√Hz, of the dynamic model (3, 2, 2) e-3 and (3, 1, 1) e-3.";

pub const ITEMS: &[Item] = &[
    Item {
        id: "figures-2.2-2.12",
        title: "Cooperative navigation on the kinematic model",
        covers: &[figures(2, [2, 12])],
        taken_as: "tracks, errors and covariance over time of the kinematic (constant velocity) CEKF, with a DVL and without it, \
                   with acoustic ranges and without them",
        conditions: SURVEYED,
        study: &SURVEY,
        rows: &[
            "kinematic + DVL",
            "kinematic + DVL, no ranges",
            "compass + DVL dead reckoning",
            "kinematic, no DVL",
            "kinematic, no DVL, q = 1e-3",
        ],
        columns: ERRORS,
        printed: &[],
        independent: &[
            Reported { name: "kinematic + DVL", values: &[0.34, 0.82] },
            Reported { name: "kinematic, no DVL", values: &[204.0, 728.0] },
            Reported { name: "kinematic, no DVL, q = 1e-3", values: &[2.2, 9.6] },
        ],
        curves: WITH_SIGMA,
        differs: "Without a DVL the kinematic model stands and falls with its process noise: q_u,v = 1e-3 instead of the loose one \
                  is the difference between keeping and losing the vehicle, so that a comparison must state its Q.",
    },
    Item {
        id: "study-init-150m",
        title: "Initialisation error of 150 m (2.6.2)",
        covers: &[],
        taken_as: "a filter started 150 m off, with a covariance that says so, converging on ranges alone",
        conditions: "The survey's measurements while the vehicle is deeper than 2 m: no fix of it. Start at the true state but for \
                     the position, 150 m off on a bearing that the seed picks, with 150 m one sigma per axis; ship from its GNSS.",
        study: &SURVEY,
        rows: &["kinematic + DVL, 150 m off", "dynamic, no DVL, 150 m off"],
        columns: SINCE_START,
        printed: &[],
        independent: &[],
        curves: CURVES,
        differs: "Ranges from a ship that moves around the vehicle fix the position within minutes; how many depends on where \
                  on its circle the ship is, which the thesis' single run cannot show.",
    },
    Item {
        id: "study-range-noise-20m",
        title: "Range noise of 20 m (2.6.2)",
        covers: &[],
        taken_as: "the same filters on ranges of 20 m one sigma, known to the filter",
        conditions: "The survey with white noise added to its ranges up to 20 m; the filter's declared noise is 20 m. All else as before.",
        study: &SURVEY,
        rows: &[
            "kinematic + DVL, 20 m ranges",
            "dynamic, no DVL, 20 m ranges",
            "dynamic, range rate, 20 m ranges",
            "kinematic, no DVL, 20 m ranges",
        ],
        columns: ERRORS,
        printed: &[],
        independent: &[],
        curves: CURVES,
        differs: "The vehicle's velocity is known well with a DVL or the dynamic model, so that many ranges average; the \
                  independent implementation's 20 m rows (6.0 / 21 m and 5.0 / 16 m) are in a current with current states.",
    },
    Item {
        id: "figures-3.1-3.3",
        title: "Navigation on the dynamic model against kinematic + DVL and dead reckoning",
        covers: &[figures(3, [1, 3])],
        taken_as: "the survey by the dynamic model without a DVL, the kinematic model with and without one, and (Figure 3.3) \
                   dead reckoning on compass and DVL",
        conditions: SURVEYED,
        study: &SURVEY,
        rows: &[
            "dynamic, no DVL",
            "kinematic + DVL",
            "kinematic, no DVL",
            "compass + DVL dead reckoning",
            "dynamic, no DVL, no ranges",
        ],
        columns: ERRORS,
        printed: &[],
        independent: &[
            Reported { name: "dynamic, no DVL", values: &[0.46, 0.98] },
            Reported { name: "kinematic + DVL", values: &[0.34, 0.82] },
            Reported { name: "kinematic, no DVL", values: &[204.0, 728.0] },
        ],
        curves: WITH_SIGMA,
        differs: "The thesis' claim holds: with its own dynamics a vehicle without a DVL navigates nearly as well as one with a DVL, \
                  as long as the parameters are right and the water is still.",
    },
    Item {
        id: "figures-3.5-3.11",
        title: "Range rate, doubled process noise and 5 % parameters",
        covers: &[figures(3, [5, 11])],
        taken_as: "simulated counterparts of the sea trials: the dynamic filter without a DVL, with and without range rates, with \
                   twice the process noise (power), and with parameters 5 % wrong",
        conditions: "As figures-3.1-3.3. Wrong parameters: inertia, drag, fins and thrust each 5 % too high or too low, signs by \
                     the seed. Range rate of 0.1 m/s with each range.",
        study: &SURVEY,
        rows: &[
            "dynamic, no DVL",
            "dynamic, range rate",
            "dynamic, doubled Q",
            "dynamic, parameters 5 % wrong",
            "dynamic, parameters 5 % wrong, doubled Q",
            "dynamic, parameters 5 % wrong, range rate",
            "kinematic, no DVL, range rate",
        ],
        columns: ERRORS,
        printed: &[],
        independent: &[
            Reported { name: "dynamic, no DVL", values: &[0.46, 0.98] },
            Reported { name: "dynamic, parameters 5 % wrong", values: &[5.0, 10.0] },
        ],
        curves: CURVES,
        differs: "Simulated water is still and its noise white, which sea trials are not. A range rate of 0.1 m/s says little about \
                  a velocity that the model knows to centimetres per second; with ranges of 20 m it says more (study-range-noise-20m). \
                  A filter with wrong parameters is overconfident (RMS / own DRMS above 1), and doubling Q corrects little of that.",
    },
    Item {
        id: "claims-3.2.4",
        title: "Velocity covariances (3.2.4)",
        covers: &[],
        taken_as: "two claims: the ship's velocity covariance stays below the vehicle's; the dynamic model's velocity covariance \
                   is bounded without a DVL and without ranges",
        conditions: "One sigma of the horizontal velocity (root of the summed variances) of each filter while the vehicle is deeper \
                     than 2 m. Bounded: its 95th percentile in the second half of the dive is less than 10 % above that in the first half.",
        study: &SURVEY,
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
        printed: &[],
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
        title: "Allocation of moments to fins: 6-DOF against decoupled (3.1.4)",
        covers: &[],
        taken_as: "cost of an allocation that solves for all four fins in six degrees of freedom, against one that gives yaw to the \
                   vertical and pitch to the horizontal fins",
        conditions: "4000 random motions and moments a run, 0.7 to 1.5 m/s, limit 0.35 rad; the fins' damping counts in. Moment error \
                     and angles where the limit is not reached. The time is of the machine that ran this, the least of ten repetitions.",
        study: &ALLOCATION,
        rows: &["decoupled", "6-DOF"],
        columns: &[
            column("time_us", "time [µs]"),
            column("time_ratio", "time / decoupled"),
            column("moment_error_percent", "moment error [%]"),
            column("fins_deg", "fins, RMS [deg]"),
            column("within_percent", "within limits [%]"),
        ],
        printed: &[],
        independent: &[],
        curves: &[],
        differs: "On cruciform fins at the stern the two give the same moments. Both solve on the nonlinear fin model: decoupled by a \
                  safeguarded Newton a pair of fins, 6-DOF by a few Gauss-Newton steps for all four, so that neither is the \
                  clearly cheaper one; the general one also serves fins in other places.",
    },
];

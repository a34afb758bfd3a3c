//! Numbers that each run of a table has for itself.

/// Most runs of one table.
pub const MOST_RUNS: usize = 24;

macro_rules! names {
    ($what:literal) => {
        names!($what: 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24)
    };
    ($what:literal: $($number:literal)*) => {
        [$(concat!($what, " (run ", $number, ")")),*]
    };
}

/// Names of the runs' delays.
pub(super) const DELAYS: [&str; MOST_RUNS] = names!("s");
/// Names of the runs' winds.
pub const WINDS: [[&str; MOST_RUNS]; 2] = [names!("north_mps"), names!("east_mps")];

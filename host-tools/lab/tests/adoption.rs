//! A backseat with a wrong vehicle file, which may use what it identifies while it has a DVL.

use backseat_lab::adoption::{Declared, fly};

/// Four kilometres without a DVL, after twenty minutes with one. Over twenty seeds adoption takes the median from 12 m
/// to 4 m; half of what a single flight was wrong by is a weak demand on it.
#[test]
fn identified_parameters_navigate_better_than_wrong_ones() {
    let [kept, improved] =
        [Declared::Wrong, Declared::Improving].map(|declared| fly(1, declared, None).expect("flight"));
    assert_eq!(kept.verdicts[0], 0);
    assert!(improved.verdicts[0] > 0, "{:?}", improved.verdicts);
    assert!(improved.error.median_m < 0.5 * kept.error.median_m, "{:?} {:?}", improved.error, kept.error);
}

//! While no position and no velocity is heard.

use super::support::{CRUISE, initial, navigator};
use backseat_core::navigation::{Measurement, NavigationConfig, Navigator};

#[test]
fn depth_alone_does_not_teach_the_speed() {
    let mut config = NavigationConfig::REFERENCE;
    config.make_robust();
    let mut navigator = navigator(&config);
    navigator.initialise(0, &initial()).unwrap();
    let sigma = |navigator: &Navigator| navigator.main().effect_state("log_factor", "d11").unwrap().1;
    let mut before = 0.0;
    for second in 1..=600 {
        navigator.predict(1_000_000 * second, &CRUISE).unwrap();
        navigator.fuse(&Measurement::Depth { z_m: navigator.state()[2] });
        if second == 300 {
            before = sigma(&navigator);
        }
    }
    assert!(before < 0.1 && sigma(&navigator) > before);
    // nobody tells of a change of the water: even odds
    let [nominal, changing] = navigator.weights();
    assert!(nominal + changing > 0.5 && changing > 0.25);
}

//! While no position and no velocity is heard.

use super::support::{CRUISE, started};
use backseat_core::navigation::{Measurement, NavigationConfig, Navigator};

#[test]
fn depth_alone_does_not_teach_the_speed() {
    let mut config = NavigationConfig::REFERENCE;
    config.make_robust();
    let mut navigator = started(&config);
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
    // ten to one against a change of the water, twice, fade with 1500 s
    let odds = 10.0_f64.powf((-300.0_f64 / 1500.0).exp());
    let [_, changing] = navigator.weights();
    assert!((changing - 1.0 / (1.0 + 2.0 * odds)).abs() < 1e-3, "{changing}");
}

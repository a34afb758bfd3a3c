//! Change indication: three short flights and the estimate they are known to give.
//!
//! Each history in `data/` holds time, the twelve vehicle states and their sigmas twice a minute. A change of behaviour
//! shows up as a difference of these files, to be reviewed with the change that made it. To write them again:
//! `GOLDEN_HISTORY=write cargo test -p hil-sim golden_history`.

use backseat_link::Client;
use hil_sim::backseat::InProcess;
use hil_sim::flight::fly;
use hil_sim::scenario::Scenario;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Time between two rows, s.
const INTERVAL_S: usize = 30;

fn compare(name: &str, scenario: &Scenario) {
    let mut client = Client::new(InProcess::new());
    let flight = fly(scenario, &mut client, None, &AtomicBool::new(false), |_| {}).unwrap();
    let mut history = String::from(
        "t_s,x_m,y_m,z_m,roll_rad,pitch_rad,heading_rad,u_mps,v_mps,w_mps,p_radps,q_radps,r_radps,one sigma of each\n",
    );
    for sample in flight.samples.iter().skip(INTERVAL_S).step_by(INTERVAL_S) {
        let telemetry = &sample.telemetry;
        let _ = write!(history, "{:.1}", telemetry.time_us as f64 * 1e-6);
        for value in telemetry.state.iter().chain(&telemetry.sigma) {
            let _ = write!(history, ",{value:.6e}");
        }
        history.push('\n');
    }
    let _ = writeln!(history, "digest {:016x}", flight.digest);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(format!("golden_{name}.csv"));
    if std::env::var("GOLDEN_HISTORY").is_ok_and(|mode| mode == "write") {
        std::fs::write(&path, &history).unwrap();
        return;
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    for (line, (expected, found)) in golden.lines().zip(history.lines()).enumerate() {
        assert_eq!(found, expected, "{} line {}: the estimate has changed", path.display(), line + 1);
    }
    assert_eq!(golden, history, "{}", path.display());
}

fn flight_of(name: &str, minutes: f64) -> Scenario {
    let mut scenario = Scenario::built_in(name).unwrap();
    scenario.settings.seed = 1;
    scenario.settings.duration_s = 60.0 * minutes;
    scenario
}

#[test]
fn regress_still_water() {
    compare("still_water", &flight_of("survey", 10.0));
}

#[test]
fn regress_current() {
    compare("current", &flight_of("survey_current", 10.0));
}

#[test]
fn regress_dvl_and_identification() {
    compare("dvl_identification", &flight_of("identification", 10.0));
}

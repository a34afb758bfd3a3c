//! What was found of a vehicle, as a report.

use super::examination::{Findings, Misfit};
use backseat_logs::VehicleFile;
use backseat_report::{Report, Table};
use serde_json::{Value, json};

/// The report of an examination, which opens with whether the vehicle flies.
pub fn report(file: &VehicleFile, findings: &Findings) -> Report {
    let p = &file.parameters;
    let buoyancy_kg = p.displaced_mass_kg - p.mass_kg;
    let way = if buoyancy_kg >= 0.0 { "floats" } else { "sinks" };
    let righting = p.displaced_mass_kg * p.g_mps2 * p.b_cb_to_cg_m[2] * 1.0_f64.to_radians();
    let (fatal, odd): (Vec<&Misfit>, Vec<&Misfit>) = findings.misfits.iter().partition(|misfit| misfit.is_fatal);
    let verdict = match (fatal.len(), odd.len()) {
        (0, 0) => "flies",
        (0, _) => "flies, though not all of its numbers fit",
        _ => "does not fly",
    };
    // to the gram, without zeros that say nothing
    let mass_kg = (p.mass_kg * 1e3).round() / 1e3;
    let answer = format!("{} {verdict}: {} m x {} m, {mass_kg} kg.", file.name, p.length_m, p.diameter_m);
    let mut report = Report::new(format!("Vehicle {}", file.name), answer)
        .values(json(file, findings))
        .fact("buoyancy", format!("{:+.2} N ({buoyancy_kg:+.3} kg): it {way}", buoyancy_kg * p.g_mps2))
        .fact(
            "righting",
            format!("{righting:.3} N m a degree; metacentric height {:.1} mm", 1000.0 * p.b_cb_to_cg_m[2]),
        );
    if let Some(top) = findings.top_speed_mps {
        report = report.fact("top speed", format!("{top:.1} m/s"));
    }
    let header = ["speed [m/s]", "propeller [rpm]", "pitch [deg]", "elevator [deg]"];
    let cruises = findings.cruises.iter().fold(Table::new("Level flight", &header), |table, cruise| {
        // starboard down is nose down; shown positive nose up
        let angles =
            [cruise.trim.pitch_rad, -cruise.trim.fins_rad[3]].map(|angle| format!("{:.1}", angle.to_degrees()));
        table.row([format!("{:.1}", cruise.speed_mps), format!("{:.0}", cruise.rpm)].into_iter().chain(angles))
    });
    report = motion(report.table(cruises).section(&format!("At {} m/s", findings.speed_mps)), findings);
    let header = ["", "declared", "slender body", "factor", "unit"];
    let beside = findings.beside.iter().fold(Table::new("Beside a slender body of its size", &header), |table, row| {
        let [declared, slender] = [row.declared, row.slender_body].map(|value| format!("{value:.3}"));
        table.row([row.what.to_owned(), declared, slender, format!("{:.2}", row.factor()), row.unit.to_owned()])
    });
    report = report.table(beside);
    report = fatal
        .iter()
        .fold(report, |report, misfit| report.alarm(&format!("DOES NOT FLY: {}: {}", misfit.key, misfit.message)));
    odd.iter().fold(report, |report, misfit| report.text(&format!("does not fit: {}: {}", misfit.key, misfit.message)))
}

/// Turn, dive, natural motions, and the short flight in the simulator.
fn motion(mut report: Report, findings: &Findings) -> Report {
    if let Some(turn) = &findings.turn {
        let half = turn.half_turn_s.map_or_else(|| "more than 40 s".to_owned(), |s| format!("{s:.0} s"));
        let [fin, heel] = [turn.fin_rad, turn.heel_rad].map(f64::to_degrees);
        report = report.fact(
            "turn",
            format!(
                "radius {:.1} m with rudders at {fin:.0} deg, half a turn in {half}, heel {heel:.1} deg",
                turn.radius_m
            ),
        );
    }
    if let Some(dive) = &findings.dive {
        let [fin, pitch] = [dive.fin_rad, dive.pitch_rad].map(f64::to_degrees);
        report = report
            .fact("dive", format!("{:.2} m/s with elevators {fin:.0} deg down, pitch {pitch:.0} deg", dive.rate_mps));
    }
    for mode in &findings.modes {
        report = report.fact("mode", mode.words());
    }
    let Some(flight) = &findings.flight else { return report };
    let [depth, wanted] = flight.depth_m;
    let [roll, pitch] = flight.largest_rad.map(f64::to_degrees);
    let words = format!(
        "{:.0} s of the default mission: {:.2} m/s at {depth:.1} m of {wanted:.1} m, roll to {roll:.0} deg, pitch to \
         {pitch:.0} deg",
        flight.duration_s, flight.speed_mps[0]
    );
    report.fact("simulated", words)
}

fn json(file: &VehicleFile, findings: &Findings) -> Value {
    let p = &file.parameters;
    let cruises: Vec<Value> = findings
        .cruises
        .iter()
        .map(|c| {
            json!({"speed_mps": c.speed_mps, "rpm": c.rpm, "pitch_rad": c.trim.pitch_rad, "fins_rad": c.trim.fins_rad,
                "thrust_n": c.trim.thrust_n})
        })
        .collect();
    let modes: Vec<Value> = findings
        .modes
        .iter()
        .map(
            |m| json!({"plane": m.plane, "re_per_s": m.eigenvalue.re, "im_per_s": m.eigenvalue.im, "words": m.words()}),
        )
        .collect();
    json!({
        "vehicle": file.name,
        "flies": findings.flies(),
        "buoyancy_n": (p.displaced_mass_kg - p.mass_kg) * p.g_mps2,
        "metacentric_height_m": p.b_cb_to_cg_m[2],
        "cruises": cruises,
        "top_speed_mps": findings.top_speed_mps,
        "turn": findings.turn,
        "dive": findings.dive,
        "modes": modes,
        "beside_slender_body": findings.beside,
        "flight": findings.flight.map(|f| json!({"duration_s": f.duration_s, "ending": f.ending.name(),
            "depth_m": f.depth_m[0], "commanded_depth_m": f.depth_m[1], "speed_mps": f.speed_mps[0], "commanded_mps": f.speed_mps[1],
            "largest_roll_rad": f.largest_rad[0], "largest_pitch_rad": f.largest_rad[1]})),
        "misfits": findings.misfits,
    })
}

//! What `vehicle check` found, as text and as JSON.

use super::examination::{Findings, Misfit};
use backseat_logs::VehicleFile;
use serde_json::{Value, json};
use std::fmt::Write as _;

pub fn text(file: &VehicleFile, findings: &Findings) -> String {
    let mut out = String::new();
    let p = &file.parameters;
    let buoyancy_kg = p.displaced_mass_kg - p.mass_kg;
    let _ = writeln!(out, "{}: {} m x {} m, {} kg", file.name, p.length_m, p.diameter_m, p.mass_kg);
    let way = if buoyancy_kg >= 0.0 { "floats" } else { "sinks" };
    let _ = writeln!(out, "buoyancy    {:+.2} N ({buoyancy_kg:+.3} kg): it {way}", buoyancy_kg * p.g_mps2);
    let righting = p.displaced_mass_kg * p.g_mps2 * p.b_cb_to_cg_m[2] * 1.0_f64.to_radians();
    let _ = writeln!(
        out,
        "righting    {righting:.3} N m a degree; metacentric height {:.1} mm",
        1000.0 * p.b_cb_to_cg_m[2]
    );
    let _ = writeln!(out, "\n{:>8} {:>8} {:>11} {:>14}", "m/s", "rpm", "pitch [deg]", "elevator [deg]");
    for cruise in &findings.cruises {
        // starboard down is nose down; shown positive nose up
        let elevator = -cruise.trim.fins_rad[3].to_degrees();
        let pitch = cruise.trim.pitch_rad.to_degrees();
        let _ = writeln!(out, "{:>8.1} {:>8.0} {pitch:>11.1} {elevator:>14.1}", cruise.speed_mps, cruise.rpm);
    }
    if let Some(top) = findings.top_speed_mps {
        let _ = writeln!(out, "top speed   {top:.1} m/s");
    }
    let _ = writeln!(out, "\nat {} m/s:", findings.speed_mps);
    if let Some(turn) = &findings.turn {
        let half = turn.half_turn_s.map_or_else(|| "more than 40 s".to_owned(), |s| format!("{s:.0} s"));
        let _ = writeln!(
            out,
            "turn        radius {:.1} m with rudders at {:.0} deg, half a turn in {half}, heel {:.1} deg",
            turn.radius_m,
            turn.fin_rad.to_degrees(),
            turn.heel_rad.to_degrees()
        );
    }
    if let Some(dive) = &findings.dive {
        let _ = writeln!(
            out,
            "dive        {:.2} m/s with elevators {:.0} deg down, pitch {:.0} deg",
            dive.rate_mps,
            dive.fin_rad.to_degrees(),
            dive.pitch_rad.to_degrees()
        );
    }
    for mode in &findings.modes {
        let _ = writeln!(out, "mode        {}", mode.words());
    }
    let _ = writeln!(out, "\n{:<24} {:>10} {:>13} {:>7}  unit", "", "declared", "slender body", "factor");
    for row in &findings.beside {
        let factor = row.factor();
        let _ = writeln!(
            out,
            "{:<24} {:>10.3} {:>13.3} {factor:>7.2}  {}",
            row.what, row.declared, row.slender_body, row.unit
        );
    }
    if let Some(flight) = &findings.flight {
        let [depth, wanted] = flight.depth_m;
        let [roll, pitch] = flight.largest_rad.map(f64::to_degrees);
        let _ = writeln!(
            out,
            "\nin the simulator, {:.0} s of the default mission: {:.2} m/s at {depth:.1} m of {wanted:.1} m, roll to \
             {roll:.0} deg, pitch to {pitch:.0} deg",
            flight.duration_s, flight.speed_mps
        );
    }
    let (fatal, odd): (Vec<&Misfit>, Vec<&Misfit>) = findings.misfits.iter().partition(|misfit| misfit.is_fatal);
    out.push('\n');
    for misfit in odd {
        let _ = writeln!(out, "does not fit: {}: {}", misfit.key, misfit.message);
    }
    match fatal.as_slice() {
        [] => out += "flies\n",
        fatal => {
            for misfit in fatal {
                let _ = writeln!(out, "DOES NOT FLY: {}: {}", misfit.key, misfit.message);
            }
        }
    }
    out
}

pub fn json(file: &VehicleFile, findings: &Findings) -> String {
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
    let beside: Vec<Value> = findings
        .beside
        .iter()
        .map(|b| json!({"what": b.what, "key": b.key, "unit": b.unit, "declared": b.declared, "slender_body": b.slender_body}))
        .collect();
    let misfits: Vec<Value> =
        findings.misfits.iter().map(|m| json!({"fatal": m.is_fatal, "key": m.key, "message": m.message})).collect();
    let object = json!({
        "vehicle": file.name,
        "flies": !findings.misfits.iter().any(|misfit| misfit.is_fatal),
        "buoyancy_n": (p.displaced_mass_kg - p.mass_kg) * p.g_mps2,
        "metacentric_height_m": p.b_cb_to_cg_m[2],
        "cruises": cruises,
        "top_speed_mps": findings.top_speed_mps,
        "turn": findings.turn.map(|t| json!({"fin_rad": t.fin_rad, "radius_m": t.radius_m, "half_turn_s": t.half_turn_s,
            "heel_rad": t.heel_rad})),
        "dive": findings.dive.map(|d| json!({"fin_rad": d.fin_rad, "rate_mps": d.rate_mps, "pitch_rad": d.pitch_rad})),
        "modes": modes,
        "beside_slender_body": beside,
        "flight": findings.flight.map(|f| json!({"duration_s": f.duration_s, "ending": f.ending.name(),
            "depth_m": f.depth_m[0], "commanded_depth_m": f.depth_m[1], "speed_mps": f.speed_mps,
            "largest_roll_rad": f.largest_rad[0], "largest_pitch_rad": f.largest_rad[1]})),
        "misfits": misfits,
    });
    format!("{object}\n")
}

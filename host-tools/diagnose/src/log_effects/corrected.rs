//! A log without what effects of its readings make of it.

use super::{
    DEPTH_SCALE, DVL_ARM, DVL_CHANGE, DVL_DELAY, Effects, GNSS_ARM, GNSS_DELAY, HEADING_CHANGE, HEADING_LAG, MOST,
    PITCH_CHANGE, PLACE, SOFT_IRON, USBL_TURN, first_three,
};
use crate::lateness::Lag;
use backseat_core::effects::{EffectSet, Moment, SensorChannel};
use backseat_core::parameters::Installation;
use backseat_estimation::inputs;
use backseat_logs::log::{Column, Log, LogRow};
use std::borrow::Cow;

impl Effects {
    /// The log as perfect sensors would have it: at its place, in time, without scale. Effects of the board's catalogue
    /// and those of the motion change nothing here.
    #[must_use]
    pub fn corrected<'a>(&self, log: Cow<'a, Log>) -> Cow<'a, Log> {
        let mut log = log;
        let has = |entries: &[usize]| entries.iter().any(|entry| self.log[*entry] != [0.0; MOST]);
        if has(&[HEADING_CHANGE, PITCH_CHANGE, DVL_CHANGE]) {
            self.undo_changes(log.to_mut());
        }
        if has(&[HEADING_LAG, SOFT_IRON, DEPTH_SCALE]) {
            self.correct_readings(log.to_mut());
        }
        if has(&[USBL_TURN, PLACE]) {
            self.correct_positioning(log.to_mut());
        }
        if has(&[GNSS_DELAY]) {
            self.move_fixes(log.to_mut());
        }
        let [delay_s, ..] = self.log[DVL_DELAY];
        let moved = Installation {
            dvl_arm_m: first_three(self.log[DVL_ARM]),
            dvl_delay_s: delay_s.max(0.0),
            gnss_arm_m: first_three(self.log[GNSS_ARM]),
            ..Installation::DEFAULT
        };
        if moved == Installation::DEFAULT {
            return log;
        }
        // It was moved to the centre by what is declared; this is the rest.
        let mut raw = log.into_owned();
        raw.at_centre = false;
        Cow::Owned(inputs::at_centre(&raw, &moved).into_owned())
    }

    /// What attitude and DVL would have read without the changes under way.
    fn undo_changes(&self, log: &mut Log) {
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
        let changes = Self { board: EffectSet::NONE, ..*self };
        for row in &mut log.rows {
            let t_s = (row.time_us - start_us) as f64 * 1e-6;
            let board = changes.board_at(t_s);
            let moment = Moment { t_s, sound_speed_mps: 0.0 };
            for (channel, first) in [(SensorChannel::Attitude, Column::Roll), (SensorChannel::Dvl, Column::DvlU)] {
                for (_, info, values) in board.active() {
                    let Some(measure) = info.hooks.measure.filter(|measure| measure.channels.contains(&channel)) else {
                        continue;
                    };
                    let columns = [0, 1, 2].map(|axis| Column::ALL[first as usize + axis]);
                    let read = columns.map(|column| row.get(column).unwrap_or(f64::NAN));
                    let mut truth = read;
                    for _ in 0..12 {
                        let mut again = truth;
                        (measure.apply)(values, &moment, &mut again);
                        truth = [0, 1, 2].map(|axis| truth[axis] + read[axis] - again[axis]);
                    }
                    row.set_all(first, &truth);
                }
            }
        }
    }

    /// Fixes at the time at which the vehicle was there.
    fn move_fixes(&self, log: &mut Log) {
        let late_us = (self.log[GNSS_DELAY][0].max(0.0) * 1e6) as u64;
        let mut moved = Vec::new();
        for row in &mut log.rows {
            if let Some(position_m) = row.gnss_m() {
                row.set_all(Column::GpsX, &[f64::NAN; 2]);
                let mut fix = LogRow::new(row.time_us.saturating_sub(late_us));
                moved.push(fix.set_all(Column::GpsX, &position_m).clone());
            }
        }
        log.rows.extend(moved);
        log.rows.sort_by_key(|row| row.time_us);
    }

    fn correct_readings(&self, log: &mut Log) {
        let ([lag_s, ..], [sin2, cos2, ..]) = (self.log[HEADING_LAG], self.log[SOFT_IRON]);
        let scale = 1.0 + self.log[DEPTH_SCALE][0];
        let mut euler = [0.0; 3];
        let (mut behind, mut before_us) = (Lag::default(), None);
        for row in &mut log.rows {
            euler = row.attitude_rad().unwrap_or(euler);
            if let Some([_, q, r]) = row.rates_radps() {
                let dt_s = before_us.map_or(0.0, |us: u64| row.time_us.saturating_sub(us) as f64 * 1e-6);
                before_us = Some(row.time_us);
                let [roll, pitch, _] = euler;
                behind.advance(lag_s, dt_s, (q * roll.sin() + r * roll.cos()) / pitch.cos());
            }
            if let Some(heading) = row.get(Column::Heading) {
                let read = heading + behind.0;
                // The iron acts by the true heading: ψ = read - iron(ψ), whose terms shrink by twice the iron's size.
                let mut heading = read;
                for _ in 0..12 {
                    let (sin, cos) = (2.0 * heading).sin_cos();
                    heading = read - sin2 * sin - cos2 * cos;
                }
                row.set(Column::Heading, heading);
            }
            if let Some(depth_m) = row.get(Column::Depth) {
                row.set(Column::Depth, depth_m / scale);
            }
        }
    }

    /// What fixes and ranges by sound would be of an array that is not turned, and of transponders that are where they are
    /// declared: the declared place is corrected.
    fn correct_positioning(&self, log: &mut Log) {
        let ([turn_rad, ..], [number, north_m, east_m, _]) = (self.log[USBL_TURN], self.log[PLACE]);
        for row in &mut log.rows {
            if let Some(usbl) = row.usbl().filter(|_| turn_rad != 0.0) {
                let bearing_rad = usbl.bearing_rad - turn_rad;
                row.set_all(Column::UsblRange, &[usbl.range_m, bearing_rad, usbl.elevation_rad]);
            }
            if row.station().is_some_and(|station| f64::from(station) == number) {
                for (column, by_m) in [(Column::StationX, north_m), (Column::StationY, east_m)] {
                    if let Some(declared) = row.get(column) {
                        row.set(column, declared + by_m);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lateness::Lateness;
    use crate::log_effects::PathAt;
    use backseat_core::effects::ParameterId;
    use backseat_core::state::VehicleState;
    use nalgebra::Vector3;

    /// A DVL turned and scaled, a compass and a pitch sensor that slip from 100 to 200 s: readings of the same motion before,
    /// meanwhile and after are the same once the changes are undone, and a fin slips on top of nothing else.
    #[test]
    fn val_changes_of_readings_are_undone() {
        let effects = [
            ("dvl_change", &[0.03, 0.1, 100.0, 200.0][..]),
            ("heading_change", &[0.2, 100.0, 200.0]),
            ("pitch_change", &[-0.05, 100.0, 200.0]),
            ("fin_bias_change", &[3.0, 0.04, 100.0, 200.0]),
        ];
        let effects = effects.iter().fold(Effects::default(), |all, (name, values)| all.with(name, values).unwrap());
        let (ahead, across, down) = (1.2_f64, -0.1, 0.05);
        let mut log = Log::default();
        for t_s in [50.0, 150.0, 250.0] {
            let on = f64::from(u8::from(t_s == 150.0));
            let (gain, (sin, cos)) = (1.0 + 0.03 * on, (0.1 * on).sin_cos());
            let velocity = [cos * ahead + sin * across, cos * across - sin * ahead, down].map(|v| gain * v);
            let mut row = LogRow::new((t_s * 1e6) as u64);
            row.set_all(Column::Roll, &[0.01, 0.1 - 0.05 * on, 0.7 + 0.2 * on]).set_all(Column::DvlU, &velocity);
            log.rows.push(row);
        }
        log.rows.insert(0, LogRow::new(0));
        for row in &effects.corrected(Cow::Borrowed(&log)).rows[1..] {
            let read = [row.attitude_rad().unwrap(), row.dvl_mps().unwrap()].concat();
            for (read, truth) in read.iter().zip([0.01, 0.1, 0.7, ahead, across, down]) {
                assert!((read - truth).abs() < 1e-9, "{read} {truth}"); // repetition
            }
        }
        let left = effects.beyond_readings();
        let fin = |parameter| left.board_at(150.0).get(ParameterId::find("fin_bias", parameter).unwrap());
        assert_eq!([fin("fin"), fin("rad")], [3.0, 0.04]);
        assert_eq!(left.board_at(250.0), EffectSet::NONE);
        assert_eq!(left.board_at(150.0).active().count(), 1);
    }

    /// An array turned by 0.2 rad reads a vehicle to the north-east of it and below further to the right; the correction
    /// gives it back, and both are one turn.
    #[test]
    fn val_a_turned_array_is_turned_back() {
        let effects = Effects::default().with("usbl_turn", &[0.2]).unwrap();
        let truth = Vector3::new(300.0, 200.0, 40.0);
        let read = Vector3::new(
            300.0 * 0.2_f64.cos() - 200.0 * 0.2_f64.sin(),
            300.0 * 0.2_f64.sin() + 200.0 * 0.2_f64.cos(),
            40.0,
        );
        let mut row = LogRow::new(0);
        row.set_all(Column::UsblNorth, read.as_slice());
        let mut log = Log::default();
        log.rows.push(row);
        let corrected = effects.corrected(Cow::Borrowed(&log)).rows[0].usbl().unwrap().vector_m();
        assert!((Vector3::from(corrected) - truth).amax() < 1e-9, "{corrected:?}"); // rounding of 300 m
        // in the triad of what was read
        let along = read.normalize();
        let axes = backseat_core::navigation::triad(&along);
        let mut reading = axes.map(|axis| axis.dot(&truth));
        let at = (&VehicleState::zeros(), PathAt { ned: along.into(), ..PathAt::default() });
        effects.read(&Lateness::default(), SensorChannel::Usbl, at, &mut reading);
        assert!((Vector3::from(reading) - Vector3::new(read.norm(), 0.0, 0.0)).amax() < 1e-9, "{reading:?}");
    }

    #[test]
    fn val_a_log_is_corrected() {
        let effects = [("heading_lag", &[2.0][..]), ("soft_iron", &[0.03, -0.02]), ("depth_scale", &[0.02])];
        let effects = effects.iter().fold(Effects::default(), |all, (name, values)| all.with(name, values).unwrap());
        let mut log = Log::default();
        let mut lagged = 0.0;
        for k in 0..400_u64 {
            let t_s = 0.05 * k as f64;
            // ψ = 0.1 t behind a lag of two seconds, on iron.
            let psi = 0.1 * t_s;
            lagged = if k == 0 { 0.0 } else { psi - 0.2 * (1.0 - (-t_s / 2.0).exp()) };
            let iron = 0.03 * (2.0 * psi).sin() - 0.02 * (2.0 * psi).cos();
            let mut row = LogRow::new(k * 50_000);
            row.set_all(Column::Roll, &[0.0, 0.0, lagged + iron]).set_all(Column::P, &[0.0, 0.0, 0.1]);
            log.rows.push(row.set(Column::Depth, 10.2).clone());
        }
        let last = log.rows.len() - 1;
        assert!((lagged - 1.995).abs() > 0.1, "the lag shows");
        let corrected = effects.corrected(Cow::Borrowed(&log));
        assert!((corrected.rows[last].get(Column::Heading).unwrap() - 1.995).abs() < 1e-12);
        assert!((corrected.rows[last].get(Column::Depth).unwrap() - 10.0).abs() < 1e-12);
        assert!(matches!(Effects::default().corrected(Cow::Borrowed(&log)), Cow::Borrowed(_)));
    }
}

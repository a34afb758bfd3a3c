//! A magnetic heading taken for true.

use super::{Finding, Severity};
use crate::geomagnetism::declination_rad;
use crate::log::{Column, Log};

/// Declinations below this are no larger than a compass's own errors, rad.
const LEAST_RAD: f64 = 0.07;
/// Standard errors within which the course must lie by the declination, and beyond which it must not lie by nothing.
const SIGMAS: f64 = 3.0;
/// The same, as a share of the declination: what a compass on iron adds.
const SHARE: f64 = 0.3;

impl Log {
    /// Declination where and when the log was written, rad, positive east, and the words for it; `None` without place or date.
    pub fn declination(&self) -> Option<(f64, String)> {
        /// Mean length of a year, µs.
        const YEAR_US: f64 = 365.2425 * 86_400e6;
        let ([latitude, longitude], start_us) = (self.origin_deg?, self.start_unix_us?);
        let first_us = self.rows.first().map_or(0, |row| row.time_us);
        let year = 1970.0 + (start_us as f64 + first_us as f64) / YEAR_US;
        let declination = declination_rad(latitude, longitude, year)?;
        let ([ns, ew], place) = ([latitude < 0.0, longitude < 0.0], [latitude, longitude].map(f64::abs));
        let (ns, ew) = (if ns { 'S' } else { 'N' }, if ew { 'W' } else { 'E' });
        let words = format!(
            "{:+.1} deg (IGRF-14, {:.2}{ns} {:.2}{ew}, {year:.1})",
            declination.to_degrees(),
            place[0],
            place[1]
        );
        Some((declination, words))
    }
}

/// Whether the course lies by the declination beside the heading; `turn` is the angle between them, rad, and its sigma.
pub(super) fn check(log: &Log, [turn, sigma]: [f64; 2]) -> Option<Finding> {
    let (declination, words) = log.declination()?;
    let near = (SIGMAS * sigma).max(SHARE * declination.abs());
    let is_turned = declination.abs() > LEAST_RAD && turn.abs() > SIGMAS * sigma && (turn - declination).abs() < near;
    let is_known = SIGMAS * sigma < 0.5 * declination.abs();
    (is_turned && is_known).then(|| {
        let what = "heading_rad may be magnetic".to_owned();
        let evidence = format!(
            "the way between fixes is turned against it by {:+.1} deg (one sigma {:.1}), and the declination here is {words}",
            turn.to_degrees(),
            sigma.to_degrees()
        );
        let mend = format!("columns.heading_rad = {{ column = \"heading_rad\", unit = \"rad\", offset = {declination:.4} }}");
        Finding {
            column: Some(Column::Heading),
            severity: Severity::Remark,
            message: format!("{what}: {evidence}. A mapping that makes it true: {mend}"),
            what,
            evidence,
            mend: Some(mend),
            alternatives: Vec::new(),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_that_is_off_by_the_declination_may_be_magnetic() {
        let october_2022_us = 1_665_100_800_000_000;
        let log = Log { origin_deg: Some([25.91, -80.14]), start_unix_us: Some(october_2022_us), ..Log::default() };
        let found = check(&log, [-0.13, 0.01]).expect("west of north by 7 degrees");
        assert!(found.message.contains("-7.1 deg (IGRF-14, 25.91N 80.14W, 2022.8)"), "{}", found.message);
        assert!(found.message.contains("offset = -0.12"), "{}", found.message);
        for (turn, sigma) in [(0.13, 0.01), (0.0, 0.01), (-0.25, 0.01), (-0.13, 0.05)] {
            assert_eq!(check(&log, [turn, sigma]), None, "{turn} {sigma}");
        }
        assert_eq!(check(&Log { origin_deg: None, ..log }, [-0.13, 0.01]), None);
    }
}

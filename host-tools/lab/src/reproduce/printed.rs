//! The thesis' error tables, as printed.

use serde::Deserialize;
use std::sync::LazyLock;

/// One row of an error table.
#[derive(Clone, Debug, Deserialize)]
struct ErrorRow {
    table: String,
    /// `MAE` or `RMS`.
    statistic: String,
    velocity_cmps: f64,
    roll_deg: f64,
    pitch_deg: f64,
    p_degps: f64,
    q_degps: f64,
    r_degps: f64,
    u_mps: f64,
    v_mps: f64,
    w_mps: f64,
}

static ROWS: LazyLock<Vec<ErrorRow>> = LazyLock::new(|| {
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(&include_bytes!("printed_errors.csv")[..]);
    reader.deserialize().filter_map(Result::ok).collect()
});

/// The eight errors of a table's row, which is named as in `MAE, 0.1 cm/s`.
pub fn errors(table: &str, row: &str) -> Option<Vec<f64>> {
    let (statistic, noise) = row.split_once(", ")?;
    let noise: f64 = noise.strip_suffix(" cm/s")?.parse().ok()?;
    let is_meant = |r: &&ErrorRow| r.table == table && r.statistic == statistic && r.velocity_cmps == noise;
    let r = ROWS.iter().find(is_meant)?;
    Some(vec![r.roll_deg, r.pitch_deg, r.p_degps, r.q_degps, r.r_degps, r.u_mps, r.v_mps, r.w_mps])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_tables_are_whole() {
        // Lines of the file without header and comments; RMS is above MAE in every pair, as it must be.
        let lines = include_str!("printed_errors.csv").lines().filter(|line| line.starts_with("4.")).count();
        assert_eq!((ROWS.len(), lines), (52, 52));
        for (mae, rms) in [("4.11", "4.12"), ("4.16", "4.17"), ("4.18", "4.19"), ("4.10", "4.10"), ("4.15", "4.15")] {
            for row in ROWS.iter().filter(|row| row.table == mae && row.statistic == "MAE") {
                let noise = format!("{} cm/s", row.velocity_cmps);
                let [mean, root] =
                    [(mae, "MAE"), (rms, "RMS")].map(|(t, s)| errors(t, &format!("{s}, {noise}")).unwrap());
                assert!(mean.iter().zip(root).all(|(mean, root)| *mean < root), "{mae}, {noise}");
            }
        }
    }
}

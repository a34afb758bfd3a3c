//! Allan deviation: how the mean over a time differs from the mean over the next one.

use backseat_logs::stats::median;

/// A channel at rest: times in µs, in order, and readings.
pub type Readings = [(u64, f64)];

/// The usual interval between readings, s; none of fewer than two.
pub fn interval_s(readings: &Readings) -> Option<f64> {
    let steps: Vec<f64> = readings.windows(2).map(|pair| (pair[1].0 - pair[0].0) as f64 * 1e-6).collect();
    median(&steps).filter(|step| *step > 0.0)
}

/// Overlapping Allan deviation at 1, 2, 4 … intervals, as long as a stretch without gaps holds nine of them: pairs of
/// averaging time, s, and deviation, in the reading's unit.
pub fn deviations(readings: &Readings) -> Vec<(f64, f64)> {
    let Some(interval_s) = interval_s(readings) else { return Vec::new() };
    // Sums of each stretch: a mean over any span is the difference of two.
    let is_next = |a: &(u64, f64), b: &(u64, f64)| (b.0 - a.0) as f64 * 1e-6 < 1.5 * interval_s;
    let sums: Vec<Vec<f64>> = readings
        .chunk_by(is_next)
        .map(|stretch| {
            let first = stretch.first().map_or(0.0, |(_, value)| *value);
            let total = stretch.iter().scan(0.0, |sum, (_, value)| {
                *sum += value - first;
                Some(*sum)
            });
            std::iter::once(0.0).chain(total).collect()
        })
        .collect();
    let longest = sums.iter().map(Vec::len).max().unwrap_or(0);
    let spans = std::iter::successors(Some(1_usize), |span| Some(2 * span)).take_while(|span| 9 * span < longest);
    spans
        .filter_map(|span| {
            let (mut squares, mut count) = (0.0, 0_u32);
            for sum in &sums {
                for ends in sum.windows(2 * span + 1) {
                    let difference = (ends[2 * span] - 2.0 * ends[span] + ends[0]) / span as f64;
                    squares += 0.5 * difference * difference;
                    count += 1;
                }
            }
            (count > 0).then(|| (span as f64 * interval_s, (squares / f64::from(count)).sqrt()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_ramp_and_a_sequence_by_hand() {
        // A ramp of slope a: means over tau differ by a tau, so that the deviation is a tau / sqrt(2).
        let ramp: Vec<(u64, f64)> = (0..100).map(|k| (k * 500_000, 0.3 * k as f64 * 0.5)).collect();
        for (tau, deviation) in deviations(&ramp) {
            assert!((deviation - 0.3 * tau / 2.0_f64.sqrt()).abs() < 1e-12, "{tau}: {deviation}");
        }
        // 0 1 0 1 …: neighbours differ by 1, means over two not at all.
        let steps: Vec<(u64, f64)> = (0..40).map(|k| (k * 1_000_000, f64::from(u8::from(k % 2 == 1)))).collect();
        let found = deviations(&steps);
        assert!((found[0].1 - 0.5_f64.sqrt()).abs() < 1e-12 && found[1].1 < 1e-12, "{found:?}");
    }

    #[test]
    fn a_gap_ends_a_stretch() {
        // A jump in the gap is no difference of neighbours.
        let readings: Vec<(u64, f64)> =
            (0..40).chain(140..180).map(|k| (k * 100_000, if k < 100 { 0.0 } else { 5.0 })).collect();
        assert!(deviations(&readings).iter().all(|(_, deviation)| *deviation == 0.0));
        assert!(deviations(&[]).is_empty());
    }
}

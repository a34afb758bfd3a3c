//! Sensor readings that a log repeats while the sensor is away.

/// Times between which a sensor's readings repeat themselves far longer than they otherwise do: the sensor was not
/// there (or stood still to the last digit), and the log holds its last reading.
#[must_use]
pub fn held_readings(series: &[(f64, Vec<f64>)]) -> Vec<[f64; 2]> {
    /// Shorter repeats are chance.
    const SHORTEST_S: f64 = 10.0;
    /// How often longer than the median repeat.
    const LONGER: usize = 10;
    /// Fewest other readings by which to know what is usual.
    const FEWEST: usize = 20;
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (i, (_, reading)) in series.iter().enumerate() {
        match runs.last_mut() {
            Some((first, last)) if series[*first].1 == *reading => *last = i,
            _ => runs.push((i, i)),
        }
    }
    // Where nothing else varies, a constant is what was measured.
    if runs.len() < FEWEST {
        return Vec::new();
    }
    let mut lengths: Vec<usize> = runs.iter().map(|(first, last)| last - first + 1).collect();
    lengths.sort_unstable();
    let usual = lengths[lengths.len() / 2];
    let is_held = |(first, last): &(usize, usize)| {
        last - first + 1 >= LONGER * usual && series[*last].0 - series[*first].0 >= SHORTEST_S
    };
    runs.into_iter().filter(is_held).map(|(first, last)| [series[first].0, series[last].0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_that_are_held_are_told_from_a_constant() {
        let series = |value: &dyn Fn(u32) -> f64| -> Vec<(f64, Vec<f64>)> {
            (0..100).map(|t| (f64::from(t), vec![value(t)])).collect()
        };
        assert!(held_readings(&series(&|_| 1.5)).is_empty());
        assert!(held_readings(&series(&|t| f64::from(t % 7))).is_empty());
        let held = held_readings(&series(&|t| if (40..60).contains(&t) { 0.5 } else { f64::from(t) }));
        assert_eq!(held, [[40.0, 59.0]]);
    }
}

//! Where a share passes a level.

/// The smallest size from which on the share of hits is at least `level`, by the isotonic fit of hits over sizes
/// (pooling of adjacent violators: the maximum-likelihood share that never falls with size). `None` if it never is.
pub fn smallest(tried: &[(f64, bool)], level: f64) -> Option<f64> {
    let mut tried = tried.to_vec();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    // (smallest size, hits, number) of stretches of one share.
    let mut stretches: Vec<(f64, f64, f64)> = Vec::new();
    for (size, hit) in tried {
        stretches.push((size, f64::from(u8::from(hit)), 1.0));
        while let [.., before, last] = &mut stretches[..] {
            if before.1 / before.2 < last.1 / last.2 {
                break;
            }
            *before = (before.0, before.1 + last.1, before.2 + last.2);
            stretches.pop();
        }
    }
    stretches.iter().find(|(_, hits, of)| hits / of >= level).map(|(size, ..)| *size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_miss_among_hits_moves_the_level_up() {
        let tried = |hits: [bool; 6]| (1..7).map(f64::from).zip(hits).collect::<Vec<_>>();
        assert_eq!(smallest(&tried([false, false, true, true, true, true]), 0.95), Some(3.0));
        // The hit at 2 and the miss at 3 are pooled to a half.
        assert_eq!(smallest(&tried([false, true, false, true, true, true]), 0.95), Some(4.0));
        assert_eq!(smallest(&tried([false; 6]), 0.95), None);
        assert_eq!(smallest(&tried([true; 6]), 0.95), Some(1.0));
    }
}

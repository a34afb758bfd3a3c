//! Reading the vector files.

use backseat_wire::nmea::{Checksum, Framer, Sentence};
use backseat_wire::{Counts, Error};

/// `status TAB source TAB sentence`.
pub fn sentences(file: &'static str) -> Vec<(&'static str, &'static str)> {
    lines(file).map(|columns| (columns[0], columns[2])).collect()
}

/// Columns of every line that is no comment.
pub fn lines(file: &'static str) -> impl Iterator<Item = Vec<&'static str>> {
    file.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).map(|line| line.split('\t').collect())
}

pub fn bytes(digits: &str) -> Vec<u8> {
    let digits = digits.trim();
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap()).collect()
}

pub fn sentence(line: &str) -> Sentence<'_> {
    Sentence::from_line(line.as_bytes(), Checksum::Optional).unwrap_or_else(|cause| panic!("{line}: {cause:?}"))
}

/// Feeds a stream cut in two at every position, with noise before it, and checks that the sentences are always the
/// same.
pub fn assert_framed_at_every_split(lines: &[&str]) {
    let stream: Vec<u8> =
        lines.iter().flat_map(|line| b"\xFF*~".iter().copied().chain(line.bytes()).chain(*b"\r\n")).collect();
    let expected: Vec<Vec<u8>> = lines.iter().map(|line| sentence(line).body().to_vec()).collect();
    for split in 0..=stream.len() {
        let mut framer = Framer::new(Checksum::Optional);
        let mut found = Vec::new();
        for mut part in [&stream[..split], &stream[split..]] {
            while let Some(outcome) = framer.feed(&mut part) {
                found.push(outcome.unwrap().body().to_vec());
            }
        }
        assert_eq!(found, expected, "split at {split}");
        assert_eq!((framer.counts().accepted(), framer.counts().rejected()), (lines.len() as u32, 0));
    }
}

/// Feeds a binary decoder a stream cut in two at `split`.
pub fn fed_at<D, T>(
    mut decoder: D,
    stream: &[u8],
    split: usize,
    feed: impl Fn(&mut D, &mut &[u8]) -> Option<Result<T, Error>>,
    counts: impl Fn(&D) -> Counts,
) -> (Vec<T>, Counts) {
    let mut found = Vec::new();
    for mut part in [&stream[..split], &stream[split..]] {
        while let Some(outcome) = feed(&mut decoder, &mut part) {
            found.extend(outcome.ok());
        }
    }
    let counts = counts(&decoder);
    (found, counts)
}

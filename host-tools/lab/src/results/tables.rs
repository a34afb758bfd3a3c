//! The tables of a page, put in the place of those with the same columns.

/// `page` with each of its tables replaced by the first of `printed` that has the same columns and was not used yet; how many
/// were replaced, and how many printed ones found no place.
pub fn put(page: &str, printed: &str) -> (String, usize, usize) {
    let mut new: Vec<Vec<&str>> = blocks(printed).into_iter().filter(|block| is_table(block)).collect();
    let all = new.len();
    let lines: Vec<&str> = blocks(page)
        .into_iter()
        .flat_map(|block| {
            let same = new.iter().position(|table| is_table(&block) && columns(table[0]) == columns(block[0]));
            same.map_or(block, |at| new.remove(at))
        })
        .collect();
    (lines.join("\n") + "\n", all - new.len(), new.len())
}

/// The lines, those of a table together.
fn blocks(text: &str) -> Vec<Vec<&str>> {
    let lines: Vec<&str> = text.lines().collect();
    lines.chunk_by(|a, b| a.starts_with('|') && b.starts_with('|')).map(<[&str]>::to_vec).collect()
}

fn is_table(block: &[&str]) -> bool {
    block[0].starts_with('|')
}

fn columns(header: &str) -> Vec<&str> {
    header.split('|').map(str::trim).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_table_takes_the_place_of_the_one_with_its_columns() {
        let page = "# Page\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nText.\n\n| c |\n|---|\n| 3 |\n";
        let printed = "Runs: 7\n\n| c   |\n|-----|\n| 4   |\n\n| d |\n|---|\n| 5 |\n";
        let (new, put, left) = super::put(page, printed);
        assert_eq!(new, "# Page\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nText.\n\n| c   |\n|-----|\n| 4   |\n");
        assert_eq!((put, left), (1, 1));
    }
}

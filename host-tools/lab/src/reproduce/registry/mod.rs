//! Everything that can be reproduced.

mod control;
mod identification;
mod navigation;

use super::item::Item;

/// All items, in the order of the thesis.
pub fn all() -> impl Iterator<Item = &'static Item> {
    navigation::ITEMS.iter().chain(identification::ITEMS).chain(control::ITEMS)
}

/// The items that the arguments name; without arguments all.
pub fn selected(asked: &[String]) -> Vec<&'static Item> {
    all().filter(|item| asked.is_empty() || asked.iter().any(|asked| item.is_meant_by(asked))).collect()
}

/// Refuses a name without an item, and lists the items.
pub fn known(asked: &str) -> Result<String, String> {
    if all().any(|item| item.is_meant_by(asked)) {
        return Ok(asked.to_owned());
    }
    let width = all().map(|item| item.id.len()).max().unwrap_or(0);
    let list: Vec<String> = all().map(|item| format!("  {:width$}  {}", item.id, item.title)).collect();
    Err(format!(
        "there is no such table or figure here. There are (and every table and figure in these ranges, as in figure-3.5):\n{}",
        list.join("\n")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::item::Printed;

    #[test]
    fn ids_are_unique_and_mean_their_item() {
        let ids: Vec<&str> = all().map(|item| item.id).collect();
        for (index, id) in ids.iter().enumerate() {
            assert!(!ids[..index].contains(id), "{id} twice");
            assert!(selected(&[(*id).to_owned()]).iter().any(|item| item.id == *id));
        }
    }

    #[test]
    fn what_is_to_be_reproduced_is_there() {
        let numbers = |kind: &str, chapter: u32, range: std::ops::RangeInclusive<u32>| -> Vec<String> {
            range.map(|number| format!("{kind}-{chapter}.{number}")).collect()
        };
        let asked = [
            numbers("table", 4, 8..=8),
            numbers("table", 4, 10..=12),
            numbers("table", 4, 15..=19),
            numbers("figure", 2, 2..=12),
            numbers("figure", 3, 1..=3),
            numbers("figure", 3, 5..=11),
            numbers("figure", 4, 7..=15),
            numbers("figure", 5, 1..=2),
        ];
        for asked in asked.iter().flatten() {
            assert!(known(asked).is_ok(), "{asked}");
        }
        for unknown in ["table-4.9", "figure-3.4", "figure-2", "figure-2.x", "figure", "", "study"] {
            assert!(known(unknown).is_err(), "{unknown}");
        }
    }

    #[test]
    fn reported_rows_have_no_more_columns_than_the_item() {
        for item in all() {
            assert!(!item.rows.is_empty() && !item.columns.is_empty(), "{}", item.id);
            for reported in item.independent {
                assert!(reported.values.len() <= item.columns.len(), "{}", item.id);
            }
            // What is printed of an item is of one of its rows.
            let printed: Vec<Vec<f64>> = item.rows.iter().filter_map(|row| item.printed.of(row)).collect();
            assert!(printed.iter().all(|values| values.len() <= item.columns.len()), "{}", item.id);
            let given = match item.printed {
                Printed::Nothing => 0,
                Printed::Values(rows) | Printed::Below(rows) => rows.len(),
                Printed::Errors(_) => printed.len().max(2),
            };
            assert_eq!(printed.len(), given, "{}", item.id);
        }
    }
}

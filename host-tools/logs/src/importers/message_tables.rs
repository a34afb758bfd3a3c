//! What is read of logs of messages, and what is said of the rest: `messages.toml`.

use super::formats::{WrittenColumn, one};
use crate::log::Column;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The tables by name.
pub(super) static TABLES: LazyLock<BTreeMap<String, MessageTable>> =
    LazyLock::new(|| toml::from_str(include_str!("messages.toml")).expect("messages.toml is a table of messages"));

/// The messages of one kind of log.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MessageTable {
    /// Messages, and what to say where they are left out.
    pub hints: Vec<(String, String)>,
    pub messages: Vec<Message>,
    #[serde(default)]
    pub layouts: Vec<Layout>,
}

/// A message that is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Message {
    pub name: String,
    at_least: Option<(String, f64)>,
    at_most: Option<(String, f64)>,
    bits: Option<(String, u32)>,
    /// It is what the vehicle reckons, not what a sensor measures.
    #[serde(default)]
    pub is_estimate: bool,
    pub takes: Vec<Take>,
}

impl Message {
    /// Whether a message with these numbers is of use.
    pub(super) fn is_of_use(&self, get: impl Fn(&str) -> Option<f64>) -> bool {
        let is_enough =
            self.at_least.as_ref().is_none_or(|(field, least)| get(field).is_some_and(|value| value >= *least));
        let at_most = self.at_most.as_ref();
        let is_small = at_most.is_none_or(|(field, most)| get(field).is_none_or(|value| value <= *most));
        let bits = self.bits.as_ref();
        is_enough
            && is_small
            && bits.is_none_or(|(field, bits)| get(field).is_some_and(|value| value as u32 & bits == *bits))
    }
}

/// What numbers of a message become.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Take {
    /// Latitude and longitude, times the factor degrees.
    Fix {
        fix: [String; 2],
        #[serde(default = "one")]
        degrees: f64,
    },
    /// Parts w, x, y, z of a quaternion from forward-right-down to north-east-down, or as ROS has it.
    Quaternion {
        quaternion: [String; 4],
        #[serde(default)]
        is_enu_flu: bool,
    },
    /// A number.
    Number(Number),
}

/// A number, over another one where it is a difference, plus the offset, times the factor.
#[derive(Deserialize)]
#[serde(from = "WrittenColumn")]
pub(super) struct Number {
    pub field: String,
    pub per: Option<String>,
    pub column: Column,
    pub scale: f64,
    pub offset: f64,
}

impl From<WrittenColumn> for Number {
    fn from(written: WrittenColumn) -> Self {
        let (column, scale) = written.sample();
        Self { field: written.column, per: written.per, column, scale, offset: written.offset }
    }
}

/// Numbers of a message one behind the other, with their letters.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    pub number: u32,
    #[serde(default)]
    pub check: u8,
    pub name: String,
    #[serde(deserialize_with = "fields")]
    pub fields: Vec<(String, u8)>,
}

fn fields<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(String, u8)>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let field = |word: &str| word.split_once(':').map(|(name, letter)| (name.to_owned(), letter.as_bytes()[0]));
    let fields: Option<_> = text.split_whitespace().map(field).collect();
    fields.ok_or_else(|| serde::de::Error::custom("expected name:letter"))
}

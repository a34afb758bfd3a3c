//! A flight, and what the board said in it.

use super::draw::{Change, Drawn, Kind};
use super::known::{self, Knowable};
use crate::flights;
use backseat_wire::hostlink::Naming;
use serde::{Deserialize, Serialize};

/// A cause that the board named.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Said {
    /// Its number, and what else it could be; 0: nothing.
    pub cause: u8,
    pub rival: u8,
    pub size: f64,
    pub sigma: f64,
    pub since_s: f64,
    pub probability: f64,
}

/// What the board stated from a time on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Statement {
    pub time_s: f64,
    pub named: Vec<Said>,
    pub unexplained: bool,
}

/// One flight.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NamedFlight {
    /// Its seed.
    pub number: u64,
    pub kind: Kind,
    pub changes: Vec<Change>,
    /// Of a single one of the table: when it could be known.
    pub knowable: Option<Knowable>,
    /// Each statement that names others than the one before, as it was first; behind them the last of all.
    pub statements: Vec<Statement>,
    pub ended_s: f64,
    pub finished: bool,
    pub digest: String,
}

impl Statement {
    fn new(naming: &Naming) -> Self {
        let said = |named: &backseat_wire::hostlink::NamedCause| Said {
            cause: named.cause,
            rival: named.rival,
            size: f64::from(named.size[0]),
            sigma: f64::from(named.sigma[0]),
            since_s: 1e-6 * named.since_us as f64,
            probability: f64::from(named.probability),
        };
        Self {
            time_s: 1e-6 * naming.time_us as f64,
            named: naming.named.iter().map(said).collect(),
            unexplained: naming.unexplained,
        }
    }

    fn causes(&self) -> (bool, Vec<u8>) {
        (self.unexplained, self.named.iter().map(|said| said.cause).collect())
    }
}

/// Flies it in this process.
///
/// # Errors
/// A flight that fails.
pub fn fly(seed: u64, drawn: &Drawn) -> anyhow::Result<NamedFlight> {
    let flight = flights::fly(&drawn.scenario)?;
    let all = flight.naming.iter().map(Statement::new);
    let mut statements: Vec<Statement> = Vec::new();
    let mut last = None;
    for statement in all {
        if statements.last().is_none_or(|before| before.causes() != statement.causes()) {
            statements.push(statement.clone());
        }
        last = Some(statement);
    }
    statements.extend(last);
    Ok(NamedFlight {
        number: seed,
        kind: drawn.kind,
        changes: drawn.changes.clone(),
        knowable: if drawn.kind == Kind::One { known::knowable(drawn)? } else { None },
        statements,
        ended_s: flight.simulated_s,
        finished: flight.finished,
        digest: format!("{:016x}", flight.digest),
    })
}

/// How a flight is judged.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The first cause named is the right one: after this time, s.
    Right(f64),
    /// The right one was given as the rival of the first.
    Rival(f64),
    /// Another was named first.
    Wrong,
    /// *None of these*.
    Unexplained,
    /// Nothing was said.
    Silent,
}

impl NamedFlight {
    /// What was named first, if anything was.
    pub fn first(&self) -> Option<&Statement> {
        self.statements.iter().find(|statement| !statement.named.is_empty() || statement.unexplained)
    }

    /// The first statement against the first change.
    pub fn outcome(&self) -> Outcome {
        let Some(first) = self.first() else { return Outcome::Silent };
        if first.unexplained {
            return Outcome::Unexplained;
        }
        let mut outcome = Outcome::Wrong;
        for (change, said) in self.changes.iter().filter_map(|change| Some((change, first.named.first()?))) {
            let delay_s = first.time_s - change.time_s;
            if change.cause == said.cause && delay_s > -60.0 {
                return Outcome::Right(delay_s);
            }
            if change.cause == said.rival && change.cause != 0 {
                outcome = Outcome::Rival(delay_s);
            }
        }
        outcome
    }

    /// Until when its change is to be named, if it can be.
    pub fn named_until_s(&self) -> Option<f64> {
        self.knowable.as_ref()?.named_until_s()
    }

    /// The last size said of a change, over its sigma from the truth.
    pub fn off(&self, change: &Change) -> Option<f64> {
        let said = self.statements.last()?.named.iter().find(|said| said.cause == change.cause)?;
        Some((said.size - change.size[0]) / said.sigma)
    }

    /// The last statement says *none of these*.
    pub fn ends_unexplained(&self) -> bool {
        self.statements.last().is_some_and(|statement| statement.unexplained)
    }

    /// All changes have begun five minutes before its end.
    pub fn has_all_begun(&self) -> bool {
        self.changes.iter().all(|change| change.time_s + 300.0 < self.ended_s)
    }

    /// Of two causes named at once one is no change, nor is its rival.
    pub fn names_a_wrong_one_beside(&self) -> bool {
        let is_there = |said: &Said| self.changes.iter().any(|own| own.cause == said.cause || own.cause == said.rival);
        self.statements.iter().any(|statement| statement.named.len() > 1 && !statement.named.iter().all(is_there))
    }

    /// Both changes are named at some time.
    pub fn names_all(&self) -> bool {
        self.changes.iter().all(|change| {
            let named = |said: &Said| said.cause == change.cause || said.rival == change.cause;
            self.statements.iter().any(|statement| statement.named.iter().any(named))
        })
    }
}

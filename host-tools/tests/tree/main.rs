//! The tree itself: its pages, its imports, its dependencies.

mod docs;
mod import_cycles;
mod release;
mod supply_chain;

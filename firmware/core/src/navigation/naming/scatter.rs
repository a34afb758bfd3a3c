//! How much the scores scatter from block to block, over what white innovations would.

use super::columns::COLUMNS;

/// Blocks that count as white before any is seen.
const PRIOR_BLOCKS: f64 = 12.0;

/// How much the scores scatter from block to block.
#[derive(Clone)]
pub(super) struct Scatter {
    pub(super) blocks: f64,
    /// Σ r²/σ², and Σ r r'/σ σ' with the block before.
    pub(super) squares: [f64; COLUMNS],
    pub(super) lagged: [f64; COLUMNS],
    pub(super) last: [f64; COLUMNS],
}

impl Scatter {
    pub(super) const NONE: Self =
        Self { blocks: 0.0, squares: [0.0; COLUMNS], lagged: [0.0; COLUMNS], last: [0.0; COLUMNS] };

    pub(super) fn colour(&self) -> [f64; COLUMNS] {
        let mut colour = [1.0; COLUMNS];
        for (colour, (squares, lagged)) in colour.iter_mut().zip(self.squares.iter().zip(&self.lagged)) {
            let scatter = (PRIOR_BLOCKS + squares + lagged) / (PRIOR_BLOCKS + self.blocks);
            *colour = if scatter > 1.0 { scatter } else { 1.0 };
        }
        colour
    }
}

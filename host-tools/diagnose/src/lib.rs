//! Which physical effect does the declared model lack, how large is it, and what else could it be?
//!
//! ```text
//! samples     a log as readings and inputs          model       the declared vehicle with a set of effects
//! terms       what is varied: columns               whitener    innovations and how they move with each term
//! gram        normal equations, block by block      linear      least squares on a choice of columns
//! noise       scales, outliers                      waves       a peak in the DVL's spectrum
//! candidates  the catalogue as hypotheses           search      forward selection, onsets
//! rivals      what else it could be                 structure   what no entry accounts for
//! bench       one log made ready, refined fits      diagnosis   the whole loop and its verdict
//! reduced     logs without the vehicle's dynamics   scores      before and after on held-out data
//! planar      of them: heading, speed and fixes     glide       a glider
//! pings       a pinger with a clock of its own
//! statistics  tails and whiteness                   picture     what the report draws
//! ```
//!
//! The method: the filter itself is the whitener. Its normalised innovations are white if the model is right, so that
//! least squares on them is generalised least squares on the data. Their derivatives by every parameter of the
//! catalogue run along with the state, so that one pass over a log gives the normal equations of all hypotheses at
//! once. Effects are fixed parameters, never states: a state would absorb what it is not (a current the hard iron), and
//! nothing is gated, because a gate locks out good ranges while the model is wrong.
//!
//! Parameters are fitted on training blocks (six of every nine minutes of the first four fifths) and judged on the
//! others. Evidence counts after the number of hypotheses tried, divided by how much more the blocks' scores scatter
//! than the noise explains (residuals that are still coloured).

pub mod bench;
pub mod candidates;
pub mod diagnosis;
pub mod glide;
pub mod gram;
pub mod linear;
pub mod model;
pub mod noise;
pub mod picture;
pub mod pings;
pub mod planar;
pub mod reduced;
pub mod rivals;
pub mod samples;
pub mod scores;
pub mod search;
pub mod statistics;
pub mod structure;
pub mod terms;
pub mod waves;
pub mod whitener;

//! Which physical effect does the declared model lack, how large is it, and what else could it be?
//!
//! ```text
//! samples           a log as readings and inputs        model         the declared vehicle with a set of effects
//! regressors        what is varied: columns             whitener      innovations, and their derivatives by each column
//! normal_equations  information matrix and score, by    linear        least squares on a choice of columns
//!                   blocks of time
//! noise             scales, outliers                    waves         a peak in the DVL's spectrum
//! coloured_noise    noise that lasts, channel by channel
//! candidates        the catalogue as hypotheses         search        what each is worth, times of events
//! alternatives      which other entry it could be       structure     terms outside the catalogue that remain
//! prepared_log      one log made ready, joint fits      diagnosis     the whole loop
//! selection         which effects are accepted          found         an effect with its intervals
//! full_log          selection where the dynamics are run
//! noise_effects     outliers and waves as effects
//! verdict           the table of verdict rules          scores        before and after on held-out data
//! log_models        logs without fins and propeller     figures       what the report draws
//! proposal          terms in no catalogue, as a formula event_times   intervals of onset and end
//! statistics        whiteness of a sequence             timing        when fins and propeller act
//! judged            what may be named                 borne_out     what data that had no say in an effect say of it
//! split             what fits, chooses and judges       floor         what is left beside what the sensors can make
//! ```
//!
//! The method: the filter itself is the whitener. Its normalised innovations are white if the model is right, so that
//! least squares on them is generalised least squares on the data. Their derivatives by every parameter of the
//! catalogue run along with the state, so that one pass over a log gives the normal equations of all hypotheses at
//! once. Effects are fixed parameters, never states: a state would absorb other effects as well (a current would absorb
//! hard iron). Nothing is gated, because a gate rejects good ranges while the model is wrong.
//!
//! Parameters are fitted on training blocks (five of every nine minutes of the first nine tenths), chosen on others and
//! judged on the rest. The evidence is corrected for the number of hypotheses tried, and divided by the factor by which the blocks'
//! scores scatter more than the noise explains (residuals that are still coloured).

mod acoustic_path;
pub mod actuators;
pub mod alternatives;
pub mod borne_out;
pub mod candidates;
pub mod coloured_noise;
pub mod diagnosis;
pub mod event_times;
pub mod figures;
pub mod floor;
pub mod found;
pub mod full_log;
pub mod judged;
mod lasting_noise;
pub mod lateness;
pub mod linear;
pub mod log_effects;
pub mod log_models;
pub mod model;
pub mod noise;
pub mod noise_effects;
pub mod normal_equations;
pub mod prepared_log;
pub mod proposal;
pub mod regressors;
pub mod remaining;
pub mod samples;
pub mod scores;
pub mod search;
pub mod selection;
pub mod split;
pub mod statistics;
pub mod structure;
pub mod timing;
pub mod torpedo;
pub mod verdict;
pub mod waves;
pub mod whitener;

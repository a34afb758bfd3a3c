//! What has changed, as it is named, and a filter that predicts with it.

use super::Estimator;
use crate::consequences::Fins;
use backseat_core::navigation::naming::{Named, Naming, Statement};

impl Estimator {
    /// What is stated of what has changed, once for each time that it was weighed anew.
    pub fn take_statement(&mut self) -> Option<Statement> {
        self.naming.take_statement()
    }

    /// Predicts with these fins, the nominal filter apart, which goes on to be asked what has changed.
    #[inline(never)] // the models are not to stay on the stack under a step
    pub fn set_fins(&mut self, (shares, stands_rad): &Fins) {
        self.navigator.set_fins(shares, stands_rad);
        if let Some(model) = &mut self.model {
            model.set_fin_effectiveness(shares);
            model.set_standing_fins(stands_rad);
        }
    }

    /// A cause is used from now on, or none.
    pub fn judge_use_of(&mut self, named: Option<&Named>) {
        self.naming.follow(named);
    }

    /// For a study.
    pub fn naming_mut(&mut self) -> &mut Naming {
        &mut self.naming
    }

    /// What is named, and by how much the cause in use has predicted better.
    pub fn naming(&self) -> &Naming {
        &self.naming
    }
}

//! What the commands compute, for other front ends than the command line: the Python package calls these functions, so
//! that its numbers are those of the commands to the bit.

pub use crate::diagnose::{
    DiagnosisReport, compute as diagnose, html as diagnosis_page, json as diagnosis_json, sentence,
};
pub use crate::identify::{
    Choice as Method, IdentificationResult, Known, Settings as IdentificationSettings, compute as identify,
    html as identification_page,
};
pub use crate::navigate::{
    Estimate, Model, NavigationResult, Settings as NavigationSettings, compute as navigate, html as navigation_page,
};
pub use crate::sim::simulate;
pub use crate::vehicle::examination;
pub use backseat_analysis::read_log::ReadLog;

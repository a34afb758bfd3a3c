//! Which columns of a log decide what can be done with it.

use backseat_logs::Log;
use backseat_logs::log::Column;

/// The five columns of propeller and fins.
pub const ACTUATORS: &[Column] = Column::group(Column::PropRpm, Column::FinStarboard);

/// Whether propeller and all fins have samples.
pub fn has_actuators(log: &Log) -> bool {
    ACTUATORS.iter().all(|column| log.has(*column))
}

/// Whether a log may be one that others are joined with: it says nothing of how a vehicle moves.
pub(crate) fn is_beside(log: &Log) -> bool {
    ![Column::Depth, Column::DvlU, Column::SpeedLog].into_iter().any(|column| log.has(column))
}

/// Names of the columns without samples.
pub(crate) fn lacking(log: &Log, columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().filter(|column| !log.has(**column)).map(|column| column.name()).collect();
    names.join(", ")
}

/// What stands before the command of a log whose model is in the laboratory, which the command line does not have.
pub const IN_LABORATORY: &str = "has its model in the laboratory: ";

/// What stands before the use of a log that is none of a vehicle by itself.
pub const ONLY_BESIDE: &str = "only beside ";

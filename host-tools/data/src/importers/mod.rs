//! Logs of other makers, read into a vehicle log.

//! Dead reckoning, to compare the filter with.

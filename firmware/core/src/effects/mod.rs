//! The catalogue of physical effects a declared model may lack, one file an entry.

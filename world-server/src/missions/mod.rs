//! The missions that there are.

pub mod waste;

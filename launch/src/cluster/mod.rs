//! Runs over several machines, as a [`file`] describes them.

pub mod file;

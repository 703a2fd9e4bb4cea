//! Runs over several machines: the cluster [file](mod@file), the daemon of each [`host`], and `alliance cluster up`, which can also
//! [start](mod@start) the daemons.

pub mod file;
pub mod host;
mod relay;
pub mod start;
mod up;

pub use up::ClusterCommand;

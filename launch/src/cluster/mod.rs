//! A run over several machines, as a [file](mod@file) describes it: a daemon on each [`host`], and the command that starts it all, the daemons too if it is told [how](start).

pub mod file;
pub mod host;
mod relay;
pub mod start;
mod up;

pub use up::ClusterCommand;

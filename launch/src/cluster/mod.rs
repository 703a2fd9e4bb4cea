//! A run over several machines, as a [file](mod@file) describes it: a daemon on each [`host`], and the command that starts it all.

pub mod file;
pub mod host;
mod relay;
mod up;

pub use up::ClusterCommand;

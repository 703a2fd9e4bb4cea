//! The commands for runs on several machines: [`up`] starts a run, [`host`] is the daemon on each other host, [`keys`] makes certificates.

pub mod host;
pub mod keys;
mod up;

pub use up::ClusterCommand;

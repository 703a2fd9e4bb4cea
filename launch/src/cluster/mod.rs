//! A run over several machines: a daemon on each host, and the command that starts it all.

pub mod host;
mod relay;

//! `alliance report`.
mod failures;
mod history;
mod metrics;
mod spans;
mod stints;
#[cfg(test)]
mod tests;
mod thin;
#[cfg(test)]
use {alliance_proto::ids::TaskId, alliance_proto::time::SimTime, history::History};

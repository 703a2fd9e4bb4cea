//! Replacement for `mcap` in a program that is built without it.

use std::io::{Seek, Write};

use run_log::RunLog;

/// The error for a run that cannot be reproduced.
#[derive(Debug, thiserror::Error)]
#[error("")]
pub struct Differs;

/// Returns an error, because this program has no MCAP support.
pub fn write(_: &RunLog, _: impl Write + Seek) -> anyhow::Result<()> {
    super::mcap_is_there()
}

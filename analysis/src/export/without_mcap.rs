//! Replacement for `mcap` in a program that is built without it.

use std::io::{Seek, Write};

use run_log::RunLog;

/// Returns an error, because this program has no MCAP support.
pub fn write(_: &RunLog, _: impl Write + Seek) -> anyhow::Result<()> {
    super::mcap_is_there()
}

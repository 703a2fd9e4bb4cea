//! In the place of `mcap` in a program that is built without it.

use std::io::{Seek, Write};

use alliance_proto::log::RunLog;

/// The run cannot be shown as it was.
#[derive(Debug, thiserror::Error)]
#[error("")]
pub struct Differs;

/// Says that it cannot be done.
pub fn write(_: &RunLog, _: impl Write + Seek) -> anyhow::Result<()> {
    super::mcap_is_there()
}

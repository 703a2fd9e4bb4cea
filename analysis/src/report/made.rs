//! Date and command of a run, from its folder.

use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::figures::FigureSelection;

/// Facts that a replay does not reproduce, and the shown part of the run.
#[derive(Clone, Debug, Default)]
pub struct RunOrigin {
    /// The start time, UTC.
    pub date: Option<String>,
    pub command: Option<String>,
    /// The part of the run that the figures show, in words; `None` for the whole run.
    pub window: Option<String>,
}

impl RunOrigin {
    /// Reads host.json. A killed run has no such file.
    #[must_use]
    pub fn of(folder: &Path, wanted: &FigureSelection) -> Self {
        let text = std::fs::read(folder.join("host.json")).unwrap_or_default();
        let host: serde_json::Value = serde_json::from_slice(&text).unwrap_or_default();
        let started = host["started_unix_ms"].as_u64();
        let started =
            started.and_then(|unix_ms| UNIX_EPOCH.checked_add(Duration::from_millis(unix_ms)));
        let part = |word: &str, at: Option<f64>| at.map(|at| format!("{word} {at} s"));
        let parts = [part("from", wanted.from_s), part("to", wanted.to_s)];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        Self {
            date: started.map(|time| humantime::format_rfc3339_seconds(time).to_string()),
            command: host["command"].as_str().map(str::to_owned),
            window: (!parts.is_empty()).then(|| parts.join(" ")),
        }
    }
}

//! When and how a run was made, as far as its folder says so.

use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::figures::Wanted;

/// What no repetition of the run would give again, and what of it is shown.
#[derive(Clone, Debug, Default)]
pub struct Made {
    /// When it started, UTC.
    pub date: Option<String>,
    /// The command by which it was started.
    pub command: Option<String>,
    /// The part of the run that the figures show, in words, if it is a part.
    pub window: Option<String>,
}

impl Made {
    /// Reads host.json, which a killed run lacks.
    #[must_use]
    pub fn of(folder: &Path, wanted: &Wanted) -> Self {
        let text = std::fs::read(folder.join("host.json")).unwrap_or_default();
        let host: serde_json::Value = serde_json::from_slice(&text).unwrap_or_default();
        let started = host["started_unix_ms"].as_u64();
        let started =
            started.and_then(|unix_ms| UNIX_EPOCH.checked_add(Duration::from_millis(unix_ms)));
        let part = |word: &str, at: Option<f64>| at.map(|at| format!("{word} {at} s"));
        let parts = [part("from", wanted.from_s), part("to", wanted.to_s)];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        Self {
            date: started.map(|it| humantime::format_rfc3339_seconds(it).to_string()),
            command: host["command"].as_str().map(str::to_owned),
            window: (!parts.is_empty()).then(|| parts.join(" ")),
        }
    }
}

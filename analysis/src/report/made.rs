//! Date and command of a run, from its folder.

use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::figures::FigureSelection;
use crate::export::PAGE;

/// Facts that a replay does not reproduce, and the shown part of the run.
#[derive(Clone, Debug, Default)]
pub struct RunOrigin {
    /// The start time, UTC.
    pub date: Option<String>,
    pub command: Option<String>,
    /// The part of the run that the figures show, in words; `None` for the whole run.
    pub window: Option<String>,
    /// The link from the report to the page of the run as a file; `None` without that file.
    pub page: Option<String>,
}

impl RunOrigin {
    /// Reads host.json, which a killed run does not have. `out` is the folder of the report.
    #[must_use]
    pub fn of(folder: &Path, out: &Path, wanted: &FigureSelection) -> Self {
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
            page: page_of(folder, out),
        }
    }
}

/// Returns the link from a file in `out` to the page of the run in `folder`, if that exists. The link to a report inside the run's
/// folder stays valid when the folder moves.
fn page_of(folder: &Path, out: &Path) -> Option<String> {
    let page = folder.join(PAGE).canonicalize().ok()?;
    let is_inside = out.parent().is_some_and(|above| above == folder);
    Some(if is_inside {
        format!("../{PAGE}")
    } else {
        // A space or `#` in a path would end the link or begin its fragment.
        let path = page.display().to_string();
        format!(
            "file://{}",
            path.replace('%', "%25")
                .replace('#', "%23")
                .replace(' ', "%20")
        )
    })
}

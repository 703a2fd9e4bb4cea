//! The takeovers of a finished run, from the events of its log.

use std::path::Path;

use observation::takeovers::{LossTakeover, loss_takeovers};
use proto::event::EventLine;
use run_log::{EventRow, RunFile, Table};

/// Returns the takeovers of the run in a folder; none if its events cannot be read.
#[must_use]
pub fn takeovers_in(folder: &Path, run: &RunFile) -> Vec<LossTakeover> {
    let Ok(events) = csv::Reader::from_path(folder.join(Table::Events.file_name())) else {
        return Vec::new();
    };
    let rows = events.into_deserialize::<EventRow>();
    let events: Vec<EventLine> = rows.map_while(Result::ok).map(event_line).collect();
    loss_takeovers(&run.setup, &events, run.result.sim_time_ms)
}

/// Returns a row of events.csv as observers of a live run receive it.
#[must_use]
pub fn event_line(row: EventRow) -> EventLine {
    EventLine {
        t_ms: row.t_ms,
        kind: row.kind,
        robot: row.robot,
        subject: row.subject,
        reason: row.reason,
        detail: row.detail,
    }
}

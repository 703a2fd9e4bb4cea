//! A finished run: every tick of it, ready to be shown in any order.

use std::path::Path;

use alliance_proto::event::EventLine;
use alliance_proto::ids::Tick;
use alliance_proto::log::{EventRow, LogLevel, RunLog};
use alliance_proto::view::{MESSAGES_MAX, View};
use serde_json::{Value, json};
use study::retrace::retrace;

use super::about::about;

/// Views that are held at most; of a longer run those of every second, third, … tick.
const VIEWS_MAX: u64 = 20_000;

/// Robots in all views together at most: about half a kilobyte each.
const ROBOTS_MAX: u64 = 400_000;

/// Views that are told at once at most.
pub const COUNT_MAX: u64 = 1000;

/// What `GET /api/run`, `/api/views` and `/api/events` tell.
pub struct Logged {
    about: Value,
    views: Vec<View>,
    every: u64,
    events: Vec<EventLine>,
    /// Why what is shown is not quite what was logged.
    pub warning: Option<String>,
}

impl Logged {
    /// Reads a run's folder, and runs it again.
    ///
    /// # Errors
    /// When it holds no run, or one without a whole tick.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let logged = RunLog::open(folder)?;
        let team = logged.run.setup.scenario.robots.len().max(1) as u64;
        let views_max = (ROBOTS_MAX / team).clamp(1, VIEWS_MAX);
        let every = logged.run.result.ticks.max(last_tick(&logged)) / views_max + 1;
        let mut views = Vec::new();
        let mut messages = Vec::new();
        let mut left_out = 0;
        let again = retrace(&logged, LogLevel::Summary, |mut view| {
            messages.append(&mut view.messages);
            left_out += view.messages_left_out;
            if view.tick % every == 0 {
                let surplus = messages.len().saturating_sub(MESSAGES_MAX);
                view.messages = messages.drain(..).skip(surplus).collect();
                view.messages_left_out = std::mem::take(&mut left_out) + surplus as u64;
                views.push(view);
            }
        })?;
        let events = again
            .log
            .each_row()
            .map(|row| row.map(line))
            .collect::<Result<Vec<_>, _>>()?;
        let ticks = again.log.run.result.ticks;
        let log = json!({
            "ticks": ticks,
            "every": every,
            "duration_ms": again.log.run.result.sim_time_ms,
            "outcome": logged.run.outcome,
            "hash": logged.run.hash,
            "warning": again.differs,
        });
        // By its own name, not by that of a link to it.
        let folder = folder.canonicalize()?;
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let about = about(
            "log",
            &name,
            &folder.display().to_string(),
            &logged.run.setup,
            log,
        );
        Ok(Self {
            about,
            views,
            every,
            events,
            warning: again.differs,
        })
    }

    /// What does not change.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// At most `count` views: of the tick `from`, and of every `step`-th after it, each rounded down to one that is held.
    #[must_use]
    pub fn views(&self, from: Tick, count: u64, step: u64) -> Vec<&View> {
        (0..count.min(COUNT_MAX))
            .map_while(|index| {
                let tick = from.checked_add(index.checked_mul(step.max(1))?)?;
                self.views.get(usize::try_from(tick / self.every).ok()?)
            })
            .collect()
    }

    /// All events.
    #[must_use]
    pub fn events(&self) -> &[EventLine] {
        &self.events
    }
}

/// Of a log that did not end.
fn last_tick(logged: &RunLog) -> Tick {
    logged.last.map_or(0, |last| last.tick + 1)
}

fn line(row: EventRow) -> EventLine {
    EventLine {
        t_ms: row.t_ms,
        kind: row.kind,
        robot: row.robot,
        subject: row.subject,
        reason: row.reason,
        detail: row.detail,
    }
}

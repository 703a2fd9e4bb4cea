//! A finished run in memory, for display in any order of ticks. The memory is bounded: views and curves of long runs are thinned.

use missions::Registry;
use std::future::Future;
use std::path::Path;
use std::time::Duration;

use analysis::replay_views::retrace_into;
use analysis::report::takeovers::event_line;
use axum::extract::ws::WebSocket;
use observation::about::about;
use observation::detections::DetectionWatch;
use observation::takeovers::{LossTakeover, loss_takeovers};
use proto::control::AgentState;
use proto::event::EventLine;
use proto::tick::Outcome;
use proto::view::{Corner, View};
use run_log::{LogLevel, MemoryLog, RunLog, RunOutcome};
use scenario::ids::{RobotId, Tick};
use scenario::time::SimTime;
use serde_json::{Value, json};
use tokio::sync::watch;
use tokio::time::timeout;

use super::corners::Corners;
use super::views::{Views, in_brief, remove_idle_sets};

/// The time without an open page after which the server ends.
const DESERTED: Duration = Duration::from_secs(5);

/// The maximum number of views in one answer.
pub const COUNT_MAX: u64 = 1000;

/// The number of views in the overview of a run.
const OVERVIEW: u64 = 300;

/// The data of `GET /api/run`, `/api/views`, `/api/overview`, `/api/corners` and `/api/events`.
pub struct Logged {
    about: Value,
    views: Views,
    corners: Corners,
    /// By time, with the detections of lost robots and the takeovers from them.
    events: Vec<EventLine>,
    pages: watch::Sender<usize>,
    interrupted: bool,
    /// The difference between the replay and the log, if there is one.
    pub warning: Option<String>,
}

impl Logged {
    /// Reads the folder of a run and replays the run.
    ///
    /// # Errors
    /// If the folder contains no run, or a run without a complete tick.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let vocabulary = Registry::current().vocabulary();
        // The replay needs no table of every tick.
        let logged = RunLog::open_within(folder, &vocabulary, 0)?;
        let scenario = &logged.run.setup.scenario;
        let step = SimTime(scenario.step_ms);
        let mut views = Views::new();
        let mut corners = Corners::new(scenario.robots.len(), step);
        let mut detections = DetectionWatch::new(&logged.run.setup);
        let mut detected = Vec::new();
        let memory = MemoryLog::default();
        let replayed = retrace_into(&logged, LogLevel::Summary, memory, |simulation| {
            corners.add(simulation.take_corners());
            if views.wants(simulation.tick()) {
                let mut view = simulation.view();
                detected.extend(detections.see(&view));
                remove_idle_sets(&mut view);
                views.add(view);
            }
        })?;
        corners.add(last_levels(&replayed.end, step));
        let log = RunLog::from_memory(&replayed.sink, &vocabulary)?;
        let events = log.each_row().map(|row| row.map(event_line));
        let mut events = events.collect::<Result<Vec<_>, _>>()?;
        let end = replayed.run.result.sim_time_ms;
        let takeovers = loss_takeovers(&logged.run.setup, &events, end);
        events.extend(detected);
        events.extend(takeovers.into_iter().map(LossTakeover::into_event));
        events.sort_by_key(|event| event.t_ms);
        let result = &replayed.run.result;
        let log = json!({
            "ticks": result.ticks,
            "every": views.every(),
            "chunk": views.chunk(),
            "duration_ms": result.sim_time_ms,
            "outcome": logged.run.outcome,
            "hash": logged.run.hash,
            "branch": logged.run.branch,
            "warning": replayed.differs,
        });
        // The real name, not that of a symbolic link such as `latest`.
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
            corners,
            events,
            pages: watch::Sender::new(0),
            interrupted: logged.run.outcome == RunOutcome::Ended(Outcome::Interrupted),
            warning: replayed.differs,
        })
    }

    /// Returns `true` if a user ended the run.
    #[must_use]
    pub fn was_interrupted(&self) -> bool {
        self.interrupted
    }

    /// Counts a page as open until it disconnects.
    pub async fn count_page(&self, mut page: WebSocket) {
        self.pages.send_modify(|open| *open += 1);
        // Messages of a page are ignored.
        while let Some(Ok(_)) = page.recv().await {}
        self.pages.send_modify(|open| *open -= 1);
    }

    /// Waits until the last page has been closed for a while. The delay covers a reload, which closes the page first.
    pub fn wait_until_deserted(&self) -> impl Future<Output = ()> + Send + 'static {
        let mut pages = self.pages.subscribe();
        async move {
            let mut seen = false;
            loop {
                seen |= *pages.borrow_and_update() > 0;
                let empty = *pages.borrow() == 0;
                match timeout(DESERTED, pages.changed()).await {
                    // The sender is dropped with the server.
                    Ok(Err(_)) => return,
                    Err(_) if seen && empty => return,
                    Ok(Ok(())) | Err(_) => {}
                }
            }
        }
    }

    /// Returns the constant description of the run.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// Returns at most `count` views: of the tick `from` and every `step`-th after it, each rounded down to a view in memory.
    #[must_use]
    pub fn views(&self, from: Tick, count: u64, step: u64) -> Vec<&View> {
        (0..count.min(COUNT_MAX))
            .map_while(|index| {
                let tick = from.checked_add(index.checked_mul(step.max(1))?)?;
                self.views.at(tick)
            })
            .collect()
    }

    /// Returns at most [`OVERVIEW`] views of the whole run, with only the poses and states of the robots.
    #[must_use]
    pub fn overview(&self) -> Vec<View> {
        let step = self.views.count().div_ceil(OVERVIEW).max(1) * self.views.every();
        let views = self.views(0, OVERVIEW, step);
        views.into_iter().map(in_brief).collect()
    }

    /// Returns the corners of all curves of a robot by time; empty for an unknown robot.
    #[must_use]
    pub fn corners(&self, rank: usize) -> &[Corner] {
        self.corners.of(rank)
    }

    #[must_use]
    pub fn events(&self) -> &[EventLine] {
        &self.events
    }
}

/// Returns the ends of the curves of present robots if `view` is the last one. They belong to the step before the view.
fn last_levels(view: &View, step: SimTime) -> Vec<Corner> {
    let present = (0..).zip(&view.robots);
    let present = present.filter(|(_, robot)| robot.state == AgentState::Present);
    present
        .flat_map(|(rank, robot)| {
            robot.sets.iter().map(move |set| Corner {
                robot: RobotId(rank),
                set: set.motivation.set,
                at: view.now - step,
                level: set.motivation.motivation,
                state: set.motivation.state,
                last: true,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use std::process::Command;

    use in_process::Team;
    use run_log::MotivationRow;
    use run_log::recorder::Folder;
    use scenario::Setup;
    use serde_json::{Value, json};
    use tempfile::TempDir;

    use super::*;

    #[test]
    fn the_tables_of_every_tick_are_not_read() {
        let folder = TempDir::new().unwrap();
        let setup = Setup::resolve(default_scenario(), 1, None).unwrap().setup;
        let sink = Folder::create(folder.path()).unwrap();
        let team = Team::new(setup, LogLevel::Compact, sink).unwrap();
        team.run().unwrap();
        // A folder in place of a table cannot be read.
        let table = folder.path().join("motivations.csv");
        std::fs::remove_file(&table).unwrap();
        std::fs::create_dir(&table).unwrap();
        let logged = Logged::open(folder.path()).unwrap();
        assert_eq!(logged.warning, None);
    }

    /// The curves of the page agree with the log at every activation and reset, for any window length.
    #[test]
    fn charts_show_every_activation_and_reset_of_the_log() {
        let folder = TempDir::new().unwrap();
        let setup = Setup::resolve(default_scenario(), 1, None).unwrap().setup;
        let sink = Folder::create(folder.path()).unwrap();
        Team::new(setup, LogLevel::Full, sink)
            .unwrap()
            .run()
            .unwrap();
        let logged = Logged::open(folder.path()).unwrap();
        let about = logged.about();
        let log = RunLog::open(folder.path(), &Registry::built_in().vocabulary()).unwrap();
        let rows: Vec<Value> = log
            .each_row::<MotivationRow>()
            .map(|row| {
                let row = row.unwrap();
                json!([
                    row.t_ms,
                    row.robot,
                    row.behavior_set,
                    row.motivation,
                    row.state
                ])
            })
            .collect();
        let robots = about["scenario"]["robots"].as_array().unwrap();
        let corners: Vec<&[Corner]> = (0..robots.len()).map(|rank| logged.corners(rank)).collect();
        let data = json!({
            "robots": robots.iter().map(|robot| &robot["name"]).collect::<Vec<_>>(),
            "sets": about["catalog"]["sets"],
            "duration_ms": about["log"]["duration_ms"],
            "corners": corners,
            "rows": rows,
        });
        let file = folder.path().join("told.json");
        std::fs::write(&file, data.to_string()).unwrap();
        crate::page::node(
            Command::new("node").env("ALLIANCE_LOG", &file),
            "log.test.js",
        );
    }
}

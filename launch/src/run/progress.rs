//! The progress of a run on the terminal: one line for the mission, one for each robot of a team that fits. Where stderr is no terminal, a line
//! every few seconds.

use std::io::IsTerminal;
use std::sync::Arc;
use std::time::Duration;

use alliance_proto::control::AgentState;
use alliance_proto::event::EventLine;
use alliance_proto::mission::columns::{
    Column, ColumnValue, Progress as MissionProgress, in_short,
};
use alliance_proto::scenario::{Catalog, Setup};
use alliance_proto::tell;
use alliance_proto::view::{RobotView, View};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use tokio::time::Instant;

/// Least time between two lines where stderr is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Robots of which it is told what they do; of larger teams only the first.
const ROBOTS_TOLD: usize = 12;

/// Shows views as they come.
pub struct Progress {
    names: Vec<String>,
    catalog: Arc<Catalog>,
    columns: &'static [Column],
    started: Option<(Instant, f64)>,
    /// It has been said for whom the clock waits.
    told: Option<String>,
    style: Style,
}

enum Style {
    Terminal {
        bars: MultiProgress,
        mission: ProgressBar,
        robots: Vec<ProgressBar>,
    },
    Lines {
        last: Option<Instant>,
    },
}

impl Progress {
    /// Nothing shown yet.
    pub fn new(setup: &Setup) -> Self {
        let names: Vec<String> = setup
            .scenario
            .robots
            .iter()
            .map(|r| r.name.clone())
            .collect();
        let style = if std::io::stderr().is_terminal() {
            let bars = MultiProgress::new();
            let mission = bars.add(ProgressBar::no_length());
            mission.set_style(template("{msg}"));
            let robots = names
                .iter()
                // One more, for how many others there are.
                .take(ROBOTS_TOLD + 1)
                .map(|_| {
                    let line = bars.add(ProgressBar::no_length());
                    line.set_style(template("  {msg}"));
                    line
                })
                .collect();
            Style::Terminal {
                bars,
                mission,
                robots,
            }
        } else {
            Style::Lines { last: None }
        };
        Self {
            names,
            catalog: Arc::clone(&setup.catalog),
            columns: setup.catalog.mission.terms().columns,
            started: None,
            told: None,
            style,
        }
    }

    /// Shows a snapshot.
    pub fn show(&mut self, view: &View) {
        let now = Instant::now();
        let waits_for = view
            .clock
            .as_ref()
            .and_then(|clock| clock.waits_for.as_ref());
        if self.told.as_ref() != waits_for {
            self.told = waits_for.cloned();
            if let Some(whom) = waits_for {
                self.say(&format!(
                    "the clock stands at {}: it waits for {whom}; Ctrl-C ends the run",
                    view.now
                ));
            }
        }
        let sim = view.now.as_secs_f64();
        let (since, from) = *self.started.get_or_insert((now, sim));
        let real = now.duration_since(since).as_secs_f64();
        // Too early to tell the speed of a run that has only just been seen.
        let clock = if real < 0.05 {
            format!("{sim:.1} s simulated")
        } else {
            format!("{sim:.1} s simulated, {:.0}x", (sim - from) / real)
        };
        let robots = self.names.iter().zip(&view.robots).take(ROBOTS_TOLD);
        let mut doing: Vec<String> = robots
            .map(|(name, robot)| self.describe(name, robot))
            .collect();
        let others = self.names.len().saturating_sub(ROBOTS_TOLD);
        if others > 0 {
            doing.push(format!("and {others} more"));
        }
        let columns = self.columns.iter().zip(&view.mission);
        let row: Vec<ColumnValue> = columns
            .map(|(column, number)| column.seen(*number))
            .collect();
        match &mut self.style {
            Style::Terminal {
                mission, robots, ..
            } => {
                if let Some(MissionProgress { done, total, .. }) = MissionProgress::of(&row) {
                    mission.set_style(template("{bar:24} {msg}"));
                    mission.set_length(total);
                    mission.set_position(done);
                }
                mission.set_message(format!("{}  {clock}", in_short(&row)));
                for (line, doing) in robots.iter().zip(doing) {
                    line.set_message(doing);
                }
            }
            Style::Lines { last } => {
                if last.is_none_or(|last| now.duration_since(last) >= LINE_INTERVAL) {
                    *last = Some(now);
                    tell!("{clock}, {}; {}", in_short(&row), doing.join("; "));
                }
            }
        }
    }

    /// Prints a line above the progress.
    pub fn say(&self, line: &str) {
        match &self.style {
            // A terminal that cannot be written to has nobody in front of it.
            Style::Terminal { bars, .. } => drop(bars.println(line)),
            Style::Lines { .. } => tell!("{line}"),
        }
    }

    /// Tells what happens to faults.
    pub fn tell(&self, line: &EventLine) {
        if matches!(line.kind.as_str(), "applied" | "healed" | "failed") {
            let why = if line.reason.is_empty() {
                String::new()
            } else {
                format!(" ({})", line.reason)
            };
            let at = line.t_ms.as_secs_f64();
            self.say(&format!(
                "{at:.3} s: {} {} {}{why}",
                line.subject, line.kind, line.detail
            ));
        }
    }

    /// Takes the progress off the terminal.
    pub fn clear(&self) {
        if let Style::Terminal { bars, .. } = &self.style {
            let _ = bars.clear();
        }
    }

    fn describe(&self, name: &str, robot: &RobotView) -> String {
        let doing = match (robot.state, robot.active) {
            (AgentState::Absent | AgentState::Dead, _) => "no agent",
            (AgentState::Coming, _) => "coming",
            (AgentState::Silent, _) => "silent",
            (AgentState::Present, None) => "idle",
            (AgentState::Present, Some(set)) => self.catalog.behavior_name(set),
        };
        let load = robot
            .carrying
            .map_or_else(String::new, |item| format!(", carries {item}"));
        format!("{name}: {doing}{load}")
    }
}

fn template(text: &str) -> ProgressStyle {
    ProgressStyle::with_template(text).unwrap_or_else(|_| ProgressStyle::default_bar())
}

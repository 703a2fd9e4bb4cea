//! The progress display of a run: one line for the mission and one per robot. If stderr is not a terminal, one line every few seconds.

use std::io::IsTerminal;
use std::sync::Arc;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use proto::control::AgentState;
use proto::view::{RobotView, View};
use scenario::ids::Tick;
use scenario::mission::columns::{Column, ColumnValue, Progress as MissionProgress, short_summary};
use scenario::{Catalog, Setup};
use terminal::{counted, stderr_line};
use tokio::time::Instant;

/// The minimum time between two lines if stderr is not a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// The maximum length of a line if stderr is not a terminal.
const LINE_WIDTH: usize = 80;

/// The maximum number of robots in the display; the first ones of larger teams.
const ROBOTS_SHOWN: usize = 12;

/// The time over which the speed is measured, at least.
const SPEED_INTERVAL: Duration = Duration::from_secs(5);

/// A progress display that is updated by views.
pub struct ProgressDisplay {
    names: Vec<String>,
    catalog: Arc<Catalog>,
    columns: &'static [Column],
    speed: SpeedMeter,
    /// The robots for which the clock waits, as last printed.
    waits_for: Option<String>,
    style: Style,
}

enum Style {
    Terminal {
        bars: MultiProgress,
        mission: ProgressBar,
        robots: Vec<ProgressBar>,
    },
    Lines {
        /// The time and the tick of the last line.
        last: Option<(Instant, Tick)>,
    },
}

impl ProgressDisplay {
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
                // One more line, for the number of further robots.
                .take(ROBOTS_SHOWN + 1)
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
            columns: setup.catalog.mission.vocabulary().columns,
            speed: SpeedMeter::default(),
            waits_for: None,
            style,
        }
    }

    pub fn show(&mut self, view: &View) {
        let now = Instant::now();
        let waits_for = view
            .clock
            .as_ref()
            .and_then(|clock| clock.waits_for.as_ref());
        if self.waits_for.as_ref() != waits_for {
            self.waits_for = waits_for.cloned();
            if let Some(robots) = waits_for {
                self.print_line(&format!(
                    "the clock stands still at {}: it waits for {robots}; Ctrl-C ends the run",
                    view.now
                ));
            }
        }
        let sim = view.now.as_secs_f64();
        let clock = view.clock.as_ref();
        let is_paused = clock.is_some_and(|clock| clock.paused && clock.steps_left == 0);
        let is_held = is_paused || clock.is_some_and(|clock| clock.waits_for.is_some());
        let speed = self.speed.update(now, sim, is_held);
        let clock = match speed {
            Some(speed) => format!("{sim:.1} s simulated, {}", speed_text(speed)),
            None if is_paused => format!("{sim:.1} s simulated, paused"),
            None => format!("{sim:.1} s simulated"),
        };
        let robots = self.names.iter().zip(&view.robots).take(ROBOTS_SHOWN);
        let mut doing: Vec<String> = robots
            .map(|(name, robot)| self.describe(name, robot))
            .collect();
        let others = self.names.len().saturating_sub(ROBOTS_SHOWN);
        let columns = self.columns.iter().zip(&view.mission);
        let row: Vec<ColumnValue> = columns
            .map(|(column, number)| column.with_number(*number))
            .collect();
        match &mut self.style {
            Style::Terminal {
                mission, robots, ..
            } => {
                if let Some(progress) = MissionProgress::from_row(&row) {
                    mission.set_style(template("{bar:24} {msg}"));
                    mission.set_length(progress.total());
                    mission.set_position(progress.done);
                }
                mission.set_message(format!("{}  {clock}", short_summary(&row)));
                if others > 0 {
                    doing.push(format!("and {}", counted(others, "more robot")));
                }
                for (line, doing) in robots.iter().zip(doing) {
                    line.set_message(terminal::escaped(&doing).into_owned());
                }
            }
            Style::Lines { last } => {
                // While the clock is held or stands still, the line would not change.
                let due = last.is_none_or(|(at, tick)| {
                    tick != view.tick && now.duration_since(at) >= LINE_INTERVAL
                });
                if due {
                    *last = Some((now, view.tick));
                    let start = format!("{clock}, {}", short_summary(&row));
                    stderr_line!("{}", bounded_line(start, &doing, others));
                }
            }
        }
    }

    pub fn print_line(&self, line: &str) {
        match &self.style {
            // Errors of a closed terminal are ignored.
            Style::Terminal { bars, .. } => drop(bars.println(terminal::escaped(line))),
            Style::Lines { .. } => stderr_line!("{line}"),
        }
    }

    pub fn clear(&self) {
        if let Style::Terminal { bars, .. } = &self.style {
            let _ = bars.clear();
        }
    }

    fn describe(&self, name: &str, robot: &RobotView) -> String {
        let doing = match (robot.state, robot.active) {
            (AgentState::Absent | AgentState::Dead, _) => "no agent",
            (AgentState::Coming, _) => "starting",
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

/// The speed of the clock relative to real time. Times at which the clock was held do not count.
#[derive(Default)]
struct SpeedMeter {
    /// Wall-clock and simulated time, s, of the point from which the speed is measured, and of the one that replaces it.
    points: Option<[(Instant, f64); 2]>,
}

impl SpeedMeter {
    /// Returns the speed at a simulated time, s. It is unknown while the clock is held, and until enough time has
    /// passed since then.
    fn update(&mut self, now: Instant, sim: f64, is_held: bool) -> Option<f64> {
        if is_held {
            self.points = None;
            return None;
        }
        let points = self.points.get_or_insert([(now, sim); 2]);
        if now.duration_since(points[1].0) >= SPEED_INTERVAL {
            *points = [points[1], (now, sim)];
        }
        let (since, from) = points[0];
        let real = now.duration_since(since).as_secs_f64();
        (real >= 0.05 && sim > from).then(|| (sim - from) / real)
    }
}

/// Formats a speed above 0 with at least two significant digits. Speeds just below a power of ten have the digits of that
/// power, so that a run in real time does not alternate between 1.0x and 1.00x.
fn speed_text(speed: f64) -> String {
    let digits = (1.0 - (1.005 * speed).log10().floor()).max(0.0) as usize;
    format!("{speed:.digits$}x")
}

/// Appends entries to a line as far as they fit into [`LINE_WIDTH`], then the number of the entries that do not, and of `others`.
fn bounded_line(mut line: String, entries: &[String], others: usize) -> String {
    let width = |text: &str| text.chars().count();
    for (index, entry) in entries.iter().enumerate() {
        let left = entries.len() - index - 1 + others;
        let rest = if left > 0 {
            format!("; and {}", counted(left, "more robot"))
        } else {
            String::new()
        };
        if width(&line) + width(entry) + width(&rest) + 2 > LINE_WIDTH {
            return format!("{line}; and {}", counted(left + 1, "more robot"));
        }
        line += &format!("; {entry}");
    }
    match others {
        0 => line,
        others => format!("{line}; and {}", counted(others, "more robot")),
    }
}

fn template(text: &str) -> ProgressStyle {
    ProgressStyle::with_template(text).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_leaves_out_the_time_of_a_pause() {
        let mut meter = SpeedMeter::default();
        let start = Instant::now();
        let mut update = |real_s: u64, sim: f64, is_held: bool| {
            meter.update(start + Duration::from_secs(real_s), sim, is_held)
        };
        assert_eq!(update(0, 0.0, false), None);
        assert_eq!(update(2, 10.0, false), Some(5.0));
        for second in 3..600 {
            assert_eq!(update(second, 10.0, true), None);
        }
        assert_eq!(update(600, 10.0, false), None);
        assert_eq!(update(601, 15.0, false), Some(5.0));
        let texts = [120.4, 20.3, 9.97, 5.0, 0.998, 0.52, 0.0041].map(speed_text);
        let expected = ["120x", "20x", "10x", "5.0x", "1.0x", "0.52x", "0.0041x"];
        assert_eq!(texts, expected);
    }

    #[test]
    fn a_line_has_at_most_80_columns_and_counts_the_other_robots() {
        let start = || "12.0 s simulated, 10x, 0 of 24 done".to_owned();
        let robots = |count: usize| -> Vec<String> {
            (1..=count).map(|robot| format!("r{robot}: idle")).collect()
        };
        assert_eq!(
            bounded_line(start(), &robots(3), 0),
            "12.0 s simulated, 10x, 0 of 24 done; r1: idle; r2: idle; r3: idle"
        );
        assert_eq!(
            bounded_line(start(), &robots(12), 18),
            "12.0 s simulated, 10x, 0 of 24 done; r1: idle; r2: idle; and 28 more robots"
        );
        for count in 0..40 {
            for others in [0, 1, 18] {
                let line = bounded_line(start(), &robots(count), others);
                assert!(line.chars().count() <= LINE_WIDTH, "{line}");
                let shown = line.matches(": idle").count();
                let more = line.split("and ").nth(1);
                let more = more.map_or(0, |more| more.split(' ').next().unwrap().parse().unwrap());
                assert_eq!(shown + more, count + others, "{line}");
            }
        }
    }
}

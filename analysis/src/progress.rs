//! The progress of work in this process that can take minutes: a bar on a terminal, otherwise a line every few seconds.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use terminal::stderr_line;
use tokio::time::Instant;

/// The work time after which the display begins. Shorter work has no display.
const QUIET: Duration = Duration::from_millis(700);

/// The shortest interval between two lines if stderr is not a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// A display of steps done, which begins after `QUIET`.
pub struct Progress {
    what: String,
    unit: &'static str,
    total: u64,
    done: u64,
    began: Instant,
    /// The time of the latest output.
    shown: Option<Instant>,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Creates the display of `total` steps. `what` is the work in words, `unit` the plural of a step.
    #[must_use]
    pub fn new(what: impl Into<String>, unit: &'static str, total: u64) -> Self {
        Self {
            what: what.into(),
            unit,
            total,
            done: 0,
            began: Instant::now(),
            shown: None,
            bar: None,
        }
    }

    /// Counts one more step.
    pub fn step(&mut self) {
        self.done += 1;
        let is_first = self.shown.is_none();
        match (self.due(Instant::now()), &self.bar) {
            (Some(line), None) => stderr_line!("{line}"),
            (_, Some(bar)) => bar.set_position(self.done),
            (None, None) => {}
        }
        if is_first && self.shown.is_some() && std::io::stderr().is_terminal() {
            self.bar = Some(bar(self.unit, self.total));
        }
    }

    /// Returns the line that is due at `now`: once the announcement, then the state at intervals.
    fn due(&mut self, now: Instant) -> Option<String> {
        let elapsed = now.duration_since(self.began);
        let line = match self.shown {
            None if elapsed < QUIET => return None,
            None => announcement(&self.what, elapsed, self.done, self.total),
            Some(shown) if now.duration_since(shown) < LINE_INTERVAL => return None,
            Some(_) => line(self.unit, elapsed, self.done, self.total),
        };
        self.shown = Some(now);
        Some(line)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn bar(unit: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    let style =
        ProgressStyle::with_template(&format!("{{bar:30}} {{pos}}/{{len}} {unit}, {{eta}} left"));
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Returns the first line, with an estimate of the whole time.
fn announcement(what: &str, elapsed: Duration, done: u64, total: u64) -> String {
    let share = (done as f64 / total.max(1) as f64).clamp(1e-6, 1.0);
    let whole = (elapsed.as_secs_f64() / share).ceil();
    format!("{what} (about {whole:.0} s)")
}

/// Returns a later line, with an estimate of the remaining time.
fn line(unit: &str, elapsed: Duration, done: u64, total: u64) -> String {
    let per_step = elapsed.as_secs_f64() / done.max(1) as f64;
    let left = Duration::from_secs_f64((per_step * total.saturating_sub(done) as f64).min(1e9));
    format!("{done}/{total} {unit}, {} left", HumanDuration(left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_estimate_the_whole_and_the_remaining_time() {
        let (second, minute) = (Duration::from_secs(1), Duration::from_secs(60));
        let first = announcement("running it again", second, 300, 12_000);
        assert_eq!(first, "running it again (about 40 s)");
        assert_eq!(
            line("ticks", minute, 3000, 12_000),
            "3000/12000 ticks, 3 minutes left"
        );
        assert_eq!(
            line("ticks", minute, 12_000, 12_000),
            "12000/12000 ticks, 0 seconds left"
        );
    }

    #[test]
    fn short_work_has_no_line_and_long_work_has_one_at_each_interval() {
        let mut progress = Progress::new("replaying the run", "ticks", 12_000);
        let began = progress.began;
        let mut at = |ms: u64, done| {
            progress.done = done;
            progress.due(began + Duration::from_millis(ms))
        };
        assert_eq!(at(699, 200), None);
        let announced = at(1000, 300);
        assert_eq!(announced.as_deref(), Some("replaying the run (about 40 s)"));
        assert_eq!(at(5999, 1800), None);
        assert_eq!(
            at(6000, 1800).as_deref(),
            Some("1800/12000 ticks, 34 seconds left")
        );
        assert_eq!(at(10_999, 3000), None);
        assert!(at(11_000, 3300).is_some());
    }
}

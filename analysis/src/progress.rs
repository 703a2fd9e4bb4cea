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

/// The number of steps from which on the first line estimates the whole time. The first step includes preparations.
const ESTIMATE_FROM: u64 = 10;

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
    bar.set_style(style(&format!("{{pos}}/{{len}} {unit}, {{eta}} left")));
    bar
}

fn style(text: &str) -> ProgressStyle {
    ProgressStyle::with_template(&format!("{{bar:30}} {text}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Returns the first line, with an estimate of the whole time if enough steps are done.
fn announcement(what: &str, elapsed: Duration, done: u64, total: u64) -> String {
    if done < ESTIMATE_FROM {
        return what.to_owned();
    }
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

/// The redraw interval of the bar, which updates the remaining time.
const TICK: Duration = Duration::from_millis(500);

/// The progress of runs: a bar with rate and remaining time, or periodic lines if stderr is not a terminal.
pub struct RunProgress {
    bar: ProgressBar,
    failed: usize,
    began: Instant,
    /// The number of runs that an earlier process finished.
    before: usize,
    done: usize,
    of: usize,
    /// The time of the latest line; `None` on a terminal.
    line: Option<Instant>,
}

impl RunProgress {
    /// Creates the display for `of` runs, of which `before` are done.
    pub fn new(before: usize, of: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(of as u64), ProgressDrawTarget::stderr());
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        if terminal {
            bar.set_style(style("{pos}/{len} runs  {msg}"));
            bar.set_position(before as u64);
            bar.enable_steady_tick(TICK);
        }
        Self {
            bar,
            failed: 0,
            began: now,
            before,
            done: before,
            of,
            line: (!terminal).then_some(now),
        }
    }

    pub fn add(&mut self, failed: bool) {
        self.done += 1;
        self.failed += usize::from(failed);
        let message = message(
            self.began.elapsed(),
            self.done - self.before,
            self.of.checked_sub(self.done),
            self.failed,
        );
        self.bar.set_message(message.clone());
        let of = self.of.max(self.done);
        self.bar.set_length(of as u64);
        self.bar.set_position(self.done as u64);
        if let Some(line) = &mut self.line
            && line.elapsed() >= LINE_INTERVAL
        {
            *line = Instant::now();
            stderr_line!("{}/{of} runs  {message}", self.done);
        }
    }

    pub fn print_line(&self, line: &str) {
        self.bar.suspend(|| stderr_line!("{line}"));
    }

    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Formats the rate and the remaining time, from the runs that were done in `elapsed`. `left` is `None` if there are more runs
/// than estimated, because the result of a run decides on the next one.
fn message(elapsed: Duration, done: usize, left: Option<usize>, failed: usize) -> String {
    let per_s = done as f64 / elapsed.as_secs_f64().max(1e-3);
    let mut text = format!("{per_s:.1}/s, ");
    match left {
        Some(left) => {
            let left = Duration::from_secs_f64((left as f64 / per_s).min(1e9));
            text += &format!("{} left", HumanDuration(left));
        }
        None => text += "more than estimated",
    }
    if failed > 0 {
        text += &format!(", {failed} failed");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_remaining_time_count_only_runs_of_this_process() {
        let message = |done, left, failed| message(Duration::from_secs(10), done, left, failed);
        assert_eq!(message(25, Some(50), 0), "2.5/s, 20 seconds left");
        assert_eq!(message(5, Some(50), 2), "0.5/s, 2 minutes left, 2 failed");
        assert_eq!(message(25, None, 0), "2.5/s, more than estimated");
    }

    #[test]
    fn lines_estimate_the_whole_and_the_remaining_time() {
        let (second, minute) = (Duration::from_secs(1), Duration::from_secs(60));
        let first = announcement("running it again", second, 300, 12_000);
        assert_eq!(first, "running it again (about 40 s)");
        let slow_start = announcement("running it again", second, 1, 12_000);
        assert_eq!(slow_start, "running it again");
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

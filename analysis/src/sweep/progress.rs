//! The progress of a sweep: a bar with rate and remaining time, or periodic lines if stderr is not a terminal.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use terminal::stderr_line;
use tokio::time::Instant;

/// The shortest interval between two lines if stderr is not a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// The redraw interval of the bar, which updates the remaining time.
const TICK: Duration = Duration::from_millis(500);

pub struct Progress {
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

impl Progress {
    /// Creates the display for `of` runs, of which `before` are done.
    pub fn new(before: usize, of: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(of as u64), ProgressDrawTarget::stderr());
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        if terminal {
            let template = "{bar:30} {pos}/{len} runs  {msg}";
            let style = ProgressStyle::with_template(template);
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
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
            // The total is an estimate if the result of a run decides on the next one.
            self.of.saturating_sub(self.done),
            self.failed,
        );
        self.bar.set_message(message.clone());
        self.bar.set_position(self.done as u64);
        if let Some(line) = &mut self.line
            && line.elapsed() >= LINE_INTERVAL
        {
            *line = Instant::now();
            stderr_line!("{}/{} runs  {message}", self.done, self.of);
        }
    }

    pub fn print_line(&self, line: &str) {
        self.bar.suspend(|| stderr_line!("{line}"));
    }

    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Formats the rate and the remaining time, from the runs that were done in `elapsed`.
fn message(elapsed: Duration, done: usize, left: usize, failed: usize) -> String {
    let per_s = done as f64 / elapsed.as_secs_f64().max(1e-3);
    let left = Duration::from_secs_f64((left as f64 / per_s).min(1e9));
    let mut text = format!("{per_s:.1}/s, {} left", HumanDuration(left));
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
        assert_eq!(message(25, 50, 0), "2.5/s, 20 seconds left");
        assert_eq!(message(5, 50, 2), "0.5/s, 2 minutes left, 2 failed");
    }
}

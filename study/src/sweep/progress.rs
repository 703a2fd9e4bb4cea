//! How far a sweep is: a bar with rate and time left; where stderr is no terminal, a line every few seconds.

use std::io::IsTerminal;
use std::time::Duration;

use alliance_proto::tell;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use tokio::time::Instant;

/// Least time between two lines where stderr is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// How often the bar is drawn anew, for the time left.
const TICK: Duration = Duration::from_millis(500);

/// Counts runs.
pub struct Progress {
    bar: ProgressBar,
    failed: usize,
    began: Instant,
    /// Runs that were done before.
    before: usize,
    done: usize,
    of: usize,
    /// When the latest line was written, where there are lines.
    line: Option<Instant>,
}

impl Progress {
    /// So many runs, some of which are done.
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

    /// One more is done.
    pub fn add(&mut self, failed: bool) {
        self.done += 1;
        self.failed += usize::from(failed);
        let message = message(
            self.began.elapsed(),
            self.done - self.before,
            // How many there will be is an estimate where one run decides on the next.
            self.of.saturating_sub(self.done),
            self.failed,
        );
        self.bar.set_message(message.clone());
        self.bar.set_position(self.done as u64);
        if let Some(line) = &mut self.line
            && line.elapsed() >= LINE_INTERVAL
        {
            *line = Instant::now();
            tell!("{}/{} runs  {message}", self.done, self.of);
        }
    }

    /// Prints a line above the bar.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| tell!("{line}"));
    }

    /// Takes the bar off the terminal.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Rate and time left, from what was done in that time.
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
    fn rate_and_time_left_are_those_of_this_process() {
        let message = |done, left, failed| message(Duration::from_secs(10), done, left, failed);
        assert_eq!(message(25, 50, 0), "2.5/s, 20 seconds left");
        assert_eq!(message(5, 50, 2), "0.5/s, 2 minutes left, 2 failed");
    }
}

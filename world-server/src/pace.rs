//! The speed of simulated time relative to the wall clock. It does not change the result of a run.

use std::fmt;
use std::ops::Add;
use std::str::FromStr;
use std::time::Duration;

use proto::control::{ClockCommand, ClockStatus};
use scenario::Problem;
use scenario::ids::Tick;

/// The largest lateness that a run makes up for. Other programs delay single ticks, and a tick in which all robots of a
/// large team send a heartbeat takes longer than the others.
pub const LATENESS_MAX: Duration = Duration::from_secs(1);

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Speed {
    /// No limit: the next tick begins as soon as the last one is complete.
    #[default]
    Max,
    /// Simulated seconds per wall-clock second, 0.001 to 1,000,000.
    Factor(f64),
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong =
            || format!("'{text}' is not a speed; use 'max', or a factor such as '5x' or '0.5x'");
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor: f64 = text
            .strip_suffix('x')
            .unwrap_or(text)
            .parse()
            .map_err(|_| wrong())?;
        Self::factor(factor).ok_or_else(wrong)
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Max => f.write_str("max"),
            Self::Factor(factor) => write!(f, "{factor}x"),
        }
    }
}

impl Speed {
    /// Returns the speed of a multiple of real time, or `None` if it is out of range.
    #[must_use]
    pub fn factor(factor: f64) -> Option<Self> {
        (0.001..=1e6)
            .contains(&factor)
            .then_some(Self::Factor(factor))
    }
}

/// The schedule of ticks. `T` is a time of the wall clock, such as an instant or the time since some start.
#[derive(Clone, Copy, Debug)]
pub struct Pace<T> {
    speed: Speed,
    step: Duration,
    due: T,
    paused: bool,
    /// Number of ticks that may begin despite the pause.
    steps_left: u64,
}

impl<T: Add<Duration, Output = T> + Copy + Ord> Pace<T> {
    /// Creates a schedule whose first tick is due at once.
    #[must_use]
    pub fn new(speed: Speed, step_ms: u64, now: T) -> Self {
        Self {
            speed,
            step: Duration::from_millis(step_ms),
            due: now,
            paused: false,
            steps_left: 0,
        }
    }

    /// Registers the begin of a tick and schedules the next one. A run that is later than [`LATENESS_MAX`] does not
    /// try to catch up.
    pub fn tick_begun(&mut self, now: T) {
        self.steps_left = self.steps_left.saturating_sub(1);
        if let Some(interval) = self.interval() {
            let due = self.due + interval;
            self.due = if due + LATENESS_MAX < now { now } else { due };
        }
    }

    #[must_use]
    pub fn is_due(&self, now: T) -> bool {
        self.may_begin() && (self.interval().is_none() || self.due <= now)
    }

    /// Returns the time at which the next tick may begin; `None` at full speed and during a pause.
    #[must_use]
    pub fn due(&self) -> Option<T> {
        self.interval()
            .filter(|_| self.may_begin())
            .map(|_| self.due)
    }

    /// Pauses the clock: no further tick begins.
    pub fn pause(&mut self) {
        self.paused = true;
        self.steps_left = 0;
    }

    pub fn resume(&mut self, now: T) {
        self.paused = false;
        self.steps_left = 0;
        self.due = self.due.max(now);
    }

    /// Allows a number of further ticks, followed by a pause.
    pub fn step(&mut self, ticks: u64, now: T) {
        self.paused = true;
        self.steps_left = self.steps_left.saturating_add(ticks);
        self.due = self.due.max(now);
    }

    pub fn set_speed(&mut self, speed: Speed, now: T) {
        self.speed = speed;
        self.due = now;
    }

    /// Executes an operator's command.
    ///
    /// # Errors
    /// If the number of steps or the speed is out of range.
    pub fn execute(&mut self, command: ClockCommand, now: T) -> Result<(), Problem> {
        match command {
            ClockCommand::Pause => self.pause(),
            ClockCommand::Resume => self.resume(now),
            ClockCommand::Step(0) => {
                return Err(Problem::at(["step"], "0 is no step", "use at least 1"));
            }
            ClockCommand::Step(ticks) => self.step(ticks, now),
            ClockCommand::Speed(factor) => {
                let speed = match factor {
                    None => Speed::Max,
                    Some(factor) => Speed::factor(factor).ok_or_else(|| {
                        let what = format!("{factor} is out of range");
                        Problem::at(["speed"], what, "use 0.001 to 1000000, or max")
                    })?,
                };
                self.set_speed(speed, now);
            }
        }
        Ok(())
    }

    /// Returns the state of the clock for operators, without a cause of waiting.
    #[must_use]
    pub fn status(&self, tick: Tick) -> ClockStatus {
        ClockStatus {
            paused: self.paused,
            speed: match self.speed {
                Speed::Max => None,
                Speed::Factor(factor) => Some(factor),
            },
            steps_left: self.steps_left,
            tick,
            waits_for: None,
        }
    }

    fn may_begin(&self) -> bool {
        !self.paused || self.steps_left > 0
    }

    /// Returns the wall-clock time of one tick; `None` at full speed.
    fn interval(&self) -> Option<Duration> {
        match self.speed {
            Speed::Max => None,
            Speed::Factor(factor) => Some(self.step.div_f64(factor)),
        }
    }
}

#[cfg(test)]
// The start is any moment; no test waits.
#[allow(clippy::disallowed_methods)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn speeds_are_parsed() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("5x".parse(), Ok(Speed::Factor(5.0)));
        assert_eq!("0.5".parse(), Ok(Speed::Factor(0.5)));
        for wrong in ["", "x", "0x", "-1x", "NaN", "inf", "fast"] {
            assert!(wrong.parse::<Speed>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn ticks_are_due_an_interval_apart_and_a_very_late_one_shifts_the_rest() {
        let start = Instant::now();
        let mut pace = Pace::new(Speed::Factor(5.0), 50, start);
        assert!(pace.is_due(start));
        pace.tick_begun(start);
        assert_eq!(pace.due(), Some(start + Duration::from_millis(10)));
        assert!(!pace.is_due(start + Duration::from_millis(9)));
        let late = start + LATENESS_MAX;
        pace.tick_begun(late);
        assert_eq!(pace.due(), Some(start + Duration::from_millis(20)));
        assert!(pace.is_due(late));
        let later = start + LATENESS_MAX + Duration::from_millis(31);
        pace.tick_begun(later);
        assert_eq!(pace.due(), Some(later));
    }

    #[test]
    fn a_paused_clock_begins_only_the_requested_steps() {
        let start = Instant::now();
        let mut pace = Pace::new(Speed::Max, 50, start);
        pace.pause();
        assert!(!pace.is_due(start) && pace.due().is_none());
        pace.step(2, start);
        assert!(pace.is_due(start));
        pace.tick_begun(start);
        assert_eq!(pace.steps_left, 1);
        pace.tick_begun(start);
        assert!(!pace.is_due(start) && pace.paused);
        pace.resume(start);
        assert!(pace.is_due(start));
        pace.set_speed(Speed::Factor(1.0), start);
        pace.tick_begun(start);
        assert_eq!(pace.due(), Some(start + Duration::from_millis(50)));
    }
}

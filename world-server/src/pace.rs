//! How fast simulated time runs against the wall clock. It changes no byte of the run.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use tokio::time::Instant;

/// Wanted speed: as fast as possible, or a factor of real time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Speed {
    /// No pace at all.
    #[default]
    Max,
    /// Simulated seconds per second, above 0.
    Factor(f64),
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong =
            || format!("'{text}' is no speed: use 'max', or a factor such as '5x' or '0.5x'");
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor: f64 = text
            .strip_suffix('x')
            .unwrap_or(text)
            .parse()
            .map_err(|_| wrong())?;
        if (0.001..=1e6).contains(&factor) {
            Ok(Self::Factor(factor))
        } else {
            Err(wrong())
        }
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

/// Says when the next tick may begin.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Wall-clock time of a tick; `None` at full speed.
    interval: Option<Duration>,
    due: Instant,
}

impl Pace {
    /// The first tick may begin at once.
    #[must_use]
    pub fn new(speed: Speed, step_ms: u64, now: Instant) -> Self {
        let interval = match speed {
            Speed::Max => None,
            Speed::Factor(factor) => {
                Some(Duration::from_secs_f64(step_ms as f64 / 1000.0 / factor))
            }
        };
        Self { interval, due: now }
    }

    /// A tick has begun: the next one is due an interval later. A run that cannot keep up does not race to make up for it.
    pub fn begun(&mut self, now: Instant) {
        if let Some(interval) = self.interval {
            self.due = (self.due + interval).max(now);
        }
    }

    /// Whether the next tick may begin.
    #[must_use]
    pub fn is_due(&self, now: Instant) -> bool {
        self.interval.is_none() || self.due <= now
    }

    /// When the next tick may begin; `None` at full speed.
    #[must_use]
    pub fn due(&self) -> Option<Instant> {
        self.interval.map(|_| self.due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_read_as_people_write_them() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("5x".parse(), Ok(Speed::Factor(5.0)));
        assert_eq!("0.5".parse(), Ok(Speed::Factor(0.5)));
        for wrong in ["", "x", "0x", "-1x", "NaN", "inf", "fast"] {
            assert!(wrong.parse::<Speed>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn ticks_are_due_an_interval_apart_and_a_late_one_shifts_the_rest() {
        let start = Instant::now();
        let mut pace = Pace::new(Speed::Factor(5.0), 50, start);
        assert!(pace.is_due(start));
        pace.begun(start);
        assert_eq!(pace.due(), Some(start + Duration::from_millis(10)));
        assert!(!pace.is_due(start + Duration::from_millis(9)));
        let late = start + Duration::from_millis(100);
        pace.begun(late);
        assert_eq!(pace.due(), Some(late));
    }
}

//! Simulated time in whole milliseconds. Sums of step lengths stay exact for a mission of any length.

use std::fmt;
use std::ops::{Add, Sub};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Problem;

/// The simulated time since the mission's start, or a span of it, in milliseconds.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    JsonSchema,
)]
#[serde(transparent)]
pub struct SimTime(pub u64);

impl SimTime {
    /// The start of the mission.
    pub const ZERO: Self = Self(0);

    /// Returns the time in seconds, for formulas and for display.
    #[inline]
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1000.0
    }

    /// Creates a span from seconds, rounded to milliseconds. Negative numbers and NaN give 0.
    #[inline]
    #[must_use]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1000.0).round() as u64)
    }

    /// Returns the span from `earlier` to this time, or 0 if `earlier` is later.
    #[inline]
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self(self.0.saturating_sub(earlier.0))
    }
}

impl Add for SimTime {
    type Output = Self;
    #[inline]
    fn add(self, span: Self) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl Sub for SimTime {
    type Output = Self;
    #[inline]
    fn sub(self, span: Self) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl fmt::Display for SimTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.as_secs_f64())
    }
}

/// Parses a span such as `60s`, `60`, `1.5s`, `500ms` or `2min` and returns it in seconds.
pub fn seconds(text: &str) -> Result<f64, Problem> {
    let units = [("ms", 0.001), ("min", 60.0), ("s", 1.0), ("", 1.0)];
    let spans = units.iter().filter_map(|(unit, unit_s)| {
        let number: f64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
        Some(number * unit_s)
    });
    let mut fitting = spans.filter(|span_s| span_s.is_finite() && !span_s.is_sign_negative());
    let remedy = "use a time such as 60s, 1.5s, 500ms or 2min";
    let wrong = || Problem::of_value(remedy, "");
    fitting.next().ok_or_else(wrong)
}

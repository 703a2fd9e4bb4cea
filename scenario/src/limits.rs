//! Ranges of numbers and rules for names, for checks of every input.

use std::collections::BTreeMap;
use std::fmt;

use super::error::{Problem, name_remedy};
use super::path::KeyPath;
use crate::names::is_name;

/// A range of numbers with their unit. It displays as `above 0 and at most 1000 m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    /// The least number of the range.
    pub from: f64,
    /// The greatest number; [`f64::MAX`] for any finite number.
    pub to: f64,
    /// True if the range excludes `from` itself.
    is_open: bool,
    /// True if the range contains only whole numbers.
    pub is_whole: bool,
    pub unit: &'static str,
}

/// Returns the range from `from` to `to`, both included.
#[must_use]
pub const fn closed(from: f64, to: f64, unit: &'static str) -> NumberRange {
    NumberRange {
        from,
        to,
        is_open: false,
        is_whole: false,
        unit,
    }
}

/// Returns the range above 0 and up to `to`.
#[must_use]
pub const fn above_zero(to: f64, unit: &'static str) -> NumberRange {
    above(0.0, to, unit)
}

/// Returns the range above `from` and up to `to`.
#[must_use]
pub const fn above(from: f64, to: f64, unit: &'static str) -> NumberRange {
    NumberRange {
        is_open: true,
        ..closed(from, to, unit)
    }
}

/// Returns the finite numbers above 0.
#[must_use]
pub const fn positive(unit: &'static str) -> NumberRange {
    above_zero(f64::MAX, unit)
}

/// Returns the whole numbers from `from` to `to`, both included.
#[must_use]
pub const fn whole(from: i64, to: i64, unit: &'static str) -> NumberRange {
    NumberRange {
        is_whole: true,
        ..closed(from as f64, to as f64, unit)
    }
}

/// The maximum number of robots with bursts of losses. Each of the squared number of links needs 320 bytes.
pub const MAX_BURST_ROBOTS: usize = 2_000;

/// The longest time, s.
pub const LONGEST_S: f64 = 1e9;
/// The greatest length of bodies, ranges and objects, m.
pub const LONGEST_M: f64 = 1e3;
/// The greatest extent of a room in missions whose robots keep maps or tracks, m. A million robots need 7 km.
pub const WIDEST_M: f64 = 8e3;
/// The greatest extent of a room, and the greatest coordinate, m. The resolution of coordinates is 8 mm there.
pub const FARTHEST_M: f64 = 1e5;

/// The range of lengths, m.
pub const LENGTH: NumberRange = above_zero(LONGEST_M, "m");
/// The range of fractions of a whole.
pub const FRACTION: NumberRange = closed(0.0, 1.0, "");
/// The range of penetrabilities of components.
pub const PENETRABILITY: NumberRange = closed(0.0, 100.0, "");
/// The range of times, s.
pub const TIME: NumberRange = above_zero(LONGEST_S, "s");
/// The range of times that may be 0, s.
pub const TIME_OR_ZERO: NumberRange = closed(0.0, LONGEST_S, "s");
/// The range of speeds, m/s.
pub const SPEED: NumberRange = above_zero(1e3, "m/s");
/// The range of turn rates, degrees per second.
pub const TURN_RATE: NumberRange = above_zero(3600.0, "deg/s");
/// The range of power, W.
pub const POWER: NumberRange = closed(0.0, 1e9, "W");

/// The range of loads and capacities, in the unit of the scenario.
pub const DEMAND: NumberRange = closed(0.0, 1e9, "");

/// The numbers from here on are shown as powers of ten. Not every whole number exists there, so all digits would differ
/// from those that were written.
const POWERS_FROM: f64 = 1e16;

/// Formats a number. A fraction of single precision, such as the size of a room, is shown as it was written.
#[must_use]
pub fn readable(number: f64) -> String {
    let single = number as f32;
    let is_single = f64::from(single) == number;
    match (number.abs() >= POWERS_FROM, is_single) {
        (true, true) => format!("{single:e}"),
        (true, false) => format!("{number:e}"),
        (false, true) if number.fract() != 0.0 => single.to_string(),
        (false, _) => number.to_string(),
    }
}

impl fmt::Display for NumberRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, to) = (readable(self.from), readable(self.to));
        match self {
            Self { to: f64::MAX, .. } => write!(f, "finite and above {from}")?,
            Self { is_whole: true, .. } => write!(f, "a whole number from {from} to {to}")?,
            Self { is_open: true, .. } => write!(f, "above {from} and at most {to}")?,
            _ => write!(f, "at least {from} and at most {to}")?,
        }
        if !self.unit.is_empty() {
            write!(f, " {}", self.unit)?;
        }
        Ok(())
    }
}

impl NumberRange {
    /// Rejects a number under a key outside the range, and NaN.
    pub fn check(&self, key: impl Into<KeyPath>, number: impl Into<f64>) -> Result<(), Problem> {
        let number = number.into();
        let above = if self.is_open {
            number > self.from
        } else {
            number >= self.from
        };
        if self.is_whole && number.is_finite() && number.fract() != 0.0 {
            let what = format!("{} is not a whole number", readable(number));
            let remedy = format!("write one from {} to {}", self.from, self.to);
            return Err(Problem::at(key, what, remedy));
        }
        if above && number <= self.to {
            return Ok(());
        }
        let what = format!("{} is out of range", readable(number));
        Err(Problem::at(key, what, format!("it must be {self}")))
    }
}

/// Rejects a text that is not a name.
pub fn check_name(key: impl Into<KeyPath>, name: &str) -> Result<(), Problem> {
    if is_name(name) {
        return Ok(());
    }
    let remedy = "use at most 32 letters, digits, '-' and '_', with a letter or a digit first";
    Err(Problem::at(key, format!("'{name}' is not a name"), remedy))
}

/// Reads a name from the command line.
pub fn read_name(text: &str) -> Result<String, Problem> {
    check_name((), text).map(|()| text.to_owned())
}

/// Rejects a name that is not among the known ones. `what` precedes the name in the message, as in "there is no task".
pub fn check_known<'a>(
    key: impl Into<KeyPath>,
    what: &str,
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Result<(), Problem> {
    let known: Vec<&str> = known.into_iter().collect();
    if known.contains(&name) {
        return Ok(());
    }
    Err(Problem::at(
        key,
        format!("{what} '{name}'"),
        name_remedy(name, known),
    ))
}

/// Checks the length of a list. Each name must be valid and occur once.
pub fn check_names<'a>(
    list: &KeyPath,
    names: impl ExactSizeIterator<Item = &'a str>,
    most: usize,
) -> Result<(), Problem> {
    if !(1..=most).contains(&names.len()) {
        let what = format!("{} entries", names.len());
        return Err(Problem::at(list, what, format!("give 1 to {most}")));
    }
    let mut first = BTreeMap::new();
    for (index, each) in names.enumerate() {
        let path = list.index(index).key("name");
        check_name(&path, each)?;
        if let Some(first) = first.insert(each, index) {
            let what = format!("'{each}' is already the name of {list}[{first}]");
            return Err(Problem::at(path, what, "give each its own name"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_shown_as_they_were_written() {
        let width_m = f64::from(3.2_f32);
        let refused = closed(0.0, width_m, "m").check(["x_m"], 4.1_f32);
        let message = refused.unwrap_err().to_string();
        let expected = "x_m: 4.1 is out of range; it must be at least 0 and at most 3.2 m";
        assert_eq!(message, expected);
        let refused = TIME_OR_ZERO.check(["limit_s"], 1e18);
        let message = refused.unwrap_err().to_string();
        let expected =
            "limit_s: 1e18 is out of range; it must be at least 0 and at most 1000000000 s";
        assert_eq!(message, expected);
        for (number, shown) in [
            (0.1, "0.1"),
            (4_294_967_296.0, "4294967296"),
            (1e-9, "0.000000001"),
            (999_999_999_999_999_999.0, "1e18"),
            (f64::from(1e20_f32), "1e20"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(readable(number), shown);
        }
    }
}

//! Ranges of numbers and rules for names, for checks of scenarios.

use std::collections::BTreeMap;
use std::fmt::Display;

use super::error::Problem;
use super::path::KeyPath;
use crate::names::is_name;

/// The range of numbers that a key accepts.
pub struct NumberRange {
    from: f64,
    /// True if the range excludes `from` itself.
    open: bool,
    to: f64,
    unit: &'static str,
}

/// Returns the range above 0 and up to `to`.
#[must_use]
pub const fn above_zero(to: f64, unit: &'static str) -> NumberRange {
    NumberRange {
        from: 0.0,
        open: true,
        to,
        unit,
    }
}

/// Returns the range from `from` to `to`, both included.
#[must_use]
pub const fn closed(from: f64, to: f64, unit: &'static str) -> NumberRange {
    NumberRange {
        from,
        open: false,
        to,
        unit,
    }
}

/// The range of lengths, m.
pub const LENGTH: NumberRange = above_zero(1e3, "m");
/// The range of fractions of a whole.
pub const FRACTION: NumberRange = closed(0.0, 1.0, "");
/// The range of penetrabilities of components.
pub const PENETRABILITY: NumberRange = closed(0.0, 100.0, "");
/// The range of times, s.
pub const TIME: NumberRange = above_zero(1e9, "s");
/// The range of speeds, m/s.
pub const SPEED: NumberRange = above_zero(1e3, "m/s");
/// The range of turn rates, degrees per second.
pub const TURN_RATE: NumberRange = above_zero(3600.0, "deg/s");
/// The range of power, W.
pub const POWER: NumberRange = closed(0.0, 1e9, "W");

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

impl NumberRange {
    /// Rejects a number at `path` outside the range, and NaN.
    pub fn check<T: Copy + Display + Into<f64>>(
        &self,
        path: KeyPath,
        number: T,
    ) -> Result<(), Problem> {
        let value: f64 = number.into();
        let high_enough = if self.open {
            value > self.from
        } else {
            value >= self.from
        };
        if high_enough && value <= self.to {
            return Ok(());
        }
        let low = if self.open { "above" } else { "at least" };
        let (from, to) = (readable(self.from), readable(self.to));
        let remedy = format!("it must be {low} {from} and at most {to} {}", self.unit);
        let shown = if value.abs() >= POWERS_FROM {
            readable(value)
        } else {
            number.to_string()
        };
        let what = format!("{shown} is out of range");
        Err(Problem::at(path, what, remedy.trim_end()))
    }
}

/// Rejects a text that is not a name.
pub fn check_name(path: KeyPath, name: &str) -> Result<(), Problem> {
    if is_name(name) {
        return Ok(());
    }
    let remedy =
        "use at most 32 letters, digits, '-' and '_', with a letter or a digit first".to_owned();
    Err(Problem::at(path, format!("'{name}' is not a name"), remedy))
}

/// Checks the length of a list. Each name must be valid and occur once.
pub fn check_names<'a>(
    list: &KeyPath,
    names: impl ExactSizeIterator<Item = &'a str>,
    most: usize,
) -> Result<(), Problem> {
    if !(1..=most).contains(&names.len()) {
        let what = format!("{} entries", names.len());
        return Err(Problem::at(list.clone(), what, format!("give 1 to {most}")));
    }
    let mut first = BTreeMap::new();
    for (index, each) in names.enumerate() {
        let path = list.index(index).key("name");
        check_name(path.clone(), each)?;
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
        let refused = closed(0.0, width_m, "m").check(KeyPath::new(["x_m"]), 4.1_f32);
        let message = refused.unwrap_err().to_string();
        let expected = "x_m: 4.1 is out of range; it must be at least 0 and at most 3.2 m";
        assert_eq!(message, expected);
        let refused = closed(0.0, 1e9, "s").check(KeyPath::new(["limit_s"]), 1e18);
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

//! Modes of failure in text form, such as `noise 0.5` or `one-wheel left`, and in files.

use toml::{Table, Value};

use super::checker::Checked;
use super::spec::{Mode, ModeForm, ModeSize};
use crate::Problem;
use crate::limits::readable;

impl ModeForm {
    /// Returns the mode with this name.
    fn named(&self, name: &str) -> Option<&Mode> {
        self.modes.iter().find(|mode| mode.name == name)
    }

    /// Returns the form in files of a mode with its size.
    ///
    /// # Errors
    /// If the size does not fit the mode.
    pub fn parse(
        &self,
        name: &str,
        size: Option<&str>,
        deg: Option<f64>,
    ) -> Result<Value, Problem> {
        let problem = |what: String, remedy: String| Problem::of_value(what, remedy);
        let Some(mode) = self.named(name) else {
            let names: Vec<&str> = self.modes.iter().map(|mode| mode.name).collect();
            let remedy = format!("there are {}", names.join(", "));
            return Err(problem(format!("'{name}' is not a mode"), remedy));
        };
        if deg.is_some() && !mode.takes_deg() {
            let others = self.modes.iter().filter(|mode| mode.takes_deg());
            let others: Vec<&str> = others.map(|mode| mode.name).collect();
            let remedy = format!("use it with {}", others.join(" or "));
            return Err(problem(format!("'{name}' takes no --deg"), remedy));
        }
        let unfit = || {
            let given = size.map_or_else(String::new, |size| format!(", not '{size}'"));
            problem(
                format!("'{name}' needs {}{given}", mode.needs),
                String::new(),
            )
        };
        let number = || {
            let number = size.and_then(|size| size.parse().ok());
            number.map(Value::Float).ok_or_else(unfit)
        };
        let content = match (mode.size, size) {
            (ModeSize::None, None) => return Ok(name.into()),
            (ModeSize::None, Some(size)) => {
                let remedy = format!("leave '{size}' out");
                return Err(problem(format!("'{name}' takes no size"), remedy));
            }
            (ModeSize::Number(_), _) => number()?,
            (ModeSize::Error { .. }, _) => {
                let deg = Value::Float(deg.unwrap_or_default());
                Table::from_iter([("m".to_owned(), number()?), ("deg".to_owned(), deg)]).into()
            }
            (ModeSize::Word(words), size) => {
                let word = size.filter(|size| words.contains(size));
                word.ok_or_else(unfit)?.into()
            }
        };
        Ok(Table::from_iter([(name.to_owned(), content)]).into())
    }

    /// Checks the size of a mode in the form of files.
    pub(super) fn check(&self, at: [&str; 3], mode: &Value) -> Checked {
        let Some((name, content)) = mode.as_table().and_then(|table| table.iter().next()) else {
            return Ok(());
        };
        let part = |key: &str| content.get(key).and_then(Value::as_float);
        let numbers = match self.named(name).map(|mode| mode.size) {
            Some(ModeSize::Number(range)) => [Some(range).zip(content.as_float()), None],
            Some(ModeSize::Error { m, deg }) => {
                [Some(m).zip(part("m")), Some(deg).zip(part("deg"))]
            }
            _ => [None, None],
        };
        let mut numbers = numbers.into_iter().flatten();
        numbers.try_for_each(|(range, number)| range.check(at, number))
    }
}

impl Mode {
    /// Returns true if the option `--deg` adds the error of a heading.
    fn takes_deg(&self) -> bool {
        matches!(self.size, ModeSize::Error { .. })
    }
}

/// Returns the text form of a mode in the form of files.
pub(super) fn format(mode: &Value) -> String {
    let words = |value: &Value| match value {
        Value::Float(number) => readable(*number),
        value => value.as_str().unwrap_or_default().to_owned(),
    };
    let Some((name, content)) = mode.as_table().and_then(|table| table.iter().next()) else {
        return words(mode);
    };
    let part = |key: &str| content.get(key).and_then(Value::as_float);
    match (part("m"), part("deg")) {
        (None, _) => format!("{name} {}", words(content)),
        (Some(m), None | Some(0.0)) => format!("{name} {}", readable(m)),
        (Some(m), Some(deg)) => format!("{name} {} --deg {}", readable(m), readable(deg)),
    }
}

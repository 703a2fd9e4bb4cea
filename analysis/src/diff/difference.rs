//! The result of a comparison.

use std::fmt;
use std::process::ExitCode;

use run_log::WORLD_ROBOT;
use scenario::ids::Tick;
use scenario::shortened;
use scenario::time::SimTime;
use serde::Serialize;
use terminal::{in_one_line, stderr_line};

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "result")]
pub enum Comparison {
    /// The two logs agree in every tick.
    Identical {
        ticks: u64,
        /// Hash of the run, 16 hexadecimal digits.
        hash: String,
    },
    Differs(Difference),
}

/// The first difference between two runs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The cause in words, such as another seed; `None` if setup and inputs are equal.
    pub cause: Option<String>,
    /// The first tick that differs; `None` if the logs do not show it.
    pub tick: Option<Tick>,
    pub t_ms: Option<SimTime>,
    /// The robot whose part of the tick differs, or "world".
    pub robot: String,
    /// The section of the tick, as in ticks.csv.
    pub section: String,
    /// The field as TABLE: COLUMN, if the log contains it.
    pub field: Option<String>,
    /// The value in the first run.
    pub a: String,
    /// The value in the second run.
    pub b: String,
}

impl Difference {
    /// Creates a difference that belongs to no tick.
    #[must_use]
    pub fn at_end(section: &str, field: Option<String>, a: String, b: String) -> Self {
        Self {
            robot: WORLD_ROBOT.to_owned(),
            section: section.to_owned(),
            field,
            a,
            b,
            ..Self::default()
        }
    }
}

impl Comparison {
    /// Writes the result to stderr as text, or to stdout as JSON, and returns the exit status.
    #[must_use]
    pub fn show(&self, json: bool) -> ExitCode {
        let status = match self {
            Self::Identical { .. } => ExitCode::SUCCESS,
            Self::Differs(_) => ExitCode::from(1),
        };
        if json {
            // Plain data with string keys: serialization cannot fail.
            let text = serde_json::to_string(self).unwrap_or_default();
            return terminal::print_result("alliance", format_args!("{text}\n"), status);
        }
        stderr_line!("{self}");
        status
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identical { ticks, hash } => write!(f, "identical: {ticks} ticks, hash {hash}"),
            Self::Differs(first) => {
                // The texts of a log from elsewhere can contain line feeds and have any length.
                let text = |text: &str| in_one_line(&shortened(text)).into_owned();
                let [robot, section, a, b] =
                    [&first.robot, &first.section, &first.a, &first.b].map(|value| text(value));
                if let Some(cause) = &first.cause {
                    writeln!(f, "{}", text(cause))?;
                }
                f.write_str("differs")?;
                if let (Some(tick), Some(t_ms)) = (first.tick, first.t_ms) {
                    write!(f, " first in tick {tick} ({t_ms})")?;
                }
                write!(f, ": {robot} {section}")?;
                if let Some(field) = &first.field {
                    write!(f, ", {}", text(field))?;
                }
                write!(f, ": '{a}' and '{b}'")
            }
        }
    }
}

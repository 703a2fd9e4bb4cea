//! Parameter files: the thesis' properties file of ALLIANCE parameters (Fig. 3.4).
//!
//! ```text
//! threshold = <value>
//! broadcastRate.<mb> = <value>                          1/s
//! timeAllowedTillCeased.<mb> = <value>                  s
//! timeWillingToAffect.<teammate>.<mb> = <value>         s
//! slowImpatience.<teammate>.<mb> = <value>              motivation/s
//! fastImpatience.<mb> = <value>                         motivation/s
//! timeBeforeYielding.<mb> = <value>                     s
//! timeBeforeGivingUp.<mb> = <value>                     s
//! ```
//! `<mb>`, a motivational behavior, is `SET` for all robots or `ROBOT.SET` for one, which beats the former wherever it
//! stands in the file. Names hold no dots, so that the number of parts tells the two apart. A parameter that the file does
//! not mention keeps the scenario's value.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;

use java_properties::{LineContent, PropertiesIter};

use super::error::{Place, Problem, ScenarioError, instead};
use super::statement::{Parameter, Statement, positive};
use crate::keys::is_name;

/// A parameter file, read and free of mistakes that show without a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterFile {
    threshold: Option<f64>,
    /// Weakest first.
    statements: Vec<Statement>,
}

/// A key of a parameter file that has no use in a scenario, as it lacks the robot, teammate or set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkippedKey {
    /// Line of the file, from 1.
    pub line: usize,
    /// The key.
    pub key: String,
}

impl fmt::Display for SkippedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (line {})", self.key, self.line)
    }
}

impl SkippedKey {
    /// The key at that place, if it is in a parameter file.
    pub(super) fn of(place: &Place) -> Option<Self> {
        match place {
            Place::Scenario(_) => None,
            Place::Parameters { line, key, .. } => Some(Self {
                line: *line,
                key: key.clone(),
            }),
        }
    }
}

impl ParameterFile {
    /// Reads a parameter file; `file_name` is for error messages. The encoding is that of Java's properties files.
    ///
    /// # Errors
    /// The first line that is not of the shape above, repeats a key, or holds a value that is not a number above 0.
    pub fn parse(file_name: &str, bytes: &[u8]) -> Result<Self, ScenarioError> {
        Self::read(file_name, bytes).map_err(|problem| problem.located(None))
    }

    /// θ, if the file states it.
    pub(super) fn threshold(&self) -> Option<f64> {
        self.threshold
    }

    /// The statements about behavior sets, weakest first.
    pub(super) fn statements(&self) -> impl Iterator<Item = Statement> + '_ {
        self.statements.iter().cloned()
    }

    fn read(file_name: &str, bytes: &[u8]) -> Result<Self, Problem> {
        let mut threshold = None;
        let mut statements = Vec::new();
        let mut first_lines = BTreeMap::new();
        let place = |line, key: &str| Place::Parameters {
            file: file_name.to_owned(),
            line,
            key: key.to_owned(),
        };
        // The reader takes what begins so for UTF-16, and panics where that is cut or torn.
        if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
            return Err(Problem {
                place: place(1, ""),
                what: "the file is UTF-16".to_owned(),
                remedy: "save it as ISO 8859-1 or UTF-8".to_owned(),
            });
        }
        // Without a line end after it the reader forgets a last line that ends in a backslash.
        for line in PropertiesIter::new(bytes.chain(&b"\n"[..])) {
            // A slice is always read to its end, so that the only thing that can be wrong is an escape.
            let line = line.map_err(|error| Problem {
                place: place(error.line_number().unwrap_or(1), ""),
                what: "malformed \\u escape".to_owned(),
                remedy: "write four hexadecimal digits after \\u".to_owned(),
            })?;
            let LineContent::KVPair(key, value) = line.content() else {
                continue;
            };
            let place = place(line.line_number(), key);
            let problem = |what: String, remedy: String| Problem {
                place: place.clone(),
                what,
                remedy,
            };
            if let Some(first) = first_lines.insert(key.clone(), line.line_number()) {
                let what = format!("the key is already on line {first}");
                return Err(problem(what, "state it once".to_owned()));
            }
            let about = about(key).map_err(|(what, remedy)| problem(what, remedy))?;
            let unit = about.as_ref().map_or("", |about| about.parameter.unit());
            let value = number(value, unit).map_err(|(what, remedy)| problem(what, remedy))?;
            positive(value, unit, &place)?;
            match about {
                None => threshold = Some(value),
                Some(about) => statements.push(Statement {
                    robot: about.robot,
                    set: Some(about.set),
                    teammate: about.teammate,
                    parameter: about.parameter,
                    value,
                    place,
                }),
            }
        }
        // A stable sort: what is for one robot comes after what is for all.
        statements.sort_by_key(|statement| statement.robot.is_some());
        Ok(Self {
            threshold,
            statements,
        })
    }
}

/// What a key speaks of.
struct About {
    parameter: Parameter,
    teammate: Option<String>,
    robot: Option<String>,
    set: String,
}

const SHAPE: &str = "the key has not the right shape";

/// What is wrong, and what would be right.
type Refusal = (String, String);

/// What the key speaks of, `None` for the threshold.
fn about(key: &str) -> Result<Option<About>, Refusal> {
    if key == "threshold" {
        return Ok(None);
    }
    let mut parts = key.split('.');
    let name = parts.next().unwrap_or_default();
    let Some(parameter) = Parameter::ALL
        .into_iter()
        .find(|known| known.property() == name)
    else {
        let known = Parameter::ALL.map(Parameter::property);
        let known = ["threshold"].into_iter().chain(known);
        if name == "threshold" {
            return Err((SHAPE.to_owned(), "write threshold alone".to_owned()));
        }
        return Err(("unknown parameter".to_owned(), instead(name, known)));
    };
    let mut rest: Vec<&str> = parts.collect();
    let shape = || {
        let teammate = if parameter.by_teammate() {
            "TEAMMATE."
        } else {
            ""
        };
        (
            SHAPE.to_owned(),
            format!("write {name}.{teammate}SET or {name}.{teammate}ROBOT.SET"),
        )
    };
    let set = rest
        .pop()
        .filter(|set| is_set_name(set))
        .ok_or_else(shape)?;
    let least = usize::from(parameter.by_teammate());
    let right_number = rest.len() == least || rest.len() == least + 1;
    if !right_number || !rest.iter().all(|robot| is_name(robot)) {
        return Err(shape());
    }
    let mut robots = rest.into_iter().map(str::to_owned);
    Ok(Some(About {
        parameter,
        teammate: if parameter.by_teammate() {
            robots.next()
        } else {
            None
        },
        robot: robots.next(),
        set: set.to_owned(),
    }))
}

/// Whether this may name a behavior set: `NAME` or `NAME(NAME)`.
fn is_set_name(set: &str) -> bool {
    match set.strip_suffix(')').and_then(|set| set.split_once('(')) {
        Some((kind, of)) => is_name(kind) && is_name(of),
        None => is_name(set),
    }
}

fn number(text: &str, unit: &str) -> Result<f64, Refusal> {
    let text = text.trim();
    let remedy = || {
        format!("write a number above 0 {unit}")
            .trim_end()
            .to_owned()
    };
    if text.is_empty() {
        return Err(("the value is missing".to_owned(), remedy()));
    }
    text.parse()
        .map_err(|_| (format!("'{text}' is not a number"), remedy()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fuzzer has found the first one.
    #[test]
    fn a_file_in_utf_16_is_refused_in_one_line() {
        let torn = b"\xff\xfe\xff\xbf\xdc\xd4P\xdc\xdc\xdc\xdc\xdc\xdc\xdc\xdc\xcc\xdc\xdc\xdc\xdc).\xdc\xf7\xff\n";
        for bytes in [&torn[..], b"\xff\xfe", b"\xfe\xff\0a\0="] {
            let said = ParameterFile::parse("p.properties", bytes).unwrap_err();
            assert_eq!(
                said.to_string(),
                "p.properties:1: the file is UTF-16; save it as ISO 8859-1 or UTF-8"
            );
        }
        assert!(ParameterFile::parse("p.properties", b"\xef\xbb\xbfthreshold = 90\n").is_ok());
    }
}

//! Parameter files: the properties file of ALLIANCE parameters in the thesis (Fig. 3.4).
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
//! `<mb>`, a motivational behavior, is `SET` for all robots or `ROBOT.SET` for one robot. The latter has priority
//! at any position in the file. Names contain no dots, so the number of parts distinguishes the two. A
//! parameter that the file omits keeps the scenario's value.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;

use java_properties::{LineContent, PropertiesIter};

use super::error::{Place, Problem, name_remedy};
use super::limits::NumberRange;
use super::path::KeyPath;
use super::statement::{Parameter, Statement, THRESHOLD, check_at};
use crate::names::is_name;

/// A parameter file without mistakes that are visible without a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterFile {
    threshold: Option<f64>,
    /// The statements about behavior sets, weakest first.
    statements: Vec<Statement>,
}

/// A key of a parameter file that has no effect, because the scenario lacks its robot, teammate or set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkippedKey {
    /// The line of the file, from 1.
    pub line: usize,
    pub key: String,
}

impl fmt::Display for SkippedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (line {})", self.key, self.line)
    }
}

impl SkippedKey {
    /// Returns the key at a place, if it is in a parameter file.
    pub(super) fn from_place(place: &Place) -> Option<Self> {
        let line = place.line?;
        let key = place.key.to_string();
        Some(Self { line, key })
    }
}

impl ParameterFile {
    /// Reads a parameter file in the encoding of Java's properties files; `file_name` is for error messages.
    ///
    /// # Errors
    /// Returns the first line with a wrong form, a repeated key, or a value that is not a number above 0.
    pub fn parse(file_name: &str, bytes: &[u8]) -> Result<Self, Problem> {
        let mut threshold = None;
        let mut statements = Vec::new();
        let mut first_lines = BTreeMap::new();
        let problem = |line, what: &str, remedy: &str| {
            Problem::with_source(file_name, what, remedy).on_line(line)
        };
        // The parser reads a file with this start as UTF-16 and panics if it is truncated or damaged.
        if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
            return Err(problem(
                1,
                "the file is UTF-16",
                "save it as ISO 8859-1 or UTF-8",
            ));
        }
        // Without a final line end, the parser drops a last line that ends in a backslash.
        for line in PropertiesIter::new(bytes.chain(&b"\n"[..])) {
            // Reading a slice cannot fail, so a malformed escape is the only possible error.
            let line = line.map_err(|error| {
                let remedy = "write four hexadecimal digits after \\u";
                problem(
                    error.line_number().unwrap_or(1),
                    "malformed \\u escape",
                    remedy,
                )
            })?;
            let LineContent::KVPair(key, value) = line.content() else {
                continue;
            };
            let place = Place {
                source: Some(file_name.to_owned()),
                line: Some(line.line_number()),
                key: KeyPath::verbatim(key),
            };
            let at_place = |problem: Problem| Problem {
                place: place.clone(),
                ..problem
            };
            if let Some(first) = first_lines.insert(key.clone(), line.line_number()) {
                let what = format!("the key is already on line {first}");
                return Err(Problem::new(place, what, "state it once"));
            }
            let parsed = parse_key(key).map_err(at_place)?;
            let range = parsed
                .as_ref()
                .map_or(THRESHOLD, |parsed| parsed.parameter.range());
            let value = number(value, range).map_err(at_place)?;
            check_at(&place, range, value)?;
            match parsed {
                None => threshold = Some(value),
                Some(parsed) => statements.push(Statement {
                    robot: parsed.robot,
                    set: Some(parsed.set),
                    teammate: parsed.teammate,
                    parameter: parsed.parameter,
                    value,
                    place,
                }),
            }
        }
        // The sort is stable: statements for one robot come after those for all.
        statements.sort_by_key(|statement| statement.robot.is_some());
        Ok(Self {
            threshold,
            statements,
        })
    }

    pub(super) fn threshold(&self) -> Option<f64> {
        self.threshold
    }

    pub(super) fn statements(&self) -> impl Iterator<Item = Statement> + '_ {
        self.statements.iter().cloned()
    }
}

struct ParsedKey {
    parameter: Parameter,
    teammate: Option<String>,
    robot: Option<String>,
    set: String,
}

const SHAPE: &str = "the key has the wrong form";

/// Parses a key. Returns `None` for the threshold.
fn parse_key(key: &str) -> Result<Option<ParsedKey>, Problem> {
    let problem = |what: &str, remedy: String| Problem::of_value(what, remedy);
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
            return Err(problem(SHAPE, "write threshold alone".to_owned()));
        }
        return Err(problem("unknown parameter", name_remedy(name, known)));
    };
    let mut rest: Vec<&str> = parts.collect();
    let shape = || {
        let teammate = if parameter.is_per_teammate() {
            "TEAMMATE."
        } else {
            ""
        };
        let remedy = format!("write {name}.{teammate}SET or {name}.{teammate}ROBOT.SET");
        problem(SHAPE, remedy)
    };
    let set = rest
        .pop()
        .filter(|set| is_set_name(set))
        .ok_or_else(shape)?;
    let least = usize::from(parameter.is_per_teammate());
    let right_number = rest.len() == least || rest.len() == least + 1;
    if !right_number || !rest.iter().all(|robot| is_name(robot)) {
        return Err(shape());
    }
    let mut robots = rest.into_iter().map(str::to_owned);
    Ok(Some(ParsedKey {
        parameter,
        teammate: if parameter.is_per_teammate() {
            robots.next()
        } else {
            None
        },
        robot: robots.next(),
        set: set.to_owned(),
    }))
}

/// Returns true if the text can name a behavior set: `NAME` or `NAME(NAME)`.
fn is_set_name(set: &str) -> bool {
    match set.strip_suffix(')').and_then(|set| set.split_once('(')) {
        Some((kind, of)) => is_name(kind) && is_name(of),
        None => is_name(set),
    }
}

fn number(text: &str, range: NumberRange) -> Result<f64, Problem> {
    let text = text.trim();
    let remedy = format!("write a number above 0 {}", range.unit);
    let remedy = remedy.trim_end();
    if text.is_empty() {
        return Err(Problem::of_value("the value is missing", remedy));
    }
    let what = || format!("'{text}' is not a number");
    text.parse().map_err(|_| Problem::of_value(what(), remedy))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks files in UTF-16. A fuzzer found the first one.
    #[test]
    fn a_file_in_utf_16_is_refused_in_one_line() {
        let torn = b"\xff\xfe\xff\xbf\xdc\xd4P\xdc\xdc\xdc\xdc\xdc\xdc\xdc\xdc\xcc\xdc\xdc\xdc\xdc).\xdc\xf7\xff\n";
        for bytes in [&torn[..], b"\xff\xfe", b"\xfe\xff\0a\0="] {
            let error = ParameterFile::parse("p.properties", bytes).unwrap_err();
            assert_eq!(
                error.to_string(),
                "p.properties:1: the file is UTF-16; save it as ISO 8859-1 or UTF-8"
            );
        }
        assert!(ParameterFile::parse("p.properties", b"\xef\xbb\xbfthreshold = 90\n").is_ok());
    }
}

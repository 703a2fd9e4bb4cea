//! The cause of a difference: another setup, or another input.

use std::collections::BTreeSet;
use std::fmt;

use proto::program_build;
use run_log::{Branch, Input, InputLine, ReadError, RunFile, RunLog};
use scenario::ids::Tick;
use scenario::shortened;
use scenario::time::SimTime;
use serde_json::Value;
use terminal::{counted, in_one_line};

/// Returns the first difference between the programs of two runs in words. Programs of different builds can decide
/// differently with equal setups and inputs.
pub fn program_difference(a: &RunFile, b: &RunFile) -> Option<String> {
    let differ = |what: &str, a: &str, b: &str| {
        let [a, b] = [a, b].map(|build| in_one_line(&shortened(build)).into_owned());
        format!("build of {what}: {a} in A, {b} in B")
    };
    if program_build::differ(&a.build, &b.build) {
        return Some(differ("the program", &a.build, &b.build));
    }
    let mut robots = a.agent_builds.keys().chain(b.agent_builds.keys());
    robots.find_map(|robot| {
        let [a, b] = [a, b].map(|run| run.agent_builds.get(robot).unwrap_or(&run.build));
        program_build::differ(a, b).then(|| differ(&format!("the agent of {robot}"), a, b))
    })
}

/// Returns the first difference in seed, scenario or version, in words.
pub fn setup_difference(a: &RunLog, b: &RunLog) -> Option<String> {
    let (run_a, run_b) = (&a.run, &b.run);
    if run_a.setup.seed != run_b.setup.seed {
        let (a, b) = (run_a.setup.seed, run_b.setup.seed);
        return Some(format!("seed: {a} in A, {b} in B"));
    }
    let mut found = Vec::new();
    // Plain data with string keys: serialization cannot fail. Parameters come last because they follow from the
    // scenario.
    let value = |run: &RunFile| serde_json::to_value(&run.setup).unwrap_or_default();
    let (one, other) = (value(run_a), value(run_b));
    values_that_differ("", &one["scenario"], &other["scenario"], &mut found);
    if found.is_empty() {
        values_that_differ("alliance", &one["alliance"], &other["alliance"], &mut found);
    }
    if let Some(ValueDifference { path, a, b }) = found.first() {
        let first = format!("{path}: {a} in A, {b} in B");
        let more = match found.len() {
            1 => String::new(),
            all => format!(" (and {})", counted(all - 1, "more value")),
        };
        return Some(format!("scenario: {first}{more}"));
    }
    let (one, other) = (&run_a.version, &run_b.version);
    (one != other).then(|| format!("version: {one} in A, {other} in B"))
}

/// Two values at the same place, in words.
pub struct ValueDifference {
    pub path: String,
    pub a: String,
    pub b: String,
}

/// Appends each pair of values that differ, with its path.
pub fn values_that_differ(path: &str, a: &Value, b: &Value, found: &mut Vec<ValueDifference>) {
    let below = |key: &dyn fmt::Display| {
        let dot = if path.is_empty() { "" } else { "." };
        format!("{path}{dot}{key}")
    };
    match (a, b) {
        (Value::Object(one), Value::Object(other)) => {
            let keys: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
            for key in keys {
                values_that_differ(&below(key), &a[key], &b[key], found);
            }
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            for (index, (one, other)) in one.iter().zip(other).enumerate() {
                values_that_differ(&below(&index), one, other, found);
            }
        }
        _ if a == b => {}
        _ => {
            let describe = |value: &Value| match value {
                Value::Null => "not set".to_owned(),
                Value::Array(list) if list.len() == 1 => "1 entry".to_owned(),
                Value::Array(list) => format!("{} entries", list.len()),
                Value::Object(_) => "set".to_owned(),
                plain => plain.to_string(),
            };
            found.push(ValueDifference {
                path: path.to_owned(),
                a: describe(a),
                b: describe(b),
            });
        }
    }
}

/// Describes the inputs in `tick` that only one of the runs has; `None` if there are none.
pub fn input_difference(
    a: &RunLog,
    b: &RunLog,
    tick: Option<Tick>,
) -> Result<Option<String>, ReadError> {
    let (inputs_a, inputs_b) = (a.inputs()?, b.inputs()?);
    let of_tick = |inputs: &[InputLine]| -> Vec<Input> {
        let inputs = inputs.iter().filter(|line| Some(line.tick) == tick);
        inputs.map(|line| line.input.clone()).collect()
    };
    let (only_a, only_b) = (of_tick(&inputs_a), of_tick(&inputs_b));
    let t_ms = SimTime(tick.unwrap_or(0) * a.run.setup.scenario.step_ms);
    let describe = |inputs: &[Input], others: &[Input], name: &str| {
        let here = inputs.iter().filter(|input| !others.contains(input));
        here.map(|input| format!("{} at {} s in {name}", in_words(input), t_ms.as_secs_f64()))
            .collect::<Vec<_>>()
    };
    let mut differences = describe(&only_a, &only_b, "A");
    differences.extend(describe(&only_b, &only_a, "B"));
    Ok((!differences.is_empty()).then(|| format!("inputs: {}", differences.join("; "))))
}

fn in_words(input: &Input) -> String {
    match input {
        Input::Join { robot, .. } => format!("{robot} joined"),
        Input::Gone { robot, .. } => format!("{robot} died"),
        Input::StallBegin { robot, .. } => format!("{robot} stopped responding"),
        Input::StallEnd { robot, .. } => format!("{robot} responded again"),
        Input::Lost {
            receiver, sender, ..
        } => format!("{receiver} lost a message of {sender}"),
        Input::Order { order, .. } => format!("'{}' was ordered", order.fault),
        Input::Clear { ids, .. } => format!("{} cleared", ids.join(", ")),
        Input::Failed { robot, .. } => format!("an order to the process of {robot} failed"),
        Input::Branch(branch) => branch_in_words(branch),
        Input::Body(body) => {
            let (x_m, y_m) = (body.x_m, body.y_m);
            format!("the body of {} was at ({x_m}, {y_m})", body.robot)
        }
    }
}

/// Describes the changes of a branch.
fn branch_in_words(branch: &Branch) -> String {
    let mut changes = Vec::new();
    match branch.faults.as_deref() {
        None => {}
        Some([]) => changes.push("no more faults".to_owned()),
        Some(orders) => {
            let faults: Vec<String> = orders
                .iter()
                .map(|order| format!("'{}'", order.fault))
                .collect();
            changes.push(format!("the faults {}", faults.join(", ")));
        }
    }
    let parameters = branch.parameters.iter();
    changes.extend(parameters.map(|(key, value)| format!("{key} = {value}")));
    format!("a branch with {}", changes.join(", "))
}

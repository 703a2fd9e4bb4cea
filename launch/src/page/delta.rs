//! Changes between successive views, which take much less space than the views. `launch/page/source/delta.js` applies them.

use serde_json::{Map, Value, json};

/// Returns the change from one value to the next one, without its unchanged parts:
///
/// - an object with the changes of entries, by key or index, between two objects of equal keys or two lists of equal length,
/// - a list of one element, the new value, if that is a list or an object,
/// - otherwise the new value itself.
#[must_use]
pub fn change(before: &Value, after: &Value) -> Value {
    match (before, after) {
        (Value::Object(old), Value::Object(new)) if old.keys().eq(new.keys()) => {
            let pairs = old.iter().zip(new.values());
            let pairs = pairs.map(|((key, old), new)| (key.clone(), old, new));
            Value::Object(changes(pairs))
        }
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            let pairs = old.iter().zip(new).enumerate();
            let pairs = pairs.map(|(index, (old, new))| (index.to_string(), old, new));
            Value::Object(changes(pairs))
        }
        (_, Value::Array(_) | Value::Object(_)) => json!([after]),
        (_, scalar) => scalar.clone(),
    }
}

fn changes<'a>(pairs: impl Iterator<Item = (String, &'a Value, &'a Value)>) -> Map<String, Value> {
    let changed = pairs.filter(|(_, old, new)| old != new);
    changed
        .map(|(key, old, new)| (key, change(old, new)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_contains_only_what_differs() {
        let before = json!({"tick": 1, "robots": [{"x": 0.5, "on": null}, {"x": 2.0, "on": 3}], "items": []});
        for (after, expected) in [
            (before.clone(), json!({})),
            (
                json!({"tick": 2, "robots": [{"x": 0.5, "on": 4}, {"x": 2.0, "on": null}], "items": []}),
                json!({"tick": 2, "robots": {"0": {"on": 4}, "1": {"on": null}}}),
            ),
            // A list of another length and an object of other keys replace the old ones.
            (
                json!({"tick": 1, "robots": [{"x": 0.5, "on": null}, {"y": 2.0}], "items": [7]}),
                json!({"robots": {"1": [{"y": 2.0}]}, "items": [[7]]}),
            ),
            (
                json!({"tick": 1, "robots": [{"x": 0.5, "on": null}, {"x": 2.0, "on": [3]}], "items": []}),
                json!({"robots": {"1": {"on": [[3]]}}}),
            ),
            (json!({"tick": 3}), json!([{"tick": 3}])),
        ] {
            assert_eq!(change(&before, &after), expected);
        }
    }
}

//! Changes between successive views, which take much less space than the views. `launch/page/source/delta.js` applies them.

use proto::view::{RobotView, View};
use serde::Serialize;
use serde_json::{Map, Value, json};

/// A view that the next one is compared with. A large team has so many items and behavior sets that only changed ones are
/// encoded.
pub struct ComparedView<'v> {
    view: &'v View,
    /// The view without its items, marks and robots.
    rest: Value,
    /// The robots without their behavior sets.
    robots: Vec<Value>,
}

impl<'v> ComparedView<'v> {
    /// # Errors
    /// As [`to_value`].
    pub fn new(view: &'v View) -> serde_json::Result<Self> {
        let rest = View {
            items: Vec::new(),
            marks: Vec::new(),
            robots: Vec::new(),
            ..view.clone()
        };
        let robots = view.robots.iter().map(|robot| {
            to_value(&RobotView {
                sets: Vec::new(),
                ..robot.clone()
            })
        });
        Ok(Self {
            view,
            rest: to_value(&rest)?,
            robots: robots.collect::<serde_json::Result<_>>()?,
        })
    }

    /// Returns the [change] to the next view, which has the same robots.
    ///
    /// # Errors
    /// As [`to_value`].
    pub fn change_to(&self, next: &Self) -> serde_json::Result<Value> {
        let (old, new) = (self.view, next.view);
        let mut all = change(&self.rest, &next.rest);
        if old.items != new.items {
            all["items"] = change_of_lists(&old.items, &new.items)?;
        }
        if old.marks != new.marks {
            all["marks"] = change_of_lists(&old.marks, &new.marks)?;
        }
        for (rank, (before, after)) in self.robots.iter().zip(&next.robots).enumerate() {
            let [old, new] = [old, new].map(|view| &view.robots[rank].sets);
            let rank = rank.to_string();
            if before != after {
                all["robots"][&rank] = change(before, after);
            }
            if old != new {
                all["robots"][&rank]["sets"] = change_of_lists(old, new)?;
            }
        }
        Ok(all)
    }
}

/// Returns the [change] from a list to the next one. Elements that stay equal are not encoded.
fn change_of_lists<T: PartialEq + Serialize>(
    before: &[T],
    after: &[T],
) -> serde_json::Result<Value> {
    let is_equal = |index: usize| before.len() == after.len() && before[index] == after[index];
    let encode = |list: &[T]| {
        let elements = list.iter().enumerate().map(|(index, element)| {
            if is_equal(index) {
                Ok(Value::Null)
            } else {
                to_value(element)
            }
        });
        elements.collect::<serde_json::Result<Value>>()
    };
    Ok(change(&encode(before)?, &encode(after)?))
}

/// Encodes through a text, because a number of 32 bits as a `Value` has more digits than the server sends.
///
/// # Errors
/// If the value cannot be encoded. All values of views can be.
pub fn to_value(content: &(impl Serialize + ?Sized)) -> serde_json::Result<Value> {
    serde_json::from_str(&serde_json::to_string(content)?)
}

/// Returns the change from one value to the next one, without its unchanged parts:
///
/// - an object with the changes of entries, by key or index, between two objects of equal keys or two lists of equal length,
/// - a list of one element, the new value, if that is a list or an object,
/// - otherwise the new value itself.
fn change(before: &Value, after: &Value) -> Value {
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
    use in_process::Team;
    use missions::waste::data::default_scenario;
    use run_log::{LogLevel, MemoryLog};
    use scenario::Setup;

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

    #[test]
    fn changes_of_views_are_those_of_their_texts() {
        let mut scenario = default_scenario();
        scenario.limit_s = 120.0;
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let mut views = vec![team.view()];
        while team.tick().unwrap().is_none() {
            views.push(team.view());
        }
        // A robot without a behavior set, and one whose motivations repeat.
        let mut fewer = views[40].clone();
        fewer.robots[1].sets.pop();
        views.extend([fewer.clone(), fewer]);
        let (mut with_sets, mut with_items) = (0, 0);
        for pair in views.windows(2) {
            let [before, after] = [&pair[0], &pair[1]].map(|view| ComparedView::new(view).unwrap());
            let found = before.change_to(&after).unwrap();
            let whole = change(&to_value(&pair[0]).unwrap(), &to_value(&pair[1]).unwrap());
            assert_eq!(found, whole);
            with_sets += usize::from(found.to_string().contains("\"sets\""));
            with_items += usize::from(found.get("items").is_some());
        }
        for count in [with_sets, with_items] {
            assert!(count > 0 && count < views.len() - 1, "{count}");
        }
    }
}

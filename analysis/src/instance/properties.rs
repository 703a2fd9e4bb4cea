//! The table of task properties: the key of the mission that states each, and the loss without the key.
//!
//! The mission's own list of parameters decides which keys exist. A new key of `[[service.points]]` with a name of this
//! table is written and exported without any further change.

use std::collections::BTreeSet;

use missions::service::data::SERVICE;
use toml::Value;

use super::frame::Frame;
use super::model::Task;

/// A property of a task.
pub struct Property {
    /// The key in instances and, below `points.`, of the mission.
    pub name: &'static str,
    /// Returns the value for a scenario; `None` if the task does not state the property.
    pub write: fn(&Task, &Context<'_>) -> Option<Value>,
    /// Reads the value from a scenario. A value of another type is ignored.
    pub read: fn(&mut Task, &Value),
    /// The consequence in a scenario whose mission lacks the key.
    pub without: Without,
}

/// The consequence of a missing key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Without {
    /// The property is dropped, for this reason.
    Dropped(&'static str),
    /// The writer states the property by other keys of the mission.
    Expressed,
}

/// The facts beside a task that its values depend on.
pub struct Context<'a> {
    pub frame: &'a Frame,
    /// Returns the name of the point of a task by its id, such as `p3`.
    pub point: &'a dyn Fn(&str) -> String,
}

/// All properties of tasks that a mission may have or lack. Places, work, arrival and kind always exist.
pub const PROPERTIES: &[Property] = &[
    Property {
        name: "opens_s",
        write: |task, _| task.opens_s.map(Value::Float),
        read: |task, value| task.opens_s = number(value),
        without: Without::Dropped("robots may begin earlier"),
    },
    Property {
        name: "deadline_s",
        write: |task, _| task.deadline_s.map(Value::Float),
        read: |task, value| task.deadline_s = number(value),
        without: Without::Expressed,
    },
    Property {
        name: "needs",
        write: |task, _| {
            let needs = task.needs.iter();
            let needs =
                needs.map(|(skill, count)| (skill.clone(), Value::Integer((*count).into())));
            (!task.needs.is_empty()).then(|| Value::Table(needs.collect()))
        },
        read: |task, value| {
            let needs = value.as_table().into_iter().flatten();
            let needs = needs.filter_map(|(skill, count)| {
                Some((skill.clone(), u32::try_from(count.as_integer()?).ok()?))
            });
            task.needs = needs.collect();
        },
        without: Without::Expressed,
    },
    Property {
        name: "value",
        write: |task, _| task.value.map(Value::Float),
        read: |task, value| task.value = number(value),
        without: Without::Dropped("each task counts the same"),
    },
    Property {
        name: "priority",
        write: |task, _| task.priority.map(Value::Integer),
        read: |task, value| task.priority = value.as_integer(),
        without: Without::Dropped("the allocator decides on the order"),
    },
    Property {
        name: "after",
        write: |task, context| {
            let names = task
                .after
                .iter()
                .map(|id| Value::String((context.point)(id)));
            (!task.after.is_empty()).then(|| Value::Array(names.collect()))
        },
        read: |task, value| {
            let names = value.as_array().into_iter().flatten();
            let names = names.filter_map(Value::as_str);
            task.after = names.map(str::to_owned).collect();
        },
        without: Without::Dropped("tasks are done in any order"),
    },
    Property {
        name: "deliver_to",
        write: |task, context| {
            let place = context.frame.place(task.deliver_to?);
            Some(Value::Array(place.map(Value::Float).to_vec()))
        },
        read: |task, value| {
            let numbers: Option<Vec<f64>> = value
                .as_array()
                .map(|list| list.iter().filter_map(number).collect());
            task.deliver_to = numbers.and_then(|numbers| numbers.try_into().ok());
        },
        without: Without::Dropped("a task ends at its place"),
    },
    Property {
        name: "demand",
        write: |task, _| task.demand.map(Value::Float),
        read: |task, value| task.demand = number(value),
        without: Without::Dropped("robots carry any load"),
    },
];

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// The properties of tasks that the mission can state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supported(BTreeSet<String>);

impl Supported {
    /// Returns the properties with a key in the mission *service* of this program.
    #[must_use]
    pub fn by_mission() -> Self {
        let parameters = SERVICE.parameters();
        let points = parameters
            .iter()
            .filter_map(|each| each.key.strip_prefix("points."));
        Self(points.map(str::to_owned).collect())
    }

    #[must_use]
    pub fn has(&self, property: &str) -> bool {
        self.0.contains(property)
    }
}

#[cfg(test)]
impl Supported {
    /// Returns a mission with exactly these properties.
    pub fn only(properties: &[&str]) -> Self {
        Self(properties.iter().map(|name| (*name).to_owned()).collect())
    }
}

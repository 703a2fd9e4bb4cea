//! The table of the optional properties of tasks, each with its key in `[[service.points]]`.

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
}

/// The facts beside a task that its values depend on.
pub struct Context<'a> {
    pub frame: &'a Frame,
    /// Returns the name of the point of a task by its id, such as `p3`.
    pub point: &'a dyn Fn(&str) -> String,
}

/// All optional properties of tasks. Places, work, arrival and kind always exist.
pub const PROPERTIES: &[Property] = &[
    Property {
        name: "opens_s",
        write: |task, _| task.opens_s.map(Value::Float),
        read: |task, value| task.opens_s = number(value),
    },
    Property {
        name: "deadline_s",
        write: |task, _| task.deadline_s.map(Value::Float),
        read: |task, value| task.deadline_s = number(value),
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
    },
    Property {
        name: "value",
        write: |task, _| task.value.map(Value::Float),
        read: |task, value| task.value = number(value),
    },
    Property {
        name: "demand",
        write: |task, _| task.load().map(Value::Float),
        read: |task, value| task.demand = number(value),
    },
    Property {
        name: "priority",
        write: |task, _| task.priority.map(Value::Integer),
        read: |task, value| task.priority = value.as_integer(),
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
    },
];

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|whole| whole as f64))
}

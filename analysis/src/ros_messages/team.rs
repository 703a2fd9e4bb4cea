//! Tasks, allocations, faults and events as JSON. ROS has no standard messages for them.

use proto::view::View;
use ros::Qos;
use ros::messages::StringMessage;
use ros::names::TEAM;
use run_log::{CellValue, EventRow};
use scenario::Setup;
use scenario::time::SimTime;
use serde_json::{Map, Value, json};

use super::destination::{Destination, Topic};
use crate::columns::{Column, declared};

/// The topics `/alliance/…` of the team.
pub struct TeamTopics {
    setup: Setup,
    tasks: StateTopic,
    allocations: StateTopic,
    faults: StateTopic,
    events: Topic<StringMessage>,
    columns: Vec<Column<EventRow>>,
}

/// A topic with a state, as an object with the time `t_ms` and one other member.
struct StateTopic {
    topic: Topic<StringMessage>,
    /// The latest state without its time.
    latest: Option<Map<String, Value>>,
}

impl StateTopic {
    fn new(to: &mut dyn Destination, name: &str) -> anyhow::Result<Self> {
        Ok(Self {
            topic: to.topic(format!("/{TEAM}/{name}"), Qos::Latched)?,
            latest: None,
        })
    }

    /// Writes a state if it has changed.
    fn write(
        &mut self,
        to: &mut dyn Destination,
        now: SimTime,
        state: Map<String, Value>,
    ) -> anyhow::Result<()> {
        if self.latest.as_ref() == Some(&state) {
            return Ok(());
        }
        let mut message = state.clone();
        message.insert("t_ms".to_owned(), json!(now));
        self.latest = Some(state);
        to.write(&self.topic, now, &text(message))
    }
}

impl TeamTopics {
    pub fn new(to: &mut dyn Destination, setup: &Setup) -> anyhow::Result<Self> {
        Ok(Self {
            setup: setup.clone(),
            tasks: StateTopic::new(to, "tasks")?,
            allocations: StateTopic::new(to, "allocations")?,
            faults: StateTopic::new(to, "faults")?,
            events: to.topic(format!("/{TEAM}/events"), Qos::Stream)?,
            columns: declared(),
        })
    }

    /// Writes the states that have changed.
    pub fn write_state(&mut self, to: &mut dyn Destination, view: &View) -> anyhow::Result<()> {
        let (tasks, allocations) = (self.tasks_of(view), self.allocations_of(view));
        self.tasks.write(to, view.now, tasks)?;
        self.allocations.write(to, view.now, allocations)?;
        let faults = Map::from_iter([("faults".to_owned(), json!(view.faults))]);
        self.faults.write(to, view.now, faults)
    }

    /// Returns the tasks with their executing robots, and the places with work that is left.
    fn tasks_of(&self, view: &View) -> Map<String, Value> {
        let catalog = &self.setup.catalog;
        let mut tasks: Vec<(&str, Vec<&str>)> = catalog
            .tasks
            .iter()
            .map(|task| (&*task.name, Vec::new()))
            .collect();
        for (spec, robot) in self.setup.scenario.robots.iter().zip(&view.robots) {
            if let Some(set) = robot.active {
                let task = catalog.sets[set.index()].task;
                tasks[task.index()].1.push(&spec.name);
            }
        }
        let tasks = tasks.into_iter();
        let tasks = tasks.map(|(task, robots)| json!({ "task": task, "robots": robots }));
        let places = view.marks.iter().filter_map(|mark| {
            let work = mark.work.as_ref()?;
            Some(json!({
                "id": mark.id,
                "label": mark.label,
                "left": work.left,
                "all": work.all,
                "unit": work.unit,
            }))
        });
        [
            ("tasks".to_owned(), tasks.collect()),
            ("places".to_owned(), places.collect()),
        ]
        .into_iter()
        .collect()
    }

    /// Returns the active behavior set of each robot in the team.
    fn allocations_of(&self, view: &View) -> Map<String, Value> {
        let catalog = &self.setup.catalog;
        let robots = self.setup.scenario.robots.iter().zip(&view.robots);
        let robots = robots.map(|(spec, robot)| {
            let set = robot.active.map(|set| &catalog.sets[set.index()]);
            let since = robot
                .sets
                .iter()
                .find(|set| Some(set.motivation.set) == robot.active);
            json!({
                "robot": spec.name,
                "state": robot.state.as_str(),
                "behavior_set": set.map(|set| &set.name),
                "task": set.map(|set| catalog.task_name(set.task)),
                "since_ms": since.map(|set| set.since),
            })
        });
        Map::from_iter([("robots".to_owned(), robots.collect())])
    }

    /// Writes a row of events.csv, with all columns.
    pub fn write_event(&self, to: &mut dyn Destination, row: &EventRow) -> anyhow::Result<()> {
        let columns = self.columns.iter();
        let object = columns.map(|column| {
            let value = (column.value)(row).map_or(Value::Null, json_of);
            (column.name.clone(), value)
        });
        to.write(&self.events, row.t_ms, &text(object.collect()))
    }
}

fn json_of(value: CellValue<'_>) -> Value {
    match value {
        CellValue::Whole(number) => json!(number),
        CellValue::Single(number) => json!(number),
        CellValue::Double(number) => json!(number),
        CellValue::Flag(flag) => json!(flag),
        CellValue::Text(text) => json!(text),
        CellValue::Hash(hash) => json!(format!("{hash:016x}")),
    }
}

fn text(object: Map<String, Value>) -> StringMessage {
    StringMessage {
        data: Value::from(object).to_string(),
    }
}

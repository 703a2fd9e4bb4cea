//! Instance → scenario → instance, for random instances.

use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use toml::Value;

use super::*;
use crate::instance::frame::Frame;
use crate::instance::from_scenario;
use crate::instance::model::{Instance, Robot, Task};
use crate::instance::properties::{Context, PROPERTIES};
use crate::instance::source::Loaded;

const SKILLS: [&str; 3] = ["arm", "camera", "task"];

fn skill() -> impl Strategy<Value = String> {
    prop::sample::select(&SKILLS[..]).prop_map(str::to_owned)
}

/// Draws a length in quarters of a metre, which is exact in single precision.
fn length() -> impl Strategy<Value = f64> {
    (-200_i32..200).prop_map(|quarters| f64::from(quarters) / 4.0)
}

/// Draws a time in halves of a second.
fn time() -> impl Strategy<Value = f64> {
    (1_u32..200).prop_map(|halves| f64::from(halves) / 2.0)
}

fn task(kinds: bool) -> impl Strategy<Value = Task> {
    let place = (length(), length(), option::of([length(), length()]));
    let times = (
        time(),
        option::of(time()),
        option::of(time()),
        option::of(time()),
    );
    let work = (
        option::of(skill()),
        option::of(2_u32..4),
        btree_map(skill(), 1_u32..4, 0..3),
    );
    let worth = (
        option::of(time()),
        option::of(-9_i64..9),
        option::of(time()),
    );
    let after = vec("[a-z]{1,3}", 0..3);
    (place, times, work, worth, after).prop_map(move |(place, times, work, worth, after)| Task {
        id: String::new(),
        x_m: place.0,
        y_m: place.1,
        work_s: times.0,
        arrival_s: times.1.unwrap_or(0.0),
        deadline_s: times.2,
        opens_s: times.3.filter(|_| !kinds),
        kind: work.0,
        workers: work.1,
        needs: if kinds { Default::default() } else { work.2 },
        value: worth.0.filter(|_| !kinds),
        priority: worth.1.filter(|_| !kinds),
        demand: worth.2.filter(|_| !kinds),
        after: if kinds { Vec::new() } else { after },
        deliver_to: place.2.filter(|_| !kinds),
    })
}

fn robot() -> impl Strategy<Value = Robot> {
    let skills = option::of(btree_map(
        skill(),
        (1_u32..8).prop_map(|level| f64::from(level) / 4.0),
        1..3,
    ));
    let robot = (
        length(),
        length(),
        option::of(time()),
        skills,
        option::of(time()),
    );
    robot.prop_map(|(x, y, speed, skills, capacity)| Robot {
        id: String::new(),
        x_m: Some(x),
        y_m: Some(y),
        speed_m_s: speed,
        skills,
        capacity,
    })
}

/// Draws an instance of what the mission has always been able to state. The first robot can do everything.
fn instance() -> impl Strategy<Value = Instance> {
    (vec(task(true), 1..12), vec(robot(), 1..5)).prop_map(|(mut tasks, mut robots)| {
        for (index, task) in tasks.iter_mut().enumerate() {
            task.id = format!("p{index}");
        }
        for (index, robot) in robots.iter_mut().enumerate() {
            robot.id = format!("r{index}");
            // Robots must not start inside each other.
            robot.x_m = robot.x_m.map(|x_m| x_m + 101.0 * index as f64);
        }
        robots[0].skills = None;
        Instance {
            name: "drawn".to_owned(),
            limit_s: Some(900.0),
            speed_m_s: Some(0.5),
            tasks,
            robots,
            ..Instance::default()
        }
    })
}

/// Returns the level of a robot at a task.
fn level(robot: &Robot, task: &Task) -> f64 {
    match (&robot.skills, &task.kind) {
        (Some(skills), Some(kind)) => skills.get(kind).copied().unwrap_or(0.0),
        _ => 1.0,
    }
}

/// Exports a scenario whose robots all state their starts.
fn exported(scenario: &Scenario) -> Instance {
    let starts = scenario.robots.iter().filter_map(|robot| robot.start);
    let starts: Vec<[f64; 2]> = starts
        .map(|start| [start.x_m, start.y_m].map(from_scenario::readable))
        .collect();
    from_scenario::instance(scenario, 1, &starts)
        .unwrap()
        .instance
}

fn json(instance: &Instance) -> String {
    serde_json::to_string(instance).unwrap()
}

#[test]
fn points_and_predecessors_keep_their_names() {
    let vocabulary = Registry::built_in().vocabulary();
    let text = "
robots = [{ name = 'blue', start = { x_m = 1, y_m = 1 } }]
[service]
kinds = [{ name = 'task', work_s = { min = 1, max = 1 } }]
points = [
    { kind = 'task', x_m = 3, y_m = 3, name = 'gate' },
    { kind = 'task', x_m = 5, y_m = 3, after = ['gate'] },
    { kind = 'task', x_m = 7, y_m = 3, after = ['p1', 'p0'] },
]
";
    let scenario = Scenario::parse("named.toml", text, &vocabulary).unwrap();
    let instance = exported(&scenario);
    let names = |instance: &Instance| -> Vec<String> {
        let tasks = instance.tasks.iter();
        let names = tasks.map(|task| format!("{} after {:?}", task.id, task.after));
        names.collect()
    };
    let expected = [
        "gate after []",
        "p1 after [\"gate\"]",
        "p2 after [\"p1\", \"gate\"]",
    ];
    assert_eq!(names(&instance), expected);
    let again = imported("named.json", &json(&instance));
    assert_eq!(names(&exported(&again.scenario)), expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn an_instance_survives_its_scenario(instance in instance()) {
        let converted = imported("drawn.json", &json(&instance));
        let back = exported(&converted.scenario);
        let loaded = Loaded { instance: instance.clone(), ..Loaded::default() };
        let frame = Frame::new(&loaded, None, Source { name: "", text: "" }).unwrap();

        prop_assert_eq!(back.tasks.len(), instance.tasks.len());
        for (found, task) in back.tasks.iter().zip(&instance.tasks) {
            prop_assert_eq!([found.x_m, found.y_m], frame.place([task.x_m, task.y_m]));
            prop_assert_eq!(found.work_s, task.work_s);
            prop_assert_eq!(found.arrival_s, task.arrival_s);
            prop_assert_eq!(found.deadline_s, task.deadline_s);
            prop_assert_eq!(found.workers.unwrap_or(1), task.workers.unwrap_or(1));
        }
        for robot in &instance.robots {
            let levels: Vec<f64> = instance.tasks.iter().map(|task| level(robot, task)).collect();
            let Some(found) = back.robots.iter().find(|found| found.id == robot.id) else {
                // Only a robot that can do nothing is left out.
                prop_assert!(levels.iter().all(|level| *level == 0.0));
                continue;
            };
            let start = frame.place([robot.x_m.unwrap(), robot.y_m.unwrap()]);
            prop_assert_eq!([found.x_m.unwrap(), found.y_m.unwrap()], start);
            prop_assert_eq!((found.speed_m_s, found.capacity), (robot.speed_m_s, robot.capacity));
            let found: Vec<f64> = back.tasks.iter().map(|task| level(found, task)).collect();
            prop_assert_eq!(found, levels);
        }
        prop_assert_eq!(back.limit_s, instance.limit_s);

        // A second pass changes nothing.
        let again = imported("drawn.json", &json(&back));
        prop_assert_eq!(exported(&again.scenario), back);
    }

    /// Each row of the table of properties, also those that the mission lacks.
    #[test]
    fn each_property_is_read_as_it_was_written(task in task(false)) {
        let context = Context { frame: &Frame::UNCHANGED, point: &|id| id.to_owned() };
        let mut values = toml::Table::new();
        for property in PROPERTIES {
            if let Some(value) = (property.write)(&task, &context) {
                values.insert(property.name.to_owned(), value);
            }
        }
        // Through the text of a file.
        let values: toml::Table = values.to_string().parse().unwrap();
        let mut found = Task {
            id: task.id.clone(),
            x_m: task.x_m,
            y_m: task.y_m,
            work_s: task.work_s,
            arrival_s: task.arrival_s,
            kind: task.kind.clone(),
            workers: task.workers,
            // Robots do not take the demands of tasks for several robots.
            demand: task.demand.filter(|_| task.load().is_none()),
            ..Task::default()
        };
        for property in PROPERTIES {
            let value: Option<&Value> = values.get(property.name);
            if let Some(value) = value {
                (property.read)(&mut found, value);
            }
        }
        prop_assert_eq!(found, task);
    }
}

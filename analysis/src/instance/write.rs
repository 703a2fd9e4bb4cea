//! A scenario file of the mission *service* from an instance.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::fmt::Write as _;

use missions::service::data::{MAX_KINDS, ServiceSection};
use scenario::fault::EventTrigger;
use scenario::limits::LONGEST_S;
use scenario::names::is_name;
use scenario::{Body, Problem, Scenario};
use toml::{Table, Value};

use super::frame::Frame;
use super::kinds::{Point, Points, WorkKind, dropped, points};
use super::model::{Floor, Instance, Robot, Task};
use super::properties::{Context, PROPERTIES};
use super::source::Loaded;

/// The scenario of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The text of the scenario file.
    pub text: String,
    /// The contents of the file that the scenario lacks or states in another way, one line each.
    pub notes: Vec<String>,
}

/// The default distance at which a robot works on a point, m.
const REACH_M: f64 = 0.3;
/// The factor of the time limit for ways around obstacles.
const DETOURS: f64 = 5.0;
/// The distance by which workers around a point are closer to it than they may be, m.
const ROOM_M: f64 = 0.05;

/// Returns the scenario of a checked instance with robots, in the given frame. `title` is the first line of the file.
///
/// # Errors
/// Returns an error if the tasks need more kinds than a scenario accepts.
pub fn scenario(loaded: &Loaded, frame: &Frame, title: &str) -> Result<Written, Problem> {
    let instance = &loaded.instance;
    let Points {
        kinds,
        points,
        notes: changes,
    } = points(instance);
    if kinds.len() > MAX_KINDS {
        let what = format!("the tasks need {} kinds of work", kinds.len());
        let remedy = format!("use at most {MAX_KINDS} different skills and numbers of workers");
        return Err(Problem::of_value(what, remedy));
    }
    let mut notes = vec![format!("frame: {frame}")];
    notes.extend(loaded.notes.iter().cloned());
    notes.extend(
        loaded
            .dropped
            .iter()
            .map(|reason| format!("dropped: {reason}")),
    );
    notes.extend(lost_loads(instance));
    notes.extend(changes);
    let team = team(instance, frame, &kinds, &mut notes);

    let mut file = File(String::new());
    file.comment(title);
    for note in &notes {
        file.comment(note);
    }
    file.value("name", Value::String(name(&instance.name)));
    file.value("limit_s", Value::Float(limit_s(instance, &points, frame)));
    file.value("room", Value::Table(room(&frame.room)));
    let least_ms = step_ms(instance, frame);
    if least_ms != Scenario::default().step_ms {
        file.value("step_ms", Value::Integer(least_ms as i64));
    }
    if let Some(body) = body(instance, frame) {
        file.value("body", body);
    }
    file.list(
        "robots",
        team.into_iter()
            .map(|(robot, id)| (Value::Table(robot), id)),
    );
    if !instance.obstacles.is_empty() {
        let obstacles = instance.obstacles.iter().map(|obstacle| {
            let place = frame.place([obstacle.x_m, obstacle.y_m].map(f64::from));
            let size = [obstacle.width_m, obstacle.height_m].map(|size| frame.length(size.into()));
            let mut each = numbers([
                ("x_m", place[0]),
                ("y_m", place[1]),
                ("width_m", size[0]),
                ("height_m", size[1]),
            ]);
            if obstacle.penetrability != 0.0 {
                each.insert(
                    "penetrability".to_owned(),
                    Value::Float(obstacle.penetrability.into()),
                );
            }
            (Value::Table(each), String::new())
        });
        file.list("obstacles", obstacles);
    }
    file.0 += "\n[service]\n";
    let reach_m = reach_m(instance, &kinds, frame);
    if reach_m != REACH_M {
        file.value("reach_m", Value::Float(reach_m));
    }
    file.list(
        "kinds",
        kinds
            .iter()
            .map(|kind| (Value::Table(kind_table(kind)), String::new())),
    );
    let index = instance
        .tasks
        .iter()
        .zip(0..)
        .map(|(task, index)| (task.id.as_str(), index));
    let index: BTreeMap<&str, usize> = index.collect();
    let context = Context {
        frame,
        // The check of the instance guarantees that the task exists.
        point: &|id| format!("p{}", index.get(id).copied().unwrap_or(0)),
    };
    let rows = points
        .iter()
        .enumerate()
        .map(|(number, Point { kind, task })| {
            let [x_m, y_m] = frame.place([task.x_m, task.y_m]);
            let mut each = Table::new();
            // The id remains in exports of the scenario, unless it is that of another point or no name.
            let comment = match EventTrigger::number_of(&task.id, "p") {
                Some(other) if other == number => String::new(),
                None if is_name(&task.id) => {
                    each.insert("name".to_owned(), Value::String(task.id.clone()));
                    String::new()
                }
                _ => task.id.clone(),
            };
            each.insert("kind".to_owned(), Value::String(kinds[*kind].name.clone()));
            each.extend(numbers([("x_m", x_m), ("y_m", y_m)]));
            if task.arrival_s > 0.0 {
                each.extend(numbers([("arrival_s", task.arrival_s)]));
            }
            each.extend(numbers([("work_s", task.work_s)]));
            for property in PROPERTIES {
                if let Some(value) = (property.write)(task, &context) {
                    each.insert(property.name.to_owned(), value);
                }
            }
            (Value::Table(each), comment)
        });
    file.list("points", rows);
    Ok(Written {
        text: file.0,
        notes,
    })
}

/// Returns a note about the demands that no robot takes.
fn lost_loads(instance: &Instance) -> Option<String> {
    let demands = instance.tasks.iter().filter(|task| task.demand.is_some());
    let lost = demands.filter(|task| task.load().is_none()).count();
    (lost > 0).then(|| dropped("demand", lost, "a robot takes a load above 0, alone"))
}

/// Returns the robots with their ids. A robot without a skill that a task needs is dropped.
fn team(
    instance: &Instance,
    frame: &Frame,
    kinds: &[WorkKind],
    notes: &mut Vec<String>,
) -> Vec<(Table, String)> {
    let needs = instance.tasks.iter().flat_map(|task| task.needs.keys());
    let needed: BTreeSet<&str> = needs.map(String::as_str).collect();
    let mut team = Vec::new();
    let mut idle = Vec::new();
    for robot in &instance.robots {
        let mut each = Table::new();
        each.insert("name".to_owned(), Value::String(robot.id.clone()));
        if let (Some(x), Some(y)) = (robot.x_m, robot.y_m) {
            let [x_m, y_m] = frame.place([x, y]);
            each.insert("start".to_owned(), table([("x_m", x_m), ("y_m", y_m)]));
        }
        if let Some(speed_m_s) = robot.speed_m_s {
            each.extend(numbers([("speed_m_s", frame.length(speed_m_s))]));
        }
        if let Some(capacity) = robot.capacity {
            each.extend(numbers([("capacity", capacity)]));
        }
        if let Some(levels) = levels(robot, kinds, &needed) {
            if levels.is_empty() {
                idle.push(robot.id.as_str());
                continue;
            }
            each.insert("skills".to_owned(), Value::Table(levels));
        }
        team.push((each, String::new()));
    }
    if !idle.is_empty() {
        notes.push(format!(
            "dropped: robots without a skill of a kind: {}",
            idle.join(", ")
        ));
    }
    team
}

/// Returns the skills of a robot for the kinds of the scenario; `None` if it states no skills.
fn levels(robot: &Robot, kinds: &[WorkKind], needed: &BTreeSet<&str>) -> Option<Table> {
    let skills = robot.skills.as_ref()?;
    let of_kinds = kinds.iter().map(|kind| {
        let level = kind
            .skill
            .as_ref()
            .map_or(1.0, |skill| skills.get(skill).copied().unwrap_or(0.0));
        (kind.name.clone(), level)
    });
    let of_needs = skills
        .iter()
        .filter(|(skill, _)| needed.contains(skill.as_str()));
    let of_needs = of_needs.map(|(skill, level)| (skill.clone(), *level));
    let levels = of_kinds.chain(of_needs).filter(|(_, level)| *level > 0.0);
    Some(
        levels
            .map(|(skill, level)| (skill, Value::Float(level)))
            .collect(),
    )
}

/// Returns the values of the body that are not the default ones.
fn body(instance: &Instance, frame: &Frame) -> Option<Value> {
    let default = Body::default();
    let speed_m_s = instance.speed_m_s.unwrap_or(default.speed_m_s.into());
    let values = [
        (
            "speed_m_s",
            Some(frame.length(speed_m_s)),
            default.speed_m_s,
        ),
        ("turn_deg_s", instance.turn_deg_s, default.turn_deg_s),
        (
            "robot_penetrability",
            instance.robot_penetrability,
            default.robot_penetrability,
        ),
    ];
    let changed = values.into_iter().filter_map(|(key, value, default)| {
        let value = value.filter(|value| *value != f64::from(default))?;
        Some((key.to_owned(), Value::Float(value)))
    });
    let changed: Table = changed.collect();
    (!changed.is_empty()).then_some(Value::Table(changed))
}

/// Returns the stated distance of work, or one at which all workers of a point have room, m.
fn reach_m(instance: &Instance, kinds: &[WorkKind], frame: &Frame) -> f64 {
    if let Some(reach_m) = instance.reach_m {
        return frame.length(reach_m);
    }
    let together = |task: &Task| task.needs.values().sum::<u32>();
    let workers = kinds.iter().map(|kind| kind.workers);
    let workers = workers.chain(instance.tasks.iter().map(together));
    let most = workers.max().unwrap_or(1);
    if instance
        .robot_penetrability
        .is_some_and(|value| value > 0.0)
        || most <= 1
    {
        return REACH_M;
    }
    let radius_m = f64::from(Body::default().radius_m);
    let reach_m = radius_m / (PI / f64::from(most)).sin() + ROOM_M;
    REACH_M.max((reach_m * 100.0).ceil() / 100.0)
}

/// Returns the table of a room. Coordinates of 0 are the default.
fn room(floor: &Floor) -> Table {
    let mut room = numbers([("x_m", floor.x_m), ("y_m", floor.y_m)]);
    room.retain(|_, place| place.as_float() != Some(0.0));
    room.extend(numbers([
        ("width_m", floor.width_m),
        ("height_m", floor.height_m),
    ]));
    room
}

/// Returns the top speed of the slowest robot, m/s.
fn slowest_m_s(instance: &Instance, frame: &Frame) -> f64 {
    let default = f64::from(Body::default().speed_m_s);
    let own = instance.robots.iter().filter_map(|robot| robot.speed_m_s);
    frame.length(own.fold(instance.speed_m_s.unwrap_or(default), f64::min))
}

/// Returns the length of a step, ms: the default, or the first longer one whose steps exceed the resolution of the
/// room's coordinates.
fn step_ms(instance: &Instance, frame: &Frame) -> u64 {
    let slowest_m_s = slowest_m_s(instance, frame);
    let least_m = f64::from(frame.room.as_room().least_step_m());
    let suffices = |step_ms: &u64| slowest_m_s * *step_ms as f64 / 1000.0 >= least_m;
    let steps = [Scenario::default().step_ms, 100, 200];
    steps.into_iter().find(suffices).unwrap_or(500)
}

/// Returns the stated time limit, or the time after which the slowest robot with the least skills has done all tasks one
/// after another, s. Obstacles extend it, and so does the wait for the robots of each slot.
fn limit_s(instance: &Instance, points: &[Point], frame: &Frame) -> f64 {
    if let Some(limit_s) = instance.limit_s {
        return limit_s;
    }
    let across_s = frame.room.width_m.hypot(frame.room.height_m) / slowest_m_s(instance, frame);
    let wait_s = ServiceSection::COALITION_WAIT_S;
    let pace = |task: &Task| {
        let skills = task
            .needs
            .keys()
            .chain(task.kind.as_ref().filter(|_| task.needs.is_empty()));
        let levels = skills.flat_map(|skill| {
            let robots = instance
                .robots
                .iter()
                .filter_map(|robot| robot.skills.as_ref());
            robots.filter_map(move |levels| levels.get(skill).copied())
        });
        levels.filter(|level| *level > 0.0).fold(1.0, f64::min)
    };
    let opening_s = |point: &Point| point.task.arrival_s + point.task.opens_s.unwrap_or(0.0);
    let last_s = points.iter().map(opening_s).fold(0.0, f64::max);
    let work_s: f64 = points
        .iter()
        .map(|Point { task, .. }| {
            let slots = f64::from(task.needs.values().sum::<u32>());
            task.work_s / pace(task) + across_s + slots * (across_s + wait_s)
        })
        .sum();
    let ways = if instance.obstacles.is_empty() {
        1.0
    } else {
        DETOURS
    };
    (last_s + ways * work_s).ceil().min(LONGEST_S)
}

fn kind_table(kind: &WorkKind) -> Table {
    let mut each = Table::new();
    each.insert("name".to_owned(), Value::String(kind.name.clone()));
    let [min, max] = kind.work_s;
    each.insert("work_s".to_owned(), table([("min", min), ("max", max)]));
    if kind.workers != 1 {
        each.insert("workers".to_owned(), Value::Integer(kind.workers.into()));
    }
    each
}

fn numbers<const N: usize>(values: [(&str, f64); N]) -> Table {
    values
        .map(|(key, number)| (key.to_owned(), Value::Float(number)))
        .into_iter()
        .collect()
}

fn table<const N: usize>(values: [(&str, f64); N]) -> Value {
    Value::Table(numbers(values))
}

/// Returns a name for the scenario: characters that a name cannot have become `-`.
fn name(text: &str) -> String {
    const MOST: usize = 32;
    let allowed = |c: char| {
        if c.is_ascii_alphanumeric() || c == '_' {
            c
        } else {
            '-'
        }
    };
    let name: String = text.trim().chars().map(allowed).collect();
    let name: String = name.trim_matches('-').chars().take(MOST).collect();
    if is_name(&name) {
        name
    } else {
        "instance".to_owned()
    }
}

/// The text of a scenario file.
struct File(String);

impl File {
    /// Adds a line of comment. Texts of the instance cannot end the line.
    fn comment(&mut self, text: &str) {
        self.0 += &format!("# {}\n", terminal::in_one_line(text));
    }

    fn value(&mut self, key: &str, value: Value) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "{key} = {value}");
    }

    /// Adds a list with one row per value, each with a comment unless it is empty.
    fn list(&mut self, key: &str, rows: impl Iterator<Item = (Value, String)>) {
        self.0 += &format!("{key} = [\n");
        for (row, comment) in rows {
            self.0 += &format!("    {row},");
            if !comment.is_empty() {
                self.0 += &format!(" # {}", terminal::in_one_line(&comment));
            }
            self.0.push('\n');
        }
        self.0 += "]\n";
    }
}

//! The instance of a scenario of the mission *service*, for exports.

use missions::service::data::{SERVICE, ServiceSection, points};
use scenario::fault::EventTrigger;
use scenario::{Problem, Scenario};
use toml::Table;

use super::model::{Floor, Instance, Robot, Task};
use super::properties::PROPERTIES;

/// The instance of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Extracted {
    pub instance: Instance,
    /// The contents of the scenario that an instance cannot express, one line each.
    pub notes: Vec<String>,
}

/// Returns the instance of a scenario with all points that its seed draws. `starts` are the places of the robots at the
/// start, by rank, m; absent robots are left out.
///
/// # Errors
/// Returns an error if the mission is another one, or if the scenario cannot be expressed as text.
pub fn instance(scenario: &Scenario, seed: u64, starts: &[[f64; 2]]) -> Result<Extracted, Problem> {
    let mission = scenario.mission();
    if mission != SERVICE {
        let what = format!("the mission is {}", mission.name());
        return Err(Problem::of_value(
            what,
            "only runs of the mission service have tasks at places",
        ));
    }
    let section = ServiceSection::of(scenario);
    // A point is known by its name or by its number.
    let id = |number: usize| {
        let name = section
            .points
            .get(number)
            .and_then(|point| point.name.clone());
        name.unwrap_or_else(|| format!("p{number}"))
    };
    let text = Table::try_from(section);
    let text = text.map_err(|error| Problem::of_value(error.to_string(), ""))?;
    let stated = text.get("points").and_then(|points| points.as_array());
    let tasks = points(scenario, seed)
        .into_iter()
        .enumerate()
        .map(|(index, point)| {
            let kind = &section.kinds[point.kind];
            let mut task = Task {
                id: id(index),
                x_m: readable(point.at.x),
                y_m: readable(point.at.y),
                work_s: point.work_s,
                arrival_s: point.arrives.as_secs_f64(),
                deadline_s: point.expires_after.map(|after| after.as_secs_f64()),
                kind: Some(kind.name.clone()),
                workers: Some(kind.workers).filter(|workers| *workers != 1),
                ..Task::default()
            };
            // Points that the seed draws state nothing.
            let values = stated.and_then(|stated| stated.get(index)?.as_table());
            for property in PROPERTIES {
                if let Some(value) = values.and_then(|values| values.get(property.name)) {
                    (property.read)(&mut task, value);
                }
            }
            for before in &mut task.after {
                if let Some(number) = EventTrigger::number_of(before, "p") {
                    *before = id(number);
                }
            }
            task
        });
    let tasks = tasks.collect();
    let robots = scenario
        .robots
        .iter()
        .zip(starts)
        .filter(|(robot, _)| !robot.absent);
    let robots = robots.map(|(robot, [x, y])| Robot {
        id: robot.name.clone(),
        x_m: Some(*x),
        y_m: Some(*y),
        speed_m_s: robot.speed_m_s.map(readable),
        skills: robot.skills.clone(),
        capacity: robot.capacity,
    });
    let mut notes = Vec::new();
    let mut note = |is_stated: bool, text: &str| {
        if is_stated {
            notes.push(text.to_owned());
        }
    };
    let mut kinds = section.kinds.iter();
    note(
        kinds.clone().any(|kind| kind.period_s.is_some()),
        "tasks that come back: only their first arrival is in the instance",
    );
    note(
        kinds.any(|kind| !kind.kept),
        "kept = false: not in the instance",
    );
    note(
        scenario.robots.iter().any(|robot| robot.absent),
        "absent robots: not in the instance",
    );
    note(scenario.energy.is_some(), "energy: not in the instance");
    Ok(Extracted {
        instance: Instance {
            name: scenario.name.clone(),
            limit_s: Some(scenario.limit_s),
            speed_m_s: Some(readable(scenario.body.speed_m_s)),
            turn_deg_s: Some(readable(scenario.body.turn_deg_s)),
            robot_penetrability: Some(readable(scenario.body.robot_penetrability)),
            reach_m: Some(readable(section.reach_m)),
            room: Some(Floor {
                x_m: readable(scenario.room.x_m),
                y_m: readable(scenario.room.y_m),
                width_m: readable(scenario.room.width_m),
                height_m: readable(scenario.room.height_m),
            }),
            tasks,
            robots: robots.collect(),
            obstacles: scenario.obstacles.clone(),
            result: None,
        },
        notes,
    })
}

/// Returns a length of single precision with the decimal digits that it was written with.
pub fn readable(single: f32) -> f64 {
    // The shortest decimal number of a finite single is a double.
    single.to_string().parse().unwrap_or_else(|_| single.into())
}

//! Checks of ranges and names of a scenario, independent of its geometry and parameters.

use std::collections::{BTreeMap, BTreeSet};

use super::alliance::BehaviorSection;
use super::catalog::Catalog;
use super::error::Problem;
use super::limits::{
    DEMAND, FARTHEST_M, LENGTH, NumberRange, PENETRABILITY, POWER, SPEED, TIME, TURN_RATE,
    above_zero, check_known, check_name, check_names, closed,
};
use super::path::KeyPath;
use super::{Robot, Scenario};
use crate::fault::RandomFaults;
use crate::ids::TaskId;
use crate::names::RESERVED;
use crate::room::check_resolution;

/// The maximum number of robots of a scenario. Random streams of links have room for ranks of 24 bits.
pub const MAX_ROBOTS: usize = 1_000_000;
/// The maximum number of tasks of each kind in a mission: spills, points, bars or targets.
pub const MAX_TASKS: usize = MAX_ROBOTS;
/// The maximum expected number of random faults in a mission.
const MAX_RANDOM_FAULTS: f64 = 1e5;

/// Rejects the first mistake of a scenario, in the order of its fields.
pub(super) fn validate(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    const STEP: NumberRange = closed(1.0, 500.0, "ms");
    check_name(["name"], &scenario.name)?;
    STEP.check(["step_ms"], scenario.step_ms as f64)?;
    TIME.check(["limit_s"], scenario.limit_s)?;
    if scenario.step_order.is_some() && scenario.alliance.switches.step_order.is_some() {
        let at = ["alliance", "switches", "step_order"];
        let what = "step_order at the top of the scenario already states it";
        return Err(Problem::at(at, what, "state it once"));
    }

    scenario.room.check(FARTHEST_M)?;
    let (body, sensors) = (&scenario.body, &scenario.sensors);
    for (section, key, range, number) in [
        ("body", "radius_m", LENGTH, body.radius_m),
        ("body", "speed_m_s", SPEED, body.speed_m_s),
        ("body", "push_m_s", SPEED, body.push_m_s),
        ("body", "turn_deg_s", TURN_RATE, body.turn_deg_s),
        ("body", "reach_m", LENGTH, body.reach_m),
        (
            "body",
            "robot_penetrability",
            PENETRABILITY,
            body.robot_penetrability,
        ),
        ("sensors", "border_range_m", LENGTH, sensors.border_range_m),
        (
            "sensors",
            "avoidance_range_m",
            LENGTH,
            sensors.avoidance_range_m,
        ),
        ("sensors", "waste_range_m", LENGTH, sensors.item_range_m),
    ] {
        range.check([section, key], number)?;
    }
    if let Some(energy) = &scenario.energy {
        above_zero(1e12, "J").check(["energy", "capacity_j"], energy.capacity_j)?;
        POWER.check(["energy", "idle_w"], energy.idle_w)?;
        POWER.check(["energy", "drive_w"], energy.drive_w)?;
    }
    scenario.radio.check()?;
    mission(scenario, catalog)?;
    robots(scenario, catalog)?;
    check_resolution(scenario)?;
    obstacles(scenario)?;
    tasks(scenario, catalog)?;
    faults(scenario, catalog)?;
    alliance(scenario, catalog)
}

/// Checks the mission's section: first by the mission itself, then against the declared parameters.
fn mission(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let mission = catalog.mission;
    mission.check(scenario)?;
    let declared = mission.parameters();
    if declared.is_empty() {
        return Ok(());
    }
    let at = KeyPath::new([mission.name()]);
    let section = serde_json::to_value(&scenario.mission).map_err(|error| {
        let remedy = "make the section serializable";
        Problem::at(at.clone(), error.to_string(), remedy)
    })?;
    let section = section.get(mission.name()).unwrap_or(&section);
    let mut declared = declared.iter();
    declared.try_for_each(|parameter| parameter.check_in(section, &at, &scenario.room))
}

fn robots(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let robots = KeyPath::new(["robots"]);
    check_names(&robots, names(scenario), MAX_ROBOTS)?;
    for (index, name) in names(scenario).enumerate() {
        if let Some((_, means)) = RESERVED.iter().find(|(reserved, _)| *reserved == name) {
            let what = format!("'{name}' means {means}");
            let at = robots.index(index).key("name");
            return Err(Problem::at(at, what, "choose another name"));
        }
    }
    if scenario.robots.iter().all(|robot| robot.absent) {
        let what = "all robots are absent";
        let remedy = "make at least one present from the start";
        return Err(Problem::at(robots, what, remedy));
    }
    let equipment = Equipment::of(scenario, catalog);
    equipment.check(&scenario.devices, &scenario.skills, &KeyPath::default())?;
    for (index, robot) in scenario.robots.iter().enumerate() {
        for (number, task) in robot.tasks.iter().enumerate() {
            if catalog.find_task(task).is_none() {
                let at = robots.index(index).key("tasks").index(number);
                let tasks = catalog.tasks.iter().map(|task| task.name.as_str());
                check_known(at, "there is no task", task, tasks)?;
            }
        }
        let at = robots.index(index);
        if let Some(controller) = &robot.controller {
            check_name(at.key("controller"), controller)?;
        }
        for (key, range, number) in [
            ("speed_m_s", SPEED, robot.speed_m_s),
            ("push_m_s", SPEED, robot.push_m_s),
            ("turn_deg_s", TURN_RATE, robot.turn_deg_s),
        ] {
            if let Some(number) = number {
                range.check(at.key(key), number)?;
            }
        }
        if let Some(capacity) = robot.capacity {
            DEMAND.check(at.key("capacity"), capacity)?;
            if !catalog.mission.vocabulary().has_loads {
                let what = "the mission has no loads";
                return Err(Problem::at(at.key("capacity"), what, "omit it"));
            }
        }
        let devices = robot.devices.iter().flatten();
        equipment.check(devices, robot.skills.iter().flatten(), &at)?;
        has_a_behavior(robot, catalog, &at)?;
        let Some(start) = &robot.start else { continue };
        let at = at.key("start");
        scenario.room.range_x().check(at.key("x_m"), start.x_m)?;
        scenario.room.range_y().check(at.key("y_m"), start.y_m)?;
        closed(-360.0, 360.0, "deg").check(at.key("heading_deg"), start.heading_deg)?;
    }
    Ok(())
}

/// The devices and skills that a robot of a scenario may have.
struct Equipment {
    devices: BTreeSet<&'static str>,
    skills: Vec<String>,
}

impl Equipment {
    fn of(scenario: &Scenario, catalog: &Catalog) -> Self {
        let of_mission = catalog.mission.vocabulary().optional_devices;
        Self {
            devices: of_mission
                .iter()
                .copied()
                .chain([Robot::SIDE_BORDER])
                .collect(),
            skills: catalog.mission.skills(scenario),
        }
    }

    /// Rejects devices and skills that no robot can have, below `at`.
    fn check<'a>(
        &self,
        devices: impl IntoIterator<Item = &'a String>,
        skills: impl IntoIterator<Item = (&'a String, &'a f64)>,
        at: &KeyPath,
    ) -> Result<(), Problem> {
        for (number, device) in devices.into_iter().enumerate() {
            let at = at.key("devices").index(number);
            let known = self.devices.iter().copied();
            check_known(at, "there is no optional device", device, known)?;
        }
        for (skill, level) in skills {
            let at = at.key("skills").key(skill);
            let known = self.skills.iter().map(String::as_str);
            check_known(&at, "there is no skill", skill, known)?;
            closed(0.0, 1e3, "").check(at, *level)?;
        }
        Ok(())
    }
}

/// Rejects a robot without any behavior.
fn has_a_behavior(robot: &Robot, catalog: &Catalog, at: &KeyPath) -> Result<(), Problem> {
    if catalog.behaviors_of(robot).next().is_some() {
        return Ok(());
    }
    let of_any_task = Robot {
        tasks: Vec::new(),
        ..robot.clone()
    };
    let tasks: BTreeSet<TaskId> = catalog
        .behaviors_of(&of_any_task)
        .map(|behavior| catalog.sets[behavior.index()].task)
        .collect();
    let tasks: Vec<&str> = tasks.iter().map(|task| catalog.task_name(*task)).collect();
    let remedy = if tasks.is_empty() {
        "give it devices or skills that a task needs, or remove it".to_owned()
    } else {
        format!("of all tasks it can do {}", tasks.join(", "))
    };
    let what = format!("{} has no behavior for any of its tasks", robot.name);
    let stated = if robot.tasks.is_empty() {
        at.clone()
    } else {
        at.key("tasks")
    };
    Err(Problem::at(stated, what, remedy))
}

fn obstacles(scenario: &Scenario) -> Result<(), Problem> {
    let at = KeyPath::new(["obstacles"]);
    let mut obstacles = scenario.obstacles.iter().enumerate();
    obstacles.try_for_each(|(index, obstacle)| obstacle.check(&at.index(index)))
}

fn faults(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let at = KeyPath::new(["faults", "timeline"]);
    let mut first = BTreeMap::new();
    for (index, order) in scenario.faults.timeline.iter().enumerate() {
        let at = at.index(index);
        let checked = order.check(scenario, catalog);
        checked.map_err(|problem| problem.under(&at))?;
        if let Some(id) = &order.id
            && let Some(first) = first.insert(id, index)
        {
            let what = format!("'{id}' is already the id of faults.timeline[{first}]");
            return Err(Problem::at(at.key("id"), what, "give each its own id"));
        }
        if let Some(id) = &order.id
            && id.starts_with(RandomFaults::ID_PREFIX)
            && scenario.faults.random.is_some()
        {
            let prefix = RandomFaults::ID_PREFIX;
            let what = format!("'{id}' may become the id of a random fault");
            let remedy = format!("choose an id that does not begin with '{prefix}'");
            return Err(Problem::at(at.key("id"), what, remedy));
        }
    }
    match &scenario.faults.random {
        Some(campaign) => random_faults(scenario, campaign),
        None => Ok(()),
    }
}

fn random_faults(scenario: &Scenario, campaign: &RandomFaults) -> Result<(), Problem> {
    let at = KeyPath::new(["faults", "random"]);
    TIME.check(at.key("mtbf_s"), campaign.mtbf_s)?;
    TIME.check(at.key("mttr_s"), campaign.mttr_s)?;
    let mix = &campaign.mix;
    let weights = [
        ("kill", mix.kill),
        ("pause", mix.pause),
        ("link", mix.link),
        ("sensor", mix.sensor),
        ("actuator", mix.actuator),
        ("power", mix.power),
        ("babble", mix.babble),
    ];
    for (kind, weight) in weights {
        closed(0.0, 1e6, "").check(at.key("mix").key(kind), weight)?;
    }
    if weights.iter().all(|(_, weight)| *weight == 0.0) {
        let what = "every weight is 0";
        return Err(Problem::at(at.key("mix"), what, "set one above 0"));
    }
    let rate = scenario.robots.len() as f64 / (campaign.mtbf_s + campaign.mttr_s);
    let expected = rate * scenario.limit_s;
    if expected > MAX_RANDOM_FAULTS {
        let what = format!("about {expected:.0} faults are expected until limit_s");
        let remedy = format!("increase it or reduce limit_s, for at most {MAX_RANDOM_FAULTS}");
        return Err(Problem::at(at.key("mtbf_s"), what, remedy));
    }
    Ok(())
}

fn tasks(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let tasks = || catalog.tasks.iter().map(|task| task.name.as_str());
    for (name, section) in &scenario.tasks {
        let at = KeyPath::new(["tasks"]).key(name);
        check_known(&at, "there is no task", name, tasks())?;
        if let Some(max_robots) = section.max_robots {
            closed(1.0, f64::from(u32::MAX), "").check(at.key("max_robots"), max_robots)?;
        }
    }
    Ok(())
}

fn alliance(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let at = KeyPath::new(["alliance"]);
    let section = &scenario.alliance;
    teammates(scenario, &section.defaults, None, &at.key("defaults"))?;
    for (set, values) in &section.sets {
        let at = at.key("sets").key(set);
        let sets = catalog.sets.iter().map(|set| set.name.as_str());
        check_known(&at, "there is no behavior set", set, sets)?;
        teammates(scenario, values, None, &at)?;
    }
    for (name, of_robot) in &section.robots {
        let at = at.key("robots").key(name);
        check_known(&at, "there is no robot", name, names(scenario))?;
        teammates(
            scenario,
            &of_robot.defaults,
            Some(name),
            &at.key("defaults"),
        )?;
        for (set, values) in &of_robot.sets {
            let at = at.key("sets").key(set);
            let robot = scenario.robots.iter().find(|robot| robot.name == *name);
            let sets = robot
                .into_iter()
                .flat_map(|robot| catalog.behaviors_of(robot));
            let what = format!("there is no behavior set of {name}");
            check_known(&at, &what, set, sets.map(|set| catalog.behavior_name(set)))?;
            teammates(scenario, values, Some(name), &at)?;
        }
    }
    Ok(())
}

/// Rejects a section that names an unknown teammate. The section's own robot is not a teammate.
fn teammates(
    scenario: &Scenario,
    section: &BehaviorSection,
    owner: Option<&str>,
    at: &KeyPath,
) -> Result<(), Problem> {
    let toward = [
        ("slow_impatience_toward", &section.slow_impatience_toward),
        (
            "willing_to_affect_toward_s",
            &section.willing_to_affect_toward_s,
        ),
    ];
    for (key, by_teammate) in toward {
        for teammate in by_teammate.keys() {
            let others = names(scenario).filter(|name| Some(*name) != owner);
            let at = at.key(key).key(teammate);
            check_known(at, "there is no teammate", teammate, others)?;
        }
    }
    Ok(())
}

fn names(scenario: &Scenario) -> impl ExactSizeIterator<Item = &str> {
    scenario.robots.iter().map(|robot| robot.name.as_str())
}

#[cfg(test)]
mod tests {
    use super::RESERVED;
    use crate::Scenario;
    use crate::testkit::vocabulary;

    #[test]
    fn a_robot_cannot_have_a_reserved_name() {
        let read = |name: &str| {
            let text = format!("[drill]\n[[robots]]\nname = 'a'\n[[robots]]\nname = '{name}'");
            Scenario::parse("s.toml", &text, &vocabulary()).map_err(|error| error.to_string())
        };
        for (name, means) in RESERVED {
            let expected =
                format!("s.toml:5: robots[1].name: '{name}' means {means}; choose another name");
            assert_eq!(read(name), Err(expected));
        }
        // The logs of hosts have a dot in their names, so these cannot clash.
        for name in ["World", "world-1", "pages", "host-h2", "launcher"] {
            assert!(read(name).is_ok(), "{name}");
        }
    }

    #[test]
    fn a_robot_without_a_behavior_is_refused_at_its_tasks() {
        let refusal = |robot: &str| {
            let text = format!("[drill]\n[[robots]]\nname = 'a'\n{robot}");
            Scenario::parse("s.toml", &text, &vocabulary()).map_err(|error| error.to_string())
        };
        let none = "s.toml:5: robots[0].tasks: a has no behavior for any of its tasks; of all tasks it can do find, report";
        let moves = "tasks = ['move(top)', 'move(bottom)']\n";
        let cannot = "skills = { lift = 0 }\n";
        assert_eq!(refusal(&format!("{cannot}{moves}")), Err(none.to_owned()));
        let none = "s.toml:4: robots[0].tasks: an empty list means no task, and a missing key means all tasks; see the reference scenario";
        assert_eq!(refusal("tasks = []"), Err(none.to_owned()));
        for robot in [cannot, moves] {
            assert!(refusal(robot).is_ok(), "{robot}");
        }
    }
}

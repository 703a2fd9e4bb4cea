//! Checks of an order, independent of its source.

use super::{
    ActuatorMode, Device, Fault, FaultRange, LinkEnd, MissionFault, Order, Role, SensorMode,
    TriggerEvent,
};
use crate::Obstacle;
use crate::limits::readable;
use crate::names::is_name;
use crate::{Catalog, Robot, Scenario, name_remedy};

/// The longest time, s, as in scenario files.
const LONGEST_S: f64 = 1e9;

/// The farthest place and the largest size, m, as in scenario files.
const FARTHEST_M: f64 = 1e3;

/// An order that is not valid. It displays as one line: field, problem and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {problem}; {remedy}", field.join("."))]
pub struct OrderError {
    /// The path to the value, from the order down.
    pub field: Vec<String>,
    /// The problem with the value.
    pub problem: String,
    /// A remedy for the problem.
    pub remedy: String,
}

type Checked = Result<(), OrderError>;

impl Order {
    /// Checks robots, behavior sets and ranges. `catalog` must be the scenario's.
    pub fn check(&self, scenario: &Scenario, catalog: &Catalog) -> Checked {
        if let Some(id) = &self.id
            && !is_name(id)
        {
            let remedy =
                "use at most 32 letters, digits, '-' and '_', with a letter or a digit first";
            return Err(wrong(&["id"], format!("'{id}' is not a name"), remedy));
        }
        let checker = Checker { scenario, catalog };
        checker.fault(&self.fault)?;
        self.check_trigger(&checker)
    }

    fn check_trigger(&self, checker: &Checker<'_>) -> Checked {
        if let Some(at_s) = self.at_s {
            within(&["at_s"], at_s, 0.0, LONGEST_S, "s")?;
        }
        if let Some(every_s) = self.every_s {
            above_zero(&["every_s"], every_s, LONGEST_S, "s")?;
        }
        if let Some(for_s) = self.for_s {
            above_zero(&["for_s"], for_s, LONGEST_S, "s")?;
            if self.fault.is_instantaneous() {
                let what = format!("'{}' is instantaneous", self.fault.name());
                return Err(wrong(&["for_s"], what, "omit the duration"));
            }
            if let Some(every_s) = self.every_s
                && for_s >= every_s
            {
                let what = format!("{for_s} s is not shorter than the interval of {every_s} s");
                return Err(wrong(&["for_s"], what, "make it heal before it repeats"));
            }
        } else if self.every_s.is_some() && !self.fault.is_instantaneous() {
            let what = "the fault repeats but never heals".to_owned();
            return Err(wrong(&["every_s"], what, "give it a duration"));
        }
        checker
            .catalog
            .mission
            .check_order(checker.scenario, self)?;
        let Some(when) = &self.when else {
            return Ok(());
        };
        if self.at_s.is_some() || self.every_s.is_some() {
            let what = "both an event and a time trigger the fault".to_owned();
            return Err(wrong(&["when"], what, "give only one of them"));
        }
        if let Some(robot) = &when.robot {
            checker.robot(&["when"], robot)?;
        }
        let mut verbs = TriggerEvent::verbs(checker.catalog.mission);
        if !verbs.clone().any(|verb| verb == when.what) {
            let what = format!("there is no event '{}'", when.what);
            return Err(wrong(&["when"], what, &name_remedy(&when.what, &mut verbs)));
        }
        match &when.subject {
            Some(set) if when.has_behavior_set_subject() => checker.set(&["when"], set),
            _ => Ok(()),
        }
    }
}

struct Checker<'s> {
    scenario: &'s Scenario,
    catalog: &'s Catalog,
}

impl Checker<'_> {
    fn fault(&self, fault: &Fault) -> Checked {
        let name = fault.name();
        if let Some(role) = fault.role() {
            self.role(name, role)?;
        } else if let Some(robot) = fault.robot() {
            self.robot(&["fault", name], robot)?;
        }
        let at = |key| ["fault", name, key];
        match fault {
            Fault::Add(robot) => self.absent(&["fault", name], robot),
            Fault::Drop(loss) => {
                self.ends(name, &loss.from, &loss.to)?;
                within(&at("burst_s"), loss.burst_s, 0.0, LONGEST_S, "s")?;
                share(&at("p"), loss.p)
            }
            Fault::Delay(delay) => {
                self.ends(name, &delay.from, &delay.to)?;
                within(&at("delay_s"), delay.delay_s, 0.0, LONGEST_S, "s")?;
                within(&at("jitter_s"), delay.jitter_s, 0.0, LONGEST_S, "s")
            }
            Fault::Duplicate(chance) | Fault::Reorder(chance) => {
                self.ends(name, &chance.from, &chance.to)?;
                share(&at("p"), chance.p)
            }
            Fault::Hold(link) => self.ends(name, &link.from, &link.to),
            Fault::Partition(partition) => self.partition(&at("groups"), &partition.groups),
            Fault::Range(range) => above_zero(&at("range_m"), range.range_m, FARTHEST_M, "m"),
            Fault::Sensor(fault) => {
                let field = at("mode");
                let mission = self.catalog.mission;
                if !Device::names_for(mission).any(|name| fault.device == *name) {
                    let what = format!("there is no choice '{}'", fault.device);
                    let known = &mut Device::names_for(mission);
                    return Err(wrong(
                        &at("device"),
                        what,
                        &name_remedy(fault.device.as_str(), known),
                    ));
                }
                self.has(&at("device"), &fault.robot, fault.device.as_str())?;
                match fault.mode {
                    SensorMode::Dropout(p) => share(&field, p),
                    SensorMode::Noise(error) | SensorMode::Bias(error) => {
                        if !fault.device.measures_lengths(mission) {
                            let what =
                                format!("'{}' does not measure lengths", fault.device.as_str());
                            return Err(wrong(&field, what, "use dead, stuck or dropout"));
                        }
                        within(&field, error.m, -FARTHEST_M, FARTHEST_M, "m")?;
                        within(&field, error.deg, -360.0, 360.0, "degrees")
                    }
                    SensorMode::Dead | SensorMode::Stuck => Ok(()),
                }
            }
            Fault::Actuator(fault) => match fault.mode {
                ActuatorMode::Slowed(part) => share(&at("mode"), part),
                ActuatorMode::TurnBias(deg_s) => {
                    within(&at("mode"), deg_s, -3600.0, 3600.0, "degrees/s")
                }
                ActuatorMode::Dead | ActuatorMode::OneWheel(_) | ActuatorMode::Gripper => Ok(()),
            },
            Fault::Skill(fault) => {
                self.can(&at("skill"), &fault.robot, &fault.skill)?;
                share(&at("share"), fault.share)
            }
            Fault::Obstacle(rectangle) => {
                anywhere(name, rectangle.x_m, rectangle.y_m)?;
                self.in_the_room(&["fault", name], rectangle)?;
                above_zero(&at("width_m"), rectangle.width_m, FARTHEST_M, "m")?;
                above_zero(&at("height_m"), rectangle.height_m, FARTHEST_M, "m")?;
                within(
                    &at("penetrability"),
                    rectangle.penetrability,
                    0.0,
                    100.0,
                    "",
                )
            }
            Fault::Mission(fault) => self.mission(fault),
            Fault::MoveRobot(moved) => {
                if let Some(heading_deg) = moved.heading_deg {
                    within(&at("heading_deg"), heading_deg, -360.0, 360.0, "degrees")?;
                }
                self.inside(name, moved.x_m, moved.y_m)
            }
            _ => Ok(()),
        }
    }

    fn mission(&self, fault: &MissionFault) -> Checked {
        let MissionFault { name, values } = fault;
        let mission_faults = self.catalog.mission.faults();
        let Some(spec) = mission_faults.iter().find(|spec| spec.name == name) else {
            let what = format!("there is no choice '{name}'");
            let known = &mut Fault::COMMON_NAMES
                .into_iter()
                .chain(mission_faults.iter().map(|spec| spec.name));
            return Err(wrong(&["fault"], what, &name_remedy(name, known)));
        };
        for key in values.keys() {
            let mut keys = spec.arguments.iter().map(|argument| argument.key);
            if !keys.clone().any(|known| known == key) {
                let remedy = name_remedy(key, &mut keys);
                let at = ["fault", name, key];
                return Err(wrong(&at, "unknown key".to_owned(), &remedy));
            }
        }
        for argument in spec.arguments {
            let at = ["fault", name, argument.key];
            let Some(stated) = values.get(argument.key) else {
                if argument.default.is_some() {
                    continue;
                }
                let what = "the key is missing".to_owned();
                return Err(wrong(&at, what, "give it a value"));
            };
            if argument.range == FaultRange::Name {
                let names = self
                    .catalog
                    .mission
                    .fault_names(self.scenario, argument.key);
                let mut names = names.iter().map(String::as_str);
                let name = stated.to_string();
                if fault
                    .get_name(argument.key)
                    .is_none_or(|name| !names.clone().any(|known| known == name))
                {
                    let what = format!("there is no {} '{name}'", argument.key);
                    return Err(wrong(&at, what, &name_remedy(&name, &mut names)));
                }
                continue;
            }
            let Some(value) = fault.get(argument.key) else {
                let what = format!("'{stated}' is not a number");
                return Err(wrong(&at, what, "write a number"));
            };
            let (from, to) = argument.range.bounds(self.scenario.room);
            if argument.range.is_whole() && value.fract() != 0.0 {
                let what = format!("{value} is not a whole number");
                return Err(wrong(&at, what, &format!("write one from {from} to {to}")));
            }
            let (_, unit) = argument.stem_and_unit();
            within(&at, value, from, to, unit)?;
        }
        Ok(())
    }

    fn robot(&self, field: &[&str], robot: &str) -> Checked {
        let mut known = self.scenario.robots.iter().map(|robot| robot.name.as_str());
        if known.clone().any(|name| name == robot) {
            return Ok(());
        }
        let what = format!("the scenario has no robot '{robot}'");
        Err(wrong(field, what, &name_remedy(robot, &mut known)))
    }

    fn set(&self, field: &[&str], set: &str) -> Checked {
        let mut known = self.catalog.sets.iter().map(|set| set.name.as_str());
        if known.clone().any(|name| name == set) {
            return Ok(());
        }
        let what = format!("there is no behavior set '{set}'");
        Err(wrong(field, what, &name_remedy(set, &mut known)))
    }

    /// Checks the role that a fault targets. Any robot that executes a task has a process, a radio and power, but
    /// perhaps no other device.
    fn role(&self, name: &str, role: Role<'_>) -> Checked {
        let field = ["fault", name];
        if !Fault::ROLE_TARGETED.contains(&name) {
            let what = format!("'{name}' cannot target a role");
            let known = Fault::ROLE_TARGETED.join(", ");
            let remedy = format!("name a robot, or use one of {known}");
            return Err(wrong(&field, what, &remedy));
        }
        match role {
            Role::Executing(task) => self.set(&field, task),
            Role::Idle => Ok(()),
        }
    }

    fn absent(&self, field: &[&str], robot: &str) -> Checked {
        let mut absent = self.scenario.robots.iter().filter(|robot| robot.absent);
        if absent.clone().any(|absent| absent.name == robot) {
            return Ok(());
        }
        let what = format!("'{robot}' is in the mission from its start");
        let known = &mut absent.by_ref().map(|robot| robot.name.as_str());
        let remedy = format!(
            "name a robot that the scenario marks as absent: {}",
            name_remedy(robot, known)
        );
        Err(wrong(field, what, &remedy))
    }

    fn ends(&self, name: &str, from: &LinkEnd, to: &LinkEnd) -> Checked {
        for (key, who) in [("from", from), ("to", to)] {
            if let LinkEnd::Robot(robot) = who {
                self.robot(&["fault", name, key], robot)?;
            }
        }
        if let (LinkEnd::Robot(from), LinkEnd::Robot(to)) = (from, to)
            && from == to
        {
            let what = format!("'{to}' does not receive its own messages");
            let remedy = "name two robots, or all";
            return Err(wrong(&["fault", name, "to"], what, remedy));
        }
        Ok(())
    }

    /// Checks that a robot has a device. A missing device cannot fail.
    fn has(&self, field: &[&str], robot: &str, device: &str) -> Checked {
        let has = |robot: &&Robot| robot.has_device(device);
        let mut with = self.scenario.robots.iter().filter(has);
        let is_there = with.clone().any(|with| with.name == robot);
        if is_there || !Device::is_optional(device, self.catalog.mission) {
            return Ok(());
        }
        let known = &mut with.by_ref().map(|robot| robot.name.as_str());
        let remedy = format!("name one that has it: {}", name_remedy(robot, known));
        Err(wrong(
            field,
            format!("'{robot}' has no '{device}'"),
            &remedy,
        ))
    }

    /// Checks that a robot has a skill. Only an existing skill can get worse.
    fn can(&self, field: &[&str], robot: &str, skill: &str) -> Checked {
        let known = self.catalog.mission.skills(self.scenario);
        let mut known = known.iter().map(String::as_str);
        if !known.clone().any(|known| known == skill) {
            let what = format!("there is no skill '{skill}'");
            return Err(wrong(field, what, &name_remedy(skill, &mut known)));
        }
        let has = |robot: &&Robot| robot.skill(skill).unwrap_or(1.0) > 0.0;
        let able = self.scenario.robots.iter().filter(has);
        let mut able = able.map(|robot| robot.name.as_str());
        if able.clone().any(|able| able == robot) {
            return Ok(());
        }
        let what = format!("'{robot}' has no skill '{skill}'");
        let remedy = format!("name one that has it: {}", name_remedy(robot, &mut able));
        Err(wrong(field, what, &remedy))
    }

    /// Checks that an obstacle lies in the room and does not fill it.
    fn in_the_room(&self, field: &[&str], rectangle: &Obstacle) -> Checked {
        let room = self.scenario.room;
        let along = |from: f32, size: f32, room: f32| {
            (
                from + size >= 0.0 && from <= room,
                from <= 0.0 && from + size >= room,
            )
        };
        let (meets_x, fills_x) = along(rectangle.x_m, rectangle.width_m, room.width_m);
        let (meets_y, fills_y) = along(rectangle.y_m, rectangle.height_m, room.height_m);
        let remedy = format!(
            "the room is {} m wide and {} m high",
            room.width_m, room.height_m
        );
        if !(meets_x && meets_y) {
            return Err(wrong(
                field,
                "the obstacle is outside the room".to_owned(),
                &remedy,
            ));
        }
        if fills_x && fills_y {
            return Err(wrong(
                field,
                "the obstacle fills the room".to_owned(),
                &remedy,
            ));
        }
        Ok(())
    }

    fn partition(&self, field: &[&str], groups: &[Vec<String>]) -> Checked {
        if groups.len() < 2 || groups.iter().any(Vec::is_empty) {
            let what = "a partition has at least two groups, none of them empty".to_owned();
            return Err(wrong(field, what, "write them as in \"blue,gold / green\""));
        }
        let mut seen = Vec::new();
        for robot in groups.iter().flatten() {
            self.robot(field, robot)?;
            if seen.contains(&robot) {
                let what = format!("'{robot}' is in two groups");
                return Err(wrong(field, what, "name it once"));
            }
            seen.push(robot);
        }
        Ok(())
    }

    /// Checks that a place lies inside the border.
    fn inside(&self, name: &str, x_m: f32, y_m: f32) -> Checked {
        let room = self.scenario.room;
        within(
            &["fault", name, "x_m"],
            x_m,
            0.0,
            f64::from(room.width_m),
            "m",
        )?;
        within(
            &["fault", name, "y_m"],
            y_m,
            0.0,
            f64::from(room.height_m),
            "m",
        )
    }
}

fn anywhere(name: &str, x_m: f32, y_m: f32) -> Checked {
    within(&["fault", name, "x_m"], x_m, -FARTHEST_M, FARTHEST_M, "m")?;
    within(&["fault", name, "y_m"], y_m, -FARTHEST_M, FARTHEST_M, "m")
}

fn share(field: &[&str], value: impl Into<f64>) -> Checked {
    within(field, value, 0.0, 1.0, "")
}

fn above_zero(field: &[&str], value: impl Into<f64>, to: f64, unit: &str) -> Checked {
    let value = value.into();
    if value > 0.0 && value <= to {
        return Ok(());
    }
    let remedy = format!("it must be above 0 and at most {to} {unit}");
    Err(wrong(
        field,
        format!("{value} is out of range"),
        remedy.trim_end(),
    ))
}

fn within(field: &[&str], value: impl Into<f64>, from: f64, to: f64, unit: &str) -> Checked {
    let value = value.into();
    if (from..=to).contains(&value) {
        return Ok(());
    }
    let (from, to) = (readable(from), readable(to));
    let remedy = format!("it must be at least {from} and at most {to} {unit}");
    Err(wrong(
        field,
        format!("{} is out of range", readable(value)),
        remedy.trim_end(),
    ))
}

fn wrong(field: &[&str], what: String, remedy: &str) -> OrderError {
    OrderError::at(field, what, remedy)
}

impl OrderError {
    /// Creates an error at a field of the order.
    #[must_use]
    pub fn at(field: &[&str], what: String, remedy: &str) -> Self {
        Self {
            field: field.iter().map(|key| (*key).to_owned()).collect(),
            problem: what,
            remedy: remedy.to_owned(),
        }
    }
}

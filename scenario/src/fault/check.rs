//! Checks of an order, independent of its source.

use super::spec::{FaultArgument, FaultKind, FaultRange};
use super::{Fault, MissionFault, Order, Role, TriggerEvent};
use crate::limits::readable;
use crate::names::{ALL, is_name};
use crate::{Catalog, Scenario, name_remedy};

/// The longest time, s, as in scenario files.
pub(super) const LONGEST_S: f64 = 1e9;

/// The farthest place and the largest size, m, as in scenario files.
pub(super) const FARTHEST_M: f64 = 1e3;

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

pub(super) type Checked = Result<(), OrderError>;

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

/// A scenario against which orders are checked.
pub struct Checker<'s> {
    pub(super) scenario: &'s Scenario,
    pub(super) catalog: &'s Catalog,
}

impl Checker<'_> {
    fn fault(&self, fault: &Fault) -> Checked {
        let name = fault.name();
        if let Some(role) = fault.role() {
            self.role(name, role)?;
        } else if let Some(robot) = fault.robot() {
            self.robot(&["fault", name], robot)?;
        }
        match fault {
            Fault::Mission(fault) => self.mission(fault),
            _ => fault.kind().map_or(Ok(()), |kind| {
                self.arguments(kind, &fault.values())?;
                (kind.check)(fault, self)
            }),
        }
    }

    /// Checks the ranges of numbers and the ends of links.
    fn arguments(&self, kind: &FaultKind, values: &toml::Table) -> Checked {
        let name = kind.spec.name;
        let text = |key| values.get(key).and_then(toml::Value::as_str);
        for argument in kind.spec.arguments {
            let at = ["fault", name, argument.key];
            match (argument.range, text(argument.key)) {
                (FaultRange::From | FaultRange::To, Some(end)) if end != ALL => {
                    self.robot(&at, end)?;
                    if argument.range == FaultRange::To && text("from") == Some(end) {
                        let what = format!("'{end}' does not receive its own messages");
                        return Err(wrong(&at, what, "name two robots, or all"));
                    }
                }
                _ => {
                    let value = values.get(argument.key).and_then(toml::Value::as_float);
                    value.map_or(Ok(()), |value| self.number(&at, argument, value))?;
                }
            }
        }
        Ok(())
    }

    /// Checks a number against the range of its argument.
    fn number(&self, at: &[&str], argument: &FaultArgument, value: f64) -> Checked {
        let Some((from, to)) = argument.range.bounds(self.scenario.room) else {
            return Ok(());
        };
        let (_, unit) = argument.stem_and_unit();
        if argument.range.is_whole() && value.fract() != 0.0 {
            let what = format!("{value} is not a whole number");
            return Err(wrong(at, what, &format!("write one from {from} to {to}")));
        }
        match argument.range {
            FaultRange::Above(to) => above_zero(at, value, to, unit),
            _ => within(at, value, from, to, unit),
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
            self.number(&at, argument, value)?;
        }
        Ok(())
    }

    pub(super) fn robot(&self, field: &[&str], robot: &str) -> Checked {
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
        let known: Vec<&str> = Fault::role_targeted().collect();
        if !known.contains(&name) {
            let what = format!("'{name}' cannot target a role");
            let known = known.join(", ");
            let remedy = format!("name a robot, or use one of {known}");
            return Err(wrong(&field, what, &remedy));
        }
        match role {
            Role::Executing(task) => self.set(&field, task),
            Role::Idle => Ok(()),
        }
    }
}

pub(super) fn share(field: &[&str], value: impl Into<f64>) -> Checked {
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

pub(super) fn within(
    field: &[&str],
    value: impl Into<f64>,
    from: f64,
    to: f64,
    unit: &str,
) -> Checked {
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

pub(super) fn wrong(field: &[&str], what: String, remedy: &str) -> OrderError {
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

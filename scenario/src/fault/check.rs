//! Checks of an order, independent of its source.

use super::checker::{Checked, Checker};
use super::spec::{FaultKind, FaultRange};
use super::{Fault, MissionFault, Order, Role, TriggerEvent};
use crate::limits::{TIME, TIME_OR_ZERO, check_known, check_name};
use crate::names::ALL;
use crate::{Catalog, Problem, Scenario, name_remedy};

impl Order {
    /// Checks robots, behavior sets and ranges. `catalog` must be the scenario's.
    pub fn check(&self, scenario: &Scenario, catalog: &Catalog) -> Checked {
        if let Some(id) = &self.id {
            check_name(["id"], id)?;
        }
        let checker = Checker { scenario, catalog };
        checker.fault(&self.fault)?;
        self.check_trigger(&checker)
    }

    fn check_trigger(&self, checker: &Checker<'_>) -> Checked {
        if let Some(at_s) = self.at_s {
            TIME_OR_ZERO.check(["at_s"], at_s)?;
        }
        if let Some(every_s) = self.every_s {
            TIME.check(["every_s"], every_s)?;
        }
        if let Some(for_s) = self.for_s {
            TIME.check(["for_s"], for_s)?;
            if self.fault.is_instantaneous() {
                let what = format!("'{}' is instantaneous", self.fault.name());
                return Err(Problem::at(["for_s"], what, "omit the duration"));
            }
            if let Some(every_s) = self.every_s
                && for_s >= every_s
            {
                let what = format!("{for_s} s is not shorter than the interval of {every_s} s");
                return Err(Problem::at(
                    ["for_s"],
                    what,
                    "make it heal before it repeats",
                ));
            }
        } else if self.every_s.is_some() && !self.fault.is_instantaneous() {
            let what = "the fault repeats but never heals";
            return Err(Problem::at(["every_s"], what, "give it a duration"));
        }
        checker
            .catalog
            .mission
            .check_order(checker.scenario, self)?;
        let Some(when) = &self.when else {
            return Ok(());
        };
        if self.at_s.is_some() || self.every_s.is_some() {
            let what = "both an event and a time trigger the fault";
            return Err(Problem::at(["when"], what, "give only one of them"));
        }
        if let Some(robot) = &when.robot {
            checker.robot(["when"], robot)?;
        }
        let verbs = TriggerEvent::verbs(checker.catalog.mission);
        check_known(["when"], "there is no event", &when.what, verbs)?;
        match &when.subject {
            Some(set) if when.has_behavior_set_subject() => checker.set(["when"], set),
            _ => Ok(()),
        }
    }
}

impl Checker<'_> {
    fn fault(&self, fault: &Fault) -> Checked {
        let name = fault.name();
        if let Some(role) = fault.role() {
            self.role(name, role)?;
        } else if let Some(robot) = fault.robot() {
            self.robot(["fault", name], robot)?;
        }
        match fault {
            Fault::Mission(fault) => self.mission(fault),
            _ => fault.kind().map_or(Ok(()), |kind| {
                self.arguments(kind, &fault.values())?;
                (kind.check)(fault, self)
            }),
        }
    }

    /// Checks the ranges of numbers, the sizes of modes and the ends of links.
    fn arguments(&self, kind: &FaultKind, values: &toml::Table) -> Checked {
        let name = kind.spec.name;
        let text = |key| values.get(key).and_then(toml::Value::as_str);
        for argument in kind.spec.arguments {
            let at = ["fault", name, argument.key];
            match (argument.range, text(argument.key)) {
                (FaultRange::From | FaultRange::To, Some(end)) if end != ALL => {
                    self.robot(at, end)?;
                    if argument.range == FaultRange::To && text("from") == Some(end) {
                        let what = format!("'{end}' does not receive its own messages");
                        return Err(Problem::at(at, what, "name two robots, or all"));
                    }
                }
                (FaultRange::Mode(form), _) => {
                    let mode = values.get(argument.key);
                    mode.map_or(Ok(()), |mode| form.check(at, mode))?;
                }
                _ => {
                    let value = values.get(argument.key).and_then(toml::Value::as_float);
                    if let Some((range, value)) = argument.numbers(self.scenario.room).zip(value) {
                        range.check(at, value)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn mission(&self, fault: &MissionFault) -> Checked {
        let MissionFault { name, values } = fault;
        let mission_faults = self.catalog.mission.vocabulary().faults;
        let Some(spec) = mission_faults.iter().find(|spec| spec.name == name) else {
            let mission = self.catalog.mission.name();
            let what = format!("there is no fault '{name}' in the mission {mission}");
            let own = mission_faults.iter().map(|spec| spec.name);
            let known = Fault::COMMON_NAMES.into_iter().chain(own);
            return Err(Problem::at(["fault"], what, name_remedy(name, known)));
        };
        for key in values.keys() {
            let mut keys = spec.arguments.iter().map(|argument| argument.key);
            if !keys.clone().any(|known| known == key) {
                let remedy = name_remedy(key, &mut keys);
                return Err(Problem::at(["fault", name, key], "unknown key", remedy));
            }
        }
        for argument in spec.arguments {
            let at = ["fault", name, argument.key];
            let Some(stated) = values.get(argument.key) else {
                if argument.default.is_some() {
                    continue;
                }
                return Err(Problem::at(at, "the key is missing", "give it a value"));
            };
            if argument.range == FaultRange::Name {
                let mission = self.catalog.mission;
                let names = mission.fault_names(self.scenario, argument.key);
                let what = format!("there is no {}", argument.key);
                let names = names.iter().map(String::as_str);
                check_known(at, &what, &stated.to_string(), names)?;
                continue;
            }
            let Some(value) = fault.get(argument.key) else {
                let what = format!("'{stated}' is not a number");
                return Err(Problem::at(at, what, "write a number"));
            };
            if let Some(range) = argument.numbers(self.scenario.room) {
                range.check(at, value)?;
            }
        }
        Ok(())
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
            return Err(Problem::at(field, what, remedy));
        }
        match role {
            Role::Executing(task) => self.set(field, task),
            Role::Idle => Ok(()),
        }
    }
}

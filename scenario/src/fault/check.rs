//! Checks of an order, independent of its source.

use super::checker::{Checked, Checker, LONGEST_S, above_zero, within, wrong};
use super::spec::{FaultArgument, FaultKind, FaultRange};
use super::{Fault, MissionFault, Order, Role, TriggerEvent};
use crate::names::{ALL, is_name};
use crate::{Catalog, Scenario, name_remedy};

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
        let mission_faults = self.catalog.mission.vocabulary().faults;
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

//! Other parameters of the allocators of a resolved setup, by a short key.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::Value;

use super::alliance::{BehaviorParams, ByTeammate};
use super::error::{Problem, name_remedy};
use super::limits::check_known;
use super::statement::Parameter;
use super::{Scenario, Setup};

impl Setup {
    /// Returns the setup with other parameters. A key of ALLIANCE is `PARAMETER`, `ROBOT.PARAMETER` or
    /// `ROBOT.SET.PARAMETER`; a longer key has precedence. A value of `slow_impatience` or `willing_to_affect_s` is valid
    /// toward every teammate. A key of another allocator is `allocators.NAME.PARAMETER`, whose name and range
    /// [`Scenario::check_allocators`] checks.
    ///
    /// # Errors
    /// Returns the first unknown key, or the first value that violates a rule of ALLIANCE.md §1.
    pub fn with_parameters(&self, values: &BTreeMap<String, f64>) -> Result<Self, Problem> {
        let mut setup = self.clone();
        let mut ordered: Vec<(&String, f64)> =
            values.iter().map(|(key, value)| (key, *value)).collect();
        ordered.sort_by_key(|(key, _)| key.matches('.').count());
        for (key, value) in ordered {
            match key.strip_prefix("allocators.") {
                Some(key) => setup.set_allocator_value(key, value)?,
                None => setup.set_alliance_value(key, value)?,
            }
        }
        if !values.is_empty() {
            setup.check()?;
        }
        Ok(setup)
    }

    fn set_allocator_value(&mut self, key: &str, value: f64) -> Result<(), Problem> {
        let Some((name, parameter)) = key.split_once('.') else {
            let what = format!("'allocators.{key}' has too few parts");
            return Err(Problem::of_value(what, "use allocators.NAME.PARAMETER"));
        };
        let scenario = &mut self.scenario;
        let deciders: BTreeSet<&str> = scenario
            .robots
            .iter()
            .map(|robot| scenario.decider_of(robot))
            .collect();
        check_known((), "no robot has the allocator", name, deciders)?;
        let value = if value.fract() == 0.0 && value.abs() < 1e15 {
            Value::from(value as i64)
        } else {
            Value::from(value)
        };
        let section = scenario.allocators.entry(name.to_owned()).or_default();
        section.insert(parameter.to_owned(), value);
        Ok(())
    }

    fn set_alliance_value(&mut self, key: &str, value: f64) -> Result<(), Problem> {
        let mut parts: Vec<&str> = key.split('.').collect();
        let name = parts.pop().unwrap_or_default();
        let known = Parameter::ALL.map(Parameter::key);
        let Some(parameter) = Parameter::ALL.into_iter().find(|known| known.key() == name) else {
            let what = format!("ALLIANCE has no parameter '{name}' that may change during a run");
            return Err(Problem::of_value(what, name_remedy(name, known)));
        };
        parameter.range().check((), value)?;
        let (robot, set) = match parts[..] {
            [] => (None, None),
            [robot] => (Some(robot), None),
            [robot, set] => (Some(robot), Some(set)),
            _ => {
                let what = format!("'{key}' has too many parts");
                return Err(Problem::of_value(what, "use ROBOT.SET.PARAMETER"));
            }
        };
        if let Some(robot) = robot {
            self.scenario.find_robot((), robot)?;
        }
        let concerned = self.scenario.robots.iter();
        let concerned = concerned.filter(|spec| robot.is_none_or(|robot| robot == spec.name));
        let (deciders, names): (Vec<&str>, Vec<String>) = concerned
            .map(|spec| (self.scenario.decider_of(spec), spec.name.clone()))
            .unzip();
        let is_alliance = |decider: &&str| *decider == Scenario::DEFAULT_ALLOCATOR;
        if let Some(other) = deciders.iter().find(|decider| !is_alliance(decider))
            && !deciders.iter().any(is_alliance)
        {
            let what = format!("the allocator is {other}, not alliance");
            let remedy = format!("use allocators.{other}.PARAMETER");
            return Err(Problem::of_value(what, remedy));
        }
        let followers: Vec<String> = std::iter::zip(&deciders, names)
            .filter(|(decider, _)| is_alliance(decider))
            .map(|(_, name)| name)
            .collect();
        let mut found = false;
        for (name, params) in Arc::make_mut(&mut self.alliance.robots) {
            if !followers.contains(name) {
                continue;
            }
            for (name, params) in &mut params.sets {
                if set.is_none_or(|set| set == name) {
                    found = true;
                    assign(params, parameter, value);
                }
            }
        }
        if let Some(set) = set.filter(|_| !found) {
            let robot = robot.unwrap_or_default();
            let what = format!("{robot} has no behavior set '{set}'");
            let sets = self.alliance.robots.get(robot).into_iter();
            let sets = sets.flat_map(|params| params.sets.keys().map(String::as_str));
            return Err(Problem::of_value(what, name_remedy(set, sets)));
        }
        Ok(())
    }
}

fn assign(params: &mut BehaviorParams, parameter: Parameter, value: f64) {
    let all = |values: &mut ByTeammate| {
        Arc::make_mut(values)
            .values_mut()
            .for_each(|old| *old = value);
    };
    match parameter {
        Parameter::BroadcastRate => params.broadcast_rate_hz = value,
        Parameter::CeasedAfter => params.ceased_after_s = value,
        Parameter::FastImpatience => params.fast_impatience = value,
        Parameter::SlowImpatience => all(&mut params.slow_impatience),
        Parameter::WillingToAffect => all(&mut params.willing_to_affect_s),
        Parameter::BeforeYielding => params.before_yielding_s = value,
        Parameter::BeforeGivingUp => params.before_giving_up_s = value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::default_setup;

    fn changed(values: &[(&str, f64)]) -> Result<Setup, String> {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), *value));
        let setup = default_setup(1);
        let changed = setup.with_parameters(&values.collect());
        changed.map_err(|problem| problem.to_string())
    }

    #[test]
    fn a_longer_key_has_precedence() {
        let setup = default_setup(1);
        assert_eq!(changed(&[]).as_ref(), Ok(&setup));
        let set = setup.alliance.robots["gold"].sets.keys().next().unwrap();
        let own = format!("gold.{set}.fast_impatience");
        let values = [
            (own.as_str(), 9.0),
            ("fast_impatience", 7.0),
            ("gold.fast_impatience", 8.0),
        ];
        let robots = changed(&values).unwrap().alliance.robots;
        let of = |robot: &str, set: &str| robots[robot].sets[set].fast_impatience;
        let others = setup.alliance.robots["gold"].sets.keys().skip(1);
        assert_eq!(of("gold", set), 9.0);
        assert!(others.into_iter().all(|other| of("gold", other) == 8.0));
        assert!(
            robots["blue"]
                .sets
                .values()
                .all(|set| set.fast_impatience == 7.0)
        );
    }

    #[test]
    fn only_robots_with_alliance_can_change() {
        let mut setup = default_setup(1);
        setup.scenario.robots[0].allocator = Some("drill".to_owned());
        let values = |key: &str| BTreeMap::from([(key.to_owned(), 7.0)]);
        let changed = setup.with_parameters(&values("gold.fast_impatience"));
        assert!(changed.is_ok(), "{changed:?}");
        let refused = setup.with_parameters(&values("blue.fast_impatience"));
        assert_eq!(
            refused.unwrap_err().to_string(),
            "the allocator is drill, not alliance; use allocators.drill.PARAMETER"
        );
    }

    #[test]
    fn other_allocators_have_their_own_keys() {
        let mut setup = default_setup(1);
        setup.scenario.robots[0].allocator = Some("drill".to_owned());
        let values = |key: &str| BTreeMap::from([(key.to_owned(), 7.0)]);
        let changed = setup.with_parameters(&values("allocators.drill.pace"));
        assert_eq!(changed.unwrap().scenario.allocators["drill"]["pace"], 7);
        for (key, expected) in [
            ("allocators.drill", "use allocators.NAME.PARAMETER"),
            ("allocators.cbba.pace", "no robot has the allocator 'cbba'"),
        ] {
            let refusal = setup.with_parameters(&values(key)).unwrap_err().to_string();
            assert!(refusal.contains(expected), "{refusal}");
        }
    }

    #[test]
    fn unknown_keys_and_impossible_values_are_refused() {
        for (key, value, expected) in [
            ("fast_impatienc", 1.0, "did you mean 'fast_impatience'?"),
            (
                "threshold",
                1.0,
                "no parameter 'threshold' that may change during a run",
            ),
            (
                "glod.fast_impatience",
                1.0,
                "no robot 'glod'; did you mean 'gold'?",
            ),
            (
                "gold.dance.fast_impatience",
                1.0,
                "gold has no behavior set 'dance'",
            ),
            ("a.b.c.fast_impatience", 1.0, "use ROBOT.SET.PARAMETER"),
            ("fast_impatience", -1.0, "-1"),
        ] {
            let refusal = changed(&[(key, value)]).unwrap_err();
            assert!(refusal.contains(expected), "{key}: {refusal}");
        }
    }
}

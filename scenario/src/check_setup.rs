//! Checks of a setup that was read from a file. Neither the scenario nor the values in force are trusted.

use std::collections::{BTreeMap, BTreeSet};

use super::Setup;
use super::alliance::{Alliance, BehaviorParams};
use super::catalog::BehaviorSpec;
use super::error::{Problem, name_remedy};
use super::path::KeyPath;
use super::resolve::{check, lists_all_teammates};
use super::statement::{Parameter, Statement, THRESHOLD};
use super::values::Values;

impl Setup {
    /// Checks a setup from a file as strictly as [`Setup::resolve`] checks its inputs. The values in force must be
    /// complete, in range, and only of this scenario's robots.
    pub fn check(&self) -> Result<(), Problem> {
        let resolved = check(&self.scenario, &self.catalog, None).map(|(alliance, _)| alliance);
        resolved
            .map_err(|problem| problem.under(["scenario"]))
            .and_then(|resolved| self.check_values(&resolved))
    }

    /// Checks the values in force. `resolved` has the scenario's values without a parameter file, which changes only
    /// values.
    fn check_values(&self, resolved: &Alliance) -> Result<(), Problem> {
        let at = KeyPath::new(["alliance"]);
        let Alliance {
            threshold,
            step_ms,
            switches,
            robots,
        } = &self.alliance;
        THRESHOLD.check(at.key("threshold"), *threshold)?;
        if *step_ms != resolved.step_ms {
            let what = format!("{step_ms} differs from the scenario's value");
            let remedy = format!("it must be {}", resolved.step_ms);
            return Err(Problem::at(at.key("step_ms"), what, remedy));
        }
        let order = self.scenario.step_order();
        if *switches != resolved.switches || self.step_order != order {
            let what = "they differ from the scenario's switches";
            let remedy = "use those of scenario.alliance";
            return Err(Problem::at(at.key("switches"), what, remedy));
        }
        let catalog = &self.catalog;
        let named = self.named_teammates();
        let at = at.key("robots");
        same_keys(robots, &resolved.robots, &at)?;
        for robot in &self.scenario.robots {
            // Both maps have the same keys.
            let (given, wanted) = (&robots[&robot.name], &resolved.robots[&robot.name]);
            let at = at.key(&robot.name);
            if given.rank != wanted.rank {
                let what = format!("{} is the rank of another robot", given.rank);
                return Err(Problem::at(
                    at.key("rank"),
                    what,
                    format!("it must be {}", wanted.rank),
                ));
            }
            let at = at.key("sets");
            same_keys(&given.sets, &wanted.sets, &at)?;
            for id in catalog.behaviors_of(robot) {
                let spec = &catalog.sets[id.index()];
                let teammates = named.iter().copied().filter(|name| *name != robot.name);
                let (given, wanted) = (&given.sets[&spec.name], &wanted.sets[&spec.name]);
                let at = at.key(&spec.name);
                if given.task != wanted.task {
                    let what = format!("'{}' is the task of another set", given.task);
                    let remedy = format!("it must be '{}'", wanted.task);
                    return Err(Problem::at(at.key("task"), what, remedy));
                }
                let built_in = catalog
                    .mission
                    .default_alliance_params(&self.scenario, robot, spec);
                let values = Values::built_in(built_in, teammates);
                check_params(given, &robot.name, spec, values, &at)?;
            }
        }
        Ok(())
    }

    /// Returns the teammates with values of their own. A large team lists only those that a value names.
    fn named_teammates(&self) -> BTreeSet<&str> {
        let robots = self.scenario.robots.iter();
        let robots: BTreeSet<&str> = robots.map(|robot| robot.name.as_str()).collect();
        if lists_all_teammates(&self.scenario, &self.catalog) {
            return robots;
        }
        let sets = self
            .alliance
            .robots
            .values()
            .flat_map(|robot| robot.sets.values());
        let named = sets.flat_map(|set| set.slow_impatience.keys());
        let named = named
            .map(String::as_str)
            .filter(|name| robots.contains(name));
        named.chain([BehaviorParams::OTHERS]).collect()
    }
}

/// Checks the values as statements about the built-in ones, so that the rules for statements apply.
fn check_params(
    given: &BehaviorParams,
    robot: &str,
    spec: &BehaviorSpec,
    mut values: Values<'_>,
    at: &KeyPath,
) -> Result<(), Problem> {
    let statements = stated(given, at);
    for (number, statement) in statements.iter().enumerate() {
        statement.check()?;
        values.apply(statement, number);
    }
    values.check(&statements, robot, &spec.name)?;
    let complete = values.into_params(given.task.clone());
    let (slow, willing) = (Parameter::SlowImpatience, Parameter::WillingToAffect);
    let (of_slow, of_willing) = (&given.slow_impatience, &given.willing_to_affect_s);
    same_keys(of_slow, &complete.slow_impatience, &at.key(slow.key()))?;
    same_keys(
        of_willing,
        &complete.willing_to_affect_s,
        &at.key(willing.key()),
    )
}

fn stated(given: &BehaviorParams, at: &KeyPath) -> Vec<Statement> {
    let BehaviorParams {
        task: _,
        broadcast_rate_hz,
        ceased_after_s,
        fast_impatience,
        slow_impatience,
        willing_to_affect_s,
        before_yielding_s,
        before_giving_up_s,
    } = given;
    let plain = [
        (Parameter::BroadcastRate, broadcast_rate_hz),
        (Parameter::CeasedAfter, ceased_after_s),
        (Parameter::FastImpatience, fast_impatience),
        (Parameter::BeforeYielding, before_yielding_s),
        (Parameter::BeforeGivingUp, before_giving_up_s),
    ];
    let plain = plain
        .into_iter()
        .map(|(parameter, value)| Statement::new(parameter, None, *value, at.key(parameter.key())));
    let by_teammate = [
        (Parameter::SlowImpatience, slow_impatience),
        (Parameter::WillingToAffect, willing_to_affect_s),
    ];
    let toward = by_teammate.into_iter().flat_map(|(parameter, values)| {
        values.iter().map(move |(name, value)| {
            let at = at.key(parameter.key()).key(name);
            Statement::new(parameter, Some(name), *value, at)
        })
    });
    plain.chain(toward).collect()
}

/// Rejects a table whose keys are not exactly the wanted ones.
fn same_keys<V, W>(
    given: &BTreeMap<String, V>,
    wanted: &BTreeMap<String, W>,
    at: &KeyPath,
) -> Result<(), Problem> {
    let names = || wanted.keys().map(String::as_str);
    if let Some(missing) = names().find(|name| !given.contains_key(*name)) {
        let what = format!("'{missing}' is missing");
        let remedy = "state every value in force, as the run wrote it";
        return Err(Problem::at(at.clone(), what, remedy));
    }
    match given.keys().find(|name| !wanted.contains_key(*name)) {
        None => Ok(()),
        Some(unknown) => {
            let what = format!("the scenario has no '{unknown}'");
            Err(Problem::at(at.clone(), what, name_remedy(unknown, names())))
        }
    }
}

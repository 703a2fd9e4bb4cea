//! The parameters of one behavior set of one robot while statements are applied, and the rules between them.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::alliance::BehaviorParams;
use super::error::Problem;
use super::statement::{Parameter, Statement};
use crate::mission::data::DefaultAllianceParams;

/// A value and the index of its statement; `None` for a built-in value.
#[derive(Clone, Copy)]
struct Sourced {
    value: f64,
    from: Option<usize>,
}

/// The values of one behavior set of one robot. The maps have one entry per teammate.
pub(super) struct Values<'a> {
    broadcast_rate: Sourced,
    ceased_after: Sourced,
    fast_impatience: Sourced,
    slow_impatience: BTreeMap<&'a str, Sourced>,
    willing_to_affect: BTreeMap<&'a str, Sourced>,
    before_yielding: Sourced,
    before_giving_up: Sourced,
}

impl<'a> Values<'a> {
    /// Creates the values that apply where nothing is stated.
    pub fn built_in(
        mission: DefaultAllianceParams,
        teammates: impl Iterator<Item = &'a str>,
    ) -> Self {
        let built_in = |value| Sourced { value, from: None };
        let slow_impatience: BTreeMap<_, _> = teammates
            .map(|name| (name, built_in(mission.slow_impatience)))
            .collect();
        Self {
            broadcast_rate: built_in(mission.broadcast_rate_hz),
            ceased_after: built_in(mission.ceased_after_s),
            fast_impatience: built_in(mission.fast_impatience),
            willing_to_affect: slow_impatience
                .keys()
                .map(|name| (*name, built_in(mission.willing_to_affect_s)))
                .collect(),
            slow_impatience,
            before_yielding: built_in(mission.before_yielding_s),
            before_giving_up: built_in(mission.before_giving_up_s),
        }
    }

    /// Applies a statement; `number` is its index in the list. Returns true if there is a matching value.
    pub fn apply(&mut self, statement: &Statement, number: usize) -> bool {
        let new = Sourced {
            value: statement.value,
            from: Some(number),
        };
        let by_teammate = |values: &mut BTreeMap<&str, Sourced>| {
            let wanted = statement.teammate.as_deref();
            let mut any = false;
            for (name, value) in values {
                if wanted.is_none_or(|wanted| wanted == *name) {
                    *value = new;
                    any = true;
                }
            }
            any
        };
        let plain = match statement.parameter {
            Parameter::SlowImpatience => return by_teammate(&mut self.slow_impatience),
            Parameter::WillingToAffect => return by_teammate(&mut self.willing_to_affect),
            Parameter::BroadcastRate => &mut self.broadcast_rate,
            Parameter::CeasedAfter => &mut self.ceased_after,
            Parameter::FastImpatience => &mut self.fast_impatience,
            Parameter::BeforeYielding => &mut self.before_yielding,
            Parameter::BeforeGivingUp => &mut self.before_giving_up,
        };
        *plain = new;
        true
    }

    /// Rejects values that violate a rule between two of them (ALLIANCE.md §1), at the stronger of the two statements.
    pub fn check(&self, statements: &[Statement], robot: &str, set: &str) -> Result<(), Problem> {
        let broken = |a: Sourced, b: Sourced, what: String, remedy: &str| {
            // Built-in values satisfy the rules, so at least one of the two has been stated.
            let statement = a.from.max(b.from).and_then(|number| statements.get(number));
            statement.map_or(Ok(()), |statement| {
                let what = format!("{robot}'s {set} has {what}");
                Err(Problem::new(statement.place.clone(), what, remedy))
            })
        };
        let (rate, ceased) = (self.broadcast_rate, self.ceased_after);
        if ceased.value <= 1.0 / rate.value {
            let what = format!("tau = {} s with rho = {} Hz", ceased.value, rate.value);
            broken(rate, ceased, what, "the rule is tau > 1/rho")?;
        }
        let fast = self.fast_impatience;
        for (teammate, slow) in &self.slow_impatience {
            if slow.value >= fast.value {
                let what = format!(
                    "slow impatience {} toward {teammate} with fast impatience {}",
                    slow.value, fast.value
                );
                broken(fast, *slow, what, "the rule is 0 < slow < fast")?;
            }
        }
        Ok(())
    }

    /// Returns the values in force; `task` is the name of the set's task.
    pub fn into_params(self, task: String) -> BehaviorParams {
        let by_name = |values: BTreeMap<&str, Sourced>| {
            let named = values
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value.value));
            Arc::new(named.collect())
        };
        BehaviorParams {
            task,
            broadcast_rate_hz: self.broadcast_rate.value,
            ceased_after_s: self.ceased_after.value,
            fast_impatience: self.fast_impatience.value,
            slow_impatience: by_name(self.slow_impatience),
            willing_to_affect_s: by_name(self.willing_to_affect),
            before_yielding_s: self.before_yielding.value,
            before_giving_up_s: self.before_giving_up.value,
        }
    }
}

//! Faults with a trigger and a duration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{EventTrigger, Fault, RandomFaults};
use crate::time::SimTime;
use crate::{KeyPath, Problem};

/// A fault with its trigger and its duration. Without a trigger it takes effect at once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// The id that clears the fault; absent lets the world choose one.
    #[serde(default)]
    pub id: Option<String>,
    /// The fault to apply when triggered.
    pub fault: Fault,
    /// The simulated time at which the fault takes effect, s. A past time means now.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// The interval of a repeated fault, s. The first time is `at_s`, or now.
    #[serde(default)]
    pub every_s: Option<f64>,
    /// The event whose next occurrence triggers the fault.
    #[serde(default)]
    pub when: Option<EventTrigger>,
    /// The duration, s; absent lasts until the fault is cleared. Instantaneous faults, such as a restart, have none.
    #[serde(default)]
    pub for_s: Option<f64>,
}

impl Order {
    /// Creates a fault that takes effect at once and lasts until it is cleared.
    #[must_use]
    pub fn now(fault: Fault) -> Self {
        Self {
            id: None,
            fault,
            at_s: None,
            every_s: None,
            when: None,
            for_s: None,
        }
    }

    /// Returns the simulated time at which the fault is due, if time triggers it.
    #[must_use]
    pub fn at(&self) -> Option<SimTime> {
        self.at_s.map(SimTime::from_secs_f64)
    }

    /// Returns a problem if the fault takes effect after the last step of a run with this limit, s. For an order by hand
    /// it is a mistake; a file may contain later times for longer runs.
    #[must_use]
    pub fn beyond_limit(&self, limit_s: f64, step_ms: u64) -> Option<Problem> {
        // A fault that is due between two steps takes effect at the later one.
        let tick = self.at()?.0.div_ceil(step_ms);
        let due = SimTime(tick.saturating_mul(step_ms));
        if due < SimTime::from_secs_f64(limit_s) {
            return None;
        }
        let what = format!(
            "'{}' is due at {} s, not before the end of the run, {limit_s} s",
            self.fault,
            due.as_secs_f64()
        );
        Some(Problem::at(["at_s"], what, "choose an earlier time"))
    }

    /// Returns the number of times that the fault takes effect in a run with this limit, s. `due` is the first time; without
    /// one, the fault waits for an event and takes effect once at most.
    #[must_use]
    pub fn times(&self, due: Option<SimTime>, limit_s: f64, step_ms: u64) -> u64 {
        let Some(due) = due else {
            return 1;
        };
        // A fault that is due between two steps takes effect at the later one.
        let at_step = |time: SimTime| time.0.div_ceil(step_ms).saturating_mul(step_ms);
        let limit = SimTime::from_secs_f64(limit_s);
        let left_ms = limit.0.saturating_sub(at_step(due));
        match self.every_s {
            None => u64::from(left_ms > 0),
            Some(every_s) => {
                let every = SimTime::from_secs_f64(every_s).max(SimTime(1));
                left_ms.div_ceil(at_step(every))
            }
        }
    }

    /// Returns the duration of the fault, if it is limited.
    #[must_use]
    pub fn duration(&self) -> Option<SimTime> {
        self.for_s.map(SimTime::from_secs_f64)
    }
}

/// The section `[faults]` of a scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Faults {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub timeline: Vec<Order>,
    /// Random faults in addition to the schedule.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub random: Option<RandomFaults>,
}

impl Faults {
    /// Returns true if there are no faults.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.timeline.is_empty() && self.random.is_none()
    }

    /// Returns a problem for each fault that takes effect after the last step of a run with this limit, s.
    #[must_use]
    pub fn beyond_limit(&self, limit_s: f64, step_ms: u64) -> Vec<Problem> {
        let at = KeyPath::new(["faults", "timeline"]);
        let timeline = self.timeline.iter().enumerate();
        let late = timeline.filter_map(|(index, order)| {
            let problem = order.beyond_limit(limit_s, step_ms)?;
            Some(problem.under(at.index(index)))
        });
        late.collect()
    }
}

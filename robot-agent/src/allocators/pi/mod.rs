//! PI: performance impact (Zhao, Meng, Chung, IEEE Transactions on Cybernetics 46(4):902–915, 2016;
//! docs/allocators/pi.md). Each robot orders its tasks in a list. The impact of a task is its share of the list's cost:
//! its own time and the delay of the tasks after it. Robots agree on the least impact of each task by the consensus of
//! CBBA, and a task moves to the robot with the lower impact.
//!
//! - `impact`: the cost of a list, removal and inclusion impacts.
//! - `list`: the list of a robot, and the phases of removal and inclusion.
//! - `consensus`: γ, β and s, and the messages.

mod impact;
mod list;
#[cfg(test)]
mod tests;

use scenario::ParameterRange::{Above, Whole};
use scenario::ParameterSpec;
use scenario::time::SimTime;

use crate::allocator::unit::WorkUnit;
use crate::allocator::{Allocator, Decision, Input, SelfState, parameters};
use crate::allocators::consensus;
use crate::allocators::consensus::tables::{TableKind, Tables};
use crate::allocators::consensus::winners::Winners;
use impact::Costs;
use list::TaskList;

parameters! {
    /// The parameters in `[allocators.pi]`.
    pub struct PiConfig {
        tasks: usize = 4, "", Whole(1, 16),
            "maximum number of tasks in the list of a robot; larger: a longer plan, but more computation (decided here)";
        refresh_s: f64 = 1.0, "s", Above(0.0, 1e9),
            "time between two broadcasts of a robot's list of impacts; shorter than τ, or teammates count it as lost (decided here)";
    }
}

/// The rule of one robot.
#[derive(Clone, Debug)]
pub struct Pi {
    me: SelfState,
    unit: WorkUnit,
    /// γ, as negative bids, and β.
    beliefs: Winners,
    /// The ordered list a of the robot's tasks.
    list: TaskList,
    /// The time stamps s, and the messages.
    consensus: Tables,
    config: PiConfig,
}

impl Allocator for Pi {
    type Config = PiConfig;

    fn plans_sequences() -> bool {
        true
    }

    fn parameters() -> Vec<ParameterSpec> {
        PiConfig::parameters()
    }

    fn new(me: &SelfState, config: &PiConfig) -> Self {
        let beliefs = Winners::new(me);
        let refresh = SimTime::from_secs_f64(config.refresh_s);
        Self {
            unit: WorkUnit::default(),
            list: TaskList::new(me.robot, config.tasks, &beliefs),
            consensus: Tables::new(TableKind::Impacts, refresh, &beliefs),
            beliefs,
            me: me.clone(),
            config: *config,
        }
    }

    /// Adopts another time between broadcasts. The list is part of the state, so that its size stays.
    fn adopt(&mut self, config: &PiConfig) -> bool {
        let is_same_size = config.tasks == self.config.tasks;
        if is_same_size {
            let refresh = SimTime::from_secs_f64(config.refresh_s);
            self.consensus.set_refresh(refresh);
            self.config = *config;
        }
        is_same_size
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let before = decision.active;
        let mut must_rebuild = self.unit.update(&self.me, input, before);
        let (beliefs, list) = (&mut self.beliefs, &mut self.list);
        beliefs.apply_rounds(input.choices);
        must_rebuild |= self.consensus.receive(&self.me, input, beliefs, |_| ());

        if beliefs.take_changed() || must_rebuild {
            let tasks = beliefs.tasks().to_vec();
            let costs = Costs::new(input, &tasks, &self.unit);
            let continues = self.unit.should_continue();
            if must_rebuild {
                list.release(continues, beliefs);
            }
            list.update(continues, &costs, beliefs);
            if must_rebuild {
                list.update_gamma(&costs, beliefs);
            }
            // The robot's own changes are no reason to change its list again.
            beliefs.take_changed();
        }

        let first = list.first();
        consensus::start(decision, first, list.take_outbid());
        self.consensus.send(input.now, beliefs, &mut decision.say);
        let holder = |task| self.beliefs.holder(task);
        let under_way = self.unit.under_way();
        under_way.log(&self.me, input, decision, holder);
        self.unit.note_active(before, decision.active, input.now);
    }
}

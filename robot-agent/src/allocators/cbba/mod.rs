//! CBAA and CBBA: consensus-based auctions (Choi, Brunet, How, IEEE T-RO 25(4):912–926, 2009; docs/allocators/cbba.md).
//! Each robot builds a bundle of tasks greedily and broadcasts its list of winning bids. A fixed table of rules
//! corrects the lists until all agree. CBAA uses bundles of one task. ACBBA sends only changes (Johnson, Ponda, Choi,
//! How, AIAA 2010).
//!
//! - `bundle`: the choice of tasks and bids (BUILD, REPLAN). `score`: the score of a path.
//! - `consensus`: the winners, the rules that merge lists (Table I), and the messages.
//! - `deltas`, `records`: the messages of ACBBA, without a table.

pub(super) mod bundle;
mod deltas;
mod records;
pub(super) mod score;
#[cfg(test)]
pub(super) mod tests;

use proto::allocation::AllocationMessage;
use scenario::time::SimTime;
use scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use serde::Deserialize;

use crate::allocator::unit::WorkUnit;
use crate::allocator::{Allocator, Decision, Input, SelfState};
use crate::allocators::consensus;
use crate::allocators::consensus::tables::{TableKind, Tables};
use crate::allocators::consensus::winners::Winners;
use bundle::Bundle;
use deltas::Deltas;
use score::StepUtilities;

/// The parameters in `[allocators.cbba]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CbbaConfig {
    /// L_t, the maximum number of tasks in a bundle.
    pub bundle: usize,
    pub refresh_s: f64,
}

impl Default for CbbaConfig {
    fn default() -> Self {
        Self {
            bundle: 2,
            refresh_s: CbaaConfig::default().refresh_s,
        }
    }
}

/// The parameters in `[allocators.cbaa]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CbaaConfig {
    pub refresh_s: f64,
}

impl Default for CbaaConfig {
    fn default() -> Self {
        Self { refresh_s: 1.0 }
    }
}

impl CbaaConfig {
    /// Returns the parameters of CBBA with one task at a time.
    fn single(self) -> CbbaConfig {
        CbbaConfig {
            bundle: 1,
            refresh_s: self.refresh_s,
        }
    }
}

fn refresh_spec() -> ParameterSpec {
    ParameterSpec {
        key: "refresh_s",
        unit: "s",
        default: ParameterDefault::Number(CbaaConfig::default().refresh_s),
        about: "time between two broadcasts of a robot's list of winners; shorter than τ, or teammates count it as lost (decided here)",
        range: ParameterRange::Above(0.0, 1e9),
    }
}

fn bundle_spec() -> ParameterSpec {
    ParameterSpec {
        key: "bundle",
        unit: "",
        default: ParameterDefault::Whole(CbbaConfig::default().bundle as i64),
        about: "maximum number of tasks that a robot bids for at once (L_t in the paper)",
        range: ParameterRange::Whole(1, 16),
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub bundle: usize,
    pub refresh: SimTime,
}

impl CbbaConfig {
    fn rules(self) -> Rules {
        Rules {
            bundle: self.bundle,
            refresh: SimTime::from_secs_f64(self.refresh_s),
        }
    }
}

impl AcbbaConfig {
    fn rules(self) -> Rules {
        Rules {
            bundle: self.bundle,
            refresh: SimTime::from_secs_f64(self.repeat_s),
        }
    }
}

/// The exchange of messages by which robots agree on the winners.
pub(super) trait Consensus: Clone + std::fmt::Debug + Send + 'static {
    fn new(me: &SelfState, rules: &Rules, beliefs: &Winners) -> Self;

    /// Receives messages and removes silent robots (FORGET). Tasks that the robot loses leave its bundle at once.
    /// Returns whether a robot was added or lost.
    fn receive(
        &mut self,
        me: &SelfState,
        input: &Input<'_>,
        beliefs: &mut Winners,
        bundle: &mut Bundle,
    ) -> bool;

    fn send(&mut self, now: SimTime, beliefs: &mut Winners, messages: &mut Vec<AllocationMessage>);

    /// Replaces the time between two broadcasts of the whole list.
    fn set_refresh(&mut self, refresh: SimTime);
}

impl Consensus for Tables {
    fn new(_: &SelfState, rules: &Rules, beliefs: &Winners) -> Self {
        Self::new(TableKind::Bids, rules.refresh, beliefs)
    }

    fn receive(
        &mut self,
        me: &SelfState,
        input: &Input<'_>,
        beliefs: &mut Winners,
        bundle: &mut Bundle,
    ) -> bool {
        self.receive(me, input, beliefs, |beliefs| bundle.drop_lost(beliefs))
    }

    fn send(&mut self, now: SimTime, beliefs: &mut Winners, messages: &mut Vec<AllocationMessage>) {
        self.send(now, beliefs, messages);
    }

    fn set_refresh(&mut self, refresh: SimTime) {
        self.set_refresh(refresh);
    }
}

/// The bidding rule of one robot, with any consensus method.
#[derive(Clone, Debug)]
pub(super) struct Bidder<C> {
    me: SelfState,
    unit: WorkUnit,
    pub beliefs: Winners,
    pub bundle: Bundle,
    consensus: C,
    rules: Rules,
}

impl<C: Consensus> Bidder<C> {
    pub fn new(me: &SelfState, rules: Rules) -> Self {
        let beliefs = Winners::new(me);
        Self {
            unit: WorkUnit::default(),
            bundle: Bundle::new(me.robot, rules.bundle),
            consensus: C::new(me, &rules, &beliefs),
            beliefs,
            me: me.clone(),
            rules,
        }
    }

    /// Adopts other times. The bundle is part of the state, so that its size stays.
    pub fn adopt(&mut self, rules: Rules) -> bool {
        let is_same_size = rules.bundle == self.rules.bundle;
        if is_same_size {
            self.consensus.set_refresh(rules.refresh);
            self.rules = rules;
        }
        is_same_size
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.step_with(input, decision, false, |_, _, _| &[]);
    }

    /// Runs one step. Before each choice, `left_tasks` returns which tasks the robot leaves to teammates, by their index
    /// in [`Winners::tasks`]; missing ones are not left. With `is_event` the robot plans anew in any case. Returns whether
    /// the robot has planned anew.
    pub fn step_with<'l>(
        &mut self,
        input: &Input<'_>,
        decision: &mut Decision,
        is_event: bool,
        left_tasks: impl FnOnce(&Bundle, &StepUtilities<'_, '_>, &Winners) -> &'l [bool],
    ) -> bool {
        let before = decision.active;
        let mut must_replan = self.unit.update(&self.me, input, before) || is_event;
        self.beliefs.apply_rounds(input.choices);
        self.bundle.drop_lost(&mut self.beliefs);
        let (beliefs, bundle) = (&mut self.beliefs, &mut self.bundle);
        must_replan |= self.consensus.receive(&self.me, input, beliefs, bundle);

        let worths = StepUtilities {
            input,
            begun: self.unit.committed(),
            active: before,
        };
        if must_replan {
            bundle.replan(self.unit.should_continue(), &worths, beliefs);
        }
        if beliefs.take_changed() || must_replan {
            let left = left_tasks(bundle, &worths, beliefs);
            let is_left = |own: usize| left.get(own) == Some(&true);
            bundle.build(self.unit.should_continue(), &worths, beliefs, is_left);
            // The robot's own new bids are no reason to bid again.
            beliefs.take_changed();
        }

        let first = bundle.first();
        consensus::start(decision, first, bundle.take_outbid());
        self.consensus.send(input.now, beliefs, &mut decision.say);
        let holder = |task| self.beliefs.holder(task);
        let under_way = self.unit.under_way();
        under_way.log(&self.me, input, decision, holder);
        self.unit.note_active(before, decision.active, input.now);
        must_replan
    }

    /// Returns the utilities of a step, as after the step.
    pub fn utilities<'a, 'i>(&self, input: &'a Input<'i>) -> StepUtilities<'a, 'i> {
        StepUtilities {
            input,
            begun: self.unit.committed(),
            active: None,
        }
    }
}

#[derive(Clone, Debug)]
pub struct Cbba(Bidder<Tables>);

impl Allocator for Cbba {
    type Config = CbbaConfig;

    fn plans_sequences() -> bool {
        true
    }

    fn parameters() -> Vec<ParameterSpec> {
        vec![bundle_spec(), refresh_spec()]
    }

    fn new(me: &SelfState, config: &CbbaConfig) -> Self {
        Self(Bidder::new(me, config.rules()))
    }

    fn adopt(&mut self, config: &CbbaConfig) -> bool {
        self.0.adopt(config.rules())
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.0.step(input, decision);
    }
}

/// The parameters in `[allocators.acbba]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AcbbaConfig {
    /// L_t, the maximum number of tasks in a bundle.
    pub bundle: usize,
    pub repeat_s: f64,
}

impl Default for AcbbaConfig {
    fn default() -> Self {
        Self {
            bundle: CbbaConfig::default().bundle,
            repeat_s: 5.0,
        }
    }
}

/// CBBA that sends only changes.
#[derive(Clone, Debug)]
pub struct Acbba(Bidder<Deltas>);

impl Allocator for Acbba {
    type Config = AcbbaConfig;

    fn plans_sequences() -> bool {
        true
    }

    fn parameters() -> Vec<ParameterSpec> {
        let repeat = ParameterSpec {
            key: "repeat_s",
            unit: "s",
            default: ParameterDefault::Number(AcbbaConfig::default().repeat_s),
            about: "time between two broadcasts of a robot's whole list, which repair lost changes (decided here)",
            range: ParameterRange::Above(0.0, 1e9),
        };
        vec![bundle_spec(), repeat]
    }

    fn new(me: &SelfState, config: &AcbbaConfig) -> Self {
        Self(Bidder::new(me, config.rules()))
    }

    fn adopt(&mut self, config: &AcbbaConfig) -> bool {
        self.0.adopt(config.rules())
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.0.step(input, decision);
    }
}

/// CBBA with one task at a time.
#[derive(Clone, Debug)]
pub struct Cbaa(Cbba);

impl Allocator for Cbaa {
    type Config = CbaaConfig;

    fn parameters() -> Vec<ParameterSpec> {
        vec![refresh_spec()]
    }

    fn new(me: &SelfState, config: &CbaaConfig) -> Self {
        Self(Cbba::new(me, &config.single()))
    }

    fn adopt(&mut self, config: &CbaaConfig) -> bool {
        self.0.adopt(&config.single())
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.0.step(input, decision);
    }
}

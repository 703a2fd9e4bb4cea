//! Steps that can be left out: while time alone changes nothing, the rows of the latest step hold.
//!
//! What it buys: a robot at work or one that waits costs a comparison instead of an evaluation of all its behaviors, about a fifth
//! of the robot-steps per second (BENCHMARKS.md). What it equals: evaluating every step. A property test compares the two
//! (`tests/properties.rs`), and the equations are read without this file.

use alliance_proto::time::SimTime;

use super::behavior::{Awake, Stance};
use super::engine::Engine;
use crate::allocator::Input;

impl Engine {
    /// Makes the next step whole, whether or not anything can have changed.
    pub(in crate::allocators) fn weigh_anew(&mut self) {
        self.steady_until = SimTime::ZERO;
    }

    /// Whether a step in which nothing new is heard would give the same as the latest one: a robot at work or one that waits, of
    /// which each set stays at θ or at 0, so that only time can change anything, and has not yet.
    pub(super) fn is_steady(&self, input: &Input<'_>) -> bool {
        let applicable = || self.rows.iter().map(|row| row.sensory_feedback);
        input.now < self.steady_until
            && input.progressed.is_empty()
            && applicable().eq(input.applicable.iter().copied())
    }

    /// When time alone changes the outcome of a step next: a heartbeat is due, a window of a teammate opens or ends (eq. 2.4), the
    /// active set has been active for ψ or λ (eq. 2.6), or a wait ends. `None` where every step changes it, for a set is getting
    /// impatient.
    pub(super) fn next_turn(&self, now: SimTime) -> Option<SimTime> {
        let mut next = match self.awake {
            Awake {
                active: Some(active),
                waiting: 0,
            } => self.end_of_activity(active, now)?,
            Awake { active: None, .. } => self.end_of_waiting(now)?,
            Awake { .. } => return None,
        };
        for set in &self.config.sets {
            for (teammate, record) in self.history.about(set.own_task) {
                // Toward a robot that is none of the team there is no rate, and no turn.
                let phi = set
                    .params
                    .toward(*teammate)
                    .map_or(SimTime::ZERO, |it| it.phi);
                next = record
                    .turns(set.params.tau, phi, now)
                    .fold(next, SimTime::min);
            }
        }
        Some(next)
    }

    /// When time alone next changes what the active set does. The others are suppressed; what teammates claim only ages, which
    /// makes nobody give way.
    fn end_of_activity(&self, active: usize, now: SimTime) -> Option<SimTime> {
        let Stance::Active { since, .. } = self.behaviors[active].stance else {
            return None;
        };
        let since = since.max(self.learned_of(active).trial);
        let set = &self.config.sets[active];
        let ends = [set.params.psi, set.params.lambda].map(|span| since + span);
        let ends = ends.into_iter().filter(|&end| end >= now);
        Some(ends.fold(self.heartbeats.next(active, set), SimTime::min))
    }

    /// When time alone next changes what the waiting sets do: claims expire, and waits are bounded. `None` where another set gets
    /// impatient, or where none waits.
    fn end_of_waiting(&self, now: SimTime) -> Option<SimTime> {
        let mut next = None;
        let sets = self.behaviors.iter().zip(&self.config.sets);
        for (index, (behavior, set)) in sets.enumerate() {
            match behavior.stance {
                Stance::Waiting { since } => {
                    let left = set.params.waiting_bound().since(behavior.spent_waiting());
                    // It ends once it is longer than its bound.
                    let bound = since + left + SimTime(1);
                    let claims = self.teammates.expiries(set.task, set.params.tau, now);
                    let heartbeat = self.heartbeats.next(index, set);
                    let ends = claims.chain([bound, heartbeat]).min();
                    next = ends.into_iter().chain(next).min();
                }
                // Not applicable, so that it stays at 0.
                _ if !self.rows[index].sensory_feedback => {}
                _ => return None,
            }
        }
        next
    }
}

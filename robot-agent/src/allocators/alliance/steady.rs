//! Skipping of steps: while time alone changes nothing, the rows of the latest step stay valid.
//!
//! A working or waiting robot then needs one comparison instead of an evaluation of all its behaviors.
//! `tests/properties.rs` compares the results with full evaluation.

use scenario::time::SimTime;

use super::behavior::{NonHibernating, SetState};
use super::engine::Engine;
use crate::allocator::Input;

impl Engine {
    /// Forces a full evaluation in the next step.
    pub(in crate::allocators) fn weigh_anew(&mut self) {
        self.steady_until = SimTime::ZERO;
    }

    /// Returns whether a step without new messages would repeat the latest one.
    pub(super) fn is_steady(&self, input: &Input<'_>) -> bool {
        let applicable = || self.rows.iter().map(|row| row.sensory_feedback);
        input.now < self.steady_until
            && input.progressed.is_empty()
            && applicable().eq(input.applicable.iter().copied())
    }

    /// Returns the time of the next change that needs no message: a due heartbeat, the start or end of a teammate's
    /// window (eq. 2.4), ψ or λ of the active set (eq. 2.6), or the end of a wait. Returns `None` while a motivation
    /// rises.
    pub(super) fn next_turn(&self, now: SimTime) -> Option<SimTime> {
        let mut next = match self.awake {
            NonHibernating {
                active: Some(active),
                waiting: 0,
            } => self.end_of_activity(active, now)?,
            NonHibernating { active: None, .. } => self.end_of_waiting(now)?,
            NonHibernating { .. } => return None,
        };
        for set in &self.config.sets {
            for (teammate, record) in self.history.records_of(set.task_index) {
                // A robot outside the team has no rate, so that it causes no change.
                let phi = set
                    .params
                    .toward(*teammate)
                    .map_or(SimTime::ZERO, |toward| toward.phi);
                next = record
                    .changes_after(set.params.tau, phi, now)
                    .fold(next, SimTime::min);
            }
        }
        Some(next)
    }

    /// Returns the time of the next time-driven change of the active set. Aging claims never make it yield.
    fn end_of_activity(&self, active: usize, now: SimTime) -> Option<SimTime> {
        let SetState::Active { since, .. } = self.behaviors[active].stance else {
            return None;
        };
        let since = since.max(self.learned_of(active).trial);
        let set = &self.config.sets[active];
        let ends = [set.params.psi, set.params.lambda].map(|span| since + span);
        let ends = ends.into_iter().filter(|&end| end >= now);
        Some(ends.fold(self.heartbeats.next(active, set), SimTime::min))
    }

    /// Returns the time of the next time-driven change of the waiting sets. Returns `None` if another set's motivation
    /// rises or no set waits.
    fn end_of_waiting(&self, now: SimTime) -> Option<SimTime> {
        let mut next = None;
        let sets = self.behaviors.iter().zip(&self.config.sets);
        for (index, (behavior, set)) in sets.enumerate() {
            match behavior.stance {
                SetState::Waiting { since } => {
                    let left = set.params.waiting_bound().since(behavior.spent_waiting());
                    // The wait ends when it is longer than its bound.
                    let bound = since + left + SimTime(1);
                    let claims = self.teammates.expiries(set.task, set.params.tau, now);
                    let heartbeat = self.heartbeats.next(index, set);
                    let ends = claims.chain([bound, heartbeat]).min();
                    next = ends.into_iter().chain(next).min();
                }
                // The set is not applicable, so its motivation stays 0.
                _ if !self.rows[index].sensory_feedback => {}
                _ => return None,
            }
        }
        next
    }
}

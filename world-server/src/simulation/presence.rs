//! Participation of robots: joining, death, silence and return.

use proto::join::Refusal;
use proto::process::ProcessAction;
use run_log::Input;
use scenario::ids::{Incarnation, RobotId, Tick};

use super::Simulation;
use super::tick::TickPhase;
use crate::barrier::Presence;

impl Simulation {
    /// Invites an agent; see [`Barrier::invite`](crate::barrier::Barrier::invite).
    ///
    /// # Errors
    /// If the agent may not join.
    pub fn invite(&mut self, robot: &str) -> Result<(RobotId, Incarnation, Tick), Refusal> {
        if self.outcome.is_some() {
            return Err(Refusal::Over);
        }
        self.barrier.invite(robot)
    }

    /// Admits an agent; see [`Barrier::arrive`](crate::barrier::Barrier::arrive). The clock starts after the last robot's arrival.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.set_order_index();
        self.barrier.arrive(robot, incarnation);
        self.barrier.start_if_all_arrived();
        self.order_index += self.barrier.take_external_count();
        if self.barrier.presence(robot) == Presence::Present {
            self.conclude_if(robot, &[ProcessAction::Start]);
        }
    }

    /// Stops the wait for a robot's arrival; see [`Barrier::start_without`](crate::barrier::Barrier::start_without).
    pub fn start_without(&mut self, robot: RobotId) {
        self.barrier.start_without(robot);
        self.barrier.start_if_all_arrived();
    }

    /// Records the death of an agent; see [`Barrier::agent_lost`](crate::barrier::Barrier::agent_lost).
    pub fn agent_lost(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.set_order_index();
        let asked_for = self.is_killing(robot);
        self.barrier.agent_lost(robot, incarnation, asked_for);
        self.order_index += self.barrier.take_external_count();
        self.handle_departure(robot, was_invited, "its process ended before it joined");
    }

    /// Cancels an invitation; see [`Barrier::give_up`](crate::barrier::Barrier::give_up).
    pub fn cancel_invitation(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.barrier.give_up(robot, incarnation);
        self.handle_departure(robot, was_invited, "it was welcomed and did not join");
    }

    fn handle_departure(&mut self, robot: RobotId, was_invited: bool, why: &str) {
        let at_once = self.barrier.presence(robot) == Presence::Empty;
        if at_once {
            self.drop_load(robot);
        }
        if self.barrier.is_lost(robot) || at_once {
            self.conclude_if(robot, &[ProcessAction::Kill, ProcessAction::Terminate]);
        }
        if at_once && was_invited {
            self.fail_start_of(robot, why);
        }
        self.settle();
    }

    /// Drops a robot's load before the current tick is sensed.
    fn drop_load(&mut self, robot: RobotId) {
        self.active[robot.index()] = None;
        self.keep_figures();
        self.events.extend(self.world.release_load(robot));
    }

    /// Skips incarnations in a replay; see [`Barrier::skip_to`](crate::barrier::Barrier::skip_to).
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.barrier.skip_to(robot, incarnation);
    }

    /// Sets the order index of the next outside input. Collected reports have none, because their order is free.
    pub(super) fn set_order_index(&mut self) {
        let gathers = self.phase == TickPhase::Reports;
        self.barrier
            .set_order_index((!gathers).then_some(self.order_index));
    }

    /// Checks in a replay whether an input of the current tick is due now.
    #[must_use]
    pub fn is_input_due(&self, input: &Input) -> bool {
        input
            .moment()
            .is_none_or(|moment| moment <= self.order_index)
    }

    /// Admits an agent in a replay; see [`Barrier::admit`](crate::barrier::Barrier::admit).
    pub fn admit(&mut self, robot: RobotId, incarnation: Incarnation, at_once: bool) {
        self.set_order_index();
        self.barrier.admit(robot, incarnation, at_once);
        self.barrier.start_if_all_arrived();
        self.order_index += self.barrier.take_external_count();
    }

    /// Marks a robot as silent; see [`Barrier::stall`](crate::barrier::Barrier::stall). The run counts as unscripted.
    pub fn stall(&mut self, robot: RobotId) {
        if self.barrier.is_awaited(robot) {
            self.unscripted = true;
            self.stalls += 1;
            self.barrier.stall(robot);
            self.settle();
        }
    }
}

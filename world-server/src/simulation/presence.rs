//! Which robots take part: who joins, dies, falls silent, comes back.

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::join::Refusal;
use alliance_proto::log::Input;
use alliance_proto::process::ProcessAct;

use super::Simulation;
use crate::barrier::Presence;

impl Simulation {
    /// See [`Barrier::invite`](crate::barrier::Barrier::invite).
    ///
    /// # Errors
    /// Why the agent may not join.
    pub fn invite(&mut self, robot: &str) -> Result<(RobotId, Incarnation, Tick), Refusal> {
        if self.outcome.is_some() {
            return Err(Refusal::Over);
        }
        self.barrier.invite(robot)
    }

    /// See [`Barrier::arrive`](crate::barrier::Barrier::arrive); the clock starts when every robot of the scenario has arrived.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.mark_moment();
        self.barrier.arrive(robot, incarnation);
        self.barrier.start_if_all_here();
        self.moment += self.barrier.take_came();
        if self.barrier.presence(robot) == Presence::Present {
            self.conclude_if(robot, &[ProcessAct::Start]);
        }
    }

    /// See [`Barrier::start_without`](crate::barrier::Barrier::start_without).
    pub fn start_without(&mut self, robot: RobotId) {
        self.barrier.start_without(robot);
        self.barrier.start_if_all_here();
    }

    /// See [`Barrier::gone`](crate::barrier::Barrier::gone).
    pub fn gone(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.mark_moment();
        let asked_for = self.is_killing(robot);
        self.barrier.gone(robot, incarnation, asked_for);
        self.moment += self.barrier.take_came();
        self.left(robot, was_invited, "its process ended before it joined");
    }

    /// See [`Barrier::give_up`](crate::barrier::Barrier::give_up).
    pub fn give_up(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.barrier.give_up(robot, incarnation);
        self.left(robot, was_invited, "it was welcomed and did not join");
    }

    /// An agent may have left its place.
    fn left(&mut self, robot: RobotId, was_invited: bool, why: &str) {
        let at_once = self.barrier.presence(robot) == Presence::Empty;
        if at_once {
            self.let_go(robot);
        }
        if self.barrier.is_gone(robot) || at_once {
            self.conclude_if(robot, &[ProcessAct::Kill, ProcessAct::Terminate]);
        }
        if at_once && was_invited {
            self.fail_start_of(robot, why);
        }
        self.settle();
    }

    /// What a robot carries falls before the current tick is sensed.
    fn let_go(&mut self, robot: RobotId) {
        self.active[robot.index()] = None;
        self.keep_figures();
        self.events.extend(self.world.lose(robot));
    }

    /// In a replay: see [`Barrier::skip_to`](crate::barrier::Barrier::skip_to).
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.barrier.skip_to(robot, incarnation);
    }

    /// Reports of different robots may come in any order while they are gathered; of everything else the order is kept.
    pub(super) fn mark_moment(&mut self) {
        let gathers = self.opened && !self.settled;
        self.barrier.set_moment((!gathers).then_some(self.moment));
    }

    /// In a replay: whether what came from outside at some moment of the current tick is due now.
    #[must_use]
    pub fn feeds(&self, input: &Input) -> bool {
        input.moment().is_none_or(|moment| moment <= self.moment)
    }

    /// In a replay: see [`Barrier::admit`](crate::barrier::Barrier::admit).
    pub fn admit(&mut self, robot: RobotId, incarnation: Incarnation, at_once: bool) {
        self.mark_moment();
        self.barrier.admit(robot, incarnation, at_once);
        self.barrier.start_if_all_here();
        self.moment += self.barrier.take_came();
    }

    /// See [`Barrier::stall`](crate::barrier::Barrier::stall). The scenario did not ask for it.
    pub fn stall(&mut self, robot: RobotId) {
        if self.barrier.is_awaited(robot) {
            self.unscripted = true;
            self.barrier.stall(robot);
            self.settle();
        }
    }
}

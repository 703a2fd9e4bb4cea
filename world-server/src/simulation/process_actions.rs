//! Process actions of faults. They run one after the other, and each is awaited, so no deadline affects the run.

use std::collections::VecDeque;

use proto::process::ProcessAction;
use run_log::Input;
use scenario::fault::Fault;
use scenario::ids::RobotId;

use super::Simulation;
use crate::barrier::Presence;
use crate::faults::schedule::FaultIndex;
use run_log::recorder::FaultEvent;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PendingAction {
    pub robot: RobotId,
    pub act: ProcessAction,
    pub fault: FaultIndex,
    /// False if the process has not joined the run yet.
    takes_part: bool,
}

impl PendingAction {
    pub fn new(robot: RobotId, act: ProcessAction, fault: FaultIndex) -> Self {
        Self {
            robot,
            act,
            fault,
            takes_part: true,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Acts {
    waiting: VecDeque<PendingAction>,
    under_way: Option<PendingAction>,
    /// The number of actions started in this tick.
    started: u32,
}

impl Acts {
    pub fn push(&mut self, act: PendingAction) {
        self.waiting.push_back(act);
    }

    pub fn end_tick(&mut self) {
        self.started = 0;
    }

    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.under_way.is_none()
    }
}

impl Simulation {
    /// Returns the next process action, each once. The tick waits for its effect: a killed agent is [gone](Simulation::agent_lost), a
    /// started one has [arrived](Simulation::arrive), a stopped or continued one is [done](Simulation::act_done).
    pub fn next_act(&mut self) -> Option<(RobotId, ProcessAction)> {
        loop {
            if let Some(act) = self.take_action()? {
                return Some(act);
            }
        }
    }

    /// Takes one action from the queue: `None` if none is waiting, `Some(None)` if it has nothing to do. Each action has its own
    /// order index, so a replay can place outside inputs between any two.
    pub fn take_action(&mut self) -> Option<Option<(RobotId, ProcessAction)>> {
        if self.acts.under_way.is_some() {
            return None;
        }
        if self.acts.is_empty() {
            // A stopped clock requests no tick, so later changes start here.
            self.begin();
        }
        let mut next = self.acts.waiting.pop_front()?;
        self.order_index += 1;
        // A joining robot does not take part yet and is missing in the log.
        let is_coming = self.barrier.is_joining(next.robot);
        let lives = self.barrier.presence(next.robot) != Presence::Empty
            && !self.barrier.is_lost(next.robot);
        let ends = matches!(next.act, ProcessAction::Kill | ProcessAction::Terminate);
        match next.act {
            ProcessAction::Start if is_coming || !lives => self.barrier.expect(next.robot),
            ProcessAction::Start => return Some(None),
            _ if ends && self.barrier.is_killed(next.robot) => {
                // Another action was faster in the same tick.
                self.hit(next.fault, "");
                return Some(None);
            }
            _ if is_coming || !lives => {
                let fault = &self.schedule.status(next.fault).order.fault;
                if matches!(fault, Fault::Remove(_)) {
                    // The body is removed in any case.
                    self.hit(next.fault, "");
                } else if Self::is_effect(fault, next.act) {
                    let why = format!("no process of '{}' takes part", self.name(next.robot));
                    self.push_fault_event(FaultEvent::Failed, next.fault, &why);
                }
                if !ends || !lives {
                    return Some(None);
                }
                next.takes_part = false;
            }
            _ => {}
        }
        self.acts.under_way = Some(next);
        // A replay has no joining robots, so actions on them do not count.
        self.acts.started += u32::from(next.takes_part);
        if next.act != ProcessAction::Start || !is_coming {
            return Some(Some((next.robot, next.act)));
        }
        // Another launcher started the process; it is admitted now.
        if self.barrier.presence(next.robot) == Presence::Present {
            self.conclude(next);
        }
        Some(None)
    }

    /// Checks whether the tick waits for a process action.
    #[must_use]
    pub fn awaits_act(&self) -> bool {
        self.acts.under_way.is_some()
    }

    /// Returns the number of earlier actions in this tick.
    #[must_use]
    pub fn act_number(&self) -> u32 {
        self.acts.started.saturating_sub(1)
    }

    /// Records the launcher's success or failure at the action of [`Simulation::next_act`].
    pub fn act_done(&mut self, robot: RobotId, act: ProcessAction, result: Result<(), String>) {
        let Some(done) = self.acts.under_way else {
            return;
        };
        if (done.robot, done.act) != (robot, act) {
            return;
        }
        match (result, act) {
            (Ok(()), ProcessAction::Stop) => self.conclude(done),
            (Ok(()), ProcessAction::Continue) => {
                self.barrier.readmit(robot);
                self.conclude(done);
            }
            // The agent's liveliness token reports the effect.
            (Ok(()), ProcessAction::Start | ProcessAction::Kill | ProcessAction::Terminate) => {}
            (Err(why), _) => self.fail(done, &why),
        }
    }

    /// Checks whether the robot's process is being ended.
    pub(super) fn is_killing(&self, robot: RobotId) -> bool {
        self.acts.under_way.is_some_and(|act| {
            act.robot == robot && matches!(act.act, ProcessAction::Kill | ProcessAction::Terminate)
        })
    }

    /// Completes the current action if it is one of these actions on this robot.
    pub(super) fn conclude_if(&mut self, robot: RobotId, acts: &[ProcessAction]) {
        if let Some(done) = self.acts.under_way
            && done.robot == robot
            && acts.contains(&done.act)
        {
            self.conclude(done);
        }
    }

    /// Fails the current action if it is the start of this robot.
    pub(super) fn fail_start_of(&mut self, robot: RobotId, why: &str) {
        if let Some(start) = self.acts.under_way
            && (start.robot, start.act) == (robot, ProcessAction::Start)
        {
            self.fail(start, why);
        }
    }

    fn conclude(&mut self, done: PendingAction) {
        self.acts.under_way = None;
        self.order_index += u32::from(done.takes_part);
        let status = self.schedule.status(done.fault);
        let is_effect = Self::is_effect(&status.order.fault, done.act);
        if is_effect && done.takes_part && status.failed.is_none() {
            self.hit(done.fault, "");
        }
        self.settle();
    }

    fn fail(&mut self, failed: PendingAction, why: &str) {
        self.acts.under_way = None;
        self.order_index += u32::from(failed.takes_part);
        match failed.act {
            ProcessAction::Start => self.barrier.cancel_expected(failed.robot),
            ProcessAction::Kill | ProcessAction::Terminate => {
                self.barrier.cancel_kill(failed.robot)
            }
            ProcessAction::Stop => self.barrier.readmit(failed.robot),
            ProcessAction::Continue => self.barrier.release(failed.robot),
        }
        if !failed.takes_part {
            // The log contains no agent that this failure could concern.
            tracing::warn!(
                robot = self.name(failed.robot),
                why,
                "cannot end a process that has not joined yet"
            );
            return self.settle();
        }
        self.unscripted = true;
        self.failures.push(Input::Failed {
            robot: self.name(failed.robot).to_owned(),
            act: failed.act,
            number: Some(self.act_number()),
            reason: why.to_owned(),
        });
        self.push_fault_event(FaultEvent::Failed, failed.fault, why);
        self.settle();
    }
}

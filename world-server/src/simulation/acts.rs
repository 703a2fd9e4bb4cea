//! What faults ask of processes: one act after the other, each waited for, so that no deadline decides anything (DESIGN §5).

use std::collections::VecDeque;

use alliance_proto::fault::Fault;
use alliance_proto::ids::RobotId;
use alliance_proto::log::Input;
use alliance_proto::process::ProcessAct;

use super::Simulation;
use crate::barrier::Presence;
use crate::faults::schedule::FaultIndex;
use crate::recorder::FaultEvent;

/// Something to be done to the process of a robot's agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Act {
    pub robot: RobotId,
    pub act: ProcessAct,
    pub fault: FaultIndex,
    /// Whether the run knows of whom it concerns.
    takes_part: bool,
}

impl Act {
    pub fn new(robot: RobotId, act: ProcessAct, fault: FaultIndex) -> Self {
        Self {
            robot,
            act,
            fault,
            takes_part: true,
        }
    }
}

/// Acts in the order in which they are done.
#[derive(Clone, Debug, Default)]
pub(super) struct Acts {
    waiting: VecDeque<Act>,
    /// What the launcher is doing.
    under_way: Option<Act>,
    /// How many have been asked for in this tick.
    asked: u32,
}

impl Acts {
    pub fn push(&mut self, act: Act) {
        self.waiting.push_back(act);
    }

    /// The next tick begins.
    pub fn end_tick(&mut self) {
        self.asked = 0;
    }

    /// Whether nothing is left to be done.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.under_way.is_none()
    }
}

impl Simulation {
    /// What is to be done next to a process, each act once; the tick waits until it has had its effect: an agent that is
    /// killed is [gone](Simulation::gone), one that is started has [arrived](Simulation::arrive), one that is stopped or
    /// continued is [done](Simulation::act_done).
    pub fn next_act(&mut self) -> Option<(RobotId, ProcessAct)> {
        loop {
            if let Some(act) = self.take_act()? {
                return Some(act);
            }
        }
    }

    /// The same, one act at a time, be it done or not: `None` if none is waiting, `Some(None)` if the next one has nothing to do. Each
    /// is a moment of its own, so that a replay can do what came from outside between any two of them.
    pub fn take_act(&mut self) -> Option<Option<(RobotId, ProcessAct)>> {
        if self.acts.under_way.is_some() {
            return None;
        }
        if self.acts.is_empty() {
            // What comes after it before the tick comes even when a clock that stands still asks for no tick.
            self.begin();
        }
        let mut next = self.acts.waiting.pop_front()?;
        self.moment += 1;
        // Who is on its way has no part in the run yet, and a replay knows nothing of it.
        let is_coming = self.barrier.is_coming(next.robot);
        match next.act {
            ProcessAct::Start if is_coming => self.barrier.expect(next.robot),
            ProcessAct::Stop | ProcessAct::Continue if is_coming => return Some(None),
            ProcessAct::Kill | ProcessAct::Terminate if self.barrier.is_killed(next.robot) => {
                // Something else was faster in the same tick.
                self.hit(next.fault, 1);
                return Some(None);
            }
            _ if self.is_moot(next) => return Some(None),
            ProcessAct::Start => self.barrier.expect(next.robot),
            ProcessAct::Kill | ProcessAct::Terminate => next.takes_part = !is_coming,
            ProcessAct::Stop | ProcessAct::Continue => {}
        }
        self.acts.under_way = Some(next);
        // In a replay nobody is coming who takes no part, and nothing is done to such a one.
        self.acts.asked += u32::from(next.takes_part);
        if next.act != ProcessAct::Start || !is_coming {
            return Some(Some((next.robot, next.act)));
        }
        // Somebody else has started it: it is let in now.
        if self.barrier.presence(next.robot) == Presence::Present {
            self.conclude(next);
        }
        Some(None)
    }

    /// Whether the tick waits for an act to have its effect.
    #[must_use]
    pub fn awaits_act(&self) -> bool {
        self.acts.under_way.is_some()
    }

    /// How many acts had been asked for in this tick before the one that is under way.
    #[must_use]
    pub fn act_number(&self) -> u32 {
        self.acts.asked.saturating_sub(1)
    }

    /// Whether an act would find nothing to do: it lives already, or lives no more.
    fn is_moot(&self, act: Act) -> bool {
        let lives =
            self.barrier.presence(act.robot) != Presence::Empty && !self.barrier.is_gone(act.robot);
        (act.act == ProcessAct::Start) == lives
    }

    /// The launcher has done what [`Simulation::next_act`] asked for, or says why it cannot.
    pub fn act_done(&mut self, robot: RobotId, act: ProcessAct, result: Result<(), String>) {
        let Some(done) = self.acts.under_way else {
            return;
        };
        if (done.robot, done.act) != (robot, act) {
            return;
        }
        match (result, act) {
            (Ok(()), ProcessAct::Stop) => self.conclude(done),
            (Ok(()), ProcessAct::Continue) => {
                self.barrier.readmit(robot);
                self.conclude(done);
            }
            // The token tells when it has had its effect.
            (Ok(()), ProcessAct::Start | ProcessAct::Kill | ProcessAct::Terminate) => {}
            (Err(why), _) => self.fail(done, &why),
        }
    }

    /// Whether this robot's process is being ended.
    pub(super) fn is_killing(&self, robot: RobotId) -> bool {
        self.acts.under_way.is_some_and(|act| {
            act.robot == robot && matches!(act.act, ProcessAct::Kill | ProcessAct::Terminate)
        })
    }

    /// If the act under way has asked for this of this robot, it has had its effect.
    pub(super) fn conclude_if(&mut self, robot: RobotId, acts: &[ProcessAct]) {
        if let Some(done) = self.acts.under_way
            && done.robot == robot
            && acts.contains(&done.act)
        {
            self.conclude(done);
        }
    }

    /// If the act under way is the start of this robot: it has failed.
    pub(super) fn fail_start_of(&mut self, robot: RobotId, why: &str) {
        if let Some(start) = self.acts.under_way
            && (start.robot, start.act) == (robot, ProcessAct::Start)
        {
            self.fail(start, why);
        }
    }

    fn conclude(&mut self, done: Act) {
        self.acts.under_way = None;
        self.moment += u32::from(done.takes_part);
        // What heals a fault is none of its effects, nor what has to go before one.
        let is_effect = match self.schedule.status(done.fault).order.fault {
            Fault::Kill(_) | Fault::Terminate(_) | Fault::Remove(_) => {
                matches!(done.act, ProcessAct::Kill | ProcessAct::Terminate)
            }
            Fault::Pause(_) => done.act == ProcessAct::Stop,
            Fault::Continue(_) => done.act == ProcessAct::Continue,
            _ => done.act == ProcessAct::Start,
        };
        if is_effect && done.takes_part {
            self.hit(done.fault, 1);
        }
        self.settle();
    }

    fn fail(&mut self, failed: Act, why: &str) {
        self.acts.under_way = None;
        self.moment += u32::from(failed.takes_part);
        match failed.act {
            ProcessAct::Start => self.barrier.expect_no_more(failed.robot),
            ProcessAct::Kill | ProcessAct::Terminate => self.barrier.cancel_kill(failed.robot),
            ProcessAct::Stop => self.barrier.readmit(failed.robot),
            ProcessAct::Continue => self.barrier.release(failed.robot),
        }
        if !failed.takes_part {
            // The run knows of nobody to whom it could have happened.
            tracing::warn!(
                robot = self.name(failed.robot),
                why,
                "still on its way, and could not be ended"
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
        self.tell(FaultEvent::Failed, failed.fault, why);
        self.settle();
    }
}

//! Effects of faults when they are applied and when they heal.

use proto::process::ProcessAction;
use scenario::fault::{Fault, Role};
use scenario::ids::RobotId;

use super::Simulation;
use super::process_actions::PendingAction;
use crate::barrier::Presence;
use crate::faults::schedule::{FaultIndex, Transition};
use crate::interruption::Interruption;
use crate::world::ChangeError;
use run_log::recorder::{Event, EventKind, FaultEvent, FaultHits};

impl Simulation {
    /// Returns the next change of a fault that is due.
    pub(super) fn next_transition(&mut self) -> Option<Transition> {
        // The lowest rank with the role has precedence.
        let with_role = |role: Role<'_>| {
            let active = match role {
                Role::Executing(task) => Some(self.setup.catalog.find_behavior(task)?),
                Role::Idle => None,
            };
            let mut reported = self.reported.iter();
            let rank = reported.position(|reported| *reported == Some(active))?;
            Some(self.setup.scenario.robots[rank].name.as_str())
        };
        self.schedule.next(self.world.now(), with_role)
    }

    /// Runs the experiment's own handlers.
    pub(super) fn run_handlers(&mut self) {
        if !self.handlers.is_empty() {
            self.keep_figures();
        }
        for handler in &mut self.handlers {
            let events = handler.trigger_event(self.world.now(), &mut self.world);
            self.events.extend(events);
        }
    }

    pub(super) fn clear_one(&mut self, fault: FaultIndex) {
        match self.schedule.clear(fault, self.world.now()) {
            Some(true) => self.heal(fault),
            Some(false) => self.push_fault_event(FaultEvent::Disarmed, fault, ""),
            None => {}
        }
    }

    pub(super) fn apply(&mut self, index: FaultIndex) {
        self.push_fault_event(FaultEvent::Applied, index, "");
        self.switch(index, true);
    }

    pub(super) fn heal(&mut self, index: FaultIndex) {
        self.push_fault_event(FaultEvent::Healed, index, "");
        self.switch(index, false);
    }

    /// Applies the effect of a fault, or reverts it. Each kind that acts on processes, presence or power has one arm for
    /// both. Faults of messages, sensors, actuators and skills act as long as they are in force (`faults/`).
    fn switch(&mut self, index: FaultIndex, on: bool) {
        let fault = self.schedule.status(index).order.fault.clone();
        let robot = fault.robot().and_then(|name| self.robot_named(name));
        let Some(robot) = robot else {
            return self.interrupt_world(index, &fault, on);
        };
        match &fault {
            Fault::Kill(_) if on => self.kill(index, robot, ProcessAction::Kill),
            Fault::Terminate(_) if on => self.kill(index, robot, ProcessAction::Terminate),
            Fault::Kill(_) | Fault::Terminate(_) => {
                if !self.barrier.is_absent(robot) {
                    self.act(index, robot, ProcessAction::Start);
                }
            }
            Fault::Pause(_) if on => {
                self.barrier.suspend(robot);
                self.act(index, robot, ProcessAction::Stop);
            }
            Fault::Pause(_) => {
                if self.barrier.is_suspended(robot) {
                    self.act(index, robot, ProcessAction::Continue);
                }
            }
            Fault::Continue(_) if on => {
                let runs = self.barrier.presence(robot) == Presence::Present
                    && !self.barrier.is_lost(robot)
                    && !self.barrier.is_suspended(robot);
                if runs {
                    // A signal from outside may have stopped the process, so the action follows all the same.
                    let why = format!("no fault has paused '{}'", self.name(robot));
                    self.push_fault_event(FaultEvent::Failed, index, &why);
                }
                for pause in self.in_force_on(robot, |fault| matches!(fault, Fault::Pause(_))) {
                    self.clear_one(pause);
                }
                self.act(index, robot, ProcessAction::Continue);
            }
            Fault::Restart(_) if on => self.restart(index, robot),
            Fault::Add(_) if on => self.add(index, robot),
            Fault::Add(_) => self.remove(index, robot),
            Fault::Remove(_) if on && !self.world.is_present(robot) => {
                let why = ChangeError::Absent.to_string();
                self.push_fault_event(FaultEvent::Failed, index, &why);
            }
            Fault::Remove(_) if on => self.remove(index, robot),
            Fault::Remove(_) => self.add(index, robot),
            Fault::Power(_) => {
                let others = self.in_force_on(robot, |fault| matches!(fault, Fault::Power(_)));
                self.world.set_powered(robot, !on && others.is_empty());
            }
            _ => self.interrupt_world(index, &fault, on),
        }
    }

    /// Checks whether a process action is the effect of a fault. Other actions heal it or prepare its effect.
    pub(super) fn is_effect(fault: &Fault, act: ProcessAction) -> bool {
        match fault {
            Fault::Kill(_) | Fault::Terminate(_) | Fault::Remove(_) => {
                matches!(act, ProcessAction::Kill | ProcessAction::Terminate)
            }
            Fault::Pause(_) => act == ProcessAction::Stop,
            Fault::Continue(_) => act == ProcessAction::Continue,
            _ => act == ProcessAction::Start,
        }
    }

    /// Begins or ends a change of the world. Other faults change nothing here.
    fn interrupt_world(&mut self, index: FaultIndex, fault: &Fault, on: bool) {
        if !on {
            if let Some(mut change) = self.interruptions.remove(&index) {
                change.end(&mut self.world);
            }
            return;
        }
        let mut change = Interruption::from_fault(fault, &self.setup.roster);
        self.keep_figures();
        match change.begin(&mut self.world) {
            None => {}
            Some(Ok(detail)) => {
                self.interruptions.insert(index, change);
                self.hit(index, &detail);
            }
            Some(Err(why)) => self.push_fault_event(FaultEvent::Failed, index, &why.to_string()),
        }
    }

    /// Returns the matching faults in force on a robot, without momentary ones.
    fn in_force_on(&self, robot: RobotId, matches: impl Fn(&Fault) -> bool) -> Vec<FaultIndex> {
        let name = self.name(robot);
        self.schedule
            .in_force()
            .filter(|(_, fault)| matches(fault) && fault.robot() == Some(name))
            .map(|(index, _)| index)
            .collect()
    }

    /// Kills a robot. If it takes part in this tick, it dies after the tick: its report counts, but its broadcasts reach no
    /// robot.
    fn kill(&mut self, fault: FaultIndex, robot: RobotId, act: ProcessAction) {
        // A robot that has died in this tick takes part no more.
        let is_present = self.barrier.presence(robot) == Presence::Present;
        if is_present && !self.barrier.is_lost(robot) {
            self.barrier.kill_after_tick(robot);
            self.pending_kills
                .push(PendingAction::new(robot, act, fault));
        } else {
            self.barrier.kill_after_tick(robot);
            self.act(fault, robot, act);
        }
    }

    /// Starts a robot's process in a new incarnation. Permanent faults that have ended the process are over then.
    fn restart(&mut self, index: FaultIndex, robot: RobotId) {
        if self.barrier.is_absent(robot) {
            let why = ChangeError::Absent.to_string();
            return self.push_fault_event(FaultEvent::Failed, index, &why);
        }
        let kills = |fault: &Fault| matches!(fault, Fault::Kill(_) | Fault::Terminate(_));
        for kill in self.in_force_on(robot, kills) {
            if self.schedule.is_permanent(kill) {
                self.schedule.clear(kill, self.world.now());
                self.push_fault_event(FaultEvent::Healed, kill, "the robot is started anew");
            }
        }
        // A later restart finds the robot alive.
        self.kill_at_once(index, robot);
        self.act(index, robot, ProcessAction::Start);
    }

    fn kill_at_once(&mut self, fault: FaultIndex, robot: RobotId) {
        // Waiting kills come first; otherwise they would affect the successor.
        for act in self.pending_kills.extract_if(.., |act| act.robot == robot) {
            self.acts.push(act);
        }
        self.barrier.kill_after_tick(robot);
        self.act(fault, robot, ProcessAction::Kill);
    }

    fn add(&mut self, fault: FaultIndex, robot: RobotId) {
        match self.world.add_robot(robot) {
            Ok(_) => self.act(fault, robot, ProcessAction::Start),
            Err(why) => self.push_fault_event(FaultEvent::Failed, fault, &why.to_string()),
        }
    }

    fn remove(&mut self, fault: FaultIndex, robot: RobotId) {
        self.kill_at_once(fault, robot);
        self.barrier.mark_absent(robot);
        self.active[robot.index()] = None;
        self.keep_figures();
        self.events.extend(self.world.remove_robot(robot));
    }

    fn act(&mut self, fault: FaultIndex, robot: RobotId, act: ProcessAction) {
        self.acts.push(PendingAction::new(robot, act, fault));
    }

    /// Adds a row about a fault to events.csv.
    pub(super) fn push_fault_event(&mut self, kind: FaultEvent, index: FaultIndex, why: &str) {
        if kind == FaultEvent::Failed {
            self.schedule.fail(index, why);
        }
        let status = self.schedule.status(index);
        let fault = &status.order.fault;
        let trigger = match (&status.order.when, status.order.at_s, status.order.every_s) {
            (Some(when), ..) => when.to_string(),
            (None, Some(at_s), None) => format!("at {at_s} s"),
            (None, None, None) => "at once".to_owned(),
            (None, at_s, Some(every_s)) => {
                format!("at {} s, every {every_s} s", at_s.unwrap_or_default())
            }
        };
        let reason = match kind {
            FaultEvent::Armed | FaultEvent::Applied => trigger,
            _ => why.to_owned(),
        };
        let robot = fault.robot().and_then(|name| self.robot_named(name));
        let event = Event {
            subject: status.id.clone(),
            reason,
            detail: fault.to_string(),
            ..Event::new(EventKind::Fault(kind), robot)
        };
        self.events.push(event);
    }

    /// Counts an effect of a fault. The first one since its application is an event with this reason.
    pub(super) fn hit(&mut self, fault: FaultIndex, why: &str) {
        let id = &self.schedule.status(fault).id;
        match self.hits.iter_mut().find(|hits| hits.fault == *id) {
            Some(hits) => hits.count += 1,
            None => self.hits.push(FaultHits {
                fault: id.clone(),
                count: 1,
            }),
        }
        if self.schedule.hit(fault) {
            self.push_fault_event(FaultEvent::Hit, fault, why);
        }
    }
}

//! Operators' orders during a run. They take effect at the beginning of a tick and are inputs of that tick.

use std::borrow::Cow;

use proto::control::{Armed, Cleared, FaultStatus, Phase};
use run_log::{Branch, Input};
use scenario::fault::{Fault, Order};
use scenario::ids::Tick;
use scenario::time::SimTime;
use scenario::{Problem, Setup};

use super::Simulation;
use crate::barrier::Presence;
use crate::faults::in_vain::refuse_place;
use crate::faults::schedule::Schedule;
use crate::interruption::Interruption;
use crate::world::Places;
use run_log::recorder::FaultEvent;

/// A command that waits for the next tick.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum QueuedCommand {
    Order(Order),
    Clear(Vec<String>),
}

impl Simulation {
    /// Orders a fault for an operator.
    ///
    /// # Errors
    /// If the order is invalid; the text contains a remedy.
    pub fn order(&mut self, mut order: Order) -> Result<Armed, Problem> {
        self.refuse_if_over()?;
        let Setup {
            scenario, catalog, ..
        } = &*self.setup;
        order.check(scenario, catalog)?;
        if order.fault.affects_process() && !self.has_launcher {
            let name = order.fault.name();
            let what = format!("'{name}' needs the launcher, which owns the processes");
            return Err(Problem::of_value(what, "start the run with `alliance run`"));
        }
        let reserved: Vec<&str> = self
            .commands
            .iter()
            .filter_map(|command| match command {
                QueuedCommand::Order(order) => order.id.as_deref(),
                QueuedCommand::Clear(_) => None,
            })
            .collect();
        let id = self.schedule.choose_id(order.id.take(), &reserved)?;
        order.id = Some(id.clone());
        let (tick, now) = self.next_beginning();
        let at = match order.when {
            Some(_) => None,
            None => Some(order.at().unwrap_or(now).max(now)),
        };
        // A fault that is due between two ticks takes effect at the later one.
        let step = self.setup.scenario.step_ms;
        let tick = at.map(|at| at.0.div_ceil(step).max(tick));
        self.command(QueuedCommand::Order(order));
        Ok(Armed {
            id,
            tick,
            t_ms: tick.map(|tick| SimTime(tick * step)),
        })
    }

    /// Orders a fault of an operator. An order without an effect is refused, because it is probably a mistake. `is_stopped`
    /// is true if the launcher has reported that the target's process is stopped.
    ///
    /// # Errors
    /// If the order is invalid, or would have no effect at once or in this run; the text contains a remedy.
    pub fn order_by_hand(&mut self, order: Order, is_stopped: bool) -> Result<Armed, Problem> {
        let scenario = &self.setup.scenario;
        let late = order.beyond_limit(scenario.limit_s, scenario.step_ms);
        late.map_or(Ok(()), Err)?;
        self.check_target(&order, is_stopped)?;
        self.refusal(&order).map_or(Ok(()), Err)?;
        self.order(order)
    }

    /// Rejects an immediate fault of a process that does not exist, or a continuation of one that is not stopped.
    fn check_target(&self, order: &Order, is_stopped: bool) -> Result<(), Problem> {
        let robot = order.fault.robot().and_then(|name| self.robot_named(name));
        let is_now = order.at_s.is_none() && order.every_s.is_none() && order.when.is_none();
        let Some(robot) = robot.filter(|_| is_now && self.barrier.started()) else {
            return Ok(());
        };
        let name = self.name(robot);
        match order.fault {
            Fault::Kill(_) | Fault::Terminate(_) | Fault::Pause(_)
                if self.barrier.presence(robot) == Presence::Empty =>
            {
                let remedy = format!("`alliance fault restart {name}` starts one");
                Err(Problem::of_value(
                    format!("'{name}' has no process"),
                    remedy,
                ))
            }
            Fault::Continue(_) if !self.barrier.is_suspended(robot) && !is_stopped => {
                Err(Problem::of_value(format!("'{name}' is not paused"), ""))
            }
            _ => Ok(()),
        }
    }

    /// Returns the reason why an operator's order has no effect. A replay does not call it, because the world may change
    /// between an order and its effect.
    fn refusal(&self, order: &Order) -> Option<Problem> {
        let Setup {
            scenario, catalog, ..
        } = &*self.setup;
        if order.check(scenario, catalog).is_err() {
            return None;
        }
        self.refusal_at_any_time(order)
            .or_else(|| self.refusal_now(order))
    }

    /// Returns the reason why an order has no effect if it takes effect at once: its change of the world is tried on a
    /// copy, after the orders that wait for the same tick.
    fn refusal_now(&self, order: &Order) -> Option<Problem> {
        let roster = &self.setup.roster;
        let (_, now) = self.next_beginning();
        let is_now = |order: &Order| {
            let is_due = order.at().is_none_or(|at| at <= now);
            is_due && order.every_s.is_none() && order.when.is_none()
        };
        if !is_now(order) || !Interruption::may_fail(&order.fault) {
            return None;
        }
        let mut world = self.world.clone();
        for command in &self.commands {
            match command {
                QueuedCommand::Order(waiting) if is_now(waiting) => {
                    // A failure concerns only that order.
                    let _ = Interruption::try_on(&mut world, &waiting.fault, roster);
                }
                QueuedCommand::Order(_) => {}
                // Clearing may make room.
                QueuedCommand::Clear(_) => return None,
            }
        }
        let tried = Interruption::try_on(&mut world, &order.fault, roster);
        let why = tried.err()?;
        let at = ["fault", order.fault.name()];
        Some(Problem::at(at, why.to_string(), ""))
    }

    /// Returns the reason why an order has no effect at any time: the border, the scenario's obstacles, and tasks that
    /// earlier orders need.
    fn refusal_at_any_time(&self, order: &Order) -> Option<Problem> {
        let scenario = &self.setup.scenario;
        match &order.fault {
            Fault::Mission(fault) => {
                let times =
                    |order: &Order, due| order.times(due, scenario.limit_s, scenario.step_ms);
                let schedule = self.schedule_after_commands();
                let of_mission = |index| {
                    let FaultStatus { order, phase, .. } = schedule.status(index);
                    match &order.fault {
                        Fault::Mission(fault) if *phase == Phase::Armed => {
                            Some((fault, times(order, schedule.due(index))))
                        }
                        _ => None,
                    }
                };
                let ordered: Vec<_> = schedule.all().filter_map(of_mission).collect();
                let (_, now) = self.next_beginning();
                let due = order.at().unwrap_or(now).max(now);
                let times = times(order, order.when.is_none().then_some(due));
                let mission = self.world.mission();
                mission.refuse_order(fault, times, &ordered, &Places::of(scenario))
            }
            fault @ Fault::MoveRobot(_) => refuse_place(fault, &Places::of(scenario)),
            _ => None,
        }
    }

    /// Clears the fault with the given id, or all faults, for an operator.
    ///
    /// # Errors
    /// If there is no such fault, or it has already ended.
    pub fn clear(&mut self, id: Option<&str>) -> Result<Cleared, Problem> {
        self.refuse_if_over()?;
        let faults = self.faults();
        let live: Vec<String> = faults
            .iter()
            .filter(|status| status.phase != Phase::Over)
            .map(|status| status.id.clone())
            .collect();
        let ids = match id {
            None => live,
            Some(id) if live.iter().any(|live| live == id) => vec![id.to_owned()],
            Some(id) if faults.iter().any(|status| status.id == id) => {
                let what = format!("the fault '{id}' has already ended");
                return Err(Problem::of_value(what, ""));
            }
            Some(id) if live.is_empty() => {
                let remedy = "no fault is armed or in force";
                return Err(Problem::of_value(
                    format!("there is no fault '{id}'"),
                    remedy,
                ));
            }
            Some(id) => {
                let remedy = format!("armed or in force: {}", live.join(", "));
                return Err(Problem::of_value(
                    format!("there is no fault '{id}'"),
                    remedy,
                ));
            }
        };
        let (tick, t_ms) = self.next_beginning();
        self.replay_clear(ids.clone());
        Ok(Cleared { ids, tick, t_ms })
    }

    /// Clears faults as one operator command. A replay calls it directly.
    pub fn replay_clear(&mut self, ids: Vec<String>) {
        if !ids.is_empty() {
            self.command(QueuedCommand::Clear(ids));
        }
    }

    /// Leaves the course of a repeated run, before anything else happens in the current tick. A replay calls it, too.
    ///
    /// # Errors
    /// If a fault has the id of another one, or a parameter does not exist. Nothing has changed then.
    pub fn branch(&mut self, branch: &Branch) -> Result<(), Problem> {
        let setup = self.setup.with_parameters(&branch.parameters)?;
        if let Some(orders) = &branch.faults {
            let ids = orders.iter().filter_map(|order| order.id.clone());
            for id in ids {
                self.schedule.choose_id(Some(id), &[])?;
            }
        }
        *self.setup = setup;
        if let Some(orders) = &branch.faults {
            for fault in self.schedule.all() {
                if self.schedule.disarm(fault) {
                    self.push_fault_event(FaultEvent::Disarmed, fault, "");
                }
            }
            for order in orders {
                // The ids were checked above.
                if let Ok(fault) = self.schedule.arm(order.clone(), self.world.now()) {
                    self.push_fault_event(FaultEvent::Armed, fault, "");
                }
            }
        }
        self.inputs.push(Input::Branch(branch.clone()));
        Ok(())
    }

    /// Returns all faults of the run, in the order of arming. Waiting commands count as executed.
    #[must_use]
    pub fn faults(&self) -> Vec<FaultStatus> {
        self.schedule_after_commands().statuses().cloned().collect()
    }

    /// Returns the schedule after the waiting commands.
    fn schedule_after_commands(&self) -> Cow<'_, Schedule> {
        let (_, now) = self.next_beginning();
        let mut schedule = Cow::Borrowed(&self.schedule);
        for command in &self.commands {
            match command {
                QueuedCommand::Order(order) => {
                    // The id was free when it was assigned and is reserved since then.
                    let _ = schedule.to_mut().arm(order.clone(), now);
                }
                QueuedCommand::Clear(ids) => {
                    for id in ids {
                        if let Some(fault) = schedule.find(id) {
                            schedule.to_mut().clear(fault, now);
                        }
                    }
                }
            }
        }
        schedule
    }

    fn refuse_if_over(&self) -> Result<(), Problem> {
        match self.outcome {
            Some(_) => Err(Problem::of_value("the run is over", "")),
            None => Ok(()),
        }
    }

    /// Returns the earliest tick that a command can change.
    fn next_beginning(&self) -> (Tick, SimTime) {
        let later = u64::from(!self.phase.admits_changes());
        let step = self.setup.scenario.step_ms;
        (
            self.barrier.tick() + later,
            self.world.now() + SimTime(later * step),
        )
    }

    fn command(&mut self, command: QueuedCommand) {
        self.commands.push_back(command);
        // Begin now if possible, because a stopped clock requests no tick.
        self.begin();
    }

    pub(super) fn execute_command(&mut self, command: QueuedCommand) {
        let moment = (self.order_index > 0).then_some(self.order_index);
        self.order_index += 1;
        self.schedule.begin_command();
        match command {
            QueuedCommand::Order(order) => {
                self.inputs.push(Input::Order {
                    order: order.clone(),
                    moment,
                });
                // The id was free when it was assigned and is reserved since then.
                if let Ok(fault) = self.schedule.arm(order, self.world.now()) {
                    self.push_fault_event(FaultEvent::Armed, fault, "");
                }
            }
            QueuedCommand::Clear(ids) => {
                for id in &ids {
                    if let Some(fault) = self.schedule.find(id) {
                        self.clear_one(fault);
                    }
                }
                self.inputs.push(Input::Clear { ids, moment });
            }
        }
    }
}

//! One group of robots that are sent a tick, step and report together.

use proto::team::Broadcast;
use robot_agent::agent::{Agent, Workspace};
use scenario::StepOrder;
use scenario::ids::{RobotId, Tick};
use world_server::barrier::Verdict;

use crate::inputs::TickInputs;
use crate::pool::{Chunk, WorkerPool};
use crate::run::Run;
use crate::seat::{Seat, TOGETHER, Workspaces};

impl Run {
    /// Steps the next group of robots, or the whole team on several threads. Returns `false` if no robot is left.
    pub(super) fn step_group(&mut self, inputs: &TickInputs) -> bool {
        if let Some(mut pool) = self.take_pool(inputs) {
            let simulation = &mut self.simulation;
            let chunks = pool.step(simulation, &mut self.seats, &self.broadcasts, &self.driven);
            let any = chunks.is_some();
            for chunk in chunks.into_iter().flatten() {
                self.pass_on(chunk);
            }
            self.simulation.settle();
            self.pool = Some(pool);
            return any;
        }
        // With external inputs, all robots that can be sent the tick form one group, because the inputs take effect after that.
        let is_undisturbed = inputs.leave_reports_alone();
        let most = if is_undisturbed { TOGETHER } else { usize::MAX };
        self.asked.clear();
        while self.asked.len() < most
            && let Some(robot) = self.simulation.next_recipient()
        {
            self.asked.push(robot);
        }
        if self.asked.is_empty() {
            return false;
        }
        if is_undisturbed {
            self.answer(inputs);
        } else {
            self.answer_in_order(inputs);
        }
        true
    }

    /// Returns the threads if they can step the team in this tick. They cannot if the inputs of the tick or the step order
    /// prescribe an order of robots, or if external controllers answer.
    fn take_pool(&mut self, inputs: &TickInputs) -> Option<WorkerPool> {
        let is_free = inputs.leave_reports_alone()
            && self.answer_source.is_none()
            && self.simulation.setup().step_order != StepOrder::InOrder;
        if is_free { self.pool.take() } else { None }
    }

    /// Passes the broadcasts of a chunk to the team, and ends agents whose reports are malformed.
    fn pass_on(&mut self, chunk: &mut Chunk) {
        let mut broadcasts = chunk.broadcasts.drain(..);
        let mut own = Vec::new();
        let mut dismissed = Vec::new();
        for sent in chunk.sent.drain(..) {
            own.extend(broadcasts.by_ref().take(sent.broadcasts));
            self.send(sent.robot, &mut own, &mut chunk.used);
            if !sent.is_valid {
                dismissed.push(sent.robot);
            }
        }
        // As in a group, agents end after all reports.
        for robot in dismissed {
            self.end_agent(robot);
        }
    }

    /// Steps the robots of the group one by one, in the order that the inputs of the tick require.
    fn answer_in_order(&mut self, inputs: &TickInputs) {
        let mut asked = std::mem::take(&mut self.asked);
        // A robot that dies while reports are gathered dies before the last report arrives. The order is therefore: robots that die after
        // their own report or stall, then other robots that die, then all others.
        let tick = self.simulation.tick();
        asked.sort_by_key(|robot| match self.death(*robot, inputs) {
            Some(counted) if counted == Some(tick) || inputs.stall(self.name(*robot)) => 0,
            Some(_) => 1,
            None => 2,
        });
        for robot in asked {
            self.asked.clear();
            self.asked.push(robot);
            let death = self.death(robot, inputs);
            if inputs.stall(self.name(robot)) {
                self.simulation.stall(robot);
            } else if death.is_none_or(|counted| counted == Some(tick)) {
                self.answer(inputs);
            }
            if death.is_some() {
                self.end_agent(robot);
            }
        }
    }

    /// Returns the tick in which the robot counted last, if it dies in this tick.
    pub(super) fn death(&self, robot: RobotId, inputs: &TickInputs) -> Option<Option<Tick>> {
        inputs.death_of(
            self.name(robot),
            self.simulation.barrier().incarnation(robot),
        )
    }

    /// Steps the agents of the group and then passes on their reports.
    fn answer(&mut self, inputs: &TickInputs) {
        let Workspaces(spaces) = &mut self.spaces;
        let most = spaces.len().max(self.asked.len());
        spaces.resize_with(most, Workspace::default);
        self.perceive(inputs);
        if self.unanswered.is_some() {
            return;
        }
        let Workspaces(spaces) = &mut self.spaces;
        for phase in [Agent::allocate, Agent::act] {
            for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
                if let Seat::Agent(agent) = &mut self.seats[robot.index()] {
                    phase(agent, self.simulation.message(robot), space);
                }
            }
        }
        self.report();
    }

    /// Passes the broadcasts and the readings of the tick to the agents. External controllers answer at once.
    fn perceive(&mut self, inputs: &TickInputs) {
        let Workspaces(spaces) = &mut self.spaces;
        let robots = &self.simulation.setup().scenario.robots;
        let name = |robot: RobotId| &robots[robot.index()].name;
        for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
            let message = self.simulation.message(robot);
            let is_lost = |sender, tick, index| {
                !inputs.leave_reports_alone() && inputs.lose(name(robot), name(sender), tick, index)
            };
            self.broadcasts
                .collect(&message.manifest, is_lost, &mut space.arrived);
            match &mut self.seats[robot.index()] {
                Seat::Agent(agent) => agent.perceive(message, space),
                Seat::Foreign => {
                    if let Some(answer_source) = &mut self.answer_source {
                        let (report, broadcasts) = (&mut space.report, &mut space.broadcasts);
                        let answered = answer_source.answer(
                            robot,
                            message,
                            &space.arrived,
                            report,
                            broadcasts,
                        );
                        self.unanswered = self.unanswered.take().or(answered.err());
                    }
                }
                Seat::Empty => {}
            }
        }
    }

    /// Passes the broadcasts and reports of the group to the team and to the world.
    fn report(&mut self) {
        let mut dismissed = Vec::new();
        let asked = std::mem::take(&mut self.asked);
        let Workspaces(mut spaces) = std::mem::take(&mut self.spaces);
        for (&robot, space) in asked.iter().zip(&mut spaces) {
            if matches!(self.seats[robot.index()], Seat::Empty) {
                continue;
            }
            if let Some(Some(command)) = self.driven.get(robot.index()) {
                command.apply_to(&mut space.report.actuation);
            }
            self.send(robot, &mut space.broadcasts, &mut space.used_broadcasts);
            if self.simulation.report(&space.report) == Verdict::Malformed {
                dismissed.push(robot);
            }
        }
        (self.asked, self.spaces) = (asked, Workspaces(spaces));
        // Without its controller the robot counts as crashed, as in a run by processes.
        for robot in dismissed {
            self.end_agent(robot);
        }
    }

    /// Passes a robot's broadcasts of the tick to the team, and to the world if it records them. Broadcasts that can no longer
    /// be received move to `used`.
    #[inline]
    fn send(&mut self, robot: RobotId, broadcasts: &mut Vec<Broadcast>, used: &mut Vec<Broadcast>) {
        if let Some(traffic) = &mut self.traffic {
            traffic.add(broadcasts);
        }
        if self.simulation.has_external_controller(robot) {
            for broadcast in &*broadcasts {
                self.simulation.keep_broadcast(broadcast.clone());
            }
        }
        if self.simulation.records_allocation_messages() {
            for broadcast in &*broadcasts {
                self.simulation.keep_allocation_message(broadcast);
            }
        }
        let tick = self.simulation.tick();
        self.broadcasts.send(tick, robot, broadcasts, used);
    }
}

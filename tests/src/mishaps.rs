//! A team in one process under random faults: robots crash, return and stall, broadcasts are lost, and an operator
//! orders faults.
//!
//! The seed determines everything. The model covers the cases of real processes: a crash before or after a report, a
//! late report, a lost broadcast, and an order or a signal at any order index of a tick, also during a process act,
//! which may fail.

use missions::Registry;
use proto::process::ProcessAction;
use proto::tick::Report;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use robot_agent::radio::Radio;
use run_log::recorder::{RecordError, Recorder};
use run_log::{LogLevel, MemoryLog};
use scenario::Setup;
use scenario::fault::Order;
use scenario::ids::{Incarnation, RobotId};
use world_server::simulation::Simulation;

/// The probabilities of the random events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// The loss of a broadcast at one receiver.
    pub loss: f64,
    /// The crash of a robot in a tick.
    pub death: f64,
    /// The stall of a robot in a tick.
    pub stall: f64,
    /// The return of a crashed or stalled robot in a tick.
    pub back: f64,
    /// An operator's order and a manual kill, at each order index of a tick. The failure of a process act has ten
    /// times this probability.
    pub order: f64,
}

/// The orders of the operator, with `{}` for a robot name.
const ORDERS: [&str; 8] = [
    r#"{"fault":{"pause":"{}"},"for_s":0.5}"#,
    r#"{"fault":{"pause":"{}"},"for_s":3}"#,
    r#"{"fault":{"kill":"{}"},"for_s":2}"#,
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"continue":"{}"}}"#,
    r#"{"fault":{"mute":"{}"},"every_s":4,"for_s":0.5}"#,
    r#"{"fault":{"waste":{"x_m":2,"y_m":2}}}"#,
    r#"{"fault":{"obstacle":{"x_m":3,"y_m":2,"width_m":0.4,"height_m":0.4}},"for_s":1}"#,
];

/// Runs a mission to its end. At least one robot always takes part.
///
/// # Errors
/// Never returns an error, because the log is in memory.
pub fn run(setup: &Setup, rates: Rates, seed: u64) -> Result<Recorder<MemoryLog>, RecordError> {
    let mission = Registry::current().worlds().find(&setup.scenario);
    let mission = mission.expect("a mission that comes with the simulator");
    let mut recorder = Recorder::new(setup, LogLevel::Full, MemoryLog::default())?;
    let mut team = Team {
        simulation: Simulation::new(setup.clone(), mission, true),
        members: Vec::new(),
        rates,
        rng: ChaCha8Rng::seed_from_u64(seed),
    };
    for (rank, robot) in setup.scenario.robots.iter().enumerate() {
        // An initially absent robot counts as crashed until it is added.
        let member = team.join(&robot.name);
        let absent = || team.member(RobotId(rank as u16), 0, State::Crashed);
        let member = member.unwrap_or_else(absent);
        team.members.push(member);
    }
    loop {
        team.tick(&mut recorder)?;
        if let Some(outcome) = team.simulation.outcome() {
            recorder.finish(outcome, team.simulation.ending())?;
            return Ok(recorder);
        }
    }
}

struct Team {
    simulation: Simulation,
    /// The members by rank.
    members: Vec<Member>,
    rates: Rates,
    rng: ChaCha8Rng,
}

struct Member {
    incarnation: Incarnation,
    agent: TentativeAgent,
    radio: Radio,
    state: State,
}

enum State {
    Alive,
    Crashed,
    /// A stalled robot with the report that it sends when it returns.
    Stalled(Box<Report>),
}

impl Team {
    fn join(&mut self, name: &str) -> Option<Member> {
        let (robot, incarnation, _) = self.simulation.invite(name).ok()?;
        self.simulation.arrive(robot, incarnation);
        Some(self.member(robot, incarnation, State::Alive))
    }

    fn member(&self, robot: RobotId, incarnation: Incarnation, state: State) -> Member {
        let setup = self.simulation.setup();
        let team = TeamConfig::new(setup, Registry::current().agents());
        let team = team.expect("an allocator that comes with the simulator");
        let agent = Agent::new(robot, incarnation, setup, &team);
        Member {
            incarnation,
            agent: TentativeAgent::new(agent),
            radio: Radio::default(),
            state,
        }
    }

    fn tick(&mut self, recorder: &mut Recorder<MemoryLog>) -> Result<(), RecordError> {
        self.send_random_order();
        self.return_randomly();
        while !self.simulation.is_complete() {
            self.simulation.begin();
            self.send_random_order();
            while let Some((robot, act)) = self.simulation.next_act() {
                self.send_random_order();
                self.act(robot, act);
            }
            while let Some(robot) = self.simulation.next_recipient() {
                self.send_random_order();
                self.step(robot);
            }
            if self.simulation.barrier().is_idle() {
                self.return_randomly();
            }
        }
        self.send_random_order();
        self.simulation.finish();
        self.simulation.record(recorder).map(drop)
    }

    /// Sends a random order with some probability. The simulation refuses invalid orders.
    fn send_random_order(&mut self) {
        self.kill_randomly();
        if !self.rng.random_bool(self.rates.order) {
            return;
        }
        if self.rng.random_bool(0.1) {
            let _ = self.simulation.clear(None);
            return;
        }
        let rank = self.rng.random_range(0..self.members.len());
        let name = &self.simulation.setup().scenario.robots[rank].name;
        let order = ORDERS[self.rng.random_range(0..ORDERS.len())].replace("{}", name);
        let order: Order = serde_json::from_str(&order).expect("all entries are orders");
        let _ = self.simulation.order(order);
    }

    fn kill_randomly(&mut self) {
        if !self.rng.random_bool(self.rates.order) {
            return;
        }
        let robot = RobotId(self.rng.random_range(0..self.members.len()) as u16);
        let is_last = !self.can_spare(robot);
        let member = &mut self.members[robot.index()];
        if !is_last && !matches!(member.state, State::Crashed) {
            member.state = State::Crashed;
            self.simulation.agent_lost(robot, member.incarnation);
        }
    }

    /// Executes a process act of a fault, or lets it fail.
    fn act(&mut self, robot: RobotId, act: ProcessAction) {
        let is_crashed = matches!(self.members[robot.index()].state, State::Crashed);
        let fails = self.rng.random_bool((10.0 * self.rates.order).min(1.0));
        match act {
            ProcessAction::Start if fails => {
                let name = self.simulation.setup().scenario.robots[robot.index()]
                    .name
                    .clone();
                if let Ok((robot, incarnation, _)) = self.simulation.invite(&name) {
                    self.simulation.agent_lost(robot, incarnation);
                }
            }
            ProcessAction::Stop | ProcessAction::Continue if fails || is_crashed => {
                let reason = "the process did not react to the signal".to_owned();
                self.simulation.act_done(robot, act, Err(reason));
            }
            ProcessAction::Start => {
                let name = self.simulation.setup().scenario.robots[robot.index()]
                    .name
                    .clone();
                if let Some(member) = self.join(&name) {
                    self.members[robot.index()] = member;
                }
            }
            ProcessAction::Kill | ProcessAction::Terminate => {
                let member = &mut self.members[robot.index()];
                member.state = State::Crashed;
                let incarnation = member.incarnation;
                self.simulation.agent_lost(robot, incarnation);
            }
            ProcessAction::Stop | ProcessAction::Continue => {
                self.simulation.act_done(robot, act, Ok(()));
            }
        }
    }

    fn return_randomly(&mut self) {
        for rank in 0..self.members.len() {
            if !self.rng.random_bool(self.rates.back) {
                continue;
            }
            match std::mem::replace(&mut self.members[rank].state, State::Alive) {
                State::Alive => {}
                State::Stalled(report) => {
                    self.simulation.report(&report);
                }
                State::Crashed => {
                    let name = self.simulation.setup().scenario.robots[rank].name.clone();
                    match self.join(&name) {
                        Some(member) => self.members[rank] = member,
                        None => self.members[rank].state = State::Crashed,
                    }
                }
            }
        }
    }

    fn step(&mut self, robot: RobotId) {
        let member = &mut self.members[robot.index()];
        if matches!(member.state, State::Crashed) {
            return;
        }
        let message = self.simulation.message(robot);
        let mut space = Workspace::default();
        member.radio.collect(&message.manifest, &mut space.arrived);
        member.agent.step(Box::new(message.clone()), &mut space);
        let (report, broadcasts) = (space.report, space.broadcasts);
        // Broadcasts are sent before the report, and independently of it.
        for broadcast in broadcasts {
            for (rank, teammate) in self.members.iter_mut().enumerate() {
                if rank != robot.index() && !self.rng.random_bool(self.rates.loss) {
                    teammate.radio.receive(broadcast.clone());
                }
            }
        }
        let crashes = self.can_spare(robot) && self.rng.random_bool(self.rates.death);
        let stalls = self.can_spare(robot) && self.rng.random_bool(self.rates.stall);
        let member = &mut self.members[robot.index()];
        if crashes {
            member.state = State::Crashed;
            if self.rng.random_bool(0.5) {
                self.simulation.report(&report);
            }
            self.simulation.agent_lost(robot, member.incarnation);
        } else if stalls {
            member.state = State::Stalled(Box::new(report));
            self.simulation.stall(robot);
        } else {
            self.simulation.report(&report);
        }
    }

    /// Returns whether another robot is alive.
    fn can_spare(&self, robot: RobotId) -> bool {
        let mut others = self.members.iter().enumerate();
        others.any(|(rank, member)| rank != robot.index() && matches!(member.state, State::Alive))
    }
}

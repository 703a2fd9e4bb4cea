//! A team in one process to which everything happens: robots die, come back, fall silent, broadcasts get lost, and an operator
//! orders faults.
//!
//! All by a seed, and as processes would do it: a death before or after the report of a tick, a report that comes too late,
//! a broadcast that never arrives, an order or a signal by hand at any moment of a tick, also while something is being done to a
//! process, which may fail.

use alliance_proto::fault::Order;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::log::{LogLevel, Memory};
use alliance_proto::process::ProcessAct;
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Report;
use missions::Registry;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use robot_agent::radio::Radio;
use world_server::recorder::{RecordError, Recorder};
use world_server::simulation::Simulation;

/// How often things happen, as probabilities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// That a broadcast does not arrive at a receiver.
    pub loss: f64,
    /// That a robot dies in a tick.
    pub death: f64,
    /// That a robot falls silent in a tick.
    pub stall: f64,
    /// That a robot that is dead or silent comes back in a tick.
    pub back: f64,
    /// That an operator orders or clears something at one of the moments of a tick, that somebody kills a process there, and ten
    /// times that: that what a fault asks of a process fails.
    pub order: f64,
}

/// What an operator orders, of some robot where it is `{}`.
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
/// Never: memory takes everything.
pub fn run(setup: &Setup, rates: Rates, seed: u64) -> Result<Recorder<Memory>, RecordError> {
    let mission = Registry::of_this_program().worlds().of(&setup.scenario);
    let mission = mission.expect("a mission that comes with the simulator");
    let mut recorder = Recorder::new(setup, LogLevel::Full, Memory::default())?;
    let mut team = Team {
        simulation: Simulation::new(setup.clone(), mission, true),
        members: Vec::new(),
        rates,
        chance: ChaCha8Rng::seed_from_u64(seed),
    };
    for (rank, robot) in setup.scenario.robots.iter().enumerate() {
        // Who is absent at first is as if dead: it comes when it is brought in.
        let member = team.join(&robot.name);
        let absent = || team.member(RobotId(rank as u16), 0, State::Dead);
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
    /// By rank.
    members: Vec<Member>,
    rates: Rates,
    chance: ChaCha8Rng,
}

struct Member {
    incarnation: Incarnation,
    agent: TentativeAgent,
    radio: Radio,
    state: State,
}

enum State {
    Alive,
    Dead,
    /// Silent; what it will say when it speaks again.
    Silent(Box<Report>),
}

impl Team {
    /// A new incarnation of a robot.
    fn join(&mut self, name: &str) -> Option<Member> {
        let (robot, incarnation, _) = self.simulation.invite(name).ok()?;
        self.simulation.arrive(robot, incarnation);
        Some(self.member(robot, incarnation, State::Alive))
    }

    fn member(&self, robot: RobotId, incarnation: Incarnation, state: State) -> Member {
        let setup = self.simulation.setup();
        let team = TeamConfig::of(setup, Registry::of_this_program().agents());
        let team = team.expect("an allocator that comes with the simulator");
        let agent = Agent::new(robot, incarnation, setup, &team);
        Member {
            incarnation,
            agent: TentativeAgent::new(agent),
            radio: Radio::default(),
            state,
        }
    }

    fn tick(&mut self, recorder: &mut Recorder<Memory>) -> Result<(), RecordError> {
        self.operate();
        self.come_back();
        while !self.simulation.is_complete() {
            self.simulation.begin();
            self.operate();
            while let Some((robot, act)) = self.simulation.next_act() {
                self.operate();
                self.act(robot, act);
            }
            while let Some(robot) = self.simulation.next_question() {
                self.operate();
                self.ask(robot);
            }
            if self.simulation.barrier().is_idle() {
                self.come_back();
            }
        }
        self.operate();
        self.simulation.finish();
        self.simulation.record(recorder).map(drop)
    }

    /// An operator may say something now. What does not fit is refused, as it would be by the world.
    fn operate(&mut self) {
        self.strike();
        if !self.chance.random_bool(self.rates.order) {
            return;
        }
        if self.chance.random_bool(0.1) {
            let _ = self.simulation.clear(None);
            return;
        }
        let rank = self.chance.random_range(0..self.members.len());
        let name = &self.simulation.setup().scenario.robots[rank].name;
        let order = ORDERS[self.chance.random_range(0..ORDERS.len())].replace("{}", name);
        let order: Order = serde_json::from_str(&order).expect("all of them are orders");
        let _ = self.simulation.order(order);
    }

    /// Somebody may kill a process now, whatever is going on.
    fn strike(&mut self) {
        if !self.chance.random_bool(self.rates.order) {
            return;
        }
        let robot = RobotId(self.chance.random_range(0..self.members.len()) as u16);
        let spared = !self.can_spare(robot);
        let member = &mut self.members[robot.index()];
        if !spared && !matches!(member.state, State::Dead) {
            member.state = State::Dead;
            self.simulation.gone(robot, member.incarnation);
        }
    }

    /// Does to a process what a fault asks for, or fails at it.
    fn act(&mut self, robot: RobotId, act: ProcessAct) {
        let is_dead = matches!(self.members[robot.index()].state, State::Dead);
        let fails = self.chance.random_bool((10.0 * self.rates.order).min(1.0));
        match act {
            ProcessAct::Start if fails => {
                let name = self.simulation.setup().scenario.robots[robot.index()]
                    .name
                    .clone();
                if let Ok((robot, incarnation, _)) = self.simulation.invite(&name) {
                    self.simulation.gone(robot, incarnation);
                }
            }
            ProcessAct::Stop | ProcessAct::Continue if fails || is_dead => {
                let why = "it does not obey the signal".to_owned();
                self.simulation.act_done(robot, act, Err(why));
            }
            ProcessAct::Start => {
                let name = self.simulation.setup().scenario.robots[robot.index()]
                    .name
                    .clone();
                if let Some(member) = self.join(&name) {
                    self.members[robot.index()] = member;
                }
            }
            ProcessAct::Kill | ProcessAct::Terminate => {
                let member = &mut self.members[robot.index()];
                member.state = State::Dead;
                let incarnation = member.incarnation;
                self.simulation.gone(robot, incarnation);
            }
            ProcessAct::Stop | ProcessAct::Continue => {
                self.simulation.act_done(robot, act, Ok(()));
            }
        }
    }

    fn come_back(&mut self) {
        for rank in 0..self.members.len() {
            if !self.chance.random_bool(self.rates.back) {
                continue;
            }
            match std::mem::replace(&mut self.members[rank].state, State::Alive) {
                State::Alive => {}
                State::Silent(report) => {
                    self.simulation.report(&report);
                }
                State::Dead => {
                    let name = self.simulation.setup().scenario.robots[rank].name.clone();
                    match self.join(&name) {
                        Some(member) => self.members[rank] = member,
                        None => self.members[rank].state = State::Dead,
                    }
                }
            }
        }
    }

    fn ask(&mut self, robot: RobotId) {
        let member = &mut self.members[robot.index()];
        if matches!(member.state, State::Dead) {
            return;
        }
        let message = self.simulation.message(robot);
        let mut space = Workspace::default();
        member.radio.collect(&message.manifest, &mut space.arrived);
        member.agent.step(Box::new(message.clone()), &mut space);
        let (report, broadcasts) = (space.report, space.broadcasts);
        // Broadcasts are on the air before the report, whatever becomes of it.
        for broadcast in broadcasts {
            for (rank, teammate) in self.members.iter_mut().enumerate() {
                if rank != robot.index() && !self.chance.random_bool(self.rates.loss) {
                    teammate.radio.receive(broadcast.clone());
                }
            }
        }
        let dies = self.can_spare(robot) && self.chance.random_bool(self.rates.death);
        let stalls = self.can_spare(robot) && self.chance.random_bool(self.rates.stall);
        let member = &mut self.members[robot.index()];
        if dies {
            member.state = State::Dead;
            if self.chance.random_bool(0.5) {
                self.simulation.report(&report);
            }
            self.simulation.gone(robot, member.incarnation);
        } else if stalls {
            member.state = State::Silent(Box::new(report));
            self.simulation.stall(robot);
        } else {
            self.simulation.report(&report);
        }
    }

    /// Whether somebody else would go on.
    fn can_spare(&self, robot: RobotId) -> bool {
        let mut others = self.members.iter().enumerate();
        others.any(|(rank, it)| rank != robot.index() && matches!(it.state, State::Alive))
    }
}

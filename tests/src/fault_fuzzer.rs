//! A fault fuzzer: a model of all external inputs of a world, in any order, without processes.
//!
//! The inputs are messages of the robots' processes, acts and messages of the launcher, manual signals, orders, and
//! deadlines. Each source keeps its own order, as on the bus, and the seed draws the next source.
//!
//! The simulation with its barrier, recorder and agents is the real one. This model repeats only the few decisions of
//! `world_server::server`.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use missions::Registry;
use proto::process::ProcessAction;
use proto::team::{Broadcast, BroadcastKey};
use proto::tick::{ManifestEntry, Outcome, Report, TickMessage};
use rand::RngExt;
use rand::seq::{IndexedRandom, IteratorRandom};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use run_log::recorder::{RecordError, Recorder};
use run_log::{LogLevel, MemoryLog};
use scenario::Setup;
use scenario::fault::{Fault, FaultGroup, Order};
use scenario::ids::{Incarnation, RobotId};
use scenario::testkit::examples_of;
use world_server::barrier::{Presence, Verdict};
use world_server::simulation::Simulation;

/// The number of inputs without the end of a tick that counts as a hang.
const HANG: u32 = 200_000;

/// The number of inputs by kind and by the state of the world and of the robot concerned.
pub type Coverage = BTreeMap<(&'static str, String), u64>;

/// The conditions of a fuzzed run.
#[derive(Clone, Copy, Debug)]
pub struct Fuzz {
    pub seed: u64,
    /// The number of ticks after which the run is interrupted.
    pub ticks: u64,
    /// The share of signals, orders and starts by hand that is left out. With 0, robots complete hardly any work.
    pub calm: f64,
    /// The probability that a broadcast is lost at a receiver.
    pub loss: f64,
}

/// Draws an order. Most orders affect the process of a robot, and some have a role or an event. The share `permanent` of
/// lasting faults has no end.
///
/// # Panics
/// Panics if no fault affects processes.
pub fn process_order(robot: &str, permanent: f64, rng: &mut ChaCha8Rng) -> Order {
    let is_of_process = rng.random_bool(0.8);
    let kinds = Fault::KINDS.iter().filter(|kind| match kind.group {
        FaultGroup::Process => is_of_process,
        FaultGroup::Radio | FaultGroup::World => !is_of_process,
        FaultGroup::Robot => false,
    });
    let kind = kinds.choose(rng).expect("faults of processes");
    let role = ["executing:report-progress", "idle"][rng.random_range(0..2)];
    let has_role = kind.takes_role && rng.random_bool(0.2);
    let examples = examples_of(kind);
    let fault = examples.choose(rng).expect("an example of each fault");
    let mut order = Order::now(fault.with_target(if has_role { role } else { robot }));
    if !order.fault.is_instantaneous() && !rng.random_bool(permanent) {
        order.for_s = [0.05, 0.5, 1.0, 3.0].choose(rng).copied();
        order.every_s = rng.random_bool(0.15).then_some(5.0);
    }
    if order.every_s.is_none() && rng.random_bool(0.15) {
        let event = ["dies", "stalls"][rng.random_range(0..2)];
        order.when = format!("{robot} {event}").parse().ok();
    }
    order
}

/// Runs a mission, and adds the inputs to `coverage`.
///
/// # Errors
/// Never returns an error, because the log is in memory.
pub fn run(
    setup: &Setup,
    fuzz: Fuzz,
    coverage: &mut Coverage,
) -> Result<Recorder<MemoryLog>, RecordError> {
    let seed = fuzz.seed;
    let registry = Registry::current();
    let mission = registry.worlds().find(&setup.scenario);
    let mission = mission.expect("a mission that comes with the simulator");
    let team = TeamConfig::new(setup, registry.agents()).expect("the allocators of the simulator");
    let mut fuzzer = Fuzzer {
        simulation: Simulation::new(setup.clone(), mission, true),
        recorder: Recorder::new(setup, LogLevel::Full, MemoryLog::default())?,
        team,
        processes: Vec::new(),
        sent: BTreeMap::new(),
        peers: Vec::new(),
        orders: VecDeque::new(),
        launcher_messages: VecDeque::new(),
        under_way: None,
        number: 0,
        fuzz,
        rng: ChaCha8Rng::seed_from_u64(seed),
        coverage,
    };
    for rank in 0..setup.scenario.robots.len() {
        fuzzer.peers.push(Peer::default());
        fuzzer.spawn(RobotId(rank as u32));
    }
    fuzzer.pump()?;
    let (mut tick, mut waited) = (0, 0);
    while fuzzer.simulation.outcome().is_none() {
        if fuzzer.simulation.tick() >= fuzz.ticks {
            fuzzer.simulation.interrupt();
        } else {
            fuzzer.step()?;
        }
        let now = fuzzer.simulation.tick();
        waited = if now == tick { waited + 1 } else { 0 };
        tick = now;
        let is_alive = waited < HANG;
        assert!(
            is_alive,
            "seed {seed} hangs in tick {tick}: {}",
            fuzzer.state()
        );
    }
    let outcome = fuzzer.simulation.outcome().unwrap_or(Outcome::Interrupted);
    let ending = fuzzer.simulation.ending();
    fuzzer.recorder.finish(outcome, ending)?;
    Ok(fuzzer.recorder)
}

struct Fuzzer<'c> {
    simulation: Simulation,
    recorder: Recorder<MemoryLog>,
    team: TeamConfig,
    /// All processes that ever existed, by process id.
    processes: Vec<Process>,
    sent: BTreeMap<BroadcastKey, Arc<Broadcast>>,
    /// The state of each robot in the world's server.
    peers: Vec<Peer>,
    orders: VecDeque<ActRequest>,
    launcher_messages: VecDeque<LauncherMessage>,
    under_way: Option<ActRequest>,
    number: u64,
    fuzz: Fuzz,
    rng: ChaCha8Rng,
    coverage: &'c mut Coverage,
}

/// The process of an agent with its messages that the world has not received yet.
#[derive(Default)]
struct Process {
    robot: RobotId,
    incarnation: Incarnation,
    agent: Option<TentativeAgent>,
    has_requested_join: bool,
    stopped: bool,
    ended: bool,
    inbox: VecDeque<TickMessage>,
    outbox: VecDeque<AgentMessage>,
}

enum AgentMessage {
    Join,
    TokenUp,
    Report(Box<Report>),
    TokenDown,
}

#[derive(Default)]
struct Peer {
    pid: Option<usize>,
    stopped: bool,
    lost: bool,
    awaited: bool,
}

#[derive(Clone, Copy)]
struct ActRequest {
    number: u64,
    robot: RobotId,
    act: ProcessAction,
    pid: Option<usize>,
    started: Option<usize>,
}

enum LauncherMessage {
    Stopped(usize),
    Continued(usize),
    Ended(usize),
    Answer(u64, Result<usize, String>),
}

impl Fuzzer<'_> {
    /// Processes one random input.
    fn step(&mut self) -> Result<(), RecordError> {
        match self.rng.random_range(0..100) {
            0..45 => self.work(),
            45..84 => self.receive_from_agent(),
            84..89 => self.execute_act(),
            89..96 => self.receive_from_launcher(),
            96 => self.pass_time(),
            _ if self.rng.random_bool(self.fuzz.calm) => {}
            97 => self.signal(),
            98 => self.order(),
            _ => self.start_by_hand(),
        }
        self.pump()
    }

    fn note(&mut self, kind: &'static str, robot: RobotId) {
        let place = self.simulation.barrier().presence(robot);
        let awaited = self.peers[robot.index()].awaited;
        let act = self
            .under_way
            .map(|request| (request.act, request.robot == robot));
        let at = format!("{place:?}, awaited {awaited}, under way {act:?}");
        *self.coverage.entry((kind, at)).or_default() += 1;
    }

    /// Describes the state of each robot for an error message.
    fn state(&self) -> String {
        let barrier = self.simulation.barrier();
        let robots = self.peers.iter().enumerate().map(|(rank, peer)| {
            let process = peer.pid.map(|pid| &self.processes[pid]);
            let process = process.map(|process| {
                let waiting = (process.inbox.len(), process.outbox.len());
                (process.stopped, process.ended, waiting)
            });
            let place = barrier.presence(RobotId(rank as u32));
            let awaited = peer.awaited;
            format!("{place:?} (stopped, ended, messages: {process:?}, awaited {awaited})")
        });
        let robots: Vec<String> = robots.collect();
        let act = self.under_way.filter(|_| self.simulation.awaits_act());
        let act = act.map(|request| (request.act, request.robot, request.started));
        format!("{}; act under way {act:?}", robots.join(", "))
    }

    fn pick(&mut self, fits: impl Fn(&Process) -> bool) -> Option<usize> {
        let fitting: Vec<usize> = (0..self.processes.len())
            .filter(|pid| fits(&self.processes[*pid]))
            .collect();
        let count = fitting.len().max(1);
        fitting.get(self.rng.random_range(0..count)).copied()
    }

    fn spawn(&mut self, robot: RobotId) -> usize {
        self.processes.push(Process {
            robot,
            ..Process::default()
        });
        self.processes.len() - 1
    }

    /// Executes the next work of a random process.
    fn work(&mut self) {
        let has_work = |process: &Process| !process.has_requested_join || !process.inbox.is_empty();
        let runs = |process: &Process| !process.ended && !process.stopped && has_work(process);
        let Some(pid) = self.pick(runs) else {
            return;
        };
        let process = &mut self.processes[pid];
        if !process.has_requested_join {
            process.has_requested_join = true;
            process.outbox.push_back(AgentMessage::Join);
            return;
        }
        let (Some(message), Some(agent)) = (process.inbox.pop_front(), process.agent.as_mut())
        else {
            return;
        };
        let mut space = Workspace::default();
        for key in message.manifest.iter().flat_map(ManifestEntry::keys) {
            let is_lost = self.rng.random_bool(self.fuzz.loss);
            let arrived = self.sent.get(&key).filter(|_| !is_lost);
            space.arrived.push(arrived.cloned());
        }
        agent.step(Box::new(message), &mut space);
        process
            .outbox
            .push_back(AgentMessage::Report(Box::new(space.report)));
        let sent = space.broadcasts.into_iter();
        self.sent
            .extend(sent.map(|broadcast| (broadcast.key(), Arc::new(broadcast))));
    }

    /// Delivers the next message of a random process to the world.
    fn receive_from_agent(&mut self) {
        let Some(pid) = self.pick(|process| !process.outbox.is_empty()) else {
            return;
        };
        let (robot, incarnation) = (self.processes[pid].robot, self.processes[pid].incarnation);
        let Some(message) = self.processes[pid].outbox.pop_front() else {
            return;
        };
        match message {
            AgentMessage::Join => {
                self.note("join", robot);
                self.welcome(pid, robot);
            }
            AgentMessage::TokenUp => {
                self.note("token", robot);
                self.simulation.arrive(robot, incarnation);
            }
            AgentMessage::TokenDown => {
                self.note("token gone", robot);
                self.simulation.agent_lost(robot, incarnation);
            }
            AgentMessage::Report(report) => {
                self.note("report", robot);
                match self.simulation.report(&report) {
                    Verdict::Counted => self.peers[robot.index()].awaited = false,
                    Verdict::SilenceEnded => self.peers[robot.index()].stopped = false,
                    Verdict::Superseded => self.end(pid),
                    Verdict::Stale | Verdict::Malformed => {}
                }
            }
        }
    }

    fn welcome(&mut self, pid: usize, robot: RobotId) {
        let name = &self.simulation.setup().scenario.robots[robot.index()].name;
        let Ok((_, incarnation, _)) = self.simulation.invite(&name.clone()) else {
            return self.end(pid);
        };
        self.peers[robot.index()] = Peer {
            pid: Some(pid),
            ..Peer::default()
        };
        let process = &mut self.processes[pid];
        process.incarnation = incarnation;
        if !process.ended {
            let agent = Agent::new(robot, incarnation, self.simulation.setup(), &self.team);
            process.agent = Some(TentativeAgent::new(agent));
            process.outbox.push_back(AgentMessage::TokenUp);
        }
    }

    /// Ends a process. The launcher detects it, and the token disappears after all earlier messages.
    fn end(&mut self, pid: usize) {
        let process = &mut self.processes[pid];
        if std::mem::replace(&mut process.ended, true) {
            return;
        }
        if process.agent.is_some() {
            process.outbox.push_back(AgentMessage::TokenDown);
        }
        self.send(LauncherMessage::Ended(pid));
    }

    /// Queues a message of the launcher to the world.
    fn send(&mut self, message: LauncherMessage) {
        self.launcher_messages.push_back(message);
    }

    /// Executes the next requested act of the launcher.
    fn execute_act(&mut self) {
        let Some(request) = self.orders.pop_front() else {
            return;
        };
        let fails = self.rng.random_bool(0.1);
        let target = request.pid.filter(|pid| !self.processes[*pid].ended);
        let result = match (request.act, target) {
            (_, _) if fails => Err("the act failed".to_owned()),
            (ProcessAction::Start, _) => Ok(self.spawn(request.robot)),
            (_, None) => Err("its process has ended".to_owned()),
            (act, Some(pid)) => {
                match act {
                    ProcessAction::Stop => self.stop(pid),
                    ProcessAction::Continue => self.resume(pid),
                    _ => self.end(pid),
                }
                Ok(pid)
            }
        };
        self.send(LauncherMessage::Answer(request.number, result));
    }

    fn stop(&mut self, pid: usize) {
        if !std::mem::replace(&mut self.processes[pid].stopped, true) {
            self.send(LauncherMessage::Stopped(pid));
        }
    }

    fn resume(&mut self, pid: usize) {
        if std::mem::replace(&mut self.processes[pid].stopped, false) {
            self.send(LauncherMessage::Continued(pid));
        }
    }

    /// Delivers the next message of the launcher to the world.
    fn receive_from_launcher(&mut self) {
        match self.launcher_messages.pop_front() {
            Some(LauncherMessage::Stopped(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("stopped", robot);
                let peer = &mut self.peers[robot.index()];
                peer.lost = true;
                if peer.pid == Some(pid) {
                    peer.stopped = true;
                    self.stall(robot);
                }
            }
            Some(LauncherMessage::Continued(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("continued", robot);
                let peer = &mut self.peers[robot.index()];
                peer.lost = false;
                peer.stopped &= peer.pid != Some(pid);
            }
            Some(LauncherMessage::Ended(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("ended", robot);
                self.peers[robot.index()].lost = true;
                if let Some(request) = self.under_way
                    && request.act == ProcessAction::Start
                    && request.started == Some(pid)
                    && self.simulation.awaits_act()
                {
                    let reason = "its process ended before it joined".to_owned();
                    self.simulation
                        .act_done(request.robot, request.act, Err(reason));
                }
            }
            Some(LauncherMessage::Answer(number, result)) => {
                let Some(request) = &mut self.under_way else {
                    return;
                };
                if request.number != number {
                    return;
                }
                request.started = result.as_ref().ok().copied();
                let (robot, act) = (request.robot, request.act);
                self.note("answer", robot);
                if act == ProcessAction::Continue {
                    self.peers[robot.index()].stopped = false;
                }
                self.simulation.act_done(robot, act, result.map(drop));
            }
            None => {}
        }
    }

    fn stall(&mut self, robot: RobotId) {
        if self.simulation.barrier().is_awaited(robot) {
            self.peers[robot.index()].awaited = false;
            self.simulation.stall(robot);
        }
    }

    /// Sends a manual signal to a random process.
    fn signal(&mut self) {
        let Some(pid) = self.pick(|process| !process.ended) else {
            return;
        };
        self.note("signal", self.processes[pid].robot);
        match self.rng.random_range(0..4) {
            0 => self.end(pid),
            1 => self.stop(pid),
            _ => self.resume(pid),
        }
    }

    /// Sends a random order. The simulation refuses invalid orders.
    fn order(&mut self) {
        let rank = self.rng.random_range(0..self.peers.len());
        self.note("order", RobotId(rank as u32));
        if self.rng.random_bool(0.1) {
            let _ = self.simulation.clear(None);
            return;
        }
        let name = &self.simulation.setup().scenario.robots[rank].name;
        let order = process_order(name, 0.15, &mut self.rng);
        let _ = self.simulation.order(order);
    }

    fn start_by_hand(&mut self) {
        let robot = RobotId(self.rng.random_range(0..self.peers.len()) as u32);
        self.note("start", robot);
        self.spawn(robot);
    }

    /// Lets a deadline pass: of an awaited stopped robot, of an invited robot that does not join, of an act, or of a
    /// run without robots.
    fn pass_time(&mut self) {
        let robot = RobotId(self.rng.random_range(0..self.peers.len()) as u32);
        self.note("deadline", robot);
        let barrier = self.simulation.barrier();
        let peer = &self.peers[robot.index()];
        let process = peer.pid.map(|pid| &self.processes[pid]);
        let is_slow = process.is_some_and(|process| process.stopped || process.ended);
        if barrier.presence(robot) == Presence::Invited && is_slow {
            if let Some(incarnation) = barrier.incarnation(robot) {
                self.simulation.cancel_invitation(robot, incarnation);
            }
        } else if !barrier.started() {
            for (rank, peer) in self.peers.iter().enumerate() {
                if peer.lost {
                    self.simulation.start_without(RobotId(rank as u32));
                }
            }
        } else if is_slow {
            self.stall(robot);
        } else if let Some(request) = self.under_way
            && request
                .started
                .is_some_and(|pid| self.processes[pid].stopped)
            && self.simulation.awaits_act()
        {
            let late = "not done within 30 s".to_owned();
            self.simulation
                .act_done(request.robot, request.act, Err(late));
        } else if barrier.has_no_agents() && self.processes.iter().all(|process| process.ended) {
            self.simulation.end_if_idle();
        }
    }

    /// Advances the run as far as possible, as the server does after each input.
    fn pump(&mut self) -> Result<(), RecordError> {
        loop {
            if self.simulation.is_complete() {
                self.simulation.finish();
            }
            let advances = self.send_ticks();
            self.simulation.record(&mut self.recorder)?;
            if !advances || self.simulation.outcome().is_some() {
                return Ok(());
            }
        }
    }

    fn send_ticks(&mut self) -> bool {
        if self.simulation.outcome().is_some() {
            return false;
        }
        self.request_acts();
        self.simulation.begin();
        self.request_acts();
        let mut stopped = Vec::new();
        while let Some(robot) = self.simulation.next_recipient() {
            let message = self.simulation.message(robot).clone();
            let peer = &mut self.peers[robot.index()];
            peer.awaited = true;
            if peer.stopped {
                stopped.push(robot);
            }
            if let Some(pid) = peer.pid {
                self.processes[pid].inbox.push_back(message);
            }
        }
        let any_stopped = !stopped.is_empty();
        for robot in stopped {
            self.stall(robot);
        }
        any_stopped || self.simulation.is_complete()
    }

    fn request_acts(&mut self) {
        while let Some((robot, act)) = self.simulation.next_act() {
            self.number += 1;
            let request = ActRequest {
                number: self.number,
                robot,
                act,
                pid: self.peers[robot.index()].pid,
                started: None,
            };
            self.under_way = Some(request);
            self.orders.push_back(request);
        }
    }
}

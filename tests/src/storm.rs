//! A model of everything that may come to a world from outside, in any order, without processes: what a robot's process says to
//! the world, what the launcher does and says, signals by hand, orders, and the passing of time. Each of these goes its own way and keeps
//! its own order, as on the bus; which comes next is drawn.
//!
//! What the world makes of it is the real thing, the simulation with its barrier, recorder and agents; the few decisions of the shell
//! round it (`world_server::server`) are made here again.

use std::collections::{BTreeMap, VecDeque};

use alliance_proto::fault::Order;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::log::{LogLevel, Memory};
use alliance_proto::process::ProcessAct;
use alliance_proto::scenario::Setup;
use alliance_proto::tick::{Outcome, Report, TickMessage};
use missions::Registry;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use robot_agent::radio::Radio;
use world_server::barrier::{Presence, Verdict};
use world_server::recorder::{RecordError, Recorder};
use world_server::simulation::Simulation;

/// What an operator orders, of some robot where it is `{}`.
const ORDERS: [&str; 12] = [
    r#"{"fault":{"pause":"{}"},"for_s":0.5}"#,
    r#"{"fault":{"pause":"{}"},"for_s":3}"#,
    r#"{"fault":{"kill":"{}"},"for_s":0.3}"#,
    r#"{"fault":{"kill":"{}"}}"#,
    r#"{"fault":{"terminate":"{}"},"for_s":1}"#,
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"continue":"{}"}}"#,
    r#"{"fault":{"remove":"{}"},"for_s":1}"#,
    r#"{"fault":{"mute":"{}"},"every_s":2,"for_s":0.5}"#,
    r#"{"fault":{"kill":"{}"},"when":"{} stalls","for_s":0.5}"#,
    r#"{"fault":{"pause":"{}"},"when":"any joins","for_s":0.5}"#,
];

/// After so many happenings without an end of the tick it hangs.
const HANG: u32 = 20_000;

/// What has come, how often: which word, and where the world was with the robot that it is about.
pub type Coverage = BTreeMap<(&'static str, String), u64>;

/// A run of so many ticks at most, and what came in it.
///
/// # Errors
/// Never: memory takes everything.
pub fn run(
    setup: &Setup,
    ticks: u64,
    seed: u64,
    coverage: &mut Coverage,
) -> Result<Recorder<Memory>, RecordError> {
    let registry = Registry::of_this_program();
    let mission = registry.worlds().of(&setup.scenario);
    let mission = mission.expect("a mission that comes with the simulator");
    let team = TeamConfig::of(setup, registry.agents()).expect("allocators that come with it");
    let mut storm = Storm {
        simulation: Simulation::new(setup.clone(), mission, true),
        recorder: Recorder::new(setup, LogLevel::Full, Memory::default())?,
        team,
        processes: Vec::new(),
        peers: Vec::new(),
        orders: VecDeque::new(),
        words: VecDeque::new(),
        under_way: None,
        number: 0,
        chance: ChaCha8Rng::seed_from_u64(seed),
        coverage,
    };
    for rank in 0..setup.scenario.robots.len() {
        storm.peers.push(Peer::default());
        storm.spawn(RobotId(rank as u16));
    }
    storm.pump()?;
    let (mut tick, mut waited) = (0, 0);
    while storm.simulation.outcome().is_none() {
        if storm.simulation.tick() >= ticks {
            storm.simulation.interrupt();
        } else {
            storm.happen()?;
        }
        waited = if storm.simulation.tick() == tick {
            waited + 1
        } else {
            0
        };
        tick = storm.simulation.tick();
        assert!(
            waited < HANG,
            "storm {seed} hangs in tick {tick}: {}",
            storm.state()
        );
    }
    let outcome = storm.simulation.outcome().unwrap_or(Outcome::Interrupted);
    storm.recorder.finish(outcome, storm.simulation.ending())?;
    Ok(storm.recorder)
}

struct Storm<'c> {
    simulation: Simulation,
    recorder: Recorder<Memory>,
    team: TeamConfig,
    /// All that there ever were, by process id.
    processes: Vec<Process>,
    /// What the shell knows of each robot.
    peers: Vec<Peer>,
    /// To the launcher.
    orders: VecDeque<Asked>,
    /// From the launcher.
    words: VecDeque<LauncherWord>,
    under_way: Option<Asked>,
    number: u64,
    chance: ChaCha8Rng,
    coverage: &'c mut Coverage,
}

/// An agent's process, and what it has said that the world has not heard yet.
struct Process {
    robot: RobotId,
    incarnation: Incarnation,
    mind: Option<(TentativeAgent, Radio)>,
    has_asked: bool,
    stopped: bool,
    dead: bool,
    inbox: VecDeque<TickMessage>,
    outbox: VecDeque<Word>,
}

enum Word {
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
    asked: bool,
}

#[derive(Clone, Copy)]
struct Asked {
    number: u64,
    robot: RobotId,
    act: ProcessAct,
    pid: Option<usize>,
    started: Option<usize>,
}

enum LauncherWord {
    Stopped(usize),
    Continued(usize),
    Ended(usize),
    Answer(u64, Result<usize, String>),
}

impl Storm<'_> {
    /// The next thing that happens, whatever it is.
    fn happen(&mut self) -> Result<(), RecordError> {
        match self.chance.random_range(0..100) {
            0..45 => self.work(),
            45..84 => self.listen(),
            84..89 => self.launch(),
            89..96 => self.hear_launcher(),
            96 => self.signal(),
            97 => self.order(),
            98 => self.pass_time(),
            _ => self.start_by_hand(),
        }
        self.pump()
    }

    fn note(&mut self, what: &'static str, robot: RobotId) {
        let place = self.simulation.barrier().presence(robot);
        let asked = self.peers[robot.index()].asked;
        let act = self
            .under_way
            .map(|asked| (asked.act, asked.robot == robot));
        let at = format!("{place:?}, asked {asked}, under way {act:?}");
        *self.coverage.entry((what, at)).or_default() += 1;
    }

    /// For whom it waits.
    fn state(&self) -> String {
        let barrier = self.simulation.barrier();
        let robots = self.peers.iter().enumerate().map(|(rank, peer)| {
            let process = peer.pid.map(|pid| &self.processes[pid]);
            let process = process.map(|it| (it.stopped, it.dead, it.inbox.len(), it.outbox.len()));
            let place = barrier.presence(RobotId(rank as u16));
            format!(
                "{place:?} (stopped, dead, inbox, outbox: {process:?}, asked {})",
                peer.asked
            )
        });
        let robots: Vec<String> = robots.collect();
        let act = self.under_way.filter(|_| self.simulation.awaits_act());
        let act = act.map(|asked| (asked.act, asked.robot, asked.started));
        format!("{}; act under way {act:?}", robots.join(", "))
    }

    fn any(&mut self, fits: impl Fn(&Process) -> bool) -> Option<usize> {
        let fitting: Vec<usize> = (0..self.processes.len())
            .filter(|pid| fits(&self.processes[*pid]))
            .collect();
        let count = fitting.len().max(1);
        fitting.get(self.chance.random_range(0..count)).copied()
    }

    fn spawn(&mut self, robot: RobotId) -> usize {
        self.processes.push(Process {
            robot,
            incarnation: 0,
            mind: None,
            has_asked: false,
            stopped: false,
            dead: false,
            inbox: VecDeque::new(),
            outbox: VecDeque::new(),
        });
        self.processes.len() - 1
    }

    /// A process does the next thing that it has to do.
    fn work(&mut self) {
        let Some(pid) =
            self.any(|it| !it.dead && !it.stopped && (!it.has_asked || !it.inbox.is_empty()))
        else {
            return;
        };
        let process = &mut self.processes[pid];
        if !process.has_asked {
            process.has_asked = true;
            process.outbox.push_back(Word::Join);
            return;
        }
        let (Some(message), Some((agent, radio))) =
            (process.inbox.pop_front(), process.mind.as_mut())
        else {
            return;
        };
        let mut space = Workspace::default();
        radio.collect(&message.manifest, &mut space.arrived);
        agent.step(Box::new(message), &mut space);
        process
            .outbox
            .push_back(Word::Report(Box::new(space.report)));
        for broadcast in space.broadcasts {
            for (other, teammate) in self.processes.iter_mut().enumerate() {
                // A stopped one finds it when it goes on.
                if other != pid
                    && !teammate.dead
                    && let Some((_, radio)) = &mut teammate.mind
                {
                    radio.receive(broadcast.clone());
                }
            }
        }
    }

    /// The world hears the next word of a process.
    fn listen(&mut self) {
        let Some(pid) = self.any(|it| !it.outbox.is_empty()) else {
            return;
        };
        let (robot, incarnation) = (self.processes[pid].robot, self.processes[pid].incarnation);
        let Some(word) = self.processes[pid].outbox.pop_front() else {
            return;
        };
        match word {
            Word::Join => {
                self.note("join", robot);
                self.welcome(pid, robot);
            }
            Word::TokenUp => {
                self.note("token", robot);
                self.simulation.arrive(robot, incarnation);
            }
            Word::TokenDown => {
                self.note("token gone", robot);
                self.simulation.gone(robot, incarnation);
            }
            Word::Report(report) => {
                self.note("report", robot);
                match self.simulation.report(&report) {
                    Verdict::Counted => self.peers[robot.index()].asked = false,
                    Verdict::BackAgain => self.peers[robot.index()].stopped = false,
                    Verdict::Superseded => self.die(pid),
                    Verdict::Stale | Verdict::Malformed => {}
                }
            }
        }
    }

    fn welcome(&mut self, pid: usize, robot: RobotId) {
        let name = &self.simulation.setup().scenario.robots[robot.index()].name;
        let Ok((_, incarnation, _)) = self.simulation.invite(&name.clone()) else {
            return self.die(pid);
        };
        self.peers[robot.index()] = Peer {
            pid: Some(pid),
            ..Peer::default()
        };
        let process = &mut self.processes[pid];
        process.incarnation = incarnation;
        if !process.dead {
            let agent = Agent::new(robot, incarnation, self.simulation.setup(), &self.team);
            process.mind = Some((TentativeAgent::new(agent), Radio::default()));
            process.outbox.push_back(Word::TokenUp);
        }
    }

    /// A process ends; the launcher sees it, and its token goes after all that it said.
    fn die(&mut self, pid: usize) {
        let process = &mut self.processes[pid];
        if std::mem::replace(&mut process.dead, true) {
            return;
        }
        if process.mind.is_some() {
            process.outbox.push_back(Word::TokenDown);
        }
        self.words.push_back(LauncherWord::Ended(pid));
    }

    /// The launcher does the next thing that it was asked for.
    fn launch(&mut self) {
        let Some(asked) = self.orders.pop_front() else {
            return;
        };
        let fails = self.chance.random_bool(0.1);
        let target = asked.pid.filter(|pid| !self.processes[*pid].dead);
        let result = match (asked.act, target) {
            (_, _) if fails => Err("it does not".to_owned()),
            (ProcessAct::Start, _) => Ok(self.spawn(asked.robot)),
            (_, None) => Err("its process has ended".to_owned()),
            (ProcessAct::Kill | ProcessAct::Terminate, Some(pid)) => {
                self.die(pid);
                Ok(pid)
            }
            (ProcessAct::Stop, Some(pid)) => {
                self.stop(pid);
                Ok(pid)
            }
            (ProcessAct::Continue, Some(pid)) => {
                self.go_on(pid);
                Ok(pid)
            }
        };
        self.words
            .push_back(LauncherWord::Answer(asked.number, result));
    }

    fn stop(&mut self, pid: usize) {
        if !std::mem::replace(&mut self.processes[pid].stopped, true) {
            self.words.push_back(LauncherWord::Stopped(pid));
        }
    }

    fn go_on(&mut self, pid: usize) {
        if std::mem::replace(&mut self.processes[pid].stopped, false) {
            self.words.push_back(LauncherWord::Continued(pid));
        }
    }

    /// The world hears the next word of the launcher.
    fn hear_launcher(&mut self) {
        match self.words.pop_front() {
            Some(LauncherWord::Stopped(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("stopped", robot);
                let peer = &mut self.peers[robot.index()];
                peer.lost = true;
                if peer.pid == Some(pid) {
                    peer.stopped = true;
                    self.stall(robot);
                }
            }
            Some(LauncherWord::Continued(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("continued", robot);
                let peer = &mut self.peers[robot.index()];
                peer.lost = false;
                peer.stopped &= peer.pid != Some(pid);
            }
            Some(LauncherWord::Ended(pid)) => {
                let robot = self.processes[pid].robot;
                self.note("ended", robot);
                self.peers[robot.index()].lost = true;
                if let Some(asked) = self.under_way
                    && asked.act == ProcessAct::Start
                    && asked.started == Some(pid)
                    && self.simulation.awaits_act()
                {
                    let why = "its process ended before it joined".to_owned();
                    self.simulation.act_done(asked.robot, asked.act, Err(why));
                }
            }
            Some(LauncherWord::Answer(number, result)) => {
                let Some(asked) = &mut self.under_way else {
                    return;
                };
                if asked.number != number {
                    return;
                }
                asked.started = result.as_ref().ok().copied();
                let (robot, act) = (asked.robot, asked.act);
                self.note("answer", robot);
                if act == ProcessAct::Continue {
                    self.peers[robot.index()].stopped = false;
                }
                self.simulation.act_done(robot, act, result.map(drop));
            }
            None => {}
        }
    }

    fn stall(&mut self, robot: RobotId) {
        if self.simulation.barrier().is_awaited(robot) {
            self.peers[robot.index()].asked = false;
            self.simulation.stall(robot);
        }
    }

    /// Somebody sends a signal by hand.
    fn signal(&mut self) {
        let Some(pid) = self.any(|it| !it.dead) else {
            return;
        };
        self.note("signal", self.processes[pid].robot);
        match self.chance.random_range(0..4) {
            0 => self.die(pid),
            1 => self.stop(pid),
            _ => self.go_on(pid),
        }
    }

    /// An operator says something. What does not fit is refused.
    fn order(&mut self) {
        let rank = self.chance.random_range(0..self.peers.len());
        self.note("order", RobotId(rank as u16));
        if self.chance.random_bool(0.1) {
            let _ = self.simulation.clear(None);
            return;
        }
        let name = &self.simulation.setup().scenario.robots[rank].name;
        let order = ORDERS[self.chance.random_range(0..ORDERS.len())].replace("{}", name);
        let order: Order = serde_json::from_str(&order).expect("all of them are orders");
        let _ = self.simulation.order(order);
    }

    /// Somebody starts an agent by hand.
    fn start_by_hand(&mut self) {
        let robot = RobotId(self.chance.random_range(0..self.peers.len()) as u16);
        self.note("start", robot);
        self.spawn(robot);
    }

    /// A deadline runs out: of a robot that is asked and stopped, of one that was welcomed and does not come, of an act, or of a
    /// run in which nobody is left.
    fn pass_time(&mut self) {
        let robot = RobotId(self.chance.random_range(0..self.peers.len()) as u16);
        self.note("deadline", robot);
        let barrier = self.simulation.barrier();
        let peer = &self.peers[robot.index()];
        let process = peer.pid.map(|pid| &self.processes[pid]);
        let is_slow = process.is_some_and(|process| process.stopped || process.dead);
        if barrier.presence(robot) == Presence::Invited && is_slow {
            if let Some(incarnation) = barrier.incarnation(robot) {
                self.simulation.give_up(robot, incarnation);
            }
        } else if !barrier.started() {
            for (rank, peer) in self.peers.iter().enumerate() {
                if peer.lost {
                    self.simulation.start_without(RobotId(rank as u16));
                }
            }
        } else if is_slow {
            self.stall(robot);
        } else if let Some(asked) = self.under_way
            && asked.started.is_some_and(|pid| self.processes[pid].stopped)
            && self.simulation.awaits_act()
        {
            let late = "not done within 30 s".to_owned();
            self.simulation.act_done(asked.robot, asked.act, Err(late));
        } else if barrier.is_deserted() && self.processes.iter().all(|it| it.dead) {
            self.simulation.abandon();
        }
    }

    /// Carries the run as far as it goes, as the shell does after each word.
    fn pump(&mut self) -> Result<(), RecordError> {
        loop {
            if self.simulation.is_complete() {
                self.simulation.finish();
            }
            let goes_on = self.ask();
            self.simulation.record(&mut self.recorder)?;
            if !goes_on || self.simulation.outcome().is_some() {
                return Ok(());
            }
        }
    }

    fn ask(&mut self) -> bool {
        if self.simulation.outcome().is_some() {
            return false;
        }
        self.carry_out();
        self.simulation.begin();
        self.carry_out();
        let mut stopped = Vec::new();
        while let Some(robot) = self.simulation.next_question() {
            let message = self.simulation.message(robot).clone();
            let peer = &mut self.peers[robot.index()];
            peer.asked = true;
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

    fn carry_out(&mut self) {
        while let Some((robot, act)) = self.simulation.next_act() {
            self.number += 1;
            let asked = Asked {
                number: self.number,
                robot,
                act,
                pid: self.peers[robot.index()].pid,
                started: None,
            };
            self.under_way = Some(asked);
            self.orders.push_back(asked);
        }
    }
}

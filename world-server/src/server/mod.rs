//! The run behind one lock: what zenoh's callbacks, the timer and the signals do to it.
//!
//! It sends through publishers that were declared once, writes through the recorder, and reads the wall clock for pace and
//! deadlines; every decision about the run is the [`Simulation`]'s.
//!
//! - `joining`: how agents and hosts come to the run. `heard`: what comes from robots and launchers. `control`: what operators ask for.
//! - `acts`: what faults ask of processes. `again`, `standstill`, `clocks`: what waits, or is lost, or differs.
//! - `seals`: who may say what. `fates`: whether minds that are programs of their own tell what links do to messages.

mod acts;
mod again;
mod clocks;
mod control;
mod fates;
mod heard;
mod joining;
mod seals;
mod standstill;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use alliance_proto::event::EventNews;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::ignored::Ignored;
use alliance_proto::keys::Keys;
use alliance_proto::tick::{Outcome, TickMessage, ToAgent};
use tokio::sync::oneshot;
use tokio::time::Instant;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::barrier::Presence;
use crate::pace::Pace;
use crate::recorder::{Background, Folder, RecordError, Recorder};
use crate::simulation::Simulation;
use acts::UnderWay;
use again::Question;
use fates::Fates;
pub use seals::Seals;
use standstill::Standstill;

/// How long a welcomed agent may take to show its token, and how long the run waits when every agent is gone, in case
/// somebody starts one again.
const GRACE: Duration = Duration::from_secs(5);

/// How often the pace is looked at while agents are at work.
const WORK_INTERVAL: Duration = Duration::from_millis(1);

/// Least time between two views of a running clock: as often as a screen needs.
const VIEW_INTERVAL: Duration = Duration::from_millis(30);

/// What became of the run.
pub type Ended = Result<Outcome, RecordError>;

/// One robot as the shell knows it.
struct Peer {
    name: String,
    ticks: Publisher<'static>,
    /// Process id that its agent gave when it joined.
    pid: Option<u32>,
    invited: Option<(Incarnation, Instant)>,
    asked: Option<Instant>,
    /// What it was asked last.
    question: Option<Question>,
    /// The launcher says that its process is stopped.
    stopped: bool,
    /// The launcher says that its process ended, or is stopped: a clock that has not started does not wait for it.
    lost: bool,
}

/// The run and its surroundings.
pub struct Server {
    simulation: Simulation,
    recorder: Background<Folder>,
    /// Of minds that are programs of their own.
    fates: Fates,
    peers: Vec<Peer>,
    run: String,
    /// Of the log.
    folder: PathBuf,
    keys: Keys,
    seals: Arc<Seals>,
    session: Session,
    /// Itself, for whom the launcher answers.
    me: Weak<Mutex<Server>>,
    view: Publisher<'static>,
    events: Publisher<'static>,
    pace: Pace,
    stall_after: Duration,
    /// The current tick has begun: its questions may be asked whatever the pace.
    begun: Option<u64>,
    deserted_since: Option<Instant>,
    standstill: Standstill,
    first_tick: Option<Instant>,
    /// Nonces of all join requests: one that is put again is none.
    asked_to_join: BTreeSet<u128>,
    /// Nonces of all requests of operators.
    nonces: BTreeSet<String>,
    /// Number of the latest news of the launcher on each host.
    latest_news: BTreeMap<String, u64>,
    /// Number of the latest order to the launcher.
    orders: u64,
    /// That order.
    under_way: Option<UnderWay>,
    /// When the latest view was published.
    shown: Instant,
    refused: Ignored,
    ended: Option<oneshot::Sender<Ended>>,
}

/// The world's place on the bus.
pub struct Bus {
    /// Id of the run.
    pub run: String,
    /// Its session.
    pub session: Session,
    /// Keys of the run.
    pub keys: Keys,
    /// What messages are sealed with.
    pub seals: Arc<Seals>,
    /// Its publishers, declared once.
    pub publishers: Publishers,
}

/// Publishers of the world, declared once.
pub struct Publishers {
    /// One per robot, by rank.
    pub ticks: Vec<Publisher<'static>>,
    /// Snapshots for observers.
    pub view: Publisher<'static>,
    /// Events for observers.
    pub events: Publisher<'static>,
}

impl Server {
    /// A run that waits for its robots; `ended` is told when it is over.
    ///
    /// # Errors
    /// When the log cannot work in the background.
    pub fn new(
        simulation: Simulation,
        recorder: Recorder<Folder>,
        bus: Bus,
        pace: Pace,
        stall_after: Duration,
        ended: oneshot::Sender<Ended>,
    ) -> Result<Self, RecordError> {
        let names = &simulation.setup().scenario.robots;
        let peers = names
            .iter()
            .zip(bus.publishers.ticks)
            .map(|(robot, ticks)| Peer {
                name: robot.name.clone(),
                ticks,
                pid: None,
                invited: None,
                asked: None,
                question: None,
                stopped: false,
                lost: false,
            })
            .collect();
        Ok(Self {
            simulation,
            peers,
            folder: recorder.sink().path().to_owned(),
            recorder: Background::new(recorder)?,
            fates: Fates::default(),
            run: bus.run,
            keys: bus.keys,
            seals: bus.seals,
            session: bus.session,
            me: Weak::new(),
            view: bus.publishers.view,
            events: bus.publishers.events,
            pace,
            stall_after,
            begun: None,
            deserted_since: None,
            standstill: None,
            first_tick: None,
            asked_to_join: BTreeSet::new(),
            nonces: BTreeSet::new(),
            latest_news: BTreeMap::new(),
            orders: 0,
            under_way: None,
            shown: Instant::now(),
            refused: Ignored::default(),
            ended: Some(ended),
        })
    }

    /// The run.
    #[must_use]
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The run's log, once it has everything.
    ///
    /// # Errors
    /// When it could not be written, or has been taken.
    pub fn take_recorder(&mut self) -> Result<Recorder<Folder>, RecordError> {
        self.recorder.finish()
    }

    /// When the first tick was sent.
    #[must_use]
    pub fn first_tick(&self) -> Option<Instant> {
        self.first_tick
    }

    /// Process ids by robot, as the agents gave them.
    pub fn pids(&self) -> impl Iterator<Item = (&str, Option<u32>)> {
        self.peers.iter().map(|peer| (peer.name.as_str(), peer.pid))
    }

    /// Ignored messages by kind.
    pub fn refused(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.refused.counts()
    }

    /// Counts messages that the gateway has ignored.
    pub fn add_refused(&mut self, kind: &'static str, count: u64) {
        self.refused.add(kind, count, Instant::now().into_std());
    }

    /// Robots of the scenario that have no agent yet.
    #[must_use]
    pub fn missing(&self) -> Vec<&str> {
        let barrier = self.simulation.barrier();
        barrier
            .robots()
            .filter(|robot| {
                matches!(
                    barrier.presence(*robot),
                    Presence::Empty | Presence::Invited
                )
            })
            .map(|robot| self.peers[robot.index()].name.as_str())
            .collect()
    }

    /// Whether any agent still has a connection.
    #[must_use]
    pub fn has_company(&self) -> bool {
        !self.simulation.barrier().is_deserted()
    }

    /// Somebody wants the run to end.
    pub fn interrupt(&mut self) {
        self.simulation.interrupt();
        self.pump();
    }

    /// What the passing of wall-clock time asks for.
    pub fn tick_of_the_clock(&mut self) {
        let now = Instant::now();
        for index in 0..self.peers.len() {
            let robot = RobotId(index as u16);
            let peer = &mut self.peers[index];
            if let Some((incarnation, since)) = peer.invited
                && now.duration_since(since) > GRACE
            {
                peer.invited = None;
                tracing::warn!(robot = peer.name, "welcomed, but does not come");
                self.simulation.give_up(robot, incarnation);
            }
            let late = self.peers[index]
                .asked
                .is_some_and(|since| now.duration_since(since) > self.stall_after);
            if late {
                self.stall(robot);
            }
        }
        if !self.simulation.barrier().started() {
            for (index, _) in self.peers.iter().enumerate().filter(|(_, peer)| peer.lost) {
                self.simulation.start_without(RobotId(index as u16));
            }
        }
        if self.simulation.barrier().started() && self.simulation.barrier().is_deserted() {
            let since = *self.deserted_since.get_or_insert(now);
            if now.duration_since(since) > GRACE {
                self.simulation.abandon();
            }
        } else {
            self.deserted_since = None;
        }
        self.look_after_act(now);
        self.watch_the_clock(now);
        self.ask_again(now);
        if let Err(error) = self.recorder.flush() {
            return self.fail(error);
        }
        self.pump();
    }

    /// Publishes a snapshot for observers, who may miss it.
    pub fn show(&mut self) {
        let mut view = self.simulation.view();
        view.clock = Some(self.clock());
        for (robot, peer) in view.robots.iter_mut().zip(&self.peers) {
            robot.pid = robot.incarnation.and(peer.pid);
        }
        if let Ok(bytes) = self.seals.run.seal(self.view.key_expr(), &view) {
            // An observer's trouble is not the run's.
            let _ = self.view.put(bytes).wait();
        }
        self.shown = Instant::now();
    }

    /// Publishes the events of the tick that has just ended, for observers, who may miss them.
    fn announce_events(&mut self) {
        let events = self.recorder.take_news();
        if events.is_empty() {
            return;
        }
        let news = EventNews {
            tick: self.simulation.tick() - 1,
            events,
        };
        if let Ok(bytes) = self.seals.run.seal(self.events.key_expr(), &news) {
            // An observer's trouble is not the run's.
            let _ = self.events.put(bytes).wait();
        }
    }

    /// When the pace asks for attention; `None` while nobody takes part or a process is waited for, who ask for it when they come.
    /// While agents are at work it is asked again every millisecond: the tick may be complete at any moment, and the next one due.
    #[must_use]
    pub fn due(&self) -> Option<Instant> {
        let due = self.pace.due()?;
        if self.simulation.awaits_act() || self.simulation.barrier().is_idle() {
            return None;
        }
        let at_work = self.begun == Some(self.simulation.tick());
        Some(if at_work {
            due.max(Instant::now() + WORK_INTERVAL)
        } else {
            due
        })
    }

    /// Carries the run as far as it goes without new reports.
    pub fn pump(&mut self) {
        while self.ended.is_some() {
            if self.simulation.is_complete() {
                self.simulation.finish();
            }
            let goes_on = self.ask();
            // The agents are at work meanwhile.
            if let Err(error) = self.record() {
                return self.fail(error);
            }
            if let Some(outcome) = self.simulation.outcome() {
                return self.end(Ok(outcome));
            }
            if !goes_on {
                return;
            }
        }
    }

    /// Sends the tick to whoever is to be asked now, if it is time. Says whether the run may go on at once.
    fn ask(&mut self) -> bool {
        if self.simulation.outcome().is_some() {
            return false;
        }
        self.carry_out();
        let now = Instant::now();
        let tick = self.simulation.tick();
        if self.begun != Some(tick) && !self.pace.is_due(now) {
            return false;
        }
        self.simulation.begin();
        self.carry_out();
        let mut question = self.simulation.next_question();
        if question.is_none() && !self.simulation.is_complete() {
            return false;
        }
        if self.begun != Some(tick) {
            self.begun = Some(tick);
            self.pace.begun(now);
            self.first_tick.get_or_insert(now);
        }
        let mut stopped = Vec::new();
        while let Some(robot) = question {
            self.put_question(robot, now);
            let peer = &mut self.peers[robot.index()];
            peer.asked = Some(now);
            if peer.stopped {
                stopped.push(robot);
            }
            question = self.simulation.next_question();
        }
        let any_stopped = !stopped.is_empty();
        for robot in stopped {
            self.stall(robot);
        }
        any_stopped || self.simulation.is_complete()
    }

    /// Takes down the tick that has ended, if one has, and shows it to observers.
    fn record(&mut self) -> Result<(), RecordError> {
        if self.simulation.record(&mut self.recorder)? {
            self.announce_events();
            if self.shown.elapsed() >= VIEW_INTERVAL {
                self.show();
            }
        }
        Ok(())
    }

    fn stall(&mut self, robot: RobotId) {
        if self.simulation.barrier().is_awaited(robot) {
            let peer = &mut self.peers[robot.index()];
            peer.asked = None;
            tracing::warn!(
                robot = peer.name,
                tick = self.simulation.tick(),
                "does not answer; the team goes on without it"
            );
            self.simulation.stall(robot);
        }
    }

    fn send(&self, robot: RobotId, message: &ToAgent<&TickMessage>) {
        let publisher = &self.peers[robot.index()].ticks;
        match self.seals.robot(robot).seal(publisher.key_expr(), message) {
            Ok(bytes) => {
                if let Err(error) = publisher.put(bytes).wait() {
                    tracing::error!(%error, key = %publisher.key_expr(), "not published");
                }
            }
            Err(error) => tracing::error!(%error, key = %publisher.key_expr(), "not published"),
        }
    }

    fn end(&mut self, ended: Ended) {
        if let Some(sender) = self.ended.take() {
            if let Ok(outcome) = ended {
                self.show();
                for robot in self.simulation.barrier().robots() {
                    self.send(robot, &ToAgent::End(outcome));
                }
            }
            // The receiver is gone only when the process is ending anyway.
            let _ = sender.send(ended);
        }
    }

    fn fail(&mut self, error: RecordError) {
        for robot in self.simulation.barrier().robots() {
            self.send(robot, &ToAgent::End(Outcome::Interrupted));
        }
        self.end(Err(error));
    }

    /// Counts a message that is ignored, and warns about it at a bounded rate.
    fn refuse(&mut self, kind: &'static str, why: &dyn std::fmt::Display) {
        if let Some(count) = self.refused.count(kind, Instant::now().into_std()) {
            tracing::warn!(kind, count, %why, "message ignored");
        }
    }

    fn robot_named(&self, name: &str) -> Option<RobotId> {
        self.seals.rank(name)
    }
}

/// A panic ends the process, so a poisoned lock is never seen.
pub fn lock(server: &Mutex<Server>) -> MutexGuard<'_, Server> {
    server.lock().unwrap_or_else(PoisonError::into_inner)
}

//! The run behind one lock, with entry points for Zenoh's callbacks, timers and signals.
//!
//! The server sends through publishers that are declared once and writes through the recorder. It reads the wall clock for pace
//! and deadlines. All decisions about the run are made by the [`Simulation`].
//!
//! - `joining`: arrival of agents and hosts. `messages`: messages of robots and launchers. `control`: requests of operators.
//! - `process_orders`: process faults. `resend`, `standstill`, `clocks`: repeated messages, waiting and clock differences.
//! - `external_bodies`: bodies that move in another world.
//! - `seals`: keys of all members. `delivery_check`: a check of the receptions that external controllers report.
//! - `broadcasts`: the broadcasts that tick messages pass on.

mod broadcasts;
mod clocks;
mod control;
mod delivery_check;
mod external_bodies;
mod joining;
mod messages;
mod process_orders;
mod resend;
mod seals;
mod standstill;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use cluster::ignored::IgnoredMessages;
use proto::event::TickEvents;
use proto::keys::KeyExpressions;
use proto::tick::{Outcome, TickMessage, ToAgent};
use scenario::ids::{Incarnation, RobotId};
use tokio::sync::oneshot;
use tokio::time::Instant;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::barrier::Presence;
use crate::pace::Pace;
use crate::run_state::RunState;
use crate::simulation::Simulation;
use broadcasts::Broadcasts;
use delivery_check::DeliveryCheck;
use external_bodies::ExternalBodies;
use process_orders::CurrentOrder;
use resend::SentTick;
use run_log::recorder::{BackgroundRecorder, Ending, Folder, RecordError, Recorder};
pub use seals::Seals;
use standstill::Standstill;

/// The largest number of names in a line of text.
pub const NAMES: usize = 12;

/// The maximum time for a welcomed agent to show its token. Also the time that the run waits for a new agent after the last one
/// is lost.
const GRACE: Duration = Duration::from_secs(5);

const WORK_INTERVAL: Duration = Duration::from_millis(1);

/// The minimum time between two views of a running clock, short enough for a smooth display.
const VIEW_INTERVAL: Duration = Duration::from_millis(30);

pub type Ended = Result<Outcome, RecordError>;

struct Peer {
    name: String,
    ticks: Publisher<'static>,
    /// The process id from the agent's join request.
    pid: Option<u32>,
    invited: Option<(Incarnation, Instant)>,
    asked: Option<Instant>,
    question: Option<SentTick>,
    /// `true` if the launcher has reported that the process is stopped.
    stopped: bool,
    /// `true` if the launcher has reported that the process ended or is stopped. The clock starts without such a robot.
    lost: bool,
}

pub struct Server {
    simulation: Simulation,
    recorder: BackgroundRecorder<Folder>,
    delivery_check: DeliveryCheck,
    broadcasts: Broadcasts,
    /// The bodies in another world; `None` for a run whose bodies move in this one.
    external_bodies: Option<ExternalBodies>,
    peers: Vec<Peer>,
    run: String,
    folder: PathBuf,
    keys: KeyExpressions,
    seals: Arc<Seals>,
    session: Session,
    /// A reference to the server for the launcher's answers.
    this: Weak<Mutex<Server>>,
    view: Publisher<'static>,
    events: Publisher<'static>,
    pace: Pace<Instant>,
    stall_after: Duration,
    /// The current tick if it has begun. Its messages are then sent regardless of the pace.
    begun: Option<u64>,
    deserted_since: Option<Instant>,
    /// The robots of a repeated run whose processes have not joined yet. The clock waits for them.
    awaited: BTreeSet<RobotId>,
    standstill: Standstill,
    first_tick: Option<Instant>,
    /// The tick at which this process began. It repeated earlier ticks without robots.
    begun_at: u64,
    /// Nonces of all join requests, for the detection of replayed ones.
    join_nonces: BTreeSet<u128>,
    /// Nonces of all operator requests, for the detection of replayed ones.
    nonces: BTreeSet<String>,
    latest_process_report: BTreeMap<String, u64>,
    /// The hosts whose daemon or router has requested its robots.
    connected_hosts: BTreeSet<String>,
    orders: u64,
    under_way: Option<CurrentOrder>,
    shown: Instant,
    /// The builds of agents that differ from this program's, by robot.
    agent_builds: BTreeMap<String, String>,
    refused: IgnoredMessages,
    ended: Option<oneshot::Sender<Ended>>,
}

pub struct Bus {
    pub run: String,
    pub session: Session,
    pub keys: KeyExpressions,
    pub seals: Arc<Seals>,
    pub publishers: Publishers,
}

pub struct Publishers {
    pub ticks: Vec<Publisher<'static>>,
    pub view: Publisher<'static>,
    pub events: Publisher<'static>,
}

impl Server {
    /// Creates a run that waits for its robots. Its result is sent to `ended`.
    pub fn new(
        start: RunState,
        bus: Bus,
        pace: Pace<Instant>,
        stall_after: Duration,
        ended: oneshot::Sender<Ended>,
    ) -> Result<Self, RecordError> {
        let RunState {
            simulation,
            recorder,
            broadcasts: earlier,
        } = start;
        let mut broadcasts = Broadcasts::default();
        for broadcast in earlier {
            // A message that was sent is within the size limit.
            let _ = broadcasts.store(broadcast);
        }
        let begun_at = simulation.tick();
        let barrier = simulation.barrier();
        let takes_part =
            |robot: &RobotId| barrier.started() && barrier.incarnation(*robot).is_some();
        let awaited = match simulation.outcome() {
            None => barrier.robots().filter(takes_part).collect(),
            Some(_) => BTreeSet::new(),
        };
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
            recorder: BackgroundRecorder::new(recorder, true)?,
            delivery_check: DeliveryCheck::default(),
            broadcasts,
            external_bodies: None,
            run: bus.run,
            keys: bus.keys,
            seals: bus.seals,
            session: bus.session,
            this: Weak::new(),
            view: bus.publishers.view,
            events: bus.publishers.events,
            pace,
            stall_after,
            begun: None,
            deserted_since: None,
            awaited,
            standstill: None,
            first_tick: None,
            begun_at,
            join_nonces: BTreeSet::new(),
            nonces: BTreeSet::new(),
            latest_process_report: BTreeMap::new(),
            connected_hosts: BTreeSet::new(),
            orders: 0,
            under_way: None,
            shown: Instant::now(),
            agent_builds: BTreeMap::new(),
            refused: IgnoredMessages::default(),
            ended: Some(ended),
        })
    }

    #[must_use]
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// Returns the part of the run's result that is not in its tables.
    #[must_use]
    pub fn ending(&self) -> Ending {
        Ending {
            agent_builds: self.agent_builds.clone(),
            ..self.simulation.ending()
        }
    }

    /// Returns the recorder after it has recorded everything.
    ///
    /// # Errors
    /// Fails if the log could not be written or the recorder was already taken.
    pub fn take_recorder(&mut self) -> Result<Recorder<Folder>, RecordError> {
        self.recorder.finish()
    }

    #[must_use]
    pub fn first_tick(&self) -> Option<Instant> {
        self.first_tick
    }

    /// Returns the number of ticks that the robots' processes have made.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.simulation.tick() - self.begun_at
    }

    /// Returns the process ids from the agents' join requests, by robot.
    pub fn pids(&self) -> impl Iterator<Item = (&str, Option<u32>)> {
        self.peers.iter().map(|peer| (peer.name.as_str(), peer.pid))
    }

    pub fn refused(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.refused.counts()
    }

    pub fn add_refused(&mut self, kind: &'static str, count: u64) {
        self.refused.add(kind, count, Instant::now().into_std());
    }

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

    #[must_use]
    pub fn has_agents(&self) -> bool {
        !self.simulation.barrier().has_no_agents()
    }

    pub fn interrupt(&mut self) {
        self.simulation.interrupt();
        self.advance();
    }

    /// Checks all wall-clock deadlines, flushes the log and continues the run.
    pub fn check_deadlines(&mut self) {
        let now = Instant::now();
        for index in 0..self.peers.len() {
            let robot = RobotId(index as u32);
            let peer = &mut self.peers[index];
            if let Some((incarnation, since)) = peer.invited
                && now.duration_since(since) > GRACE
            {
                peer.invited = None;
                tracing::warn!(robot = peer.name, "agent was welcomed but did not arrive");
                self.simulation.cancel_invitation(robot, incarnation);
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
                self.simulation.start_without(RobotId(index as u32));
            }
        }
        for robot in self.awaited.clone() {
            if self.peers[robot.index()].lost
                && let Some(incarnation) = self.simulation.barrier().incarnation(robot)
            {
                // Its process ended before it joined.
                self.awaited.remove(&robot);
                self.simulation.agent_lost(robot, incarnation);
            }
        }
        if self.simulation.barrier().started() && self.simulation.barrier().has_no_agents() {
            let since = *self.deserted_since.get_or_insert(now);
            if now.duration_since(since) > GRACE {
                self.simulation.end_if_idle();
            }
        } else {
            self.deserted_since = None;
        }
        self.check_current_order(now);
        self.update_standstill(now);
        self.resend_ticks(now);
        if let Err(error) = self.recorder.flush() {
            return self.fail(error);
        }
        self.advance();
    }

    /// Publishes a view for observers. Observers may miss some.
    pub fn publish_view(&mut self) {
        let mut view = self.simulation.view();
        view.clock = Some(self.clock());
        for (robot, peer) in view.robots.iter_mut().zip(&self.peers) {
            robot.pid = robot.incarnation.and(peer.pid);
        }
        if let Ok(bytes) = self.seals.run.seal(self.view.key_expr(), &view) {
            // A failure to reach observers does not affect the run.
            let _ = self.view.put(bytes).wait();
        }
        self.shown = Instant::now();
    }

    /// Publishes the events of the tick that has just ended. Observers may miss some.
    fn announce_events(&mut self) {
        let events = self.recorder.take_events();
        if events.is_empty() {
            return;
        }
        let news = TickEvents {
            tick: self.simulation.tick() - 1,
            events,
        };
        if let Ok(bytes) = self.seals.run.seal(self.events.key_expr(), &news) {
            // A failure to reach observers does not affect the run.
            let _ = self.events.put(bytes).wait();
        }
    }

    /// Returns the time at which the pace next needs `pump`. Returns `None` without participants or during a process order, because
    /// their messages call `pump`. While agents are working it is a millisecond ahead, because the tick may be complete at any time.
    #[must_use]
    pub fn due(&self) -> Option<Instant> {
        let due = self.pace.due()?;
        let waits =
            self.simulation.awaits_act() || !self.awaited.is_empty() || self.awaits_bodies();
        if waits || self.simulation.barrier().is_idle() {
            return None;
        }
        let at_work = self.begun == Some(self.simulation.tick());
        Some(if at_work {
            due.max(Instant::now() + WORK_INTERVAL)
        } else {
            due
        })
    }

    /// Continues the run as far as possible without new reports.
    pub fn advance(&mut self) {
        while self.ended.is_some() {
            if self.simulation.is_complete() {
                self.simulation.finish();
            }
            let goes_on = self.ask();
            // The agents work during this call.
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

    /// Sends the tick to the next robots if it is due. Returns `true` if the run may continue at once.
    fn ask(&mut self) -> bool {
        if self.simulation.outcome().is_some() || !self.awaited.is_empty() || self.awaits_bodies() {
            return false;
        }
        self.send_pending_orders();
        let now = Instant::now();
        let tick = self.simulation.tick();
        if self.begun != Some(tick) && !self.pace.is_due(now) {
            return false;
        }
        self.simulation.begin();
        self.send_pending_orders();
        if self.begun != Some(tick) {
            self.place_bodies(tick);
        }
        let mut question = self.simulation.next_recipient();
        if question.is_none() && !self.simulation.is_complete() {
            return false;
        }
        if self.begun != Some(tick) {
            self.begun = Some(tick);
            self.pace.tick_begun(now);
            self.first_tick.get_or_insert(now);
        }
        let mut stopped = Vec::new();
        while let Some(robot) = question {
            self.send_tick(robot, now);
            let peer = &mut self.peers[robot.index()];
            peer.asked = Some(now);
            if peer.stopped {
                stopped.push(robot);
            }
            question = self.simulation.next_recipient();
        }
        let any_stopped = !stopped.is_empty();
        for robot in stopped {
            self.stall(robot);
        }
        any_stopped || self.simulation.is_complete()
    }

    /// Records the tick that has ended, if any, and publishes it to observers.
    fn record(&mut self) -> Result<(), RecordError> {
        if self.simulation.record(&mut self.recorder)? {
            self.send_body_commands();
            self.announce_events();
            if self.shown.elapsed() >= VIEW_INTERVAL {
                self.publish_view();
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
                "no answer; the team continues without this robot"
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
            // The bridge stops the bodies when its connection is closed.
            self.external_bodies = None;
            if let Ok(outcome) = ended {
                self.publish_view();
                for robot in self.simulation.barrier().robots() {
                    self.send(robot, &ToAgent::End(outcome));
                }
            }
            // The receiver is dropped only when the process is ending.
            let _ = sender.send(ended);
        }
    }

    fn fail(&mut self, error: RecordError) {
        for robot in self.simulation.barrier().robots() {
            self.send(robot, &ToAgent::End(Outcome::Interrupted));
        }
        self.end(Err(error));
    }

    /// Counts an ignored message and logs a warning at a limited rate.
    fn refuse(&mut self, kind: &'static str, why: &dyn std::fmt::Display) {
        if let Some(count) = self.refused.count(kind, Instant::now().into_std()) {
            tracing::warn!(kind, count, %why, "message ignored");
        }
    }

    fn robot_named(&self, name: &str) -> Option<RobotId> {
        self.seals.rank(name)
    }
}

/// Locks the server. A panic ends the process, so the lock is never poisoned.
pub fn lock(server: &Mutex<Server>) -> MutexGuard<'_, Server> {
    server.lock().unwrap_or_else(PoisonError::into_inner)
}

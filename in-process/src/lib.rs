//! A complete run in one process: the same world, agents, radio and recorder as with separate processes, and the same bytes as
//! the result. Process faults apply to the agents.
//!
//! An agent receives the world's message itself, with the readings of the mission's devices as a value. Only the hash of
//! a tick encodes them ([`proto::mission::OpenReading`]).
//!
//! [`Team`] steps world and agents and has a recorder. [`AnswerSource`] supplies the answers of external controllers.
//! [`BodyCommand`] drives a body instead of its agent. [`BroadcastCounts`] counts broadcasts.
//!
//! [`Team::use_threads`] steps the robots on several threads, and [`BackgroundTeam`] writes the log on another one. Neither
//! changes any byte.

mod background;
mod broadcast_store;
mod external_command;
mod external_controllers;
mod group;
mod inputs;
mod pool;
mod run;
mod seat;
mod threads;
mod traffic;

use missions::Registry;
use prefetch::{Layer, prefetch};
use proto::control::{Armed, Cleared};
use proto::event::EventLine;
use proto::team::Broadcast;
use proto::tick::Outcome;
use proto::view::View;
use robot_agent::allocator::ConfigError;
use run_log::recorder::{EventCollector, RecordError, Recorder, Sink};
use run_log::{Branch, BranchOrigin, Input, InputLine, LogLevel, RunFile, Table};
use scenario::fault::Order;
use scenario::ids::RobotId;
use scenario::{Problem, Profile, Setup};
use world_server::barrier::Presence;
use world_server::mission::UnknownMission;
use world_server::simulation::Simulation;

pub use background::BackgroundTeam;
pub use external_command::BodyCommand;
pub use external_controllers::{AnswerError, AnswerSource, LoggedAnswers, TickError};
use pool::WorkerPool;
pub use pool::threads_for;
pub use robot_agent::agent::AgentSnapshot;
use run::Run;
pub use seat::Workspaces;
pub use threads::look_for;
pub use traffic::{BroadcastCount, BroadcastCounts};

/// An error that prevents a run in one process from starting.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    #[error(transparent)]
    Log(#[from] RecordError),
    /// An allocator of the run, or its parameters, that this program does not support.
    #[error(transparent)]
    Allocator(#[from] ConfigError),
    /// A mission of the run that this program does not contain.
    #[error(transparent)]
    Mission(#[from] UnknownMission),
    #[error("cannot start {threads} threads: {error}; use `--jobs 1`")]
    Threads {
        threads: usize,
        error: rayon::ThreadPoolBuildError,
    },
    /// An external controller without a source of its answers.
    #[error(
        "the controller '{controller}' of {robot} is an external program and needs a run with processes; leave \
         --in-process out and give its command as --controller {controller}=COMMAND"
    )]
    ExternalController { robot: String, controller: String },
}

/// A team and its world, stepped tick by tick, with the log of the run.
pub struct Team<S> {
    run: Run,
    recorder: Recorder<S>,
    /// Takes the ticks instead of the recorder, see [`Team::omit_hash`].
    collector: Option<EventCollector>,
}

impl<S: Sink> Team<S> {
    /// Creates a run with all robots of the scenario that are not absent, ready for tick 0.
    pub fn new(setup: Setup, log: LogLevel, sink: S) -> Result<Self, StartError> {
        let joins = joins_of(&setup);
        Self::with_inputs(setup, joins, log, sink)
    }

    /// Creates a run that repeats the external inputs of a logged run. Effects of faults are not inputs, because the run computes
    /// them itself.
    pub fn with_inputs(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
    ) -> Result<Self, StartError> {
        Self::with_registry(Registry::current(), setup, inputs, log, sink)
    }

    /// Creates a run like [`Team::with_inputs`], with a source of answers for external controllers.
    pub fn with_answer_source(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
        answer_source: Option<Box<dyn AnswerSource>>,
    ) -> Result<Self, StartError> {
        Self::with_all(Registry::current(), setup, inputs, log, sink, answer_source)
    }

    /// Creates a run like [`Team::with_inputs`], with the missions and allocators of `registry`.
    pub fn with_registry(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
    ) -> Result<Self, StartError> {
        Self::with_all(registry, setup, inputs, log, sink, None)
    }

    fn with_all(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
        answer_source: Option<Box<dyn AnswerSource>>,
    ) -> Result<Self, StartError> {
        let mut run = Run::new(registry, setup, inputs, answer_source)?;
        if log.keeps(Table::AllocationMessages) {
            run.simulation.record_allocation_messages();
        }
        let recorder = Recorder::new(run.simulation.setup(), log, sink)?;
        Ok(Self {
            run,
            recorder,
            collector: None,
        })
    }

    /// Continues the run without log and hash, which take about a sixth of the time of a small team. The states of world and
    /// robots and the events are the same. Only [`Team::tick`] and the functions that look at the run may follow.
    pub fn omit_hash(&mut self) {
        self.run.simulation.omit_records();
        self.collector = Some(EventCollector::new(self.run.simulation.setup()));
    }

    /// Returns a copy of a run without a log ([`LogLevel::Off`]), with the same state between two ticks. It writes to `sink`.
    /// The allocators of the robots in `adopting` use the data that `registry` supplies.
    ///
    /// Returns `None` if the run has a log, if external controllers answer, or if one of these allocators cannot
    /// [adopt](robot_agent::allocator::Allocator::adopt) other data.
    #[must_use]
    pub fn copied<T: Sink>(
        &self,
        registry: &Registry,
        adopting: &[RobotId],
        sink: T,
    ) -> Option<Team<T>> {
        Some(Team {
            recorder: self.recorder.copied(sink)?,
            run: self.run.copied(registry, adopting)?,
            collector: self.collector.clone(),
        })
    }

    /// Requests the memory of a layer for the next tick, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        self.run.prefetch(layer);
        // The recorder is a layer below the choice between it and the collector.
        match layer {
            Layer::Fields => prefetch(&self.collector),
            _ if self.collector.is_some() => {}
            Layer::Lists => self.recorder.prefetch(Layer::Fields),
            Layer::Elements => self.recorder.prefetch(Layer::Lists),
            Layer::Contents => {}
        }
    }

    /// Adds external inputs of later ticks than the current one. The inputs of a tick must be complete before the previous
    /// tick is run, because robots that join are admitted at its end.
    pub fn add_inputs(&mut self, inputs: Vec<InputLine>) {
        self.run.add_inputs(inputs);
    }

    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    /// Returns the learned task times of all robots that learn. A robot without an agent has lost its progress in this run, so its
    /// times are those at the start.
    pub fn learned(&self) -> Profile {
        self.run.learned()
    }

    /// Drives the body of a robot with this command from now on. Its agent continues to sense, receive and send. `None` returns
    /// control to the agent. The inputs of such a run are not sufficient to repeat it.
    pub fn drive(&mut self, robot: RobotId, command: Option<BodyCommand>) {
        self.run.drive(robot, command);
    }

    /// Steps the robots on this number of threads from now on, with the same bytes. [`threads_for`] returns a suitable number.
    ///
    /// # Errors
    /// Returns [`StartError::Threads`].
    pub fn use_threads(&mut self, threads: usize) -> Result<(), StartError> {
        self.run.pool = match threads {
            0 | 1 => None,
            _ => Some(
                WorkerPool::new(self.run.seats.len(), threads)
                    .map_err(|error| StartError::Threads { threads, error })?,
            ),
        };
        Ok(())
    }

    /// Continues the run with a recorder on a thread of its own if `is_threaded` and the log has a row per tick.
    ///
    /// # Errors
    /// Returns [`RecordError::Thread`].
    pub fn into_background(self, is_threaded: bool) -> Result<BackgroundTeam<S>, RecordError>
    where
        S: Send + 'static,
    {
        BackgroundTeam::new(self.run, self.recorder, is_threaded)
    }

    /// Exchanges the team's workspaces for these. They contain no data that outlasts a tick.
    pub fn swap_workspaces(&mut self, spaces: &mut Workspaces) {
        self.run.exchange(spaces);
    }

    pub fn count_traffic(&mut self) {
        self.run.traffic = Some(BroadcastCounts::default());
    }

    /// Returns the counts of broadcasts, or `None` without [`Team::count_traffic`].
    pub fn traffic(&self) -> Option<&BroadcastCounts> {
        self.run.traffic.as_ref()
    }

    /// Returns the events since the last call, see [`Recorder::take_events`].
    pub fn take_events(&mut self) -> Vec<EventLine> {
        match &mut self.collector {
            Some(collector) => collector.take_events(),
            None => self.recorder.take_events(),
        }
    }

    pub fn view(&self) -> View {
        self.run.simulation.view_without_history()
    }

    /// Returns a view with the messages and curves since the previous call; the first call returns none of them.
    pub fn observe(&mut self) -> View {
        self.run.simulation.view()
    }

    /// Orders a fault for a person. The order takes effect in the next tick, of which it is an input.
    ///
    /// # Errors
    /// If the order is invalid or would have no effect; the text contains a remedy.
    pub fn order(&mut self, order: Order) -> Result<Armed, Problem> {
        self.run.simulation.order_by_hand(order, false)
    }

    /// Clears the fault with this id, or all faults, for a person.
    ///
    /// # Errors
    /// If there is no such fault, or it has already ended.
    pub fn clear(&mut self, id: Option<&str>) -> Result<Cleared, Problem> {
        self.run.simulation.clear(id)
    }

    /// Runs one tick. Returns the outcome if the run has ended.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
        match &mut self.collector {
            Some(collector) => self.run.tick(collector),
            None => self.run.tick(&mut self.recorder),
        }
    }

    /// Runs to the end and finishes the log.
    pub fn run(mut self) -> Result<(Outcome, Recorder<S>), TickError> {
        loop {
            if let Some(outcome) = self.tick()? {
                return Ok(self.finish(outcome)?);
            }
        }
    }

    /// Runs to the end, but at most for a number of ticks, after which the run is interrupted. `expected` is the
    /// outcome in a log: with [`Outcome::NoRobotLeft`], a run without robots ends in one more tick. Finishes the log. `see`
    /// is called before the first tick and after each.
    pub fn run_for(
        mut self,
        ticks: u64,
        expected: Outcome,
        see: impl FnMut(&mut Simulation),
    ) -> Result<(Outcome, Recorder<S>), TickError> {
        let outcome = self.continue_for(ticks, expected, see)?;
        Ok(self.finish(outcome)?)
    }

    /// Runs like [`Team::run_for`] without finishing the log. Returns the outcome.
    pub fn continue_for(
        &mut self,
        ticks: u64,
        expected: Outcome,
        mut see: impl FnMut(&mut Simulation),
    ) -> Result<Outcome, TickError> {
        see(&mut self.run.simulation);
        while self.run.simulation.tick() < ticks {
            let outcome = self.tick()?;
            see(&mut self.run.simulation);
            if let Some(outcome) = outcome {
                return Ok(outcome);
            }
        }
        // A run without robots begins one more tick before it ends. The log contains the events of that tick.
        let barrier = self.run.simulation.barrier();
        let is_deserted = barrier
            .robots()
            .all(|robot| barrier.presence(robot) != Presence::Present);
        if expected == Outcome::NoRobotLeft && is_deserted {
            self.tick()?;
        }
        // Every other end follows from the run itself.
        let outcome = self.run.simulation.outcome();
        Ok(outcome.unwrap_or(Outcome::Interrupted))
    }

    /// Marks the log as that of a branch, before the first tick.
    pub fn set_origin(&mut self, origin: BranchOrigin) -> Result<(), RecordError> {
        self.recorder.set_branch(origin)
    }

    /// Changes faults and parameters from the current tick on. The tick must not have begun.
    ///
    /// # Errors
    /// If a fault or a parameter does not fit the run.
    pub fn branch(&mut self, branch: &Branch) -> Result<(), Problem> {
        self.run.branch(branch)
    }

    /// Returns the hash of the run so far.
    #[must_use]
    pub fn hash(&self) -> String {
        self.recorder.hash()
    }

    /// Returns the world and the log at the start of a tick, and the broadcasts that a manifest can still list. Other
    /// processes continue with the agents.
    #[must_use]
    pub fn into_world(self) -> (Simulation, Recorder<S>, Vec<Broadcast>) {
        let recent = self.run.broadcasts.recent().cloned().collect();
        (self.run.simulation, self.recorder, recent)
    }

    /// Returns the state of a robot at the start of a tick, so that another process continues it; `None` if the robot has no
    /// agent.
    pub fn take_agent(&mut self, robot: RobotId) -> Option<AgentSnapshot> {
        Some(AgentSnapshot {
            agent: self.run.take_agent(robot)?,
            first_tick: self.run.simulation.tick(),
        })
    }

    /// Writes everything recorded so far and returns the log of a run in progress, as a killed run leaves it.
    pub fn unfinished(&mut self) -> Result<&S, RecordError> {
        self.recorder.flush()?;
        Ok(self.recorder.sink())
    }

    /// Finishes the log with this outcome.
    pub fn end(mut self, outcome: Outcome) -> Result<(RunFile, Recorder<S>), RecordError> {
        let ending = self.run.simulation.ending();
        let run = self.recorder.finish(outcome, ending)?;
        Ok((run, self.recorder))
    }

    fn finish(self, outcome: Outcome) -> Result<(Outcome, Recorder<S>), RecordError> {
        let (_, recorder) = self.end(outcome)?;
        Ok((outcome, recorder))
    }
}

/// Returns the inputs of an undisturbed run: all robots of the scenario that are not absent join at the start.
#[must_use]
pub fn joins_of(setup: &Setup) -> Vec<InputLine> {
    let present = setup.scenario.robots.iter().filter(|robot| !robot.absent);
    let joins = present.map(|robot| InputLine {
        tick: 0,
        input: Input::Join {
            robot: robot.name.clone(),
            incarnation: 1,
            moment: None,
            scripted: false,
        },
    });
    joins.collect()
}

//! A whole run in one process: the same world, agents, radio and recorder as in many, without processes and sockets, and the same bytes
//! as the result. What faults ask of processes is done to agents.
//!
//! `run` steps world and agents, and is lent a recorder; [`Team`] is that with a recorder of its own. [`Foreign`]: who answers for minds
//! that this program does not have; [`Command`]: what somebody makes of a body in the place of its agent; [`Traffic`]: what was said.

mod air;
mod driven;
mod foreign;
mod run;
mod traffic;

use alliance_proto::event::EventLine;
use alliance_proto::ids::RobotId;
use alliance_proto::log::{Input, InputLine, LogLevel, RunFile};
use alliance_proto::scenario::{Profile, Setup};
use alliance_proto::tick::Outcome;
use alliance_proto::view::View;
use missions::Registry;
use robot_agent::allocator::ConfigError;
use world_server::barrier::Presence;
use world_server::mission::UnknownMission;
use world_server::recorder::{RecordError, Recorder, Sink};
use world_server::simulation::Simulation;

pub use driven::Command;
pub use foreign::{Foreign, ForeignError, Kept, TickError};
use run::Run;
pub use run::Spaces;
pub use traffic::{Said, Traffic};

/// Why a run in one process cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] RecordError),
    /// This program does not know an allocator of the run, or not with these parameters.
    #[error(transparent)]
    Allocator(#[from] ConfigError),
    /// This program does not know the mission of the run.
    #[error(transparent)]
    Mission(#[from] UnknownMission),
    /// This program does not have the mind of a robot, and nobody answers for it.
    #[error(
        "the mind '{mind}' of {robot} is a program of its own, which runs by processes alone: \
         `alliance run SCENARIO --mind {mind}=COMMAND`"
    )]
    Mind {
        /// Whose.
        robot: String,
        /// Its name.
        mind: String,
    },
}

/// A team and its world, stepped by hand, and the log that they leave.
pub struct Team<S> {
    run: Run,
    recorder: Recorder<S>,
}

impl<S: Sink> Team<S> {
    /// All robots of the scenario that are not absent, ready for tick 0.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn new(setup: Setup, log: LogLevel, sink: S) -> Result<Self, StartError> {
        let joins = joins_of(&setup);
        Self::with_inputs(setup, joins, log, sink)
    }

    /// A run to which the same happens from outside as to one that was logged. What a fault asked for happens by itself.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn with_inputs(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
    ) -> Result<Self, StartError> {
        Self::with_registry(Registry::of_this_program(), setup, inputs, log, sink)
    }

    /// The same where somebody answers for the robots whose minds this program does not have.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn with_foreign(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
        foreign: Option<Box<dyn Foreign>>,
    ) -> Result<Self, StartError> {
        Self::with_all(
            Registry::of_this_program(),
            setup,
            inputs,
            log,
            sink,
            foreign,
        )
    }

    /// The same with missions and allocators that need not be those of the program.
    ///
    /// # Errors
    /// [`StartError`].
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
        foreign: Option<Box<dyn Foreign>>,
    ) -> Result<Self, StartError> {
        let run = Run::new(registry, setup, inputs, foreign)?;
        let recorder = Recorder::new(run.simulation.setup(), log, sink)?;
        Ok(Self { run, recorder })
    }

    /// The run.
    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    /// What the robots that learn know by now of how long each of them needs. Who has no agent has lost what it learned in this run,
    /// and knows what it began it with.
    pub fn learned(&self) -> Profile {
        self.run.learned()
    }

    /// From now on the body of that robot does this, whatever its agent wants, which senses, hears and speaks as before; `None`: its
    /// agent drives again. A run that is driven from outside is not repeated by its inputs.
    pub fn drive(&mut self, robot: RobotId, command: Option<Command>) {
        self.run.drive(robot, command);
    }

    /// Exchanges the team's workspaces for these. Nothing in them lasts from one tick to the next.
    pub fn exchange(&mut self, spaces: &mut Spaces) {
        self.run.exchange(spaces);
    }

    /// Counts from now on what is said, by kind.
    pub fn count_traffic(&mut self) {
        self.run.traffic = Some(Traffic::default());
    }

    /// What was said, if it is counted.
    pub fn traffic(&self) -> Option<&Traffic> {
        self.run.traffic.as_ref()
    }

    /// What has happened since this was asked last, see [`Recorder::take_events`].
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.recorder.take_events()
    }

    /// A snapshot for eyes, see [`Simulation::glance`].
    pub fn glance(&self) -> View {
        self.run.simulation.glance()
    }

    /// One tick. Says how the run ended, once it has.
    ///
    /// # Errors
    /// When the log cannot be written, or a foreign mind does not answer.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
        self.run.tick(&mut self.recorder)
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn run(mut self) -> Result<(Outcome, Recorder<S>), TickError> {
        loop {
            if let Some(outcome) = self.tick()? {
                return Ok(self.finish(outcome)?);
            }
        }
    }

    /// Runs to the end, or until that many ticks are done: then it ends as it is told to. `see` looks at the run before the
    /// first tick and after each.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn run_for(
        mut self,
        ticks: u64,
        then: Outcome,
        see: impl FnMut(&mut Simulation),
    ) -> Result<(Outcome, Recorder<S>), TickError> {
        let outcome = self.go_on_for(ticks, then, see)?;
        Ok(self.finish(outcome)?)
    }

    /// The same without the end of the log: says how the run ends.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn go_on_for(
        &mut self,
        ticks: u64,
        then: Outcome,
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
        // A run that ended for want of robots has begun one more tick: what fell due in it is in the log.
        let barrier = self.run.simulation.barrier();
        let is_deserted = barrier
            .robots()
            .all(|robot| barrier.presence(robot) != Presence::Present);
        if then == Outcome::NoRobotLeft && is_deserted {
            self.tick()?;
        }
        Ok(self.run.simulation.outcome().unwrap_or(then))
    }

    /// Ends the log: the run ended like this.
    ///
    /// # Errors
    /// When it cannot be written.
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

/// What comes from outside where nothing does but all robots of the scenario that are not absent, at the start.
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

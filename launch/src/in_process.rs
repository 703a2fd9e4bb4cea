//! A whole run in one process: the same world, agents, radio and recorder, without processes and sockets, with the same
//! bytes as the result.

use alliance_proto::ids::RobotId;
use alliance_proto::scenario::Setup;
use alliance_proto::tick::{Outcome, TickMessage};
use robot_agent::agent::Agent;
use robot_agent::radio::Radio;
use world_server::recorder::{LogLevel, RecordError, Recorder, Sink};
use world_server::simulation::Simulation;

/// A robot without its process.
struct Member {
    agent: Agent,
    radio: Radio,
}

/// A team and its world, stepped by hand.
pub struct Team<S> {
    simulation: Simulation,
    recorder: Recorder<S>,
    members: Vec<Member>,
}

impl<S: Sink> Team<S> {
    /// All robots of the scenario, ready for tick 0.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn new(setup: Setup, log: LogLevel, sink: S) -> Result<Self, RecordError> {
        let recorder = Recorder::new(&setup, log, sink)?;
        let mut simulation = Simulation::new(setup);
        let setup = simulation.setup().clone();
        let mut members = Vec::new();
        for (rank, robot) in setup.scenario.robots.iter().enumerate() {
            // Refused only when the mission has ended at its start, for want of anything to do.
            let Ok((id, incarnation, _)) = simulation.invite(&robot.name) else {
                break;
            };
            debug_assert_eq!(id.index(), rank);
            members.push(Member {
                agent: Agent::new(id, incarnation, &setup),
                radio: Radio::default(),
            });
            simulation.arrive(id, incarnation);
        }
        Ok(Self {
            simulation,
            recorder,
            members,
        })
    }

    /// The run.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// One tick. Says how the run ended, once it has.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn tick(&mut self) -> Result<Option<Outcome>, RecordError> {
        while self.simulation.outcome().is_none() && !self.simulation.is_complete() {
            for (robot, message) in self.simulation.questions() {
                self.ask(robot, &message);
            }
        }
        if self.simulation.is_complete() {
            self.simulation.finish(&mut self.recorder)?;
        }
        Ok(self.simulation.outcome())
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn run(mut self) -> Result<(Outcome, Recorder<S>), RecordError> {
        loop {
            if let Some(outcome) = self.tick()? {
                let unscripted = self.simulation.is_unscripted();
                self.recorder.finish(outcome, unscripted)?;
                return Ok((outcome, self.recorder));
            }
        }
    }

    fn ask(&mut self, robot: RobotId, message: &TickMessage) {
        let member = &mut self.members[robot.index()];
        let arrived = member.radio.collect(&message.manifest);
        let step = member.agent.step(message, arrived);
        for broadcast in step.broadcasts {
            for (rank, teammate) in self.members.iter_mut().enumerate() {
                if rank != robot.index() {
                    teammate.radio.receive(broadcast.clone());
                }
            }
        }
        self.simulation.report(step.report);
    }
}

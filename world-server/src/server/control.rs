//! The operators' requests on the control topic.

use proto::control::wire::{ControlTopic, EncodedMessage, Format, WireError};
use proto::control::{
    ClockCommand, ClockStatus, ControlCommand, Description, Phase, Reply, Request, RobotStatus,
    SetStatus, Status,
};
use proto::telemetry::BehaviorState;
use scenario::Problem;
use scenario::ids::RobotId;
use tokio::time::Instant;

use super::Server;
use crate::barrier::Presence;

impl Server {
    /// Executes a request on the control topic and returns the reply.
    ///
    /// # Errors
    /// Fails if the request is malformed or does not carry the seal of the run.
    pub fn control(
        &mut self,
        form: Format,
        payload: &[u8],
        attachment: Option<&[u8]>,
    ) -> Result<EncodedMessage, WireError> {
        let wire = ControlTopic::new(&self.keys, self.seals.run.clone());
        let request = wire
            .read_request(form, payload, attachment)
            .inspect_err(|error| self.refuse("control", error))?;
        let nonce = request.nonce.clone();
        let reply = self.execute(request);
        wire.write_reply(form, &nonce, &reply)
    }

    fn execute(&mut self, request: Request) -> Reply {
        if !self.nonces.insert(request.nonce) {
            self.refuse("control", &"replayed");
            let problem = Problem::at(["nonce"], "it has been used", "give each request its own");
            return Reply::Refused(problem.to_string());
        }
        if let Err(problem) = self.check_for_bodies(&request.command) {
            return Reply::Refused(problem.to_string());
        }
        let reply = match request.command {
            ControlCommand::Fault(order) => {
                let target = order.fault.robot().and_then(|name| self.robot_named(name));
                let is_stopped = target.is_some_and(|robot| self.peers[robot.index()].stopped);
                let armed = self.simulation.order_by_hand(order, is_stopped);
                armed.map(Reply::Armed)
            }
            ControlCommand::Clear(id) => self.simulation.clear(id.as_deref()).map(Reply::Cleared),
            ControlCommand::List => Ok(Reply::Faults(self.simulation.faults())),
            ControlCommand::Status => Ok(Reply::Status(Box::new(self.status()))),
            ControlCommand::Describe => self.description().map(Reply::Description),
            ControlCommand::Clock(command) => self.apply_clock_command(command).map(Reply::Clock),
        };
        // A paused world publishes the change at once.
        self.publish_view();
        self.advance();
        reply.unwrap_or_else(|problem| {
            self.refuse("control", &problem);
            Reply::Refused(problem.to_string())
        })
    }

    fn apply_clock_command(&mut self, command: ClockCommand) -> Result<ClockStatus, Problem> {
        self.pace.execute(command, Instant::now())?;
        Ok(self.clock())
    }

    pub(super) fn clock(&self) -> ClockStatus {
        ClockStatus {
            waits_for: self.standstill_cause(),
            ..self.pace.status(self.simulation.tick())
        }
    }

    fn description(&self) -> Result<Description, Problem> {
        let mut setup = self.simulation.setup().clone();
        // Their size is quadratic in the size of the team.
        setup.alliance.robots = std::sync::Arc::default();
        let setup = setup.to_json();
        Ok(Description {
            run: self.run.clone(),
            folder: self.shown_folder(),
            setup: setup.map_err(|error| Problem::of_value(error.to_string(), ""))?,
        })
    }

    fn shown_folder(&self) -> String {
        let folder = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        folder.display().to_string()
    }

    fn status(&self) -> Status {
        let setup = self.simulation.setup();
        let mut faults = self.simulation.faults();
        faults.retain(|fault| fault.phase != Phase::Over);
        Status {
            run: self.run.clone(),
            folder: self.shown_folder(),
            scenario: setup.scenario.name.clone(),
            seed: setup.seed,
            tick: self.simulation.tick(),
            t_ms: self.simulation.world().now(),
            clock: self.clock(),
            mission: self.simulation.mission_columns(),
            robots: self
                .simulation
                .barrier()
                .robots()
                .map(|robot| self.robot_status(robot))
                .collect(),
            faults,
        }
    }

    fn robot_status(&self, robot: RobotId) -> RobotStatus {
        let (world, barrier) = (self.simulation.world(), self.simulation.barrier());
        let catalog = self.simulation.catalog();
        let motivations = self.simulation.motivations(robot);
        let pose = world.pose(robot);
        let presence = barrier.presence(robot);
        let lives = presence != Presence::Empty;
        let active = motivations
            .iter()
            .find(|motivation| motivation.state == BehaviorState::Active)
            .filter(|_| lives);
        let task = active.and_then(|active| catalog.sets.get(active.set.index()));
        let peer = &self.peers[robot.index()];
        RobotStatus {
            robot: peer.name.clone(),
            pid: peer.pid.filter(|_| lives),
            incarnation: barrier.incarnation(robot),
            state: self.simulation.agent_state(robot),
            x_m: pose.position.x,
            y_m: pose.position.y,
            heading_rad: pose.heading_rad,
            carrying: world.mission().load(robot).is_some(),
            task: task.map(|set| catalog.task_name(set.task).to_owned()),
            sets: motivations
                .iter()
                .filter(|_| lives)
                .map(|motivation| SetStatus {
                    behavior_set: catalog.behavior_name(motivation.set).to_owned(),
                    motivation: motivation.motivation,
                    state: motivation.state.as_str().to_owned(),
                })
                .collect(),
        }
    }
}

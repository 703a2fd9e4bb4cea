//! Arrival of agents and hosts: join requests, host requests and liveliness tokens.

use std::sync::Arc;

use proto::codec::{CodecError, decode_first};
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal, Welcome};
use proto::keys::KeyExpressions;
use proto::membership::{EnlistReply, EnlistRequest, HostRobots};
use proto::program_build;
use scenario::ids::{Incarnation, RobotId, Tick};
use tokio::time::Instant;

use super::Server;
use super::clocks::check_clock;
use crate::barrier::Presence;

impl Server {
    /// Answers a join request on this key. The answer is sealed for the sender. `build` is the sealed identity of the
    /// agent's build, if it sent any.
    pub fn join(
        &mut self,
        key: &str,
        payload: &[u8],
        build: Option<&[u8]>,
    ) -> Result<Vec<u8>, CodecError> {
        let Some(name) = key.strip_prefix(&self.keys.join("")) else {
            // Agents of an earlier version use this key and seal with the token.
            self.refuse("join", &"from another version");
            let refusal = JoinReply::Refused(unread(payload));
            return self.seals.run.seal(&format!("{key}/{:032x}", 0), &refusal);
        };
        let secret = self.seals.robot_named(name);
        let request = secret.open::<JoinRequest>(&self.keys.join(name), payload);
        let (nonce, reply) = match request {
            Ok(request) if request.robot == name => {
                let build = build.and_then(|build| secret.open(&self.keys.join(name), build).ok());
                let (nonce, reply) = (request.nonce, self.answer(request));
                if let (JoinReply::Welcome(welcome), Some(build)) = (&reply, build) {
                    self.note_build(welcome.robot, build);
                }
                (nonce, reply)
            }
            Ok(request) => {
                self.refuse("join", &"on another robot's key");
                (request.nonce, JoinReply::Refused(Refusal::Malformed))
            }
            Err(error) => {
                self.refuse("join", &error);
                (0, JoinReply::Refused(unread(payload)))
            }
        };
        secret.seal(&self.keys.join_answer(name, nonce), &reply)
    }

    /// Answers a host's request on this key.
    pub fn enlist(&mut self, key: &str, payload: &[u8]) -> Result<Vec<u8>, String> {
        let host = KeyExpressions::parse_sender(key).to_owned();
        let seals = Arc::clone(&self.seals);
        let Some(secret) = seals.host(&host) else {
            self.refuse("enlist", &"unknown host");
            return Err(format!("unknown host '{host}'"));
        };
        let request = secret.open::<EnlistRequest>(&self.keys.enlist(&host), payload);
        let (nonce, reply) = match request {
            Ok(request) => (request.nonce, self.enlisted(&host, &request)),
            Err(error) => {
                self.refuse("enlist", &error);
                (0, Err(unread(payload).to_string()))
            }
        };
        let answer = secret.seal(&self.keys.enlist_answer(&host, nonce), &reply);
        answer.map_err(|error| error.to_string())
    }

    fn enlisted(&mut self, host: &str, request: &EnlistRequest) -> EnlistReply {
        if request.version != PROTOCOL_VERSION {
            return Err(version_refusal(request.version).to_string());
        }
        check_clock(request.unix_ms)?;
        let robots = &self.simulation.setup().scenario.robots;
        let barrier = self.simulation.barrier();
        let host_robots = barrier
            .robots()
            .filter(|robot| self.seals.host_of(*robot) == host);
        let (mut all, mut start) = (Vec::new(), Vec::new());
        for robot in host_robots {
            let name = &robots[robot.index()].name;
            all.push(name.clone());
            let is_free = matches!(
                barrier.presence(robot),
                Presence::Empty | Presence::Invited | Presence::Silent
            );
            // After the clock has started, robots that were killed on purpose do not come back.
            if !robots[robot.index()].absent && is_free && !barrier.is_killed(robot) {
                start.push(name.clone());
            }
        }
        self.connected_hosts.insert(host.to_owned());
        tracing::info!(host, robots = all.join(", "), "host joined");
        Ok(HostRobots { robots: all, start })
    }

    fn answer(&mut self, request: JoinRequest) -> JoinReply {
        if !self.join_nonces.insert(request.nonce) {
            self.refuse("join", &"replayed");
            return JoinReply::Refused(Refusal::Malformed);
        }
        if request.version != PROTOCOL_VERSION {
            return JoinReply::Refused(version_refusal(request.version));
        }
        let briefing = self.simulation.setup().for_robot(&request.robot);
        let setup = match briefing.to_json() {
            Ok(setup) => setup,
            Err(error) => {
                self.refuse("join", &error);
                return JoinReply::Refused(Refusal::Malformed);
            }
        };
        self.supersede(&request.robot);
        let place = match self.place_in_repeated_run(&request.robot) {
            Some(place) => Ok(place),
            None => self.simulation.invite(&request.robot),
        };
        match place {
            Err(refusal) => JoinReply::Refused(refusal),
            Ok((robot, incarnation, first_tick)) => {
                let is_awaited = self.awaited.contains(&robot);
                let peer = &mut self.peers[robot.index()];
                peer.pid = Some(request.pid);
                peer.invited = (!is_awaited).then(|| (incarnation, Instant::now()));
                (peer.stopped, peer.lost) = (false, false);
                JoinReply::Welcome(Welcome {
                    robot,
                    incarnation,
                    first_tick,
                    setup,
                })
            }
        }
    }

    /// Returns the robot, its incarnation and its first tick, if the run was repeated up to the current tick and waits for the
    /// robot's process.
    fn place_in_repeated_run(&self, robot: &str) -> Option<(RobotId, Incarnation, Tick)> {
        let robot = self.seals.rank(robot)?;
        let incarnation = self.simulation.barrier().incarnation(robot)?;
        let is_awaited = self.awaited.contains(&robot);
        is_awaited.then(|| (robot, incarnation, self.simulation.tick()))
    }

    /// Reports an agent of another build. It can decide otherwise than the program that replays the run.
    fn note_build(&mut self, robot: RobotId, build: String) {
        if program_build::is_other(&build) && !self.simulation.has_external_controller(robot) {
            let (name, world) = (&self.peers[robot.index()].name, program_build::get());
            tracing::warn!(robot = name, build, world, "the agent is of another build");
            self.agent_builds.insert(name.clone(), build);
        }
    }

    /// Ends the silent incarnation of a robot when a new agent of the same robot joins over a network. A host can disappear from a
    /// network without closing its socket.
    fn supersede(&mut self, robot: &str) {
        let Some(robot) = self.seals.rank(robot) else {
            return;
        };
        let barrier = self.simulation.barrier();
        if self.seals.is_networked()
            && barrier.presence(robot) == Presence::Silent
            && let Some(incarnation) = barrier.incarnation(robot)
        {
            self.simulation.agent_lost(robot, incarnation);
            self.advance();
        }
    }

    /// Handles the appearance or disappearance of an agent's liveliness token.
    pub fn token(&mut self, key: &str, alive: bool) {
        let plain = key.rsplit_once('/').map_or(key, |(plain, _)| plain);
        let Some((name, incarnation)) = self.keys.parse_alive(plain) else {
            return self.refuse("token", &"not a robot's incarnation");
        };
        let Some(robot) = self.robot_named(name) else {
            return self.refuse("token", &"unknown robot");
        };
        if self.seals.robot(robot).stamped(key).is_none() {
            return self.refuse("token", &"not stamped by the robot");
        }
        if alive {
            self.peers[robot.index()].invited = None;
            if self.simulation.barrier().incarnation(robot) == Some(incarnation) {
                self.awaited.remove(&robot);
            }
            self.simulation.arrive(robot, incarnation);
        } else {
            // After the end of the run, every agent leaves.
            if self.simulation.outcome().is_none() {
                tracing::info!(
                    robot = name,
                    incarnation,
                    tick = self.simulation.tick(),
                    "agent lost"
                );
            }
            self.simulation.agent_lost(robot, incarnation);
        }
        self.advance();
    }
}

/// Returns the refusal of an unreadable request. Requests of all versions begin with the version number.
fn unread(payload: &[u8]) -> Refusal {
    match decode_first(payload) {
        Ok(agent) if agent != PROTOCOL_VERSION => version_refusal(agent),
        _ => Refusal::Malformed,
    }
}

fn version_refusal(agent: u32) -> Refusal {
    Refusal::Version {
        agent,
        world: PROTOCOL_VERSION,
    }
}

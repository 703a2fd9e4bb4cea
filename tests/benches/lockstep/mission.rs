//! Scenarios for teams of any size, and the traffic of their runs.

use std::collections::BTreeMap;
use std::sync::Arc;

use alliance_tests::runs;
use missions::Registry;
use proto::codec::encode;
use proto::secret::SEAL_BYTES;
use proto::team::{Broadcast, BroadcastKey, EncodedBroadcast};
use proto::tick::{ManifestEntry, ToAgent};
use robot_agent::agent::{Agent, TeamConfig, Workspace};
use run_log::recorder::Recorder;
use run_log::{LogLevel, MemoryLog};
use scenario::Setup;
use serde::Serialize;
use world_server::simulation::Simulation;

pub struct Mission {
    pub text: String,
    pub setup: Setup,
}

impl Mission {
    pub fn new(text: String) -> Self {
        let setup = runs::setup(runs::parse(&text), 1);
        Self { text, setup }
    }

    /// Returns a team of `size` robots with the top speed and the items per spill. The first robot has blue's body,
    /// the others have gold's.
    pub fn busy(size: usize, speed_m_s: f64, items: usize, limit_s: f64) -> Self {
        let spills = [("top", 0.667), ("bottom", 0.333)].map(|(name, y)| {
            format!("[[waste.spills]]\nname = \"{name}\"\nitems = {items}\ny_fraction = {y}\n")
        });
        let robots = (0..size).map(|rank| {
            let side_sensor = rank == 0;
            format!("[[robots]]\nname = \"r{rank}\"\nside_sensor = {side_sensor}\n")
        });
        let head = format!(
            "name = \"team-of-{size}\"\nlimit_s = {limit_s:.1}\n[body]\nspeed_m_s = {speed_m_s}\n"
        );
        Self::new(head + &spills.concat() + &robots.collect::<String>())
    }
}

/// The mean sizes of messages in bytes, and the interval between broadcasts.
#[derive(Clone, Copy, Debug)]
pub struct Traffic {
    pub ticks: u64,
    pub tick_bytes: usize,
    pub report_bytes: usize,
    pub broadcast_bytes: usize,
    /// The number of ticks between two broadcasts of an agent.
    pub broadcast_every: u64,
}

/// The number and total size of the messages of one kind.
#[derive(Default)]
struct Count {
    messages: u64,
    bytes: u64,
}

impl Count {
    fn add(&mut self, message: &impl Serialize) {
        self.messages += 1;
        self.bytes += (encode(message).unwrap().len() + SEAL_BYTES) as u64;
    }

    fn mean_bytes(&self) -> usize {
        (self.bytes / self.messages.max(1)) as usize
    }
}

impl Traffic {
    /// Steps the world and the agents in this process and encodes their messages.
    pub fn of(setup: &Setup) -> Self {
        let mission = Registry::current().worlds().find(&setup.scenario).unwrap();
        let mut recorder = Recorder::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let mut simulation = Simulation::new(setup.clone(), mission, false);
        let mut agents = Vec::new();
        let team = TeamConfig::new(setup, Registry::current().agents()).unwrap();
        for robot in &setup.scenario.robots {
            let (id, incarnation, _) = simulation.invite(&robot.name).unwrap();
            simulation.arrive(id, incarnation);
            agents.push(Agent::new(id, incarnation, setup, &team));
        }
        let mut sent: BTreeMap<BroadcastKey, Arc<Broadcast>> = BTreeMap::new();
        let [mut ticks, mut reports, mut broadcasts] = [(); 3].map(|()| Count::default());
        while simulation.outcome().is_none() {
            while let Some(robot) = simulation.next_recipient() {
                let message = simulation.message(robot).clone();
                let mut space = Workspace::default();
                let keys = message.manifest.iter().flat_map(ManifestEntry::keys);
                space
                    .arrived
                    .extend(keys.map(|key| sent.get(&key).cloned()));
                let encoded = |broadcast: &Option<Arc<Broadcast>>| {
                    broadcast
                        .as_deref()
                        .map(|broadcast| EncodedBroadcast::of(broadcast).unwrap())
                };
                let listed = space.arrived.iter().map(encoded).collect();
                agents[robot.index()].step(&message, &mut space);
                ticks.add(&ToAgent::Tick {
                    tick: Box::new(message),
                    ground_truth: Vec::new(),
                    broadcasts: listed,
                });
                reports.add(&space.report);
                for broadcast in space.broadcasts {
                    broadcasts.add(&broadcast);
                    sent.insert(broadcast.key(), Arc::new(broadcast));
                }
                simulation.report(&space.report);
            }
            if simulation.is_complete() {
                simulation.finish();
                simulation.record(&mut recorder).unwrap();
            }
        }
        Self {
            ticks: simulation.tick(),
            tick_bytes: ticks.mean_bytes(),
            report_bytes: reports.mean_bytes(),
            broadcast_bytes: broadcasts.mean_bytes(),
            broadcast_every: reports.messages / broadcasts.messages.max(1),
        }
    }
}

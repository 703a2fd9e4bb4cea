//! The world alone: sensor readings and motion without controllers.

use missions::Registry;
use std::hint::black_box;
use std::time::{Duration, Instant};

use proto::readings::Actuation;
use scenario::ids::RobotId;

use super::run::setup;

/// The number of ticks in which a body drives straight, and then turns: about the mixture of a working robot.
const STRAIGHT: u64 = 60;
const TURN: u64 = 20;

pub struct World {
    world: world_server::world::World,
    commands: Vec<Option<Actuation>>,
    tick: u64,
}

impl World {
    pub fn new(robots: usize) -> Self {
        Self {
            world: {
                let setup = setup(robots);
                world_server::world::World::new(
                    &setup,
                    Registry::current().worlds().find(&setup.scenario).unwrap(),
                )
            },
            commands: vec![None; robots],
            tick: 0,
        }
    }

    /// Runs `ticks` ticks and returns their duration.
    pub fn time(&mut self, ticks: u64) -> Duration {
        let began = Instant::now();
        for _ in 0..ticks {
            self.step();
        }
        began.elapsed()
    }

    fn step(&mut self) {
        for (rank, command) in self.commands.iter_mut().enumerate() {
            black_box(self.world.readings(RobotId(rank as u16)));
            // The bodies turn at different times.
            let turns = (self.tick + 7 * rank as u64) % (STRAIGHT + TURN) >= STRAIGHT;
            *command = Some(Actuation {
                speed_m_s: if turns { 0.0 } else { 0.5 },
                turn_rad_s: if turns { 1.5 } else { 0.0 },
                ..Actuation::default()
            });
        }
        black_box(self.world.step(&self.commands));
        self.tick += 1;
    }
}

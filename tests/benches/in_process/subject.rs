//! A team that runs in one process, and its world alone.

use std::hint::black_box;
use std::time::{Duration, Instant};

use alliance_tests::runs;
use in_process::{BackgroundTeam, Team};
use missions::Registry;
use missions::waste::data::{WasteSection, family};
use proto::readings::Actuation;
use run_log::LogLevel;
use run_log::recorder::Folder;
use scenario::Setup;
use scenario::ids::RobotId;
use tempfile::TempDir;

/// The number of ticks before the measurement: by then every robot has work.
const BEGIN: u64 = 400;
/// The number of ticks after which a new mission begins: until then every robot has work.
const END: u64 = 3_000;

/// Returns the waste mission with a known border, so that all robots work from the start in a team of any size.
pub fn setup(robots: usize, allocator: &str) -> Setup {
    let mut scenario = family(robots, (2 * robots).div_ceil(3));
    WasteSection::of_mut(&mut scenario).border_known = true;
    scenario.allocator = Some(allocator.to_owned());
    runs::setup(scenario, 1)
}

pub struct Run {
    setup: Setup,
    level: LogLevel,
    threads: usize,
    team: BackgroundTeam<Folder>,
    folder: TempDir,
}

impl Run {
    /// Starts a run on this number of threads. With more than one, another thread writes a full log.
    pub fn new(setup: Setup, level: LogLevel, threads: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let sink = Folder::create(folder.path()).unwrap();
        let mut team = Team::new(setup.clone(), level, sink).unwrap();
        team.use_threads(threads).unwrap();
        let mut team = team.into_background(threads > 1).unwrap();
        for _ in 0..BEGIN {
            team.tick().unwrap();
        }
        Self {
            setup,
            level,
            threads,
            team,
            folder,
        }
    }

    /// Runs `ticks` ticks and returns their duration.
    pub fn time(&mut self, ticks: u64) -> Duration {
        let (mut left, mut spent) = (ticks, Duration::ZERO);
        while left > 0 {
            let here = (END - self.team.simulation().tick()).min(left);
            let began = Instant::now();
            for _ in 0..here {
                let outcome = self.team.tick().unwrap();
                assert_eq!(outcome, None, "the mission is too short to be measured");
            }
            spent += began.elapsed();
            left -= here;
            if left > 0 {
                *self = Self::new(self.setup.clone(), self.level, self.threads);
            }
        }
        black_box(self.folder.path());
        spent
    }
}

/// The number of ticks in which a body drives straight, and then turns: about the mixture of a working robot.
const STRAIGHT: u64 = 60;
const TURN: u64 = 20;

/// Sensor readings and motion without controllers.
pub struct World {
    world: world_server::world::World,
    commands: Vec<Option<Actuation>>,
    tick: u64,
}

impl World {
    pub fn new(robots: usize) -> Self {
        let setup = setup(robots, scenario::Scenario::DEFAULT_ALLOCATOR);
        let mission = Registry::current().worlds().find(&setup.scenario).unwrap();
        Self {
            world: world_server::world::World::new(&setup, mission),
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
            black_box(self.world.readings(RobotId(rank as u32)));
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

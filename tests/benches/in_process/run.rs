//! A team that runs in one process.

use missions::observe::data::{OBSERVE, ObserveSection};
use missions::push::data::PUSH;
use missions::service::data::SERVICE;
use missions::waste::data::{WasteSection, family};
use std::time::{Duration, Instant};

use in_process::Team;
use run_log::LogLevel;
use run_log::recorder::Folder;
use scenario::{Scenario, Setup};
use tempfile::TempDir;

/// The number of ticks before the measurement: by then every robot has work.
pub const BEGIN: u64 = 400;
/// The number of ticks after which a new mission begins: until then every robot has work.
const END: u64 = 3_000;

/// Returns the waste mission with a known border, so that all robots work from the start in a team of any size.
pub fn setup(robots: usize) -> Setup {
    with_allocator(robots, Scenario::DEFAULT_ALLOCATOR)
}

pub fn with_allocator(robots: usize, allocator: &str) -> Setup {
    let mut scenario = family(robots, (2 * robots).div_ceil(3));
    WasteSection::of_mut(&mut scenario).border_known = true;
    scenario.allocator = Some(allocator.to_owned());
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Returns a service mission with six points of work for each robot, more than a measurement needs.
pub fn service(robots: usize) -> Setup {
    let scenario = SERVICE.family(robots, 6 * robots).unwrap();
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Returns a push mission with one bar for two robots, more work than a measurement needs.
pub fn push(robots: usize) -> Setup {
    let scenario = PUSH.family(robots, robots / 2).unwrap();
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Returns an observe mission with as many moving targets as robots.
pub fn observe(robots: usize) -> Setup {
    let mut scenario = OBSERVE.family(robots, robots).unwrap();
    let section: &mut ObserveSection = scenario.mission.values_mut().unwrap();
    section.duration_s = scenario.limit_s;
    Setup::resolve(scenario, 1, None).unwrap().setup
}

pub struct Run {
    setup: Setup,
    level: LogLevel,
    mission: Mission,
}

struct Mission {
    team: Team<Folder>,
    _folder: TempDir,
}

impl Run {
    pub fn new(setup: Setup, level: LogLevel) -> Self {
        Self {
            mission: Mission::new(&setup, level),
            setup,
            level,
        }
    }

    /// Runs `ticks` ticks and returns their duration.
    pub fn time(&mut self, ticks: u64) -> Duration {
        let mut left = ticks;
        let mut spent = Duration::ZERO;
        while left > 0 {
            let here = (END - self.mission.team.simulation().tick()).min(left);
            let began = Instant::now();
            for _ in 0..here {
                let outcome = self.mission.team.tick().unwrap();
                assert_eq!(outcome, None, "the mission is too short to be measured");
            }
            spent += began.elapsed();
            left -= here;
            if left > 0 {
                self.mission = Mission::new(&self.setup, self.level);
            }
        }
        spent
    }
}

impl Mission {
    fn new(setup: &Setup, level: LogLevel) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let sink = Folder::create(folder.path()).unwrap();
        let mut team = Team::new(setup.clone(), level, sink).unwrap();
        for _ in 0..BEGIN {
            team.tick().unwrap();
        }
        Self {
            team,
            _folder: folder,
        }
    }
}

//! Random missions: room, team, tasks and faults, each a function of a seed.
//!
//! - [`room`]: obstacles with corridors between them. [`mod@team`]: robots. [`faults`]: a timeline with faults of every kind.
//!
//! The drawn values are written into a scenario, so that its run needs no further draws. To find the cause of a
//! failure, users can remove parts of that scenario.

pub mod faults;
pub mod room;
pub mod team;

use missions::Registry;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::limits::closed;
use scenario::mission::data::DrawSection;
use scenario::mission::registry::Mission;
use scenario::{Problem, Scenario, name_remedy};
use serde::{Deserialize, Serialize};

use faults::{RandomFaults, timeline};
use room::obstacles;
use team::team;

/// Maximum number of obstacles, faults and robots of a mission.
const MOST: u32 = 100;

/// Shortest and longest side of a room, m. Robots start side by side.
const LEAST_M: f32 = 6.0;
const MOST_M: f32 = 100.0;

/// The parts of a mission that are drawn; the rest comes from the scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomMission {
    /// The range of the room's width and height.
    pub room: Option<LengthRange>,
    /// The range of the number of obstacles; fewer if the room has no space.
    pub obstacles: Option<CountRange>,
    /// The range of the number of robots.
    pub robots: Option<CountRange>,
    /// Name of the mission whose tasks are drawn.
    pub mission: Option<String>,
    /// The range of the random faults.
    pub faults: Option<RandomFaults>,
}

/// A range of numbers with equal probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range<T> {
    pub min: T,
    pub max: T,
}

pub type CountRange = Range<u32>;

/// A range of lengths, m.
pub type LengthRange = Range<f32>;

/// The random streams. Each drawn part has its own stream, so that a change of one part does not shift the others.
#[derive(Clone, Copy)]
enum Stream {
    Robots = 1,
    Obstacles = 2,
    Faults = 3,
    Room = 4,
    Mission = 5,
}

/// Returns the draw function of a mission that this program contains.
fn draw_of(name: &str) -> Option<DrawSection> {
    let missions = Registry::current().vocabulary().missions;
    missions
        .iter()
        .find(|mission| mission.name() == name)?
        .random_section()
}

impl CountRange {
    fn draw(self, rng: &mut ChaCha8Rng) -> u32 {
        rng.random_range(self.min..=self.max)
    }
}

impl LengthRange {
    /// Draws a length, rounded to two decimals for readability.
    fn draw(self, rng: &mut ChaCha8Rng) -> f32 {
        (rng.random_range(self.min..=self.max) * 100.0).round() / 100.0
    }
}

impl RandomMission {
    /// Checks all ranges. The keys of problems are those below `[random_mission]`.
    ///
    /// # Errors
    /// Returns the first invalid value.
    pub fn check(&self) -> Result<(), Problem> {
        let faults = self.faults.as_ref().map(|faults| faults.between());
        let counts = [
            ("obstacles", self.obstacles, 0),
            ("robots", self.robots, 1),
            ("faults", faults, 0),
        ];
        for (key, between, least) in counts {
            let Some(CountRange { min, max }) = between else {
                continue;
            };
            if min < least || max < min || max > MOST {
                let what = format!("from {min} to {max} does not fit");
                let remedy = format!("write numbers from {least} to {MOST}, the lower one as min");
                return Err(Problem::at([key], what, remedy));
            }
        }
        if let Some(LengthRange { min, max }) = self.room
            && !(LEAST_M <= min && min <= max && max <= MOST_M)
        {
            let what = format!("from {min} to {max} m does not fit");
            let remedy =
                format!("write lengths from {LEAST_M} to {MOST_M} m, the lower one as min");
            return Err(Problem::at(["room"], what, remedy));
        }
        if let Some(name) = &self.mission
            && draw_of(name).is_none()
        {
            let missions = Registry::current().vocabulary().missions;
            let drawn = missions
                .iter()
                .filter(|mission| mission.random_section().is_some());
            let what = format!("mission '{name}' does not support random generation");
            let remedy = name_remedy(name, drawn.map(Mission::name));
            return Err(Problem::at(["mission"], what, remedy));
        }
        let until_s = self.faults.as_ref().map(|faults| faults.until_s);
        until_s.map_or(Ok(()), |until_s| {
            closed(1.0, 1e6, "s").check(["faults", "until_s"], until_s)
        })
    }

    /// Returns the scenario with the values that `seed` gives.
    #[must_use]
    pub fn draw(&self, mut scenario: Scenario, seed: u64) -> Scenario {
        let stream = |stream: Stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream as u64);
            rng
        };
        if let Some(sides) = self.room {
            let mut rng = stream(Stream::Room);
            scenario.room.width_m = sides.draw(&mut rng);
            scenario.room.height_m = sides.draw(&mut rng);
        }
        if let Some(between) = self.robots {
            let mut rng = stream(Stream::Robots);
            let count = between.draw(&mut rng);
            scenario.robots = team(count, self.faults.is_some(), &mut rng);
        }
        if let Some(draw) = self.mission.as_deref().and_then(draw_of) {
            draw(&mut scenario, &mut stream(Stream::Mission));
        }
        if let Some(between) = self.obstacles {
            let mut rng = stream(Stream::Obstacles);
            let count = between.draw(&mut rng);
            scenario.obstacles = obstacles(&scenario, count, &mut rng);
        }
        if let Some(faults) = &self.faults {
            let mut rng = stream(Stream::Faults);
            scenario.faults.timeline = timeline(faults, &scenario, &mut rng);
        }
        scenario
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use std::collections::BTreeSet;

    use scenario::Setup;
    use scenario::fault::Fault;

    use super::*;
    use crate::testkit;

    fn mission() -> RandomMission {
        RandomMission {
            room: Some(LengthRange {
                min: 6.0,
                max: 16.0,
            }),
            obstacles: Some(CountRange { min: 1, max: 8 }),
            robots: Some(CountRange { min: 1, max: 8 }),
            mission: None,
            faults: Some(RandomFaults {
                min: 0,
                max: 12,
                until_s: 240.0,
            }),
        }
    }

    #[test]
    fn every_seed_gives_a_mission_that_can_be_run_and_they_differ() {
        let mut counts: [BTreeSet<usize>; 3] = Default::default();
        let (mut kinds, mut sides) = (BTreeSet::new(), BTreeSet::new());
        for seed in 0..500 {
            let scenario = drawn(&mission(), seed);
            let missions = Registry::built_in();
            let world = missions.worlds().find(&scenario).unwrap();
            world.start_poses(&scenario).unwrap();
            for side_m in [scenario.room.width_m, scenario.room.height_m] {
                assert!((6.0..=16.0).contains(&side_m));
                sides.insert((100.0 * side_m) as u32);
            }
            let timeline = &scenario.faults.timeline;
            let lengths = [
                scenario.obstacles.len(),
                scenario.robots.len(),
                timeline.len(),
            ];
            for (counts, length) in counts.iter_mut().zip(lengths) {
                counts.insert(length);
            }
            kinds.extend(timeline.iter().map(|order| order.fault.name().to_owned()));
        }
        assert!(sides.len() > 500);
        let [obstacles, robots, faults] = counts;
        assert!(obstacles.contains(&8));
        assert_eq!(robots, (1..=8).collect());
        assert_eq!(faults, (0..=12).collect());
        // The clean-up has two faults of its own, and no skills.
        assert_eq!(kinds.len(), Fault::KINDS.len() + 1);
    }

    /// Draws a scenario that a repetition gives again, that resolves, and that survives the text form, because a failed
    /// run leaves it behind.
    fn drawn(mission: &RandomMission, seed: u64) -> Scenario {
        let scenario = mission.draw(default_scenario(), seed);
        assert_eq!(scenario, mission.draw(default_scenario(), seed));
        let read = testkit::scenario(&scenario.to_toml().unwrap());
        assert_eq!(read, scenario, "seed {seed}");
        Setup::resolve(scenario.clone(), seed, None).unwrap();
        scenario
    }

    /// Checks that all seeds give distinct scenarios, in each mission with a draw function.
    #[test]
    fn every_drawn_mission_can_be_run() {
        let missions = Registry::current().vocabulary().missions;
        let drawing = missions
            .iter()
            .filter(|mission| mission.random_section().is_some());
        let names: Vec<&str> = drawing.map(Mission::name).collect();
        assert!(names.contains(&"service"));
        for name in names {
            let random = RandomMission {
                mission: Some(name.to_owned()),
                ..mission()
            };
            let mut sections = BTreeSet::new();
            for seed in 0..200 {
                let scenario = drawn(&random, seed);
                assert_eq!(scenario.mission().name(), name);
                sections.insert(format!("{:?}", scenario.mission));
            }
            assert_eq!(sections.len(), 200, "{name}");
        }
    }

    #[test]
    fn a_drawn_part_does_not_shift_the_others() {
        let all = mission().draw(default_scenario(), 7);
        let alone = RandomMission {
            room: mission().room,
            obstacles: mission().obstacles,
            ..RandomMission::default()
        };
        let room = alone.draw(default_scenario(), 7);
        assert_eq!(room.obstacles, all.obstacles);
        assert_eq!(room.robots, default_scenario().robots);
        assert_ne!(all, mission().draw(default_scenario(), 8));
    }

    #[test]
    fn numbers_that_do_not_fit_are_named() {
        assert_eq!(mission().check(), Ok(()));
        let wrong = |text: &str| {
            let mission: RandomMission = toml::from_str(text).unwrap();
            let line = mission.check().unwrap_err().to_string();
            line.split(':').next().unwrap_or_default().to_owned()
        };
        for (text, key) in [
            ("robots = { min = 0, max = 3 }", "robots"),
            ("obstacles = { min = 4, max = 3 }", "obstacles"),
            ("obstacles = { min = 0, max = 101 }", "obstacles"),
            ("room = { min = 1.0, max = 9.0 }", "room"),
            ("room = { min = 9.0, max = nan }", "room"),
            (
                "faults = { min = 0, max = 1, until_s = 0.0 }",
                "faults.until_s",
            ),
            (
                "faults = { min = 0, max = 1, until_s = nan }",
                "faults.until_s",
            ),
            (
                "faults = { min = 0, max = 1, until_s = 1e9 }",
                "faults.until_s",
            ),
        ] {
            assert_eq!(wrong(text), key, "{text}");
        }
        for name in ["waste", "no-such"] {
            let mut mission = mission();
            mission.mission = Some(name.to_owned());
            let line = mission.check().unwrap_err().to_string();
            let what = format!("mission: mission '{name}' does not support random generation; ");
            assert!(
                line.starts_with(&what) && line.contains("service"),
                "{line}"
            );
        }
    }
}

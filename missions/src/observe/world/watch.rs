//! The observation of targets by robots, with its events and figures.

use prefetch::prefetch;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use serde::{Serialize, Serializer};
use world_server::mission::{FigureValue, StepEvents, TeamFigures};
use world_server::world::Floor;
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::targets::Targets;

#[derive(Clone, Debug)]
pub(super) struct Observation {
    /// The robots that have looked in this step so far, by rank. All false between steps.
    looks: Vec<bool>,
    looked: Vec<bool>,
    /// The robot of the lowest rank that saw the target, by target.
    seen_by: Vec<Option<RobotId>>,
    before: Vec<Option<RobotId>>,
    observers: Vec<u32>,
    observed: u32,
    pairs: u32,
    tally: Tally,
}

#[derive(Clone, Debug)]
struct Tally {
    steps: u64,
    observed: u64,
    /// The number of steps of robots with a body, and of those in which the robot saw no target.
    robot_steps: u64,
    blind: u64,
    targets: Vec<Times>,
}

#[derive(Clone, Debug, Default)]
struct Times {
    seen: u64,
    unseen: u64,
    longest_unseen: u64,
}

/// Serializes the state as a hash.
impl Serialize for Observation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fold = |hash, number: u32| xxh3_64_with_seed(&number.to_le_bytes(), hash);
        let seen_by = self.seen_by.iter();
        let seen_by = seen_by.map(|robot| robot.map_or(0, |robot| robot.0 + 1));
        let looked = self.looked.iter().map(|looked| u32::from(*looked));
        let hash = seen_by.chain(looked).fold(0, fold);
        (hash, self.observed, self.pairs).serialize(serializer)
    }
}

impl Observation {
    pub fn new(robots: usize, targets: usize) -> Self {
        Self {
            looks: vec![false; robots],
            looked: vec![false; robots],
            seen_by: vec![None; targets],
            before: vec![None; targets],
            observers: vec![0; targets],
            observed: 0,
            pairs: 0,
            tally: Tally {
                steps: 0,
                observed: 0,
                robot_steps: 0,
                blind: 0,
                targets: vec![Times::default(); targets],
            },
        }
    }

    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.looks);
        prefetch(&*self.looked);
        prefetch(&*self.seen_by);
        prefetch(&*self.before);
        prefetch(&*self.observers);
        prefetch(&*self.tally.targets);
    }

    pub fn look(&mut self, robot: RobotId) {
        self.looks[robot.index()] = true;
    }

    pub fn looked(&self) -> impl Iterator<Item = RobotId> {
        let looked = (0..).map(RobotId).zip(&self.looked);
        looked.filter_map(|(robot, looked)| looked.then_some(robot))
    }

    pub fn is_seen(&self, target: usize) -> bool {
        self.seen_by[target].is_some()
    }

    pub fn observers(&self) -> &[u32] {
        &self.observers
    }

    /// Determines the observed targets after all motion of a step, and records events.
    pub fn settle(&mut self, targets: &Targets, floor: &Floor, happened: &mut StepEvents) {
        std::mem::swap(&mut self.before, &mut self.seen_by);
        std::mem::swap(&mut self.looked, &mut self.looks);
        self.looks.fill(false);
        self.seen_by.fill(None);
        self.observers.fill(0);
        self.pairs = 0;
        for (robot, &looked) in (0..).map(RobotId).zip(&self.looked) {
            if !floor.is_present(robot) {
                continue;
            }
            let mut sees = 0;
            if looked {
                for (target, _) in targets.in_range(floor.pose(robot).position) {
                    self.seen_by[target].get_or_insert(robot);
                    self.observers[target] += 1;
                    sees += 1;
                }
            }
            self.pairs += sees;
            self.tally.robot_steps += 1;
            self.tally.blind += u64::from(sees == 0);
        }
        self.observed = self.seen_by.iter().flatten().count() as u32;
        self.tally.steps += 1;
        self.tally.observed += u64::from(self.observed);
        let per_target = self.tally.targets.iter_mut().zip(&self.seen_by);
        for (number, (times, seen_by)) in per_target.enumerate() {
            times.add(seen_by.is_some());
            let (kind, robot) = match (self.before[number], *seen_by) {
                (None, Some(robot)) => ("found", robot),
                (Some(robot), None) => ("lost", robot),
                _ => continue,
            };
            let at = targets.at(number);
            let event = happened.push_mission_event(kind, Some(robot));
            event.subject = format!("t{number}");
            event.detail = format!("at {:.3} {:.3}", at.x, at.y);
        }
    }

    pub fn write_row(&self, row: &mut Vec<FigureValue>) {
        row.extend([self.observed, self.pairs].map(FigureValue::from));
    }

    /// Writes A/n, H, the longest time without an observer of a target, and the share of robot time without a target
    /// in sight.
    pub fn write_figures(&self, step: SimTime, figures: &mut TeamFigures) {
        let tally = &self.tally;
        let share = |part: u64, of: u64| (of > 0).then(|| part as f64 / of as f64);
        let of_all = tally.steps * tally.targets.len() as u64;
        let unseen = tally.targets.iter().map(|times| times.longest_unseen);
        let mission = &mut figures.mission;
        mission.add("a", share(tally.observed, of_all));
        mission.add("h", self.entropy());
        mission.add("unseen.max_ms", unseen.max().map(|steps| steps * step.0));
        mission.add("blind_share", share(tally.blind, tally.robot_steps));
    }

    /// Returns the normalized entropy of the observed time over targets: 1 if it is spread evenly. `None` for a
    /// single target, or if no target was ever seen.
    fn entropy(&self) -> Option<f64> {
        let targets = &self.tally.targets;
        let seen = targets.iter().filter(|times| times.seen > 0);
        let parts = seen.map(|times| times.seen as f64 / self.tally.observed as f64);
        let entropy: f64 = parts.map(|part| -part * libm::log(part)).sum();
        let most = libm::log(targets.len() as f64);
        // A single observed target gives -0.
        (self.tally.observed > 0 && most > 0.0).then(|| (entropy / most).abs())
    }

    pub fn holds(&self) -> Result<(), String> {
        if self.looks.contains(&true) {
            return Err("a robot looks between steps".to_owned());
        }
        let observed = self.seen_by.iter().flatten().count() as u32;
        let observers = self.observers.iter().sum::<u32>();
        if observers != self.pairs {
            return Err(format!(
                "the observers of all targets sum up to {observers}, but there are {} pairs",
                self.pairs
            ));
        }
        if observed != self.observed || self.pairs < observed {
            return Err(format!(
                "{observed} targets are observed, in {} pairs, but the count is {}",
                self.pairs, self.observed
            ));
        }
        Ok(())
    }
}

impl Times {
    fn add(&mut self, is_seen: bool) {
        if is_seen {
            self.seen += 1;
            self.unseen = 0;
        } else {
            self.unseen += 1;
            self.longest_unseen = self.longest_unseen.max(self.unseen);
        }
    }
}

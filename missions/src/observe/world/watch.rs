//! Who sees which targets, and what is told of it.

use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;
use serde::{Serialize, Serializer};
use world_server::mission::{Happened, TeamFigures, Value};
use world_server::world::Floor;
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::targets::Targets;

/// Who has seen which targets in the last step.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// By rank: who has looked in this step so far; nobody between steps.
    looks: Vec<bool>,
    /// By rank: who had looked in the last step.
    looked: Vec<bool>,
    /// By target: the robot of the lowest rank that saw it.
    seen_by: Vec<Option<RobotId>>,
    /// The same of the step before.
    before: Vec<Option<RobotId>>,
    /// By target: how many robots saw it.
    observers: Vec<u32>,
    observed: u32,
    pairs: u32,
    tally: Tally,
}

/// What has been so far: no step to come depends on it.
#[derive(Clone, Debug)]
struct Tally {
    steps: u64,
    /// Sum over steps of the targets observed.
    observed: u64,
    /// Steps of robots with a body, and those of them in which a robot saw no target.
    robot_steps: u64,
    blind: u64,
    /// By target.
    targets: Vec<Times>,
}

/// Steps of a target.
#[derive(Clone, Debug, Default)]
struct Times {
    seen: u64,
    /// Since it was seen last.
    unseen: u64,
    longest_unseen: u64,
}

/// A hash tells the state apart.
impl Serialize for Watch {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fold = |hash, number: u32| xxh3_64_with_seed(&number.to_le_bytes(), hash);
        let seen_by = self.seen_by.iter();
        let seen_by = seen_by.map(|robot| robot.map_or(0, |robot| u32::from(robot.0) + 1));
        let looked = self.looked.iter().map(|looked| u32::from(*looked));
        let hash = seen_by.chain(looked).fold(0, fold);
        (hash, self.observed, self.pairs).serialize(serializer)
    }
}

impl Watch {
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

    /// A robot looks in this step.
    pub fn look(&mut self, robot: RobotId) {
        self.looks[robot.index()] = true;
    }

    /// Who had looked in the last step.
    pub fn looked(&self) -> impl Iterator<Item = RobotId> {
        let looked = (0..).map(RobotId).zip(&self.looked);
        looked.filter_map(|(robot, looked)| looked.then_some(robot))
    }

    /// Whether a target was seen in the last step.
    pub fn is_seen(&self, target: usize) -> bool {
        self.seen_by[target].is_some()
    }

    /// By target: how many robots saw it in the last step.
    pub fn observers(&self) -> &[u32] {
        &self.observers
    }

    /// All have moved: whoever looks sees what is in range.
    pub fn settle(&mut self, targets: &Targets, floor: &Floor, happened: &mut Happened) {
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
        let of_each = self.tally.targets.iter_mut().zip(&self.seen_by);
        for (number, (times, seen_by)) in of_each.enumerate() {
            times.add(seen_by.is_some());
            let (kind, robot) = match (self.before[number], *seen_by) {
                (None, Some(robot)) => ("found", robot),
                (Some(robot), None) => ("lost", robot),
                _ => continue,
            };
            let at = targets.at(number);
            let event = happened.tell(kind, Some(robot));
            event.subject = format!("t{number}");
            event.detail = format!("at {:.3} {:.3}", at.x, at.y);
        }
    }

    pub fn write_row(&self, row: &mut Vec<Value>) {
        row.extend([self.observed, self.pairs].map(Value::from));
    }

    /// A/n, H, the longest time that a target was seen by nobody, and the share of robots' time in which they saw no target.
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

    /// How evenly the time in which targets are seen is spread over them: its entropy, by the most that it can be. One target has
    /// none, and neither have those that were never seen.
    fn entropy(&self) -> Option<f64> {
        let targets = &self.tally.targets;
        let seen = targets.iter().filter(|times| times.seen > 0);
        let parts = seen.map(|times| times.seen as f64 / self.tally.observed as f64);
        let entropy: f64 = parts.map(|part| -part * libm::log(part)).sum();
        let most = libm::log(targets.len() as f64);
        (self.tally.observed > 0 && most > 0.0).then(|| entropy / most)
    }

    /// What must be so between steps.
    pub fn holds(&self) -> Result<(), String> {
        if self.looks.contains(&true) {
            return Err("somebody looks between steps".to_owned());
        }
        let observed = self.seen_by.iter().flatten().count() as u32;
        let observers = self.observers.iter().sum::<u32>();
        if observers != self.pairs {
            return Err(format!(
                "targets have {observers} observers, in {} pairs",
                self.pairs
            ));
        }
        if observed != self.observed || self.pairs < observed {
            return Err(format!(
                "{observed} targets are seen, in {} pairs, and {} are said to be",
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

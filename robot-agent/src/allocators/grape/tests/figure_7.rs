//! The published instances of figure 7 (docs/REPRODUCED.md), with the recorded partitions.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use proto::allocation::AllocationMessage;
use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{BehaviorId, RobotId, TaskId};

use super::super::partition::{Partition, Version};
use super::super::{Config, Grape, Utility};
use crate::allocator::{Allocator, Choice, Decision, Input};
use crate::fixtures;

/// The version of the recorded partition, newer than that of any robot.
const RECORDED: Version = Version {
    evolution: 1000,
    stamp: 0.5,
};

/// A published instance with the recorded allocation.
struct Instance {
    /// Place and demand of each task.
    tasks: Vec<([f64; 2], f64)>,
    /// Place and recorded task of each robot.
    robots: Vec<([f64; 2], usize)>,
}

impl Instance {
    fn read(text: &str) -> Self {
        let (mut tasks, mut robots) = (Vec::new(), Vec::new());
        for line in text.lines().skip(1) {
            let [kind, _, x_m, y_m, demand, task, _] = line.split(',').collect::<Vec<_>>()[..]
            else {
                panic!("{line}");
            };
            let at = [x_m, y_m].map(|text| text.parse().unwrap());
            match kind {
                "task" => tasks.push((at, demand.parse().unwrap())),
                _ => robots.push((at, task.parse::<usize>().unwrap() - 1)),
            }
        }
        Self { tasks, robots }
    }

    /// Returns the choices of a robot. The cost is the distance.
    fn choices(&self, robot: usize) -> Vec<Choice> {
        let [x_m, y_m] = self.robots[robot].0;
        let choice = |(task, (at, demand)): (u32, &([f64; 2], f64))| Choice {
            reward: *demand,
            max_robots: self.robots.len(),
            ..fixtures::choice(task, (x_m - at[0]).hypot(y_m - at[1]))
        };
        (0..).zip(&self.tasks).map(choice).collect()
    }

    fn partition(&self) -> Partition {
        let mut partition = Partition::default();
        for (robot, (_, task)) in (0..).zip(&self.robots) {
            let task = TaskId(*task as u32);
            partition.move_robot(RobotId(robot), Some(task), fixtures::STEP);
        }
        partition.version = RECORDED;
        partition
    }

    /// Runs a step in which a robot receives a partition. Returns its task and the version of its partition.
    fn step(&self, robot: usize, partition: &Partition) -> (Option<BehaviorId>, Version) {
        let (team, id) = (self.robots.len(), RobotId(robot as u32));
        let briefs = self.tasks.iter().map(|_| fixtures::brief(team, 1.0));
        let me = fixtures::self_state(id, team, briefs.collect());
        let sender = RobotId(((robot + 1) % team) as u32);
        let messages = (0..partition.parts()).map(|part| partition.message(part));
        let received: Vec<Arc<Broadcast>> = messages
            .zip(0..)
            .map(|(message, number)| {
                let body = BroadcastContent::Allocation(AllocationMessage::Partition(message));
                Arc::new(fixtures::broadcast(
                    sender,
                    (1, number),
                    fixtures::STEP,
                    body,
                ))
            })
            .collect();
        let choices = self.choices(robot);
        let input = Input {
            choices: &choices,
            received: &received,
            ..fixtures::input(fixtures::STEP, id)
        };
        let config = Config {
            utility: Utility::Published,
            ..Config::default()
        };
        let mut grape = Grape::new(&me, &config);
        let mut decision = Decision::default();
        grape.step(&input, &mut decision);
        (decision.active, grape.partition.version)
    }
}

/// Returns the folder with the published instances; `None` where it is missing.
fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/grape");
    if !folder.is_dir() {
        // The test harness captures the output of `eprintln!` in a passing test.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: there is no folder {}",
            folder.display()
        );
        return None;
    }
    Some(folder)
}

/// No robot leaves its recorded coalition. A robot that is moved to another one returns.
#[test]
fn grape_keeps_the_published_partition() {
    let Some(folder) = folder() else { return };
    for name in ["circle", "skew", "square"] {
        let text = fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
        let instance = Instance::read(&text);
        assert_eq!((instance.robots.len(), instance.tasks.len()), (320, 5));
        let partition = instance.partition();
        for (robot, (_, task)) in instance.robots.iter().enumerate() {
            let own = Some(BehaviorId(*task as u32));
            assert_eq!(
                instance.step(robot, &partition),
                (own, RECORDED),
                "{name}: {robot}"
            );

            let mut moved = partition.clone();
            let other = TaskId((*task as u32 + 1) % 5);
            moved.move_robot(RobotId(robot as u32), Some(other), fixtures::STEP);
            let (active, version) = instance.step(robot, &moved);
            assert_eq!((active, version.evolution), (own, RECORDED.evolution + 1));
        }
    }
}

//! The properties of GRAPE (docs/allocators/grape.md).

mod coalitions;
mod figure_7;

use proto::allocation::AllocationMessage;
use proto::allocation::grape::{CoalitionMember, CoalitionPartition as Message, MEMBERS_MAX};
use proto::codec::encoded_len;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::partition::{PartReceiver, Partition, Version};
use super::{Config, Grape, Utility};
use crate::allocators::team::{STEP, Situation, TAU, Team};
use crate::testkit;

const NEVER: SimTime = SimTime(1_000_000_000);

#[test]
fn grape_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Grape>(&Config::default());
    for utility in [Utility::Common, Utility::Published] {
        let refresh_s = 0.1;
        testkit::check_allocator::<Grape>(&Config { refresh_s, utility });
    }
}

fn random_team(seed: u64, refresh_s: f64) -> Team<Grape> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(1..7), chance.random_range(1..7));
    let mut situation = Situation::on_grid(&mut chance, robots, tasks);
    for task in &mut situation.tasks {
        task.max_robots = chance.random_range(1..=robots);
        task.priority = i32::from(chance.random_bool(0.1));
    }
    let mut team = Team::still(
        seed,
        NEVER,
        situation,
        Config {
            refresh_s,
            ..Config::default()
        },
    );
    if chance.random_bool(0.7) {
        team.connect_as_line(0.2);
    }
    team
}

/// Checks with independent arithmetic that no robot gains by a move.
#[track_caller]
fn check_stable(team: &Team<Grape>, seed: u64) {
    let active = team.active();
    for (robot, current) in active.iter().enumerate() {
        let worth = |task: usize| {
            let others =
                (0..active.len()).filter(|&other| other != robot && active[other] == Some(task));
            let members = 1 + others.count();
            let spec = &team.situation.tasks[task];
            let cost_s = team.situation.cost_s[robot][task].unwrap();
            let utility = spec.reward * libm::pow(0.98, cost_s);
            let worth = (spec.priority, utility / members as f64);
            (members <= spec.max_robots).then_some(worth)
        };
        let mine = current.map(|task| worth(task).expect("no coalition exceeds its limit"));
        for task in 0..team.situation.tasks.len() {
            assert!(
                worth(task) <= mine || worth(task).is_none(),
                "seed {seed}: {robot} {task}"
            );
        }
    }
}

/// The algorithm ends within n² decisions, each known to all robots after D rounds, in a Nash-stable partition. The
/// evolution number never falls.
#[test]
fn all_robots_agree_on_a_stable_partition() {
    for seed in 0..300 {
        let mut team = random_team(seed, [1e6, 0.05][seed as usize % 2]);
        let robots = team.robots.len();
        let rounds = (robots * robots + 1) * (team.diameter() + 1);
        let mut evolution = vec![0; robots];
        for _ in 0..rounds {
            team.step();
            for (rank, before) in evolution.iter_mut().enumerate() {
                let now = team.allocator(rank).partition.version.evolution;
                assert!(now >= *before);
                *before = now;
            }
        }
        check_stable(&team, seed);
        let tasks_of = |team: &Team<Grape>, rank| -> Vec<_> {
            let members = team
                .allocator(rank)
                .partition
                .message(0)
                .members
                .into_iter();
            members.map(|member| (member.robot, member.task)).collect()
        };
        let agreed = tasks_of(&team, 0);
        for _ in 0..10 {
            team.step();
            for rank in 0..robots {
                assert_eq!(tasks_of(&team, rank), agreed, "seed {seed}");
            }
        }
    }
}

#[test]
fn the_partition_is_stable_despite_message_loss() {
    for loss in [0.3, 0.6] {
        for seed in 0..80 {
            let mut team = random_team(seed, 0.05);
            team.loss = loss;
            team.run(600);
            check_stable(&team, seed);
        }
    }
}

/// A coalition loses a crashed robot τ after its last message, and no teammate adds it again.
#[test]
fn crashed_robots_are_removed() {
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let situation = Situation::on_grid(&mut chance, 3, 1);
    let mut team = Team::<Grape>::still(1, TAU, situation, Config::default());
    let mut last_message = [SimTime::ZERO; 3];
    for _ in 0..30 {
        let now = team.now();
        team.step();
        for broadcast in &team.in_flight {
            last_message[broadcast.sender.index()] = now;
        }
    }
    let holder = team.active().iter().position(Option::is_some).unwrap();
    team.kill(holder);
    while team.executors(0).is_empty() {
        team.step();
        assert!(team.now() < SimTime(50_000));
    }
    assert_eq!(team.now() - STEP, last_message[holder] + TAU);
    team.run(200);
    assert_eq!(team.executors(0).len(), 1);
}

/// Robots in between report the signs of life of a distant robot. No robot is removed, and the partition stays the
/// same.
#[test]
fn a_robot_that_moves_out_of_range_keeps_its_task() {
    for seed in 0..20 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let situation = Situation::on_grid(&mut chance, 4, 4);
        let mut team = Team::<Grape>::still(seed, TAU, situation, Config::default());
        team.run(60);
        team.connect_as_line(0.0);
        let versions = |team: &Team<Grape>| -> Vec<_> {
            let version = |rank| team.allocator(rank).partition.version;
            (0..4).map(version).collect()
        };
        let before = versions(&team);
        team.run(600);
        assert_eq!(versions(&team), before, "seed {seed}");
    }
}

#[test]
fn invalid_messages_are_ignored() {
    let known = Version {
        evolution: 3,
        stamp: 0.5,
    };
    let sound = Message {
        evolution: 4,
        stamp: 0.1,
        part: 0,
        parts: 1,
        members: vec![CoalitionMember {
            robot: RobotId(1),
            task: TaskId(0),
            seen: SimTime(0),
        }],
    };
    let take = |message: &Message| {
        let mut at = Partition::default();
        at.version = known;
        PartReceiver::default().receive(message, &mut at, (3, 2), SimTime(0))
    };
    assert!(take(&sound));
    let member = |robot, task| CoalitionMember {
        robot: RobotId(robot),
        task: TaskId(task),
        seen: SimTime(0),
    };
    let invalid: [fn(&mut Message); 8] = [
        |message| message.stamp = f64::NAN,
        |message| message.stamp = 1.0,
        |message| message.evolution = 2,
        |message| message.part = 1,
        |message| message.parts = 0,
        |message| message.parts = 2,
        |message| message.members[0].robot = RobotId(3),
        |message| message.members[0].task = TaskId(2),
    ];
    for change in invalid {
        let mut message = sound.clone();
        change(&mut message);
        assert!(!take(&message), "{message:?}");
    }
    let twice = Message {
        members: vec![member(1, 0), member(1, 1)],
        ..sound
    };
    assert!(!take(&twice));
}

/// A large team's partition is sent in parts of at most 1,200 bytes, which may arrive in any order and from any robots.
#[test]
fn parts_combine_to_the_whole_partition() {
    let mut partition = Partition::default();
    for robot in 0..1000 {
        let seen = SimTime(1 << 40);
        partition.move_robot(RobotId(60_000 + robot), Some(TaskId(60_000 + robot)), seen);
    }
    partition.count_decision(0.5);
    let mut inbox = PartReceiver::default();
    let mut whole = Partition::default();
    for part in (0..partition.parts()).rev() {
        let message = partition.message(part);
        assert!(message.members.len() <= MEMBERS_MAX);
        let length = encoded_len(&AllocationMessage::Partition(message.clone())).unwrap();
        assert!(length <= 1200, "{length}");
        let is_whole = inbox.receive(&message, &mut whole, (65_536, 65_536), SimTime(1 << 41));
        assert_eq!(is_whole, part == 0);
    }
    assert_eq!(whole, partition);
}

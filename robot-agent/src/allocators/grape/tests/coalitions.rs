//! Coalitions with slots for robots with different skills.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::TaskId;

use super::NEVER;
use crate::allocators::grape::{Config, Grape};
use crate::allocators::team::{Situation, Task, Team};

/// A group of tasks that robots join as a whole, with the skill that each of its slots needs; without skills, a task for
/// up to `max_robots` robots.
#[derive(Clone, Debug)]
struct Group {
    first: usize,
    skills: Vec<usize>,
    max_robots: usize,
    priority: i32,
    reward: f64,
}

/// A random team, the skills of its robots as bits, and its groups of tasks.
struct Instance {
    team: Team<Grape>,
    skills: Vec<u32>,
    groups: Vec<Group>,
    /// The cost of each group by robot, s.
    cost_s: Vec<Vec<f64>>,
}

fn random_instance(seed: u64, loss: f64) -> Instance {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let robots = chance.random_range(2..8);
    let skills: Vec<u32> = (0..robots).map(|_| chance.random_range(1..8)).collect();
    let (mut groups, mut tasks) = (Vec::new(), Vec::new());
    for _ in 0..chance.random_range(1..5) {
        let slots = if chance.random_bool(0.7) {
            chance.random_range(1..5)
        } else {
            0
        };
        let group = Group {
            first: tasks.len(),
            skills: (0..slots).map(|_| chance.random_range(0..3)).collect(),
            max_robots: if slots > 0 {
                1
            } else {
                chance.random_range(1..=robots)
            },
            priority: i32::from(chance.random_bool(0.1)),
            reward: f64::from(chance.random_range(1..4_u8)),
        };
        let coalition = (slots > 0).then_some(TaskId(tasks.len() as u32));
        tasks.extend((0..slots.max(1)).map(|_| Task {
            max_robots: group.max_robots,
            priority: group.priority,
            reward: group.reward,
            coalition,
            ..Task::default()
        }));
        groups.push(group);
    }
    let cost_s: Vec<Vec<f64>> = skills
        .iter()
        .map(|_| {
            groups
                .iter()
                .map(|_| f64::from(chance.random_range(0..200_u8)))
                .collect()
        })
        .collect();
    let row = |robot: usize| -> Vec<Option<f64>> {
        let of_group = groups
            .iter()
            .zip(&cost_s[robot])
            .flat_map(|(group, cost_s)| {
                let able = |skill: &usize| (skills[robot] & (1 << skill) != 0).then_some(*cost_s);
                match group.skills.is_empty() {
                    true => vec![Some(*cost_s)],
                    false => group.skills.iter().map(able).collect(),
                }
            });
        of_group.collect()
    };
    let rows: Vec<Vec<Option<f64>>> = (0..robots).map(row).collect();
    let situation = Situation::from_rows(tasks, rows);
    let refresh_s = if loss > 0.0 {
        0.05
    } else {
        [1e6, 0.05][seed as usize % 2]
    };
    let config = Config {
        refresh_s,
        ..Config::default()
    };
    let mut team = Team::still(seed, NEVER, situation, config);
    team.loss = loss;
    if chance.random_bool(0.5) {
        team.connect_as_line(0.2);
    }
    Instance {
        team,
        skills,
        groups,
        cost_s,
    }
}

/// Returns whether robots with these skills can fill slots that need one skill each, each robot one slot.
fn can_fill(skills: &[u32], slots: &[usize]) -> bool {
    let Some((first, rest)) = skills.split_first() else {
        return true;
    };
    (0..slots.len()).any(|slot| {
        let mut others = slots.to_vec();
        first & (1 << others.swap_remove(slot)) != 0 && can_fill(rest, &others)
    })
}

/// Checks with independent arithmetic that the robots of each coalition fill different slots, and that no robot gains by a
/// move: to a coalition of higher priority, then with fewer missing robots, then of higher utility.
#[track_caller]
fn check_stable(instance: &Instance, seed: u64) {
    let group_of = |task: usize| {
        instance
            .groups
            .iter()
            .rposition(|group| group.first <= task)
    };
    let active = instance.team.active();
    let group: Vec<Option<usize>> = active.iter().map(|task| task.and_then(group_of)).collect();
    for (robot, current) in group.iter().enumerate() {
        let worth = |number: usize| {
            let of_group = &instance.groups[number];
            let others =
                (0..group.len()).filter(|other| *other != robot && group[*other] == Some(number));
            let members: Vec<usize> = others.chain([robot]).collect();
            let utility = of_group.reward * libm::pow(0.98, instance.cost_s[robot][number]);
            if of_group.skills.is_empty() {
                let share = utility / members.len() as f64;
                return (members.len() <= of_group.max_robots).then_some((
                    of_group.priority,
                    0,
                    share,
                ));
            }
            let skills: Vec<u32> = members
                .iter()
                .map(|member| instance.skills[*member])
                .collect();
            let missing = of_group.skills.len().checked_sub(members.len())?;
            can_fill(&skills, &of_group.skills).then_some((
                of_group.priority,
                -(missing as i32),
                utility,
            ))
        };
        let mine = current.map(|number| worth(number).expect("each member has a slot"));
        for number in 0..instance.groups.len() {
            assert!(
                worth(number).is_none() || worth(number) <= mine,
                "seed {seed}: robot {robot} from {current:?} to {number}"
            );
        }
    }
    // Each member fills a slot of its own, for which it has the skill.
    for task in 0..instance.team.situation.tasks.len() {
        let group = &instance.groups[group_of(task).expect("the first group begins with task 0")];
        let holders = instance.team.executors(task);
        assert!(
            holders.len() <= group.max_robots,
            "seed {seed}: {holders:?} at task {task}"
        );
        if let Some(skill) = group.skills.get(task - group.first) {
            assert!(
                holders
                    .iter()
                    .all(|holder| instance.skills[*holder] & (1 << skill) != 0)
            );
        }
    }
}

/// The worth of a coalition is a product of a factor of the robot and a factor of the number of members, so that decisions
/// end in a stable partition (an exact potential).
#[test]
fn coalitions_with_slots_are_stable() {
    let mut complete = 0;
    for seed in 0..400 {
        let mut instance = random_instance(seed, 0.0);
        instance.team.run(1200);
        check_stable(&instance, seed);
        let versions = |team: &Team<Grape>| -> Vec<u64> {
            let ranks = 0..team.robots.len();
            ranks
                .map(|rank| team.allocator(rank).partition.version.evolution)
                .collect()
        };
        let before = versions(&instance.team);
        let active = instance.team.active();
        instance.team.run(20);
        assert_eq!(versions(&instance.team), before, "seed {seed}");
        assert_eq!(instance.team.active(), active, "seed {seed}");
        let is_complete = |group: &&Group| {
            let mut slots = group.first..group.first + group.skills.len();
            group.skills.len() > 1 && slots.all(|slot| active.contains(&Some(slot)))
        };
        complete += instance.groups.iter().filter(is_complete).count();
    }
    assert!(complete > 100, "{complete} complete coalitions");
}

#[test]
fn coalitions_with_slots_are_stable_despite_message_loss() {
    for seed in 0..60 {
        let mut instance = random_instance(seed, 0.4);
        instance.team.run(1500);
        check_stable(&instance, seed);
    }
}

/// Two robots with two places that each need both of them gather at one of them: a half-filled coalition attracts robots from
/// another half-filled one.
#[test]
fn robots_do_not_wait_at_two_half_filled_coalitions() {
    let task = |first: u32| Task {
        coalition: Some(TaskId(first)),
        ..Task::default()
    };
    let tasks = vec![task(0), task(0), task(2), task(2)];
    let rows = [[1.0, 1.0, 150.0, 150.0], [150.0, 150.0, 1.0, 1.0]];
    let rows = rows
        .iter()
        .map(|row| row.iter().copied().map(Some).collect());
    let situation = Situation::from_rows(tasks, rows.collect());
    let mut team = Team::<Grape>::still(1, NEVER, situation, Config::default());
    team.run(40);
    let groups: Vec<Option<usize>> = team
        .active()
        .iter()
        .map(|task| task.map(|task| task / 2))
        .collect();
    assert!(groups[0].is_some() && groups[0] == groups[1], "{groups:?}");
    assert_ne!(
        team.active()[0],
        team.active()[1],
        "each fills a slot of its own"
    );
}

//! The laws of DHBA (docs/allocators/dhba.md).

use proto::allocation::AllocationMessage;
use proto::allocation::ble::EligibleTask;
use proto::allocation::dhba::{MatrixPart, MatrixRow, ROW_ENTRIES_MAX, RowVersion};
use proto::codec::encoded_len;
use proto::tick::TaskOffer;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::assignment::Assignment;
use super::matrix::Matrix;
use super::{Config, Dhba};
use crate::allocator::{OwnBehavior, SelfState, TaskBrief};
use crate::allocators::oracle::plan::Plan;
use crate::allocators::team::{STEP, Situation, TAU, Team, allocator_messages};
use crate::{fixtures, testkit};

const NEVER: SimTime = SimTime(1_000_000_000);

#[test]
fn dhba_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Dhba>(&Config::default());
    testkit::check_allocator::<Dhba>(&Config { refresh_s: 0.1 });
}

fn utility(situation: &Situation, robot: usize, task: usize) -> f64 {
    let cost_s = situation.cost_s[robot][task].unwrap();
    situation.tasks[task].reward * libm::pow(0.98, cost_s)
}

/// Returns the largest sum of utilities of all assignments, by trying each.
fn best_sum(situation: &Situation, robot: usize, left: &mut [usize]) -> f64 {
    if robot == situation.cost_s.len() {
        return 0.0;
    }
    let mut best = best_sum(situation, robot + 1, left);
    for task in 0..left.len() {
        if left[task] > 0 {
            left[task] -= 1;
            let sum = utility(situation, robot, task) + best_sum(situation, robot + 1, left);
            left[task] += 1;
            best = best.max(sum);
        }
    }
    best
}

/// Checks that the robots' tasks are an assignment within the limits, with the largest sum of utilities.
#[track_caller]
fn check_optimal(team: &Team<Dhba>, context: &str) {
    let situation = &team.situation;
    let active = team.active();
    for (task, spec) in situation.tasks.iter().enumerate() {
        let executors = active.iter().filter(|own| **own == Some(task)).count();
        assert!(executors <= spec.max_robots, "{context}: {active:?}");
    }
    let worth = |(robot, task): (usize, &Option<usize>)| {
        task.map_or(0.0, |task| utility(situation, robot, task))
    };
    let sum: f64 = active.iter().enumerate().map(worth).sum();
    let mut left: Vec<usize> = situation.tasks.iter().map(|task| task.max_robots).collect();
    let best = best_sum(situation, 0, &mut left);
    assert!(
        (sum - best).abs() < 1e-5 * best,
        "{context}: {sum} instead of {best}"
    );
}

fn random_team(seed: u64) -> Team<Dhba> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(1..6), chance.random_range(1..7));
    let mut situation = Situation::on_grid(&mut chance, robots, tasks);
    for task in &mut situation.tasks {
        task.max_robots = chance.random_range(1..=2);
    }
    let mut team = Team::still(seed, NEVER, situation, Config::default());
    if chance.random_bool(0.7) {
        team.connect_as_line(0.2);
    }
    team
}

/// With a connected graph and without loss, the team has an optimal assignment after as many exchanges as the diameter
/// of the graph, and keeps it.
#[test]
fn the_assignment_is_optimal_after_as_many_exchanges_as_the_diameter() {
    for seed in 0..300 {
        let mut team = random_team(seed);
        let diameter = team.diameter();
        // The first step sends, and each further one is an exchange.
        team.run(1 + diameter as u64);
        check_optimal(&team, &format!("seed {seed}, diameter {diameter}"));
        let active = team.active();
        for _ in 0..60 {
            team.step();
            assert_eq!(team.active(), active, "seed {seed}");
        }
    }
}

/// One exchange less is not enough on a line: its ends do not have each other's rows.
#[test]
fn the_bound_on_exchanges_is_tight() {
    // Both ends want task 0. The robots between have nothing to do.
    let costs: [&[f64]; 4] = [&[1.0, 9.0], &[99.0, 99.0], &[99.0, 99.0], &[1.0, 99.0]];
    let mut team = Team::<Dhba>::still(0, NEVER, Situation::from_costs(&costs), Config::default());
    team.connect_as_line(0.0);
    team.run(3);
    assert_eq!(team.executors(0), [0, 3]);
    team.run(1);
    assert_eq!(team.executors(0), [3]);
    check_optimal(&team, "line of four");
}

#[test]
fn the_assignment_is_optimal_despite_loss() {
    for loss in [0.3, 0.6] {
        for seed in 0..60 {
            let mut team = random_team(seed);
            team.loss = loss;
            team.run(1_200);
            check_optimal(&team, &format!("seed {seed}, loss {loss}"));
        }
    }
}

/// Runs steps, and returns the time of the latest message of robot 0 in them.
fn last_message_of_the_first(team: &mut Team<Dhba>, steps: usize) -> SimTime {
    let mut last = SimTime::ZERO;
    for _ in 0..steps {
        let now = team.now();
        team.step();
        if team.in_flight.iter().any(|sent| sent.sender == RobotId(0)) {
            last = now;
        }
    }
    last
}

/// A crashed robot keeps its task until τ after its last message, also for robots that do not receive it directly.
#[test]
fn tasks_of_a_crashed_robot_return() {
    let costs: [&[f64]; 3] = [&[1.0], &[5.0], &[9.0]];
    let mut team = Team::<Dhba>::still(0, TAU, Situation::from_costs(&costs), Config::default());
    team.connect_as_line(0.0);
    let last = last_message_of_the_first(&mut team, 50);
    assert_eq!(team.executors(0), [0]);
    team.kill(0);
    while team.executors(0).is_empty() {
        team.step();
        assert!(team.now() < SimTime(20_000));
    }
    assert_eq!(
        (team.executors(0), team.now() - STEP),
        (vec![1], last + TAU)
    );
    team.restart(0);
    team.run(40);
    assert_eq!(team.executors(0), [0]);
}

/// Robots in between forward the signs of life of a distant robot.
#[test]
fn a_distant_robot_keeps_its_task() {
    // Without robot 0, the robot at the other end would be the best.
    let costs: [&[f64]; 4] = [&[1.0], &[60.0], &[60.0], &[5.0]];
    let mut team = Team::<Dhba>::still(0, TAU, Situation::from_costs(&costs), Config::default());
    team.connect_as_line(0.0);
    team.run(10);
    for _ in 0..600 {
        team.step();
        assert_eq!(team.executors(0), [0]);
    }
}

/// Near many teammates, a robot reports the versions of some rows in each period. All of them together report each row
/// often enough to repair lost rows and to find lost robots.
#[test]
fn crowded_robots_report_rows_in_turns() {
    const ROBOTS: usize = 24;
    let cost = |robot: usize, task: usize| 1.0 + ((7 * robot + 5 * task) % ROBOTS) as f64;
    let costs = (0..ROBOTS).map(|robot| (0..ROBOTS).map(|task| cost(robot, task)).collect());
    let costs: Vec<Vec<f64>> = costs.collect();
    let rows: Vec<&[f64]> = costs.iter().map(Vec::as_slice).collect();
    let mut team = Team::<Dhba>::still(0, TAU, Situation::from_costs(&rows), Config::default());
    let all_tasks = |team: &Team<Dhba>| {
        let mut tasks: Vec<usize> = team.active().into_iter().flatten().collect();
        tasks.sort_unstable();
        tasks
    };
    team.loss = 0.6;
    team.run(600);
    assert_eq!(all_tasks(&team), Vec::from_iter(0..ROBOTS));
    team.loss = 0.0;
    team.run(60);
    for _ in 0..5 {
        let mut reports = [0; ROBOTS];
        for _ in 0..20 {
            team.step();
            for (_, message) in allocator_messages(&team.in_flight) {
                let AllocationMessage::Dhba(MatrixPart { versions, .. }) = message else {
                    panic!("a message of DHBA");
                };
                for version in versions {
                    reports[version.robot.index()] += 1;
                }
            }
        }
        // 23 teammates are near, so that half of the robots report a row in a period.
        assert_eq!(reports, [12; ROBOTS]);
    }
    let last = last_message_of_the_first(&mut team, 20);
    let rows = |team: &Team<Dhba>| team.allocator(1).matrix.rows().count();
    team.kill(0);
    while rows(&team) == ROBOTS {
        team.step();
        assert!(team.now() < last + TAU + STEP + STEP);
    }
    assert_eq!(team.now() - STEP, last + TAU);
}

#[test]
fn a_lone_robot_does_everything() {
    let mut team = Team::<Dhba>::with_work(3, &[2, 3, 4, 1, 2], Config::default());
    team.links = vec![vec![false; 3]; 3];
    team.run(1_200);
    assert!(team.is_done());
}

/// A robot with an older row receives the newer one, and the robot that has it sends nothing else again.
#[test]
fn only_newer_rows_are_sent_again() {
    let mut team = Team::<Dhba>::still(
        0,
        NEVER,
        Situation::from_costs(&[&[1.0, 2.0], &[2.0, 1.0], &[3.0, 3.0]]),
        Config { refresh_s: 1e6 },
    );
    team.run(10);
    assert_eq!(allocator_messages(&team.in_flight).count(), 0);
    let version = |made| RowVersion {
        robot: RobotId(0),
        made,
        seen: team.now(),
    };
    let versions = vec![version(None)];
    let rows = Vec::new();
    team.inject(2, AllocationMessage::Dhba(MatrixPart { rows, versions }));
    team.step();
    let sent: Vec<_> = allocator_messages(&team.in_flight).collect();
    // Robot 1 has the row of robot 0. Robot 0 does not receive questions about its own row.
    assert_eq!(sent.len(), 1);
    let (sender, AllocationMessage::Dhba(part)) = sent[0] else {
        panic!("{sent:?}");
    };
    assert_eq!(
        (sender, part.rows.len(), part.versions.len()),
        (RobotId(1), 1, 0)
    );
}

#[test]
fn a_matrix_is_sent_in_parts_below_the_limit() {
    for latest in [250, 60_000, 4_000_000, u64::MAX] {
        check_parts(SimTime(latest));
    }
}

/// Sends a matrix of 200 rows in which all times are `latest`.
fn check_parts(latest: SimTime) {
    let mut matrix = Matrix::default();
    let entry = EligibleTask {
        task: TaskId(u32::MAX),
        round: latest,
        utility: f32::MAX,
    };
    for robot in 0..200 {
        let version = RowVersion {
            robot: RobotId(60_000 + robot),
            made: Some(latest),
            seen: latest,
        };
        let entries = vec![entry; robot as usize % (ROW_ENTRIES_MAX + 1)];
        matrix.receive_row(&version, entries.into_iter(), None, |_, _| true);
    }
    matrix.repeat(RobotId(60_000), 0);
    let (mut rows, mut versions) = (0, 0);
    while matrix.must_send() {
        let part = matrix.next_part(RobotId(60_000), latest);
        assert!(!part.rows.is_empty() || !part.versions.is_empty());
        (rows, versions) = (rows + part.rows.len(), versions + part.versions.len());
        let length = encoded_len(&AllocationMessage::Dhba(part)).unwrap();
        assert!(length <= 1200, "{length}");
    }
    assert_eq!((rows, versions), (200, 200));
}

/// Between two messages with versions, so many rows can be removed that none is left to send.
#[test]
fn versions_end_after_most_rows_are_removed() {
    let (me, early, late) = (RobotId(0), SimTime(50), SimTime(10_000));
    let mut matrix = Matrix::default();
    for robot in 0..200 {
        matrix.receive_version(&RowVersion {
            robot: RobotId(robot),
            made: None,
            seen: early,
        });
    }
    matrix.repeat(me, 0);
    assert!(matrix.next_part(me, early).versions.len() > 1);
    assert!(matrix.must_send());
    assert!(matrix.remove_silent(me, late, SimTime(5_000)));
    assert_eq!(matrix.rows().count(), 1);
    assert_eq!(matrix.next_part(me, late), MatrixPart::default());
    assert!(!matrix.must_send());
}

/// An older row and a version without a row change nothing.
#[test]
fn a_later_row_replaces_an_earlier_one() {
    let version = |made| RowVersion {
        robot: RobotId(1),
        made,
        seen: SimTime(50),
    };
    let row = |made, utility| MatrixRow {
        version: version(Some(SimTime(made))),
        entries: vec![EligibleTask {
            task: TaskId(0),
            round: SimTime::ZERO,
            utility,
        }],
    };
    let mut matrix = Matrix::default();
    assert!(matrix.receive_version(&version(None)));
    for (made, utility, is_newer) in [(0, 0.1, true), (20, 0.2, true), (10, 0.3, false)] {
        let MatrixRow { version, entries } = row(made, utility);
        let update = matrix.receive_row(&version, entries.into_iter(), None, |_, _| true);
        assert_eq!(update.has_changed, is_newer, "{made}");
    }
    let utilities: Vec<f32> = matrix
        .rows()
        .map(|(_, entries)| entries[0].utility)
        .collect();
    assert_eq!(utilities, [0.2]);
}

/// A damaged row has the version of the true one, or a later one. The next message of the robot itself replaces it, and
/// the robot makes its row anew when a teammate sends the damaged one.
#[test]
fn a_damaged_row_is_corrected() {
    let costs: [&[f64]; 3] = [&[1.0], &[5.0], &[9.0]];
    let rows = |team: &Team<Dhba>, rank: usize| -> Vec<Vec<EligibleTask>> {
        let rows = team.allocator(rank).matrix.rows();
        rows.map(|(_, entries)| entries.to_vec()).collect()
    };
    for (later_ms, links) in [(0, 2), (0, 3), (70, 2), (70, 3)] {
        let mut team =
            Team::<Dhba>::still(0, NEVER, Situation::from_costs(&costs), Config::default());
        if links == 2 {
            team.connect_as_line(0.0);
        }
        team.run(30);
        let before = rows(&team, 2);
        let made = team.allocator(1).matrix.made(RobotId(0));
        let version = RowVersion {
            robot: RobotId(0),
            made: made.map(|made| made + SimTime(later_ms)),
            seen: team.now(),
        };
        let entries = vec![EligibleTask {
            utility: 0.001,
            ..before[0][0]
        }];
        let damaged = MatrixRow { version, entries };
        let (rows_sent, versions) = (vec![damaged], Vec::new());
        let part = MatrixPart {
            rows: rows_sent,
            versions,
        };
        team.inject(0, AllocationMessage::Dhba(part));
        team.step();
        assert_ne!(rows(&team, 1), before, "the damage has an effect");
        team.run(30);
        for rank in 0..3 {
            assert_eq!(
                rows(&team, rank),
                before,
                "{later_ms} ms later, {links} links"
            );
        }
        assert_eq!(team.executors(0), [0]);
    }
}

/// Returns the assignment of the whole matrix, without the entries of older rounds.
fn whole_assignment(matrix: &Matrix, briefs: &[TaskBrief]) -> Vec<(RobotId, TaskId)> {
    let entries = || {
        let rows = matrix.rows();
        rows.flat_map(|(robot, entries)| entries.iter().map(move |entry| (robot, entry)))
    };
    let round = |task| {
        let of_task = entries().filter(|(_, entry)| entry.task == task);
        of_task.map(|(_, entry)| entry.round).max()
    };
    let current = entries().filter(|(_, entry)| Some(entry.round) == round(entry.task));
    let offers: Vec<TaskOffer> = current
        .map(|(robot, entry)| TaskOffer {
            robot,
            behavior: BehaviorId(0),
            task: entry.task,
            utility: f64::from(entry.utility),
        })
        .collect();
    let mut plan = Plan::default();
    plan.compute(&offers, briefs);
    let assigned = plan.assigned(&offers);
    assigned.map(|offer| (offer.robot, offer.task)).collect()
}

/// A robot solves only the problem of the robots that compete for its tasks. The result is that of the whole matrix, with
/// equal utilities, priorities, rounds and robots that come and go.
#[test]
fn the_assignment_of_a_group_is_that_of_the_whole() {
    const ROBOTS: u32 = 9;
    const TASKS: u32 = 12;
    let (mut smaller, mut skipped) = (0, 0);
    for seed in 0..300 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let briefs = (0..TASKS).map(|_| TaskBrief {
            max_robots: chance.random_range(1..=2),
            priority: chance.random_range(0..=i32::from(seed % 3 == 0)),
            ..fixtures::brief(ROBOTS as usize, 60.0)
        });
        let briefs: Vec<TaskBrief> = briefs.collect();
        let mut me = fixtures::self_state(RobotId(4), ROBOTS as usize, briefs.into());
        let is_own = |own: &OwnBehavior| (4..8).contains(&own.task.0);
        me.behaviors = me.behaviors.iter().copied().filter(is_own).collect();
        let SelfState { robot, briefs, .. } = &me;
        let (mut matrix, mut assignment) = (Matrix::default(), Assignment::new(&me));
        for tick in 1..60 {
            let now = SimTime(50 * tick);
            let sender = RobotId(chance.random_range(0..ROBOTS));
            let mut entries = Vec::new();
            // A robot has entries for the tasks near its number, so that there are several groups.
            for task in sender.0..(sender.0 + 4).min(TASKS) {
                if chance.random_bool(0.5) {
                    entries.push(EligibleTask {
                        task: TaskId(task),
                        round: SimTime(chance.random_range(0..=u64::from(seed % 2 == 0))),
                        utility: [0.25, 0.5, 0.7, 1.0][chance.random_range(0..4)],
                    });
                }
            }
            let version = RowVersion {
                robot: sender,
                made: Some(now),
                seen: now,
            };
            let concerns = |old: &[EligibleTask], new: &[EligibleTask]| {
                assignment.depends_on(old, new, briefs)
            };
            let update = matrix.receive_row(&version, entries.into_iter(), None, concerns);
            if matrix.remove_silent(*robot, now, SimTime(1_000)) || update.is_of_concern {
                assignment.update(&matrix, briefs);
            } else {
                skipped += 1;
            }
            let whole = whole_assignment(&matrix, briefs);
            let part = assignment.assigned();
            assert!(part.iter().all(|pair| whole.contains(pair)), "seed {seed}");
            let is_of_me = |pair: &&(RobotId, TaskId)| {
                pair.0 == *robot || me.behaviors.iter().any(|own| own.task == pair.1)
            };
            let of_me = |pairs: &[(RobotId, TaskId)]| -> Vec<(RobotId, TaskId)> {
                pairs.iter().filter(is_of_me).copied().collect()
            };
            assert_eq!(of_me(part), of_me(&whole), "seed {seed}, tick {tick}");
            smaller += u32::from(part.len() < whole.len());
        }
    }
    assert!(smaller > 1_000 && skipped > 500, "{smaller}, {skipped}");
}

//! Random teams for the tests of consensus, and the expected results, computed in other ways than by the rules.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use crate::allocator::Allocator;
use crate::allocators::team::{STEP, Situation, Team};

/// A τ after which no robot counts as lost within a test.
pub const NEVER: SimTime = SimTime(1_000_000_000);

/// A refresh in every round, s.
pub const REFRESH_S: f64 = STEP.0 as f64 / 1000.0;

impl Situation {
    /// Returns the time at which each unit of a path is done, s.
    pub fn times(&self, rank: usize, path: &[usize]) -> Vec<f64> {
        let path = path.iter().map(|&task| TaskId(task as u32));
        let path: Vec<TaskId> = path.collect();
        let mut time_s = 0.0;
        let units = path.iter().enumerate().map(|(place, &task)| {
            time_s += self.seconds(rank, &path[..place], task).unwrap();
            time_s
        });
        units.collect()
    }

    /// Computes S(p), without the bonus of a unit under way.
    pub fn score(&self, rank: usize, path: &[usize]) -> f64 {
        let times = self.times(rank, path).into_iter().zip(path);
        times.fold(0.0, |score, (time_s, &task)| {
            score + self.tasks[task].reward * libm::pow(0.98, time_s)
        })
    }

    /// Returns the number of robots that can work at the same time.
    pub fn places(&self) -> usize {
        self.tasks.iter().map(|task| task.max_robots).sum()
    }
}

/// Creates a random team, all in range or on a line, with priorities and shared tasks. `config` draws the parameters.
pub fn random_team<A: Allocator>(
    seed: u64,
    tau: SimTime,
    config: impl FnOnce(&mut ChaCha8Rng) -> A::Config,
) -> Team<A> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(1..7), chance.random_range(1..9));
    let mut situation = Situation::on_grid(&mut chance, robots, tasks);
    if chance.random_bool(0.3) {
        for task in &mut situation.tasks {
            task.priority = chance.random_range(0..2);
        }
    }
    if chance.random_bool(0.3) {
        for task in &mut situation.tasks {
            task.max_robots = chance.random_range(1..4);
        }
    }
    let config = config(&mut chance);
    let mut team = Team::still(seed, tau, situation, config);
    if chance.random_bool(0.7) {
        team.connect_as_line(if chance.random_bool(0.5) { 0.3 } else { 0.0 });
    }
    team
}

/// Lets message losses, cut links, crashes, restarts and new rounds occur in any order, and end. `check` is called after
/// each step.
pub fn go_through_trouble<A: Allocator>(team: &mut Team<A>, seed: u64, check: impl Fn(&Team<A>)) {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..10 {
        team.loss = [0.0, 0.3, 0.9][chance.random_range(0..3)];
        for link in team.links.iter_mut().flatten() {
            *link = chance.random_bool(0.7);
        }
        let robot = chance.random_range(0..team.robots.len());
        match chance.random_range(0..4) {
            0 => team.kill(robot),
            1 => team.restart(robot),
            2 => {
                let task = chance.random_range(0..team.situation.tasks.len());
                team.situation.tasks[task].round = team.now();
            }
            _ => {}
        }
        for _ in 0..chance.random_range(1..150) {
            team.step();
            check(team);
        }
    }
    team.loss = 0.0;
    for link in team.links.iter_mut().flatten() {
        *link = true;
    }
}

/// Returns the best sum of the values of all robots' paths, with at most `most` tasks each. Tries all ways to distribute
/// exclusive tasks, also without some of them if `may_omit`, and all orders of each share.
pub fn best_distribution(
    situation: &Situation,
    most: usize,
    may_omit: bool,
    value: impl Fn(usize, &[usize]) -> f64,
    better: fn(f64, f64) -> f64,
) -> f64 {
    let (robots, tasks) = (situation.cost_s.len(), situation.tasks.len());
    let count = robots + usize::from(may_omit);
    let values = (0..count.pow(tasks as u32)).filter_map(|mut code| {
        let mut shares = vec![Vec::new(); count];
        for task in 0..tasks {
            shares[code % count].push(task);
            code /= count;
        }
        let shares = &shares[..robots];
        let of_robot = |(rank, share): (usize, &Vec<usize>)| {
            best_order(&|path| value(rank, path), better, &mut Vec::new(), share)
        };
        let fits = shares.iter().all(|share| share.len() <= most);
        fits.then(|| shares.iter().enumerate().map(of_robot).sum::<f64>())
    });
    values.reduce(better).unwrap()
}

fn best_order(
    value: &dyn Fn(&[usize]) -> f64,
    better: fn(f64, f64) -> f64,
    path: &mut Vec<usize>,
    left: &[usize],
) -> f64 {
    let with_next = |&next: &usize| {
        let rest: Vec<usize> = left.iter().copied().filter(|task| *task != next).collect();
        path.push(next);
        let best = best_order(value, better, path, &rest);
        path.pop();
        best
    };
    left.iter()
        .map(with_next)
        .reduce(better)
        .unwrap_or_else(|| value(path))
}

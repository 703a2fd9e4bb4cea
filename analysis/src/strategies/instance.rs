//! Robots and tasks of the abstract study.

use std::collections::BTreeMap;
use std::fmt::Write;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::{LearnedTimes, LearnedTimesByTask, Profile};

use super::condition::{Condition, Rule, TrialFault};

/// The shortest and longest time of a task with spread 0, s.
const LEAST_S: f64 = 40.0;
const MOST_S: f64 = 160.0;

/// The limit of a run, s. It exceeds the longest optimum.
const LIMIT_S: u32 = 3600;

/// The longest valid step, ms.
const STEP_MS: u32 = 500;

/// The ALLIANCE settings. Robots step in order and receive the messages of robots that stepped before in the same tick, so two
/// robots never start the same task together. Idle and leaving robots report it, so all robots have current data on teammates
/// and free tasks.
const ACTIVATION: &str = "[alliance]\npreset = 'par98'\n[alliance.switches]\n\
    step_order = 'in-order'\nidle_heartbeat = true\nrelease_message = true\n";

/// A factor that compensates rounding, so that work ends in the planned number of steps.
const A_LITTLE_MORE: f64 = 1.0 + 1e-9;

/// The times and powers of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The working times by robot and task, whole s; `None` if the robot cannot do the task.
    pub times_s: Vec<Vec<Option<u32>>>,
    /// The power of each robot while it works, W.
    pub powers_w: Vec<f64>,
}

impl Instance {
    /// Draws an instance of a condition. The same seed gives the same tasks, robots and draws for every spread.
    #[must_use]
    pub fn draw(condition: &Condition, seed: u64) -> Self {
        let Condition {
            robots,
            tasks,
            coverage,
            spread,
            ..
        } = *condition;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(((robots << 16 | tasks) << 16 | coverage) as u64);
        let factor = |rng: &mut ChaCha8Rng| 1.0 + spread * rng.random::<f64>();
        let powers_w = (0..robots).map(|_| factor(&mut rng)).collect();
        let mut times_s = vec![Vec::with_capacity(tasks); robots];
        for _ in 0..tasks {
            let base_s = LEAST_S + (MOST_S - LEAST_S) * rng.random::<f64>();
            let factors: Vec<f64> = (0..robots).map(|_| factor(&mut rng)).collect();
            // The first `coverage` robots of a random order can do the task.
            let mut order: Vec<usize> = (0..robots).collect();
            for place in 0..coverage {
                let other = rng.random_range(place as u64..robots as u64);
                order.swap(place, other as usize);
            }
            for (robot, times_s) in times_s.iter_mut().enumerate() {
                let is_able = order[..coverage].contains(&robot);
                times_s.push(is_able.then(|| (base_s * factors[robot]).round() as u32));
            }
        }
        Self { times_s, powers_w }
    }

    /// Returns the mission as a scenario file. Each task is a kind of work with one point, and interrupted work is lost. Robots
    /// that can do no task are omitted.
    #[must_use]
    pub fn scenario(&self, rule: &Rule, fault: TrialFault) -> String {
        let mut text = format!(
            "step_ms = {STEP_MS}\nlimit_s = {LIMIT_S}\nallocator = 'l-alliance'\n{ACTIVATION}\
             [allocators.l-alliance]\n{}\n[service]\ntasks = 'kinds'\nreach_m = 1000\n",
            rule.lines()
        );
        for task in 0..self.tasks() {
            let work_s = self.fastest_s(task);
            let _ = write!(
                text,
                "[[service.kinds]]\nname = 't{task}'\nwork_s = {{ min = {work_s}, max = {work_s} }}\nkept = false\n\
                 [[service.points]]\nkind = 't{task}'\nx_m = {}\ny_m = 4\n",
                1 + task
            );
        }
        for (robot, times_s) in self.times_s.iter().enumerate() {
            let slower = match fault {
                TrialFault::Slow if robot == 0 => 3.0,
                _ => 1.0,
            };
            let skills: Vec<String> = (0..)
                .zip(times_s)
                .filter_map(|(task, time_s)| {
                    let skill = f64::from(self.fastest_s(task)) / f64::from((*time_s)?);
                    Some(format!("t{task} = {:?}", skill / slower * A_LITTLE_MORE))
                })
                .collect();
            if !skills.is_empty() {
                let skills = skills.join(", ");
                let _ = write!(
                    text,
                    "[[robots]]\nname = 'r{robot}'\nskills = {{ {skills} }}\n"
                );
            }
        }
        if fault == TrialFault::Crash {
            text += "[[faults.timeline]]\nfault.kill = 'r0'\nat_s = 60\n";
        }
        text
    }

    /// Returns the task times that all robots have beforehand.
    #[must_use]
    pub fn profile(&self) -> Profile {
        let times = |task: usize| {
            let able = (0..).zip(&self.times_s);
            let able = able.filter_map(move |(robot, times_s)| Some((robot, times_s[task]?)));
            able.map(|(robot, time_s): (usize, u32)| {
                let known = LearnedTimes {
                    trials: 1,
                    latest_s: vec![f64::from(time_s)],
                };
                (format!("r{robot}"), known)
            })
            .collect::<BTreeMap<_, _>>()
        };
        let known_to = |times_s: &Vec<Option<u32>>| -> LearnedTimesByTask {
            let able = (0..self.tasks()).filter(|&task| times_s[task].is_some());
            able.map(|task| (format!("serve(t{task})"), times(task)))
                .collect()
        };
        let robots = (0..).zip(&self.times_s);
        let robots =
            robots.map(|(robot, times_s): (usize, _)| (format!("r{robot}"), known_to(times_s)));
        Profile {
            robots: robots.filter(|(_, tasks)| !tasks.is_empty()).collect(),
        }
    }

    #[must_use]
    pub fn tasks(&self) -> usize {
        self.times_s.first().map_or(0, Vec::len)
    }

    fn fastest_s(&self, task: usize) -> u32 {
        let times_s = self.times_s.iter().filter_map(|times_s| times_s[task]);
        times_s.min().unwrap_or(1)
    }
}

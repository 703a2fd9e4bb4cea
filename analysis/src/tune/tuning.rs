//! The search, the selection among its best candidates, and the test.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::race::survivors;
use super::search::{Method, next_points};
use super::task::Task;
use crate::sweep::plan::space::values;
use crate::sweep::statistics;

/// The log ratio of a failed run: ten times the defaults' value.
const FAILED: f64 = std::f64::consts::LN_10;

/// A lower bound of all measured values, so that they have a logarithm.
const LEAST: f64 = 1e-6;

/// A run that the search requests.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    pub allocator: usize,
    /// The values of the allocator's parameters; `None` for its defaults.
    pub values: Option<Vec<f64>>,
    /// The index of the condition: a mission under a class of faults.
    pub condition: usize,
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The value of the optimized metric; `None` for a failed run.
    pub value: Option<f64>,
    /// The bytes that all robots sent.
    pub bytes: f64,
}

pub trait TrialExecutor {
    /// Executes all trials. Returns their outcomes in the same order.
    ///
    /// # Errors
    /// Returns an error if the trials cannot be executed, or after an interruption.
    fn run(&mut self, trials: &[Trial]) -> anyhow::Result<Vec<Outcome>>;

    fn report_progress(&mut self, line: &str);
}

#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    pub method: Method,
    pub generation: usize,
    /// Coordinates in the search space, each from 0 to 1.
    pub point: Vec<f64>,
    pub values: Vec<f64>,
    /// The number of runs of the method at the end of the generation.
    pub runs: usize,
    /// The number of runs of this candidate.
    pub own_runs: usize,
    /// True if the race dropped the candidate.
    pub dropped: bool,
    /// The mean logarithm of the ratio of its metric to that of the defaults in the same runs; negative is better.
    pub metric: f64,
    /// The same for the bytes sent.
    pub bytes: f64,
    /// The objective of the search: `metric` plus the weighted `bytes`.
    pub score: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Finalist {
    /// The index in [`Tuned::candidates`].
    pub candidate: usize,
    pub score: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    pub candidates: Vec<Candidate>,
    /// The finalists of each method, best first.
    pub finalists: [Vec<Finalist>; 2],
    /// The outcomes on the test seeds by condition and seed: of the defaults and of each method's best.
    pub test: [Vec<Vec<Outcome>>; 3],
}

/// The result of one method for one allocator. It depends on no other search, so that each can run on another machine.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodResult {
    candidates: Vec<Candidate>,
    finalists: Vec<Finalist>,
    /// The outcomes of the defaults on the test seeds, by condition and seed.
    test_of_defaults: Vec<Vec<Outcome>>,
    /// The outcomes of the best finalist on the test seeds.
    test_of_best: Vec<Vec<Outcome>>,
}

impl Tuned {
    /// Joins the results of the methods, in the order of [`Method::ALL`].
    #[must_use]
    pub fn join([first, mut second]: [MethodResult; 2]) -> Self {
        for finalist in &mut second.finalists {
            finalist.candidate += first.candidates.len();
        }
        let mut candidates = first.candidates;
        candidates.append(&mut second.candidates);
        Self {
            candidates,
            finalists: [first.finalists, second.finalists],
            test: [
                first.test_of_defaults,
                first.test_of_best,
                second.test_of_best,
            ],
        }
    }

    /// Returns the index of the method whose best candidate has the lower score on the selection seeds.
    #[must_use]
    pub fn chosen(&self) -> usize {
        usize::from(self.finalists[1][0].score < self.finalists[0][0].score)
    }

    #[must_use]
    pub fn best(&self, method: usize) -> &Candidate {
        &self.candidates[self.finalists[method][0].candidate]
    }
}

/// Returns the logarithms of the ratios of a run's metric and bytes to those of the defaults in the same run.
#[must_use]
pub fn ratios(task: &Task, found: Outcome, defaults: Outcome) -> (f64, f64) {
    let log = |value: f64, other: f64| libm::log(value.max(LEAST) / other.max(LEAST));
    let sign = task.metric.sign();
    match (found.value, defaults.value) {
        (Some(value), Some(other)) => (sign * log(value, other), log(found.bytes, defaults.bytes)),
        (None, Some(_)) => (FAILED, 0.0),
        (_, None) => (0.0, 0.0),
    }
}

/// Searches by one method for one allocator, selects among the best candidates, and tests the best one and the defaults.
///
/// # Errors
/// Returns an error if the runs cannot be executed, or after an interruption.
pub fn tune(
    task: &Task,
    allocator: usize,
    method: Method,
    runs: &mut impl TrialExecutor,
) -> anyhow::Result<MethodResult> {
    let mut tuner = Tuner {
        task,
        allocator,
        method,
        runs,
        defaults: BTreeMap::new(),
        candidates: Vec::new(),
    };
    tuner.search()?;
    let finalists = tuner.select()?;
    Ok(MethodResult {
        test_of_defaults: tuner.test(None)?,
        test_of_best: tuner.test(Some(finalists[0].candidate))?,
        candidates: tuner.candidates,
        finalists,
    })
}

struct Tuner<'t, R> {
    task: &'t Task,
    allocator: usize,
    method: Method,
    runs: &'t mut R,
    /// The outcomes of the allocator's defaults, by seed and condition.
    defaults: BTreeMap<(u64, usize), Outcome>,
    candidates: Vec<Candidate>,
}

#[derive(Default)]
struct Runner {
    values: Vec<f64>,
    /// The log ratios of metric and bytes, one per instance.
    ratios: Vec<(f64, f64)>,
    scores: Vec<f64>,
    rounds: usize,
}

impl Runner {
    fn score(&self) -> f64 {
        mean(self.scores.iter().copied())
    }
}

impl<R: TrialExecutor> Tuner<'_, R> {
    /// Searches until the budget is spent. The candidates of a generation share their seeds; the next generation has other seeds.
    fn search(&mut self) -> anyhow::Result<()> {
        let method = self.method;
        let tuning = &self.task.tuning;
        let parameters = &self.task.allocators[self.allocator].parameters;
        let training = &tuning.training.0;
        let rounds = tuning.seeds_per_candidate;
        let mut before: Vec<Vec<f64>> = Vec::new();
        let mut used = 0;
        while used < tuning.budget {
            let generation = before.len();
            let points = next_points(method, tuning.seed, parameters.len(), &before);
            let mut runners: Vec<Runner> = points
                .iter()
                .map(|point| Runner {
                    values: values(parameters, point),
                    ..Runner::default()
                })
                .collect();
            for round in 0..rounds {
                let seed = training[(generation * rounds + round) % training.len()];
                let alive = runners.iter_mut().filter(|runner| runner.rounds == round);
                let mut alive: Vec<&mut Runner> = alive.collect();
                let scores: Vec<&[f64]> = alive.iter().map(|runner| &runner.scores[..]).collect();
                let mut keep = survivors(&scores).into_iter();
                alive.retain(|_| keep.next().unwrap_or(true));
                used += self.round(&mut alive, seed)?;
            }
            before.push(in_order(&runners));
            for (point, runner) in points.into_iter().zip(runners) {
                self.candidates.push(Candidate {
                    method,
                    generation,
                    point,
                    runs: used,
                    own_runs: runner.scores.len(),
                    dropped: runner.rounds < rounds,
                    metric: mean(runner.ratios.iter().map(|ratio| ratio.0)),
                    bytes: mean(runner.ratios.iter().map(|ratio| ratio.1)),
                    score: runner.score(),
                    values: runner.values,
                });
            }
            let finished = self.finished();
            let best = finished.map(|place| self.candidates[place].score);
            let best = best.fold(f64::INFINITY, f64::min);
            let name = &self.task.allocators[self.allocator].name;
            self.runs.report_progress(&format!(
                "{name}, {}: generation {}, {used} of {} runs, best {:+.1} %",
                method.as_str(),
                generation + 1,
                tuning.budget,
                percent(best)
            ));
        }
        Ok(())
    }

    /// Returns the indices of the candidates that finished their race.
    fn finished(&self) -> impl Iterator<Item = usize> {
        let candidates = self.candidates.iter().enumerate();
        candidates
            .filter(|(_, candidate)| !candidate.dropped)
            .map(|(place, _)| place)
    }

    /// Runs all conditions of the search with one seed. Returns the number of runs without those of the defaults.
    fn round(&mut self, alive: &mut [&mut Runner], seed: i64) -> anyhow::Result<usize> {
        let conditions: Vec<usize> = self.task.seen().collect();
        let all: Vec<Vec<f64>> = alive.iter().map(|runner| runner.values.clone()).collect();
        let found = self.paired(&all, &conditions, &[seed])?;
        for (runner, ratios) in alive.iter_mut().zip(found) {
            runner.rounds += 1;
            let weight = self.task.tuning.bytes_weight;
            runner
                .scores
                .extend(ratios.iter().map(|ratio| ratio.0 + weight * ratio.1));
            runner.ratios.extend(ratios);
        }
        Ok(alive.len() * conditions.len())
    }

    /// Returns the log ratios to the defaults for each set of values, under these conditions and with these seeds.
    fn paired(
        &mut self,
        all: &[Vec<f64>],
        conditions: &[usize],
        seeds: &[i64],
    ) -> anyhow::Result<Vec<Vec<(f64, f64)>>> {
        let with_seed = |seed: &i64| {
            let seed = *seed as u64;
            conditions.iter().map(move |condition| (seed, *condition))
        };
        let instances: Vec<(u64, usize)> = seeds.iter().flat_map(with_seed).collect();
        let trial = |values: Option<&Vec<f64>>, (seed, condition): (u64, usize)| Trial {
            allocator: self.allocator,
            values: values.cloned(),
            condition,
            seed,
        };
        let mut new = instances.clone();
        new.retain(|instance| !self.defaults.contains_key(instance));
        let mut trials: Vec<Trial> = new.iter().map(|instance| trial(None, *instance)).collect();
        for values in all {
            let instances = instances.iter();
            trials.extend(instances.map(|instance| trial(Some(values), *instance)));
        }
        let outcomes = self.runs.run(&trials)?;
        let (of_defaults, of_values) = outcomes.split_at(new.len());
        self.defaults
            .extend(new.into_iter().zip(of_defaults.iter().copied()));
        let ratios = |(outcome, instance): (&Outcome, &(u64, usize))| {
            ratios(self.task, *outcome, self.defaults[instance])
        };
        let each = of_values.chunks(instances.len());
        let each = each.map(|outcomes| outcomes.iter().zip(&instances).map(ratios).collect());
        Ok(each.collect())
    }

    /// Returns the best candidates, in the order of their scores on the selection seeds.
    fn select(&mut self) -> anyhow::Result<Vec<Finalist>> {
        let tuning = &self.task.tuning;
        let mut places: Vec<usize> = self.finished().collect();
        let score = |place: &usize| self.candidates[*place].score;
        places.sort_by(|a, b| score(a).total_cmp(&score(b)));
        places.truncate(tuning.finalists);
        let all = places
            .iter()
            .map(|place| self.candidates[*place].values.clone());
        let all: Vec<Vec<f64>> = all.collect();
        let conditions: Vec<usize> = self.task.seen().collect();
        let found = self.paired(&all, &conditions, &tuning.selection.0)?;
        let weight = tuning.bytes_weight;
        let finalists = places.into_iter().zip(found);
        let finalists = finalists.map(|(candidate, ratios)| Finalist {
            candidate,
            score: mean(ratios.into_iter().map(|ratio| ratio.0 + weight * ratio.1)),
        });
        let mut finalists: Vec<Finalist> = finalists.collect();
        finalists.sort_by(|a, b| a.score.total_cmp(&b.score));
        Ok(finalists)
    }

    fn test(&mut self, candidate: Option<usize>) -> anyhow::Result<Vec<Vec<Outcome>>> {
        let seeds = &self.task.tuning.test.0;
        let values = candidate.map(|place| self.candidates[place].values.clone());
        let conditions = 0..self.task.conditions.len();
        let trials =
            conditions.flat_map(|condition| seeds.iter().map(move |seed| (condition, *seed)));
        let trials = trials.map(|(condition, seed)| Trial {
            allocator: self.allocator,
            values: values.clone(),
            condition,
            seed: seed as u64,
        });
        let trials: Vec<Trial> = trials.collect();
        let outcomes = self.runs.run(&trials)?;
        let by_condition = outcomes.chunks(seeds.len());
        Ok(by_condition.map(<[Outcome]>::to_vec).collect())
    }
}

/// Returns the rank of each candidate from 0, best first: more rounds are better, then a lower mean.
fn in_order(runners: &[Runner]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..runners.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&runners[*a], &runners[*b]);
        let by_rounds = b.rounds.cmp(&a.rounds);
        by_rounds.then(a.score().total_cmp(&b.score()))
    });
    let mut places = vec![0.0; runners.len()];
    for (place, runner) in order.into_iter().enumerate() {
        places[runner] = place as f64;
    }
    places
}

/// Returns the mean, or 0 without values.
#[must_use]
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    // The sum turns -0 into 0.
    statistics::mean(&values.collect::<Vec<_>>()).map_or(0.0, |mean| mean + 0.0)
}

/// Converts a mean logarithm of ratios to a change in percent.
#[must_use]
pub fn percent(log: f64) -> f64 {
    100.0 * (libm::exp(log) - 1.0)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use missions::waste::data::default_scenario;

    use super::*;
    use crate::sweep::Plan;

    const PLAN: &str = "
        [faults.none]
        [faults.dead]
        timeline = [{ fault.kill = 'gold' }]
        [faults.odd]
        timeline = [{ fault.mute = 'gold' }]
        [tune]
        budget = 300
        unseen = ['odd']
        training = { from = 101, to = 140 }
        selection = { from = 201, to = 205 }
        test = { from = 1, to = 6 }
        [tune.parameters.alliance]
        alliance.defaults.fast_impatience = { from = 1.0, to = 100.0, log = true }
        alliance.defaults.slow_impatience = { from = 0.01, to = 0.9, times = 'alliance.defaults.fast_impatience' }
    ";

    pub fn task() -> Task {
        let plan = Plan::parse("plan.toml", PLAN, |_| Ok(default_scenario())).unwrap();
        Task::of(plan).unwrap()
    }

    /// Runs that are a formula with the minimum at a fifth of 20; each seed adds a constant.
    #[derive(Default)]
    struct Formula {
        trials: Vec<Trial>,
    }

    impl TrialExecutor for Formula {
        fn run(&mut self, trials: &[Trial]) -> anyhow::Result<Vec<Outcome>> {
            self.trials.extend_from_slice(trials);
            let each = trials.iter().map(|trial| {
                let luck = (trial.seed * 7919 % 101) as f64;
                let off = match trial.values.as_deref() {
                    None => 1.0,
                    Some([fast, slow]) => {
                        let (a, b) = (libm::log(fast / 20.0), slow / fast - 0.2);
                        a * a + 4.0 * b * b
                    }
                    Some(other) => panic!("{other:?}"),
                };
                Outcome {
                    value: Some(200.0 + luck + 100.0 * off + 10.0 * trial.condition as f64),
                    bytes: 1000.0,
                }
            });
            Ok(each.collect())
        }

        fn report_progress(&mut self, _: &str) {}
    }

    #[test]
    fn the_search_keeps_its_budget_and_never_uses_test_seeds() {
        let task = task();
        let search = |method| {
            let mut runs = Formula::default();
            (tune(&task, 0, method, &mut runs).unwrap(), runs.trials)
        };
        for method in Method::ALL {
            let (found, trials) = search(method);
            let candidates = found.candidates.iter();
            let used: usize = candidates.clone().map(|candidate| candidate.own_runs).sum();
            assert_eq!(
                used,
                candidates.map(|candidate| candidate.runs).max().unwrap()
            );
            // The last generation completes: 6 candidates, 2 conditions and 4 seeds.
            assert!((300..300 + 48).contains(&used), "{used}");

            // Search, selection and test follow in this order, each with its seeds and conditions.
            let seeds = |from: u64, to: u64| {
                let matches = |trial: &Trial| (from..=to).contains(&trial.seed);
                let first = trials.iter().position(matches);
                (first.unwrap(), trials.iter().rposition(matches).unwrap())
            };
            let (search, selection, test) = (seeds(101, 140), seeds(201, 205), seeds(1, 6));
            assert!(search.1 < selection.0 && selection.1 < test.0);
            assert_eq!(test.1, trials.len() - 1);
            let unseen = |trials: &[Trial]| {
                let is_unseen = |trial: &&Trial| task.conditions[trial.condition].is_unseen;
                trials.iter().filter(is_unseen).count()
            };
            let (before, tests) = trials.split_at(test.0);
            assert_eq!((unseen(before), unseen(tests)), (0, 2 * 6));
            // Runs of the defaults are never repeated.
            let defaults = before.iter().filter(|trial| trial.values.is_none());
            let once = defaults.clone().map(|trial| (trial.seed, trial.condition));
            assert_eq!(once.collect::<BTreeSet<_>>().len(), defaults.count());
        }

        // The result does not depend on the order in which the methods run.
        let tuned = Tuned::join(Method::ALL.map(|method| search(method).0));
        let [first, second] = [Method::ALL[1], Method::ALL[0]].map(|method| search(method).0);
        assert_eq!(Tuned::join([second, first]), tuned);
        for (place, method) in Method::ALL.into_iter().enumerate() {
            let best = tuned.best(place);
            assert_eq!(best.method, method);
            assert!((15.0..27.0).contains(&best.values[0]), "{best:?}");
            assert!(best.score < -0.2, "{best:?}");
        }
        assert!(
            tuned.candidates.iter().any(|candidate| candidate.dropped),
            "no candidate was dropped"
        );
    }

    #[test]
    fn dropped_candidates_are_worse_than_the_others() {
        let runner = |rounds: usize, score: f64| Runner {
            scores: vec![score; rounds],
            rounds,
            ..Runner::default()
        };
        let all = [(4, 0.3), (2, -5.0), (4, 0.1), (3, 0.0)];
        let all = all.map(|(rounds, score)| runner(rounds, score));
        assert_eq!(in_order(&all), [1.0, 3.0, 0.0, 2.0]);
    }

    #[test]
    fn ratios_match_hand_calculation() {
        let task = task();
        let of = |value: Option<f64>, bytes: f64| Outcome { value, bytes };
        let found = ratios(&task, of(Some(50.0), 400.0), of(Some(100.0), 100.0));
        assert!((found.0 + std::f64::consts::LN_2).abs() < 1e-12);
        assert!((found.1 - 2.0 * std::f64::consts::LN_2).abs() < 1e-12);
        let failed = ratios(&task, of(None, 0.0), of(Some(1.0), 1.0));
        assert_eq!(failed, (FAILED, 0.0));
        assert!((percent(-std::f64::consts::LN_2) + 50.0).abs() < 1e-9);
    }
}

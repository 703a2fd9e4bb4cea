//! The selection of the next cases of a search: uniform or guided.
//!
//! The uniform search draws independent cases. The guided search starts with the same draws and then changes what it
//! has found:
//!
//! - A case is kept if its severity is among the highest, or if it has covered a new state. Fuzzing by coverage selects
//!   in the same way (Böhme, Pham and Roychoudhury, Coverage-Based Greybox Fuzzing as Markov Chain, CCS 2016: a case that
//!   was chosen often is chosen less).
//! - Most children are mutations and crossings of kept cases.
//! - Others take a step of an evolution strategy over the numbers of a schedule, with one self-adapted step size per case
//!   (Beyer and Schwefel, Evolution Strategies: A Comprehensive Introduction, Natural Computing 1, 2002).
//! - Some are independent draws, so that the search never stops exploring.

use std::collections::{BTreeMap, BTreeSet};

use libm::{cos, exp, log, sqrt};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::time::SimTime;

use super::case::{Case, Judgement};
use super::plan::{HuntPlan, Method};
use super::space::{Gene, Space, rounded};

/// The number of cases that are requested together. It does not depend on the number of concurrent runs, so a search
/// gives the same result on any machine.
pub const BATCH: usize = 16;

/// The largest number of kept cases.
const KEPT: usize = 64;
/// The number of kept cases with the highest severity that become parents by rank.
const ELITE: usize = 8;

/// Share of children that are independent draws.
const FRESH: f64 = 0.15;
/// Share of children that take a step of the evolution strategy.
const STEPS: f64 = 0.25;
/// Share of parents that are selected by severity; the others are selected by coverage.
const BY_SEVERITY: f64 = 0.5;

/// The first step size of the evolution strategy, as a share of a number's range.
const FIRST_STEP: f64 = 0.2;
/// The range of step sizes.
const STEP_RANGE: (f64, f64) = (0.005, 0.5);

/// A search for one allocator.
pub struct Search<'p> {
    space: Space<'p>,
    method: Method,
    seed: u64,
    generation: u32,
    measure: SeverityMeasure,
    kept: Vec<Kept>,
    states: BTreeSet<u32>,
    /// The step sizes of the cases that were requested last.
    steps: Vec<f64>,
}

/// A case that can become a parent.
struct Kept {
    case: Case,
    severity: f64,
    /// The number of states that the case was the first to cover.
    new_states: usize,
    /// The number of children.
    children: u32,
    step: f64,
}

/// The severity of a run: how far the faults have moved it from a run without faults.
#[derive(Clone, Debug)]
pub struct SeverityMeasure {
    pub limit: SimTime,
    pub abandoned: SimTime,
    /// The makespan without faults, by seed.
    pub base: BTreeMap<u64, SimTime>,
}

impl SeverityMeasure {
    /// Returns the PAR2 time as a multiple of the makespan without faults, plus the idle time as a multiple of the time
    /// from which a task is abandoned.
    #[must_use]
    pub fn severity(&self, case: &Case, judgement: &Judgement) -> f64 {
        let base = self.base.get(&case.seed).unwrap_or(&self.limit);
        let slowdown = judgement.par2(self.limit).as_secs_f64() / base.as_secs_f64().max(1.0);
        slowdown + judgement.idle_ms.as_secs_f64() / self.abandoned.as_secs_f64()
    }
}

impl<'p> Search<'p> {
    #[must_use]
    pub fn new(
        plan: &'p HuntPlan,
        allocator: usize,
        method: Method,
        measure: SeverityMeasure,
    ) -> Self {
        Self {
            space: Space::new(plan, allocator),
            method,
            seed: plan.seed,
            generation: 0,
            measure,
            kept: Vec::new(),
            states: BTreeSet::new(),
            steps: Vec::new(),
        }
    }

    /// Returns the number of states that all runs have covered.
    #[must_use]
    pub fn states(&self) -> usize {
        self.states.len()
    }

    /// Returns the next cases. Their judgements are expected by [`Self::tell`].
    pub fn ask(&mut self, count: usize) -> Vec<Case> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        // Both methods begin with the same draws, and all allocators have the same uniform draws.
        let is_changing = self.method == Method::Guided && self.generation > 0;
        rng.set_stream(u64::from(self.generation) + (u64::from(is_changing) << 32));
        self.generation += 1;
        self.steps.clear();
        let cases = (0..count).map(|_| {
            let (case, step) = match is_changing {
                true => self.child(&mut rng),
                false => (self.space.draw(&mut rng), FIRST_STEP),
            };
            self.steps.push(step);
            let base_ms = self.measure.base.get(&case.seed).copied();
            Case { base_ms, ..case }
        });
        cases.collect()
    }

    /// Records the judgements of the cases that [`Self::ask`] returned.
    pub fn tell(&mut self, cases: &[Case], judgements: &[Judgement]) {
        for ((case, judgement), &step) in cases.iter().zip(judgements).zip(&self.steps) {
            let before = self.states.len();
            self.states.extend(&judgement.states);
            if judgement.invalid.is_none() {
                self.kept.push(Kept {
                    case: case.clone(),
                    severity: self.measure.severity(case, judgement),
                    new_states: self.states.len() - before,
                    children: 0,
                    step,
                });
            }
        }
        // The sort is stable, so that the earlier of equal cases comes first.
        self.kept
            .sort_by(|one, other| other.severity.total_cmp(&one.severity));
        if self.kept.len() > KEPT {
            let mut others = self.kept.split_off(ELITE);
            others.sort_by(|one, other| other.interest().total_cmp(&one.interest()));
            others.truncate(KEPT - ELITE);
            others.sort_by(|one, other| other.severity.total_cmp(&one.severity));
            self.kept.extend(others);
        }
    }

    /// Returns a child of the kept cases with its step size.
    fn child(&mut self, rng: &mut ChaCha8Rng) -> (Case, f64) {
        let choice: f64 = rng.random_range(0.0..1.0);
        if self.kept.is_empty() || choice < FRESH {
            return (self.space.draw(rng), FIRST_STEP);
        }
        let parent = self.parent(rng);
        self.kept[parent].children += 1;
        let (case, step) = (&self.kept[parent].case, self.kept[parent].step);
        if choice < FRESH + STEPS {
            let genes = self.space.genes(&case.faults);
            if !genes.is_empty() {
                let (genes, step) = moved(genes, step, rng);
                return (self.space.with_genes(case, &genes), step);
            }
        }
        let other = rng.random_range(0..self.kept.len());
        (self.space.mutate(case, &self.kept[other].case, rng), step)
    }

    /// Selects a parent: by rank of severity, or the most interesting of three by its new states.
    fn parent(&self, rng: &mut ChaCha8Rng) -> usize {
        if rng.random_bool(BY_SEVERITY) {
            let share: f64 = rng.random_range(0.0..1.0);
            // The square prefers the first ranks.
            return (share * share * self.kept.len().min(ELITE) as f64) as usize;
        }
        let places = [0; 3].map(|_| rng.random_range(0..self.kept.len()));
        let interest = |place: &usize| self.kept[*place].interest();
        let best = places
            .into_iter()
            .max_by(|one, other| interest(one).total_cmp(&interest(other)));
        best.unwrap_or(0)
    }
}

impl Kept {
    fn interest(&self) -> f64 {
        self.new_states as f64 / f64::from(1 + self.children)
    }
}

/// Takes a step of the evolution strategy: changes the step size, then every number. A number whose range has no useful
/// size, such as a distance above 0, changes by a factor.
fn moved(mut genes: Vec<Gene>, step: f64, rng: &mut ChaCha8Rng) -> (Vec<Gene>, f64) {
    // The learning rate 1/√(2n) of Schwefel.
    let rate = 1.0 / sqrt(2.0 * genes.len() as f64);
    let step = (step * exp(rate * normal(rng))).clamp(STEP_RANGE.0, STEP_RANGE.1);
    for gene in &mut genes {
        let (from, to) = (gene.range.from, gene.range.to);
        let is_by_factor = from == 0.0 && gene.range.check((), 0.0).is_err();
        let moved = if is_by_factor {
            gene.value * exp(step * normal(rng))
        } else {
            gene.value + step * (to - from) * normal(rng)
        };
        gene.value = rounded(moved.clamp(from, to));
    }
    (genes, step)
}

/// Draws from the standard normal distribution (Box and Muller 1958). `libm` gives the same bits on every machine.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    sqrt(-2.0 * log(radius)) * cos(angle)
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use scenario::fault::Fault;

    use super::*;

    fn plan() -> HuntPlan {
        let text =
            "budget = { runs = 1 }\nseeds = 3\n[faults]\nmin = 1\nmax = 3\nuntil_s = 400.0\n";
        HuntPlan::parse("plan.toml", text, |_| Ok(default_scenario())).unwrap()
    }

    fn measure() -> SeverityMeasure {
        SeverityMeasure {
            limit: SimTime(1_000_000),
            abandoned: SimTime(100_000),
            base: BTreeMap::from([(1, SimTime(300_000)), (2, SimTime(400_000))]),
        }
    }

    /// A synthetic world: the run is slower the nearer a kill of gold is to 217 s, and broken within 1 s of it.
    fn closeness(case: &Case) -> f64 {
        let kills = case.faults.iter().filter_map(|order| match &order.fault {
            Fault::Kill(robot) if robot == "gold" => order.at_s,
            _ => None,
        });
        kills
            .map(|at_s| 1.0 / (1.0 + (at_s - 217.0).abs()))
            .fold(0.0, f64::max)
    }

    /// Returns the number of runs until a search finds the broken state of the synthetic world.
    fn runs_until_found(plan: &HuntPlan, method: Method) -> usize {
        let mut search = Search::new(plan, 0, method, measure());
        for batch in 0..500 {
            let cases = search.ask(BATCH);
            if let Some(place) = cases.iter().position(|case| closeness(case) > 0.5) {
                return BATCH * batch + place + 1;
            }
            let judgements: Vec<Judgement> = cases
                .iter()
                .map(|case| Judgement {
                    complete: true,
                    end_ms: SimTime(300_000 + (600_000.0 * closeness(case)) as u64),
                    ..Judgement::default()
                })
                .collect();
            search.tell(&cases, &judgements);
        }
        usize::MAX
    }

    #[test]
    fn the_guided_search_follows_the_severity() {
        let mut runs = Method::ALL.map(|method| {
            let all = (1..=9).map(|seed| runs_until_found(&HuntPlan { seed, ..plan() }, method));
            let mut all: Vec<usize> = all.collect();
            all.sort_unstable();
            all
        });
        let [uniform, guided] = &mut runs;
        assert!(2 * guided[4] < uniform[4], "{uniform:?} {guided:?}");
    }

    #[test]
    fn a_search_is_a_function_of_the_judgements() {
        let plan = plan();
        let run = |method| {
            let mut search = Search::new(&plan, 0, method, measure());
            let batches = (0..6).map(|batch| {
                let cases = search.ask(BATCH);
                let judgement = |place: usize| Judgement {
                    end_ms: SimTime(1000 * place as u64),
                    states: vec![batch * 100 + place as u32 % 5],
                    complete: !place.is_multiple_of(3),
                    ..Judgement::default()
                };
                let judgements: Vec<Judgement> = (0..cases.len()).map(judgement).collect();
                search.tell(&cases, &judgements);
                cases
            });
            batches.collect::<Vec<_>>()
        };
        for method in Method::ALL {
            assert_eq!(run(method), run(method));
        }
        let [uniform, guided] = Method::ALL.map(run);
        assert_eq!(uniform[0], guided[0]);
        assert_ne!(uniform[1], guided[1]);
    }

    #[test]
    fn steps_stay_in_the_ranges_and_the_step_size_changes() {
        let plan = plan();
        let space = Space::new(&plan, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut sizes = Vec::new();
        for _ in 0..300 {
            let case = space.draw(&mut rng);
            let genes = space.genes(&case.faults);
            if genes.is_empty() {
                continue;
            }
            let (genes, step) = moved(genes, FIRST_STEP, &mut rng);
            for gene in &genes {
                assert!(
                    (gene.range.from..=gene.range.to).contains(&gene.value),
                    "{gene:?}"
                );
            }
            sizes.push(step);
        }
        let less = sizes.iter().filter(|size| **size < FIRST_STEP).count();
        assert!(less > sizes.len() / 3 && less < 2 * sizes.len() / 3);
    }

    #[test]
    fn severity_grows_with_makespan_idle_time_and_failure() {
        let (plan, measure) = (plan(), measure());
        let case = Space::new(&plan, 0).case(1, Vec::new());
        let severity = |complete, end_s: u64, idle_s: u64| {
            let judgement = Judgement {
                complete,
                end_ms: SimTime(end_s * 1000),
                idle_ms: SimTime(idle_s * 1000),
                ..Judgement::default()
            };
            measure.severity(&case, &judgement)
        };
        assert!((severity(true, 300, 0) - 1.0).abs() < 1e-9);
        assert!(severity(true, 600, 0) < severity(true, 600, 50));
        assert!(severity(true, 1000, 0) < severity(false, 1000, 0));
    }
}

//! The space of fault schedules: random draws and changes.
//!
//! Targets, modes and ranges come from the declarations of the faults. The numbers of a schedule, its genes, are the
//! times and durations of its orders and the numeric arguments of its faults.

use std::sync::Arc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::fault::{Fault, FaultArgument, FaultRange, Order};
use scenario::limits::{NumberRange, closed};
use scenario::{Catalog, Scenario};

use super::case::Case;
use super::plan::{FaultBounds, HuntPlan};
use crate::random_mission::faults::{FaultSampler, sort};

/// The number of attempts to draw something that fits, before a change is given up.
const TRIES: usize = 200;

/// The longest duration of a fault that a change gives, s. It is that of random missions, doubled.
const LONGEST_S: f64 = 120.0;

/// The least duration of a fault, s.
const SHORTEST_S: f64 = 0.5;

/// The schedules of a plan for one allocator.
pub struct Space<'p> {
    scenario: Arc<Scenario>,
    catalog: Catalog,
    sampler: FaultSampler<'p>,
    bounds: &'p FaultBounds,
    seeds: &'p [u64],
}

/// A number of a schedule with its range.
#[derive(Clone, Debug, PartialEq)]
pub struct Gene {
    /// The place of the order in the schedule.
    pub order: usize,
    pub field: Field,
    pub value: f64,
    pub range: NumberRange,
}

/// The part of an order that contains a gene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    At,
    For,
    Every,
    Argument(FaultArgument),
}

impl<'p> Space<'p> {
    #[must_use]
    pub fn new(plan: &'p HuntPlan, allocator: usize) -> Self {
        let (_, scenario) = &plan.scenarios[allocator];
        let bounds = &plan.faults;
        Self {
            sampler: FaultSampler::new(scenario, bounds.until_s, |name| {
                bounds.names.contains(&name)
            }),
            catalog: Catalog::new(scenario),
            scenario: Arc::clone(scenario),
            bounds,
            seeds: &plan.seeds,
        }
    }

    /// Draws a case from the distribution of the control.
    #[must_use]
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> Case {
        let count = rng.random_range(self.bounds.min..=self.bounds.max);
        let mut faults: Vec<Order> = (0..count).filter_map(|_| self.order(rng)).collect();
        sort(&mut faults);
        self.case(self.seed(rng), faults)
    }

    /// Returns the case of a seed with these faults.
    #[must_use]
    pub fn case(&self, seed: u64, faults: Vec<Order>) -> Case {
        Case {
            scenario: Arc::clone(&self.scenario),
            seed,
            faults,
            base_ms: None,
        }
    }

    fn seed(&self, rng: &mut ChaCha8Rng) -> u64 {
        self.seeds[rng.random_range(0..self.seeds.len())]
    }

    /// Draws an order that fits the scenario. Returns `None` if that fails too often.
    fn order(&self, rng: &mut ChaCha8Rng) -> Option<Order> {
        (0..TRIES).find_map(|_| self.sampler.attempt(rng).filter(|order| self.fits(order)))
    }

    fn fits(&self, order: &Order) -> bool {
        order.check(&self.scenario, &self.catalog).is_ok() && self.sampler.fits(order)
    }

    /// Returns a changed copy of a case: one or more random changes of its faults or its seed. `other` supplies faults
    /// for crossings.
    #[must_use]
    pub fn mutate(&self, case: &Case, other: &Case, rng: &mut ChaCha8Rng) -> Case {
        let (mut seed, mut faults) = (case.seed, case.faults.clone());
        loop {
            match rng.random_range(0..9) {
                0 => self.add(&mut faults, rng),
                1 => remove(&mut faults, self.bounds.min, rng),
                2 => self.replace(&mut faults, rng),
                3 => self.change_fault(&mut faults, rng),
                4 => self.change_time(&mut faults, rng),
                5 => self.change_duration(&mut faults, rng),
                6 => self.gather(&mut faults, rng),
                7 => self.cross(&mut faults, other, rng),
                _ => seed = self.seed(rng),
            }
            // A geometric number of changes, two on average.
            if rng.random_bool(0.5) {
                break;
            }
        }
        sort(&mut faults);
        self.case(seed, faults)
    }

    fn add(&self, faults: &mut Vec<Order>, rng: &mut ChaCha8Rng) {
        if faults.len() < self.bounds.max {
            faults.extend(self.order(rng));
        }
    }

    fn replace(&self, faults: &mut [Order], rng: &mut ChaCha8Rng) {
        if let Some(order) = any(faults, rng)
            && let Some(new) = self.order(rng)
        {
            *order = new;
        }
    }

    /// Draws other targets and values for a fault of the same kind.
    fn change_fault(&self, faults: &mut [Order], rng: &mut ChaCha8Rng) {
        if let Some(order) = any(faults, rng)
            && let Some(fault) = self.sampler.redraw(&order.fault, rng)
        {
            let new = Order {
                fault,
                ..order.clone()
            };
            if self.fits(&new) {
                *order = new;
            }
        }
    }

    /// Draws another time. One in four is the start of the run, before the first messages.
    fn change_time(&self, faults: &mut [Order], rng: &mut ChaCha8Rng) {
        let at_s = rounded(rng.random_range(0.0..self.bounds.until_s));
        let at_s = if rng.random_bool(0.25) { 0.0 } else { at_s };
        if let Some(order) = any(faults, rng)
            && order.when.is_none()
        {
            order.at_s = Some(at_s);
        }
    }

    /// Draws another duration. One in three is without end.
    fn change_duration(&self, faults: &mut [Order], rng: &mut ChaCha8Rng) {
        let for_s = rounded(rng.random_range(SHORTEST_S..LONGEST_S));
        let is_endless = rng.random_bool(1.0 / 3.0);
        if let Some(order) = any(faults, rng)
            && !order.fault.is_instantaneous()
            && order.every_s.is_none()
        {
            order.for_s = (!is_endless).then_some(for_s);
        }
    }

    /// Lets two faults begin at the same time.
    fn gather(&self, faults: &mut [Order], rng: &mut ChaCha8Rng) {
        if faults.len() < 2 {
            return;
        }
        let [one, other] = [0; 2].map(|_| rng.random_range(0..faults.len()));
        if let Some(at_s) = faults[one].at_s
            && faults[other].when.is_none()
        {
            faults[other].at_s = Some(at_s);
        }
    }

    /// Replaces the second part of the faults by that of another schedule.
    fn cross(&self, faults: &mut Vec<Order>, other: &Case, rng: &mut ChaCha8Rng) {
        faults.truncate(rng.random_range(0..=faults.len()));
        let from = rng.random_range(0..=other.faults.len());
        faults.extend(other.faults[from..].iter().cloned());
        faults.truncate(self.bounds.max);
        while faults.len() < self.bounds.min {
            match self.order(rng) {
                Some(order) => faults.push(order),
                None => return,
            }
        }
    }

    /// Returns the numbers of a schedule that an evolution strategy can change.
    #[must_use]
    pub fn genes(&self, faults: &[Order]) -> Vec<Gene> {
        let each = faults.iter().enumerate();
        each.flat_map(|(place, order)| genes(place, order, &self.scenario, self.bounds.until_s))
            .collect()
    }

    /// Returns a case with other numbers, in the order of [`Self::genes`]. Numbers that do not fit are left out.
    #[must_use]
    pub fn with_genes(&self, case: &Case, genes: &[Gene]) -> Case {
        let mut faults = case.faults.clone();
        for gene in genes {
            if let Some(order) = with_value(&faults[gene.order], gene.field, gene.value)
                && self.fits(&order)
            {
                faults[gene.order] = order;
            }
        }
        sort(&mut faults);
        self.case(case.seed, faults)
    }
}

fn any<'f>(faults: &'f mut [Order], rng: &mut ChaCha8Rng) -> Option<&'f mut Order> {
    if faults.is_empty() {
        return None;
    }
    let place = rng.random_range(0..faults.len());
    faults.get_mut(place)
}

fn remove(faults: &mut Vec<Order>, min: usize, rng: &mut ChaCha8Rng) {
    if faults.len() > min {
        faults.remove(rng.random_range(0..faults.len()));
    }
}

/// Rounds to two decimals for readability.
#[must_use]
pub fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

/// Returns the numbers of an order with their ranges.
#[must_use]
pub fn genes(place: usize, order: &Order, scenario: &Scenario, until_s: f64) -> Vec<Gene> {
    let times = [
        (Field::At, order.at_s, closed(0.0, until_s, "s")),
        (Field::For, order.for_s, closed(SHORTEST_S, LONGEST_S, "s")),
        (
            Field::Every,
            order.every_s,
            closed(2.0 * LONGEST_S / 10.0, LONGEST_S, "s"),
        ),
    ];
    let times = times
        .into_iter()
        .filter_map(|(field, value, range)| Some((field, value?, range)));
    let values = order.fault.values();
    let arguments = arguments(&order.fault, scenario).into_iter();
    let numbers = arguments.filter_map(|argument| {
        let value = number(values.get(argument.key)?)?;
        let range = search_range(&argument, scenario)?;
        Some((Field::Argument(argument), value, range))
    });
    times
        .chain(numbers)
        .map(|(field, value, range)| Gene {
            order: place,
            field,
            value,
            range,
        })
        .collect()
}

/// Returns the declared arguments of a fault.
#[must_use]
pub fn arguments(fault: &Fault, scenario: &Scenario) -> Vec<FaultArgument> {
    match fault.kind() {
        Some(kind) => kind.spec.arguments.to_vec(),
        None => {
            let mut specs = scenario.mission().vocabulary().faults.iter();
            let spec = specs.find(|spec| spec.name == fault.name());
            spec.map_or_else(Vec::new, |spec| spec.arguments.to_vec())
        }
    }
}

/// Returns the declared range of a numeric argument. Times are limited to the longest duration. Whole numbers are left to
/// the other changes.
fn search_range(argument: &FaultArgument, scenario: &Scenario) -> Option<NumberRange> {
    let range = argument.numbers(scenario.room)?;
    match argument.range {
        FaultRange::Time => Some(closed(0.0, LONGEST_S, "s")),
        _ if range.is_whole => None,
        _ => Some(range),
    }
}

/// Returns a number of a TOML value.
#[must_use]
pub fn number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(number) => Some(*number),
        toml::Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

/// Returns the order with another number. Returns `None` if the fault does not accept it.
#[must_use]
pub fn with_value(order: &Order, field: Field, value: f64) -> Option<Order> {
    let mut order = order.clone();
    match field {
        Field::At => order.at_s = Some(value),
        Field::For => order.for_s = Some(value),
        Field::Every => order.every_s = Some(value),
        Field::Argument(argument) => {
            order.fault = with_argument(&order.fault, argument.key, value.into())?;
        }
    }
    Some(order)
}

/// Returns the fault with another value of an argument. Returns `None` if it does not accept it.
#[must_use]
pub fn with_argument(fault: &Fault, key: &str, value: toml::Value) -> Option<Fault> {
    let mut values = fault.values();
    values.insert(key.to_owned(), value);
    Fault::from_values(fault.name(), values).ok()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use missions::waste::data::default_scenario;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;

    fn plan(text: &str) -> HuntPlan {
        let text = format!("budget = {{ runs = 1 }}\n{text}");
        HuntPlan::parse("plan.toml", &text, |_| Ok(default_scenario())).unwrap()
    }

    #[test]
    fn draws_and_changes_reach_every_fault_and_always_give_a_valid_case() {
        let plan = plan("seeds = 3\n[faults]\nmin = 2\nmax = 5\nuntil_s = 100.0\n");
        let space = Space::new(&plan, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut kinds = BTreeSet::new();
        let mut case = space.draw(&mut rng);
        for _ in 0..3000 {
            let other = space.draw(&mut rng);
            case = space.mutate(&case, &other, &mut rng);
            assert!((2..=5).contains(&case.faults.len()), "{case:?}");
            assert!((1..=3).contains(&case.seed));
            for order in &case.faults {
                assert!(space.fits(order), "{order:?}");
                assert!(
                    order.at_s.is_none_or(|at_s| (0.0..=100.0).contains(&at_s)),
                    "{order:?}"
                );
            }
            kinds.extend(
                case.faults
                    .iter()
                    .map(|order| order.fault.name().to_owned()),
            );
            case.setup().unwrap();
        }
        // This mission has no skills, and no robot is absent.
        let expected: BTreeSet<String> = plan
            .faults
            .names
            .iter()
            .map(|name| (*name).to_owned())
            .collect();
        let missing: Vec<&String> = expected.difference(&kinds).collect();
        assert_eq!(missing, ["add", "skill"]);
    }

    #[test]
    fn only_the_stated_faults_are_drawn() {
        let plan = plan("[faults]\nonly = [\"kill\", \"waste\", \"drop\"]\nwithout = [\"drop\"]\n");
        let space = Space::new(&plan, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut kinds = BTreeSet::new();
        for _ in 0..200 {
            let case = space.draw(&mut rng);
            let case = space.mutate(&case, &space.draw(&mut rng), &mut rng);
            kinds.extend(
                case.faults
                    .iter()
                    .map(|order| order.fault.name().to_owned()),
            );
        }
        assert_eq!(Vec::from_iter(kinds), ["kill", "waste"]);
    }

    #[test]
    fn genes_are_read_and_written_back() {
        let plan = plan("[faults]\nmax = 6\n");
        let space = Space::new(&plan, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut arguments = BTreeSet::new();
        for _ in 0..500 {
            let case = space.draw(&mut rng);
            let genes = space.genes(&case.faults);
            assert_eq!(space.with_genes(&case, &genes), case);
            for gene in &genes {
                if let Field::Argument(argument) = gene.field {
                    arguments.insert(argument.key);
                }
            }
        }
        for key in ["p", "burst_s", "delay_s", "range_m", "x_m"] {
            assert!(arguments.contains(key), "{arguments:?}");
        }
    }
}

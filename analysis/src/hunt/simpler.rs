//! Simpler values of a fault order: shorter durations, earlier times, smaller shares and rounder numbers.
//!
//! Each value has a complexity: the default comes first, then numbers with few digits, then smaller ones. All variants
//! have a lower complexity than the order, so that shrinking ends.

use libm::{floor, log10};
use scenario::Scenario;
use scenario::fault::{FaultArgument, FaultRange, Order};

use super::space::{Field, arguments, number, with_argument, with_value};

/// The largest number of digits of a drawn number. Some faults store numbers of single precision, which has seven digits.
const DIGITS: i32 = 6;

/// The least power of ten of times and durations, s.
const TIMES: i32 = 0;
/// The least power of ten of other numbers.
const SHARES: i32 = -1;
/// The greatest power of ten.
const GREATEST: i32 = 4;

/// The longest duration that an endless fault becomes, s.
const FINITE_S: f64 = 1000.0;

/// Returns groups of simpler orders, each with the simplest variant first. A group concerns one value: the duration, the
/// repetition, the time, and each argument.
#[must_use]
pub fn groups(order: &Order, scenario: &Scenario) -> Vec<Vec<Order>> {
    let mut all = vec![durations(order), repetitions(order), times(order)];
    let arguments = arguments(&order.fault, scenario);
    all.extend(arguments.iter().map(|argument| values(order, argument)));
    for group in &mut all {
        // Two numbers may be the same in the precision of the fault.
        group.retain(|variant| variant != order);
        group.dedup();
    }
    all.retain(|group| !group.is_empty());
    all
}

fn durations(order: &Order) -> Vec<Order> {
    if order.fault.is_instantaneous() || order.every_s.is_some() {
        return Vec::new();
    }
    let shorter = match order.for_s {
        Some(for_s) => smaller(for_s, TIMES).chain(rounder(for_s)).collect(),
        None => smaller(FINITE_S, TIMES).collect::<Vec<f64>>(),
    };
    let shorter = shorter.into_iter().filter(|for_s| *for_s > 0.0);
    shorter
        .filter_map(|for_s| with_value(order, Field::For, for_s))
        .collect()
}

fn repetitions(order: &Order) -> Vec<Order> {
    let once = order.every_s.map(|_| Order {
        every_s: None,
        ..order.clone()
    });
    once.into_iter().collect()
}

fn times(order: &Order) -> Vec<Order> {
    let Some(at_s) = order.at_s else {
        return Vec::new();
    };
    let zero = (at_s > 0.0).then_some(0.0).into_iter();
    let earlier = zero.chain(smaller(at_s, TIMES)).chain(rounder(at_s));
    earlier
        .filter_map(|at_s| with_value(order, Field::At, at_s))
        .collect()
}

/// Returns the orders with simpler values of an argument.
fn values(order: &Order, argument: &FaultArgument) -> Vec<Order> {
    let values = order.fault.values();
    let Some(value) = values.get(argument.key) else {
        return Vec::new();
    };
    let simpler: Vec<toml::Value> = match (argument.range, value) {
        (FaultRange::Flag, toml::Value::Boolean(flag)) if *flag != argument.default_flag() => {
            vec![argument.default_flag().into()]
        }
        (FaultRange::Choice(choices), toml::Value::String(name)) => {
            let names = choices.iter().map(|(name, _)| *name);
            let before = names.take_while(|other| other != name);
            before.map(toml::Value::from).collect()
        }
        // A mode of failure with its size.
        (FaultRange::Mode(_), toml::Value::Table(mode)) => {
            let sizes = mode
                .iter()
                .filter_map(|(key, size)| Some((key, number(size)?)));
            let smaller = sizes.flat_map(|(key, size)| {
                let sizes = smaller(size, SHARES).chain(rounder(size));
                sizes.map(|size| {
                    let mut mode = mode.clone();
                    mode.insert(key.clone(), size.into());
                    toml::Value::Table(mode)
                })
            });
            smaller.collect()
        }
        (range, value) => match number(value) {
            Some(value) => numbers(value, argument.default, range)
                .into_iter()
                .map(toml::Value::from)
                .collect(),
            None => Vec::new(),
        },
    };
    let faults = simpler
        .into_iter()
        .filter_map(|value| with_argument(&order.fault, argument.key, value));
    faults
        .map(|fault| Order {
            fault,
            ..order.clone()
        })
        .collect()
}

/// Returns simpler numbers of an argument, the simplest first.
fn numbers(value: f64, default: Option<f64>, range: FaultRange) -> Vec<f64> {
    if default == Some(value) {
        return Vec::new();
    }
    // A smaller coordinate or item is not simpler, but a rounder one is.
    let has_size = !matches!(range, FaultRange::X | FaultRange::Y | FaultRange::Item);
    let is_whole = matches!(range, FaultRange::Item | FaultRange::Whole(..));
    let zero = (has_size && value > 0.0).then_some(0.0);
    let smaller = smaller(value, if is_whole { TIMES } else { SHARES });
    let smaller = smaller.filter(|_| has_size);
    let all = default.into_iter().chain(zero).chain(smaller);
    let mut all: Vec<f64> = all.chain(rounder(value).filter(|_| !is_whole)).collect();
    all.dedup();
    all
}

/// Returns 1, 2 and 5 times the powers of ten below a value, ascending.
fn smaller(value: f64, least: i32) -> impl Iterator<Item = f64> {
    let powers =
        (least..=GREATEST).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| scaled(digit, power)));
    powers.take_while(move |smaller| *smaller < value)
}

/// Returns the value rounded to fewer digits, the fewest first.
fn rounder(value: f64) -> impl Iterator<Item = f64> {
    (1..digits(value)).map(move |count| rounded_to(value, count))
}

/// Returns the number of significant decimal digits, at most [`DIGITS`].
fn digits(value: f64) -> i32 {
    let is_exact = |count: &i32| (rounded_to(value, *count) - value).abs() <= 1e-6 * value.abs();
    (1..DIGITS).find(is_exact).unwrap_or(DIGITS)
}

/// Rounds to a number of significant digits.
fn rounded_to(value: f64, count: i32) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let magnitude = floor(log10(value.abs())) as i32;
    let power = magnitude - count + 1;
    scaled((value / scaled(1.0, power)).round(), power)
}

/// Returns a number times a power of ten. Negative powers divide, so that 3 tenths are 0.3.
fn scaled(number: f64, power: i32) -> f64 {
    let factor = (0..power.abs()).fold(1.0, |factor, _| 10.0 * factor);
    if power < 0 {
        number / factor
    } else {
        number * factor
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use proptest::prelude::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use scenario::fault::{Fault, Loss};

    use super::super::plan::HuntPlan;
    use super::super::space::Space;
    use super::*;

    fn texts(group: &[Order]) -> String {
        let texts: Vec<String> = group.iter().map(ToString::to_string).collect();
        texts.join("\n")
    }

    #[test]
    fn the_variants_of_an_order_begin_with_the_simplest() {
        let order = Order {
            at_s: Some(137.25),
            for_s: Some(4.5),
            ..Order::now(Fault::Drop(Loss {
                from: Default::default(),
                to: Default::default(),
                p: 0.37,
                burst_s: 2.0,
            }))
        };
        let groups = groups(&order, &default_scenario());
        let groups: Vec<String> = groups.iter().map(|group| texts(group)).collect();
        insta::assert_snapshot!(groups.join("\n\n"));
    }

    #[test]
    fn an_endless_fault_becomes_a_finite_one_and_an_instant_stays() {
        let kill = Order::now(Fault::Kill("gold".to_owned()));
        assert_eq!(durations(&kill)[0].for_s, Some(1.0));
        let restart = Order::now(Fault::Restart("gold".to_owned()));
        assert!(durations(&restart).is_empty());
    }

    proptest! {
        #[test]
        fn rounding_keeps_the_value_near_and_ends(value in 0.01..10_000.0_f64) {
            let mut value = (value * 100.0).round() / 100.0;
            for _ in 0..40 {
                let Some(rounder) = rounder(value).next() else {
                    break;
                };
                prop_assert!(digits(rounder) < digits(value), "{rounder} {value}");
                value = rounder;
            }
            prop_assert_eq!(rounder(value).next(), None);
        }

        /// Shrinking with a judge that accepts everything ends soon, for schedules of all faults.
        #[test]
        fn any_order_has_a_simplest_variant(seed in any::<u64>()) {
            let plan = "budget = { runs = 1 }\n";
            let plan = HuntPlan::parse("plan.toml", plan, |_| Ok(default_scenario())).unwrap();
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let case = Space::new(&plan, 0).draw(&mut rng);
            for mut order in case.faults {
                let mut steps = 0;
                while let Some(group) = groups(&order, &case.scenario).into_iter().next() {
                    // The last variant is the slowest way down.
                    order = group.into_iter().last().unwrap();
                    steps += 1;
                    prop_assert!(steps < 500, "{}", order);
                }
            }
        }
    }
}

//! The statistics of comparisons against SciPy, with small and large random samples, with and without ties.

use std::collections::BTreeMap;

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use analysis::compare::statistics::bootstrap::means;
use analysis::compare::statistics::friedman::friedman;
use analysis::compare::statistics::holm::holm;
use analysis::compare::statistics::mcnemar::mcnemar;
use analysis::compare::statistics::nemenyi::{critical_difference, nemenyi};
use analysis::compare::statistics::wilcoxon::wilcoxon;
use analysis::sweep::wilson;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};

const CASES: usize = 200;

/// The allowed difference of values near 1.
const CLOSE: f64 = 1e-9;

/// The allowed difference between two bootstraps of 10,000 resamples, as a share of the interval's width.
const NEAR: f64 = 0.06;

struct Case {
    test: &'static str,
    input: Value,
    found: Vec<f64>,
}

/// Returns a random value. Values on a coarse grid can be tied.
fn value(rng: &mut ChaCha8Rng, coarse: bool) -> f64 {
    let value = rng.random_range(-3000..=5000_i32);
    if coarse {
        f64::from(value / 500)
    } else {
        f64::from(value) / 7.0 + f64::from(rng.random_range(0..1000_i32)) * 1e-5
    }
}

fn case(test: &'static str, number: usize, rng: &mut ChaCha8Rng) -> Case {
    let coarse = number.is_multiple_of(2);
    let length = 2 + number / 2;
    let mut values = |count: usize, coarse: bool| -> Vec<f64> {
        (0..count).map(|_| value(rng, coarse)).collect()
    };
    let (input, found) = match test {
        "wilcoxon" => {
            let differences = values(length, coarse);
            let found = wilcoxon(&differences);
            let found = vec![found.p, found.effect];
            (json!({ "differences": differences }), found)
        }
        "mcnemar" => {
            let only = [(); 2].map(|()| rng.random_range(0..=length as u64));
            (json!({ "only": only }), vec![mcnemar(only[0], only[1])])
        }
        "wilson" => {
            let hits = rng.random_range(0..=length as u64) as usize;
            let (from, to) = wilson(hits, length);
            (json!({ "share": [hits, length] }), vec![from, to])
        }
        "holm" => {
            let mut p = values(length, coarse);
            p.iter_mut().for_each(|p| *p = (p.abs() / 800.0).min(1.0));
            (json!({ "p": p }), holm(&p))
        }
        "friedman" => {
            let k = 3 + number % 10;
            let blocks: Vec<Vec<f64>> = (0..length).map(|_| values(k, coarse)).collect();
            let found = friedman(&blocks).unwrap();
            let mut all = vec![found.statistic, found.p];
            all.extend(found.mean_ranks);
            (json!({ "blocks": blocks }), all)
        }
        "nemenyi" => {
            let (k, blocks) = (2 + number % 14, length);
            let difference = f64::from(rng.random_range(0..=100_u32)) / 100.0 * (k as f64 - 1.0);
            let p = nemenyi(difference, k, blocks);
            let ranks = [k as f64, blocks as f64, difference];
            let found = vec![critical_difference(0.05, k, blocks), p];
            (json!({ "ranks": ranks }), found)
        }
        _ => {
            let values = values(20 + length, coarse);
            let (from, to) = means(&[&values])[0].interval(0.95).unwrap();
            (json!({ "values": values }), vec![from, to])
        }
    };
    let mut input = input;
    input["test"] = test.into();
    Case { test, input, found }
}

#[test]
fn each_statistic_agrees_with_scipy() {
    let Some(python) = python(&["scipy"]) else {
        return;
    };
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut cases = Vec::new();
    for (test, count) in [
        ("wilcoxon", CASES),
        ("mcnemar", CASES),
        ("wilson", CASES),
        ("holm", CASES),
        ("friedman", CASES),
        // SciPy needs a tenth of a second for each of these cases.
        ("nemenyi", CASES / 10),
        ("bootstrap", CASES / 10),
    ] {
        cases.extend((0..count).map(|number| case(test, number, &mut rng)));
    }
    let lab = Lab::new();
    let lines: Vec<String> = cases.iter().map(|case| case.input.to_string()).collect();
    lab.write("cases.jsonl", lines.join("\n"));
    let output = run(&lab, &python, "scipy_statistics.py", &["cases.jsonl"]);
    let reference = output.lines().map(serde_json::from_str::<Vec<f64>>);
    let reference: Vec<_> = reference.map(Result::unwrap).collect();
    assert_eq!(reference.len(), cases.len());

    let mut agreed: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    let mut first = None;
    for (case, reference) in cases.iter().zip(&reference) {
        let allowed = |value: f64| match case.test {
            "bootstrap" => NEAR * (reference[1] - reference[0]),
            // SciPy integrates to about seven digits.
            "nemenyi" => 1e-6,
            _ => CLOSE * value.abs().max(1.0),
        };
        let mut both = case.found.iter().zip(reference);
        let agrees = case.found.len() == reference.len()
            && both.all(|(found, expected)| (found - expected).abs() <= allowed(*expected));
        let (count, of) = agreed.entry(case.test).or_default();
        *count += usize::from(agrees);
        *of += 1;
        if !agrees && first.is_none() {
            let (input, found) = (&case.input, &case.found);
            first = Some(format!("{input}: {found:?}, SciPy {reference:?}"));
        }
    }
    for (test, (count, of)) in &agreed {
        println!("{test}: {count} of {of} agree with SciPy");
    }
    assert_eq!(first, None);
}

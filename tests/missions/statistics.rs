//! The statistics of comparisons against SciPy, on random samples: small and large ones, with ties and without.

use std::collections::BTreeMap;
use std::fs;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};
use study::compare::statistics::bootstrap::means;
use study::compare::statistics::friedman::friedman;
use study::compare::statistics::holm::holm;
use study::compare::statistics::mcnemar::mcnemar;
use study::compare::statistics::nemenyi::{critical_difference, nemenyi};
use study::compare::statistics::wilcoxon::wilcoxon;
use study::sweep::wilson;

use crate::harness::Lab;
use crate::python::{python, run};

/// Random samples of each test.
const CASES: usize = 200;

/// Of values of the order of 1.
const CLOSE: f64 = 1e-9;

/// Two draws of 10,000 resamples differ by so much of an interval's width.
const NEAR: f64 = 0.06;

struct Case {
    test: &'static str,
    asked: Value,
    found: Vec<f64>,
}

/// Values that lie on a coarse grid are tied.
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
    let (asked, found) = match test {
        "wilcoxon" => {
            let differences = values(length, coarse);
            let found = wilcoxon(&differences);
            (
                json!({ "differences": differences }),
                vec![found.p, found.effect],
            )
        }
        "mcnemar" => {
            let only = [
                rng.random_range(0..=length as u64),
                rng.random_range(0..=length as u64),
            ];
            (json!({ "only": only }), vec![mcnemar(only[0], only[1])])
        }
        "wilson" => {
            let hits = rng.random_range(0..=length as u64) as usize;
            let (from, to) = wilson(hits, length);
            (json!({ "share": [hits, length] }), vec![from, to])
        }
        "holm" => {
            let p: Vec<f64> = values(length, coarse)
                .iter()
                .map(|it| (it.abs() / 800.0).min(1.0))
                .collect();
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
            let all = vec![
                critical_difference(0.05, k, blocks),
                nemenyi(difference, k, blocks),
            ];
            (
                json!({ "ranks": [k as f64, blocks as f64, difference] }),
                all,
            )
        }
        _ => {
            let values = values(20 + length, coarse);
            let (from, to) = means(&[&values])[0].interval(0.95).unwrap();
            (json!({ "values": values }), vec![from, to])
        }
    };
    let mut asked = asked;
    asked["test"] = test.into();
    Case { test, asked, found }
}

#[test]
fn each_statistic_agrees_with_scipy() {
    let Some(python) = python(&["scipy"]) else {
        return;
    };
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut cases = Vec::new();
    for test in [
        "wilcoxon",
        "mcnemar",
        "wilson",
        "holm",
        "friedman",
        "nemenyi",
        "bootstrap",
    ] {
        // SciPy needs a tenth of a second for each of these.
        let count = if matches!(test, "nemenyi" | "bootstrap") {
            CASES / 10
        } else {
            CASES
        };
        cases.extend((0..count).map(|number| case(test, number, &mut rng)));
    }
    let lab = Lab::new();
    let lines: Vec<String> = cases.iter().map(|case| case.asked.to_string()).collect();
    fs::write(lab.path("cases.jsonl"), lines.join("\n")).unwrap();
    let said = run(&lab, &python, "scipy_statistics.py", &["cases.jsonl"]);
    let theirs: Vec<Vec<f64>> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(theirs.len(), cases.len());

    let mut agreed: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    let mut first = None;
    for (case, theirs) in cases.iter().zip(&theirs) {
        let allowed = |it: f64| match case.test {
            "bootstrap" => NEAR * (theirs[1] - theirs[0]),
            // SciPy itself integrates to about seven digits.
            "nemenyi" => 1e-6,
            _ => CLOSE * it.abs().max(1.0),
        };
        let mut both = case.found.iter().zip(theirs);
        let agrees = case.found.len() == theirs.len()
            && both.all(|(own, it)| (own - it).abs() <= allowed(*it));
        let (count, of) = agreed.entry(case.test).or_default();
        *count += usize::from(agrees);
        *of += 1;
        if !agrees && first.is_none() {
            first = Some(format!(
                "{}: {:?}, SciPy {theirs:?}",
                case.asked, case.found
            ));
        }
    }
    for (test, (count, of)) in &agreed {
        println!("{test}: {count} of {of} agree with SciPy");
    }
    assert_eq!(first, None);
}

//! The check of a result: what it must contain, and which of its runs are repeated.

use proto::program_build;
use scenario::Problem;
use xxhash_rust::xxh3::xxh3_64;

use super::result::{BenchResult, BenchRun, VERSION};
use super::suite::SuitePlan;
use crate::sweep::run::Row;

/// Checks that this program and these controllers have made the result. A build that is not known differs from none.
///
/// # Errors
/// Returns the first difference with its remedy.
pub fn check_program(
    file: &str,
    result: &BenchResult,
    controllers: Option<&str>,
) -> Result<(), Problem> {
    let problem = |what: String, remedy: &str| Err(Problem::with_source(file, what, remedy));
    if result.version != VERSION || program_build::is_other(&result.build) {
        let BenchResult { version, build, .. } = result;
        let own = program_build::get();
        let what = format!(
            "version {version} (build {build}) made this result, and this is version {VERSION} (build {own})"
        );
        return problem(what, "check it with the program that made it");
    }
    match (&result.controllers, controllers) {
        (Some(_), None) => problem(
            "the result has controllers in Python".to_owned(),
            "name their files with --controller",
        ),
        (stated, given) if stated.as_deref() != given => problem(
            "the files of --controller differ from those that made this result".to_owned(),
            "use the files of the submission, in the order in which they were stated",
        ),
        _ => Ok(()),
    }
}

/// Checks that the result contains each run of its suite once, in order, and was not changed afterwards.
///
/// # Errors
/// Returns the first difference with its remedy.
pub fn check_content(file: &str, result: &BenchResult, plan: &SuitePlan) -> Result<(), Problem> {
    let problem = |what: String, remedy: &str| Err(Problem::with_source(file, what, remedy));
    let suite = &result.suite;
    if result.suite_digest != plan.digest {
        let what = format!(
            "the suite {suite} has the digest {} here, and {} in the result",
            plan.digest, result.suite_digest
        );
        return problem(what, "a suite never changes: run the published one");
    }
    let runs = plan.runs();
    for run in 0..runs.max(result.runs.len()) {
        let expected = (run < runs).then(|| plan.settings(run));
        let found = result.runs.get(run).map(BenchRun::settings);
        if expected == found {
            continue;
        }
        let what = match (expected, found) {
            (Some(expected), Some(found)) => {
                format!("runs[{run}] is ({found}), but {suite} has ({expected}) there")
            }
            (Some(expected), None) => format!("runs[{run}] is missing: ({expected})"),
            (None, found) => {
                let found = found.map(|found| found.to_string()).unwrap_or_default();
                format!("runs[{run}] is ({found}), but {suite} has only {runs} runs")
            }
        };
        return problem(
            what,
            "a result contains each run of the suite once, in order",
        );
    }
    let digest = result.content_digest();
    if result.digest != digest {
        let what = format!(
            "the content has the digest {digest}, but the result states {}",
            result.digest
        );
        return problem(what, "the result was changed after the runs");
    }
    Ok(())
}

/// Returns the runs to repeat, in ascending order: this share of the runs of each allocator, at least one. The digest of
/// the content chooses them, so that each change of the content chooses other ones.
#[must_use]
pub fn sample(result: &BenchResult, share: f64) -> Vec<usize> {
    let mut sample = Vec::new();
    for allocator in &result.allocators {
        let of_allocator = |run: &usize| result.runs[*run].allocator == *allocator;
        let mut runs: Vec<usize> = (0..result.runs.len()).filter(of_allocator).collect();
        runs.sort_by_cached_key(|run| xxh3_64(format!("{} {run}", result.digest).as_bytes()));
        runs.truncate((share * runs.len() as f64).ceil() as usize);
        sample.extend(runs);
    }
    sample.sort_unstable();
    sample
}

/// Returns what a repetition of a run refutes, or `None` if all figures are equal.
#[must_use]
pub fn refuted(result: &BenchResult, plan: &SuitePlan, row: &Row) -> Option<String> {
    let run = row.run;
    let stated = &result.runs[run];
    let what = match BenchRun::new(plan, row) {
        Ok(repeated) => {
            let (name, stated, repeated) = stated.difference(&repeated)?;
            format!("{name} is {stated}, but {repeated} when repeated")
        }
        Err(reason) => format!("the repetition failed: {reason}"),
    };
    Some(format!("runs[{run}] ({}): {what}", stated.settings()))
}

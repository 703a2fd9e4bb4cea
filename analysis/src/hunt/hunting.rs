//! The whole hunt: for each allocator the runs without faults, the searches, and the shrinking of their findings.

use std::collections::BTreeMap;

use scenario::time::SimTime;
use terminal::counted;

use super::case::{Case, Conditions, Judge, Judgement};
use super::plan::{Budget, HuntPlan, Method};
use super::search::{BATCH, Search, SeverityMeasure};
use super::shrink::{Shrunk, shrink};
use super::violation::ViolationKind;

/// A case with a violation, or the worst one of a search for the worst PAR2 time.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The number of the run in its search, from 1.
    pub run: usize,
    pub kind: ViolationKind,
    pub case: Case,
    pub judgement: Judgement,
    /// The least case; equal to the found one if the plan does not shrink.
    pub shrunk: Shrunk,
}

/// The result of one search.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchResult {
    /// `None` for the runs without faults.
    pub method: Option<Method>,
    pub runs: usize,
    /// The number of covered states.
    pub states: usize,
    /// The largest PAR2 time of all runs.
    pub worst_par2: SimTime,
    pub finding: Option<Finding>,
}

/// The results of one allocator: the runs without faults, then each search. No search follows if a run without faults has
/// a violation.
#[derive(Clone, Debug, PartialEq)]
pub struct AllocatorResult {
    pub allocator: String,
    pub searches: Vec<SearchResult>,
}

/// Executes a plan.
///
/// # Errors
/// Returns the errors of the judge.
pub fn hunt(plan: &HuntPlan, judge: &mut dyn Judge) -> anyhow::Result<Vec<AllocatorResult>> {
    (0..plan.scenarios.len())
        .map(|allocator| hunt_allocator(plan, allocator, judge))
        .collect()
}

fn hunt_allocator(
    plan: &HuntPlan,
    allocator: usize,
    judge: &mut dyn Judge,
) -> anyhow::Result<AllocatorResult> {
    let (name, scenario) = &plan.scenarios[allocator];
    let cases = plan
        .seeds
        .iter()
        .map(|&seed| plan.fault_free(allocator, seed));
    let cases: Vec<Case> = cases.collect();
    let judgements = judge.judge(&cases, &plan.conditions)?;
    let limit = SimTime::from_secs_f64(scenario.limit_s);
    let measure = SeverityMeasure {
        limit,
        abandoned: plan.conditions.abandoned,
        base: cases
            .iter()
            .zip(&judgements)
            .filter(|(_, judgement)| judgement.complete)
            .map(|(case, judgement)| (case.seed, judgement.end_ms))
            .collect::<BTreeMap<_, _>>(),
    };
    let mut fault_free = SearchResult {
        method: None,
        runs: cases.len(),
        states: 0,
        worst_par2: worst(&judgements, limit),
        finding: None,
    };
    let mut found = cases.iter().zip(&judgements).enumerate();
    let found = found.find_map(|(place, (case, judgement))| {
        Some((place + 1, judgement.kind()?, case, judgement))
    });
    if let Some((run, kind, case, judgement)) = found {
        judge.note(&format!(
            "{name}: {kind} without any fault, with seed {}",
            case.seed
        ));
        let finding = finding(plan, run, kind, case, judgement, &plan.conditions, judge)?;
        fault_free.finding = Some(finding);
        return Ok(AllocatorResult {
            allocator: name.clone(),
            searches: vec![fault_free],
        });
    }
    let mut searches = vec![fault_free];
    for &method in &plan.methods {
        let search = Search::new(plan, allocator, method, measure.clone());
        searches.push(execute(plan, name, method, search, limit, judge)?);
    }
    Ok(AllocatorResult {
        allocator: name.clone(),
        searches,
    })
}

fn worst(judgements: &[Judgement], limit: SimTime) -> SimTime {
    let times = judgements.iter().map(|judgement| judgement.par2(limit));
    times.max().unwrap_or_default()
}

/// Executes one search until its first violation or the end of its budget.
fn execute(
    plan: &HuntPlan,
    name: &str,
    method: Method,
    mut search: Search<'_>,
    limit: SimTime,
    judge: &mut dyn Judge,
) -> anyhow::Result<SearchResult> {
    let began_s = judge.elapsed_s();
    let mut result = SearchResult {
        method: Some(method),
        runs: 0,
        states: 0,
        worst_par2: SimTime::ZERO,
        finding: None,
    };
    let mut found: Option<(usize, ViolationKind, Case, Judgement)> = None;
    loop {
        let count = match plan.budget {
            Budget::Runs(runs) => BATCH.min(runs - result.runs),
            Budget::Seconds(seconds) if judge.elapsed_s() - began_s < seconds => BATCH,
            Budget::Seconds(_) => 0,
        };
        if count == 0 {
            break;
        }
        let cases = search.ask(count);
        let judgements = judge.judge(&cases, &plan.conditions)?;
        search.tell(&cases, &judgements);
        for (place, (case, judgement)) in cases.iter().zip(&judgements).enumerate() {
            let run = result.runs + place + 1;
            let par2 = judgement.par2(limit);
            let kind = judgement.kind();
            let is_worse = judgement.invalid.is_none() && par2 > result.worst_par2;
            if is_worse {
                result.worst_par2 = par2;
            }
            let kind = match plan.maximizes_par2 {
                true if kind.is_none() => is_worse.then_some(ViolationKind::WorstPar2),
                _ => kind,
            };
            let Some(kind) = kind else {
                continue;
            };
            let is_first = found
                .as_ref()
                .is_none_or(|(_, known, ..)| *known == ViolationKind::WorstPar2);
            if is_first {
                found = Some((run, kind, case.clone(), judgement.clone()));
            }
        }
        result.runs += count;
        if found
            .as_ref()
            .is_some_and(|(_, kind, ..)| *kind != ViolationKind::WorstPar2)
        {
            break;
        }
    }
    result.states = search.states();
    if let Some((run, kind, case, judgement)) = found {
        judge.note(&format!(
            "{name}, {}: {kind} in run {run}, with {}",
            method.as_str(),
            counted(case.faults.len(), "fault")
        ));
        let conditions = Conditions {
            par2_from: (kind == ViolationKind::WorstPar2).then(|| judgement.par2(limit)),
            ..plan.conditions.clone()
        };
        result.finding = Some(finding(
            plan,
            run,
            kind,
            &case,
            &judgement,
            &conditions,
            judge,
        )?);
    } else {
        judge.note(&format!(
            "{name}, {}: no violation in {}",
            method.as_str(),
            counted(result.runs, "run")
        ));
    }
    Ok(result)
}

/// Shrinks a case and returns the finding.
fn finding(
    plan: &HuntPlan,
    run: usize,
    kind: ViolationKind,
    case: &Case,
    judgement: &Judgement,
    conditions: &Conditions,
    judge: &mut dyn Judge,
) -> anyhow::Result<Finding> {
    let shrunk = shrink(case, judgement, kind, conditions, plan.shrink_runs, judge)?;
    Ok(Finding {
        run,
        kind,
        case: case.clone(),
        judgement: judgement.clone(),
        shrunk,
    })
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;

    use super::super::violation::FoundViolation;
    use super::*;

    /// A judge without runs: a schedule with this kind of fault is broken, and each fault takes 100 s.
    struct Rule {
        kind: &'static str,
        judged: usize,
        notes: Vec<String>,
    }

    impl Judge for Rule {
        fn judge(
            &mut self,
            cases: &[Case],
            conditions: &Conditions,
        ) -> anyhow::Result<Vec<Judgement>> {
            self.judged += cases.len();
            let judgement = |case: &Case| {
                let is_broken = case
                    .faults
                    .iter()
                    .any(|order| order.fault.name() == self.kind);
                let end_ms = SimTime(300_000 + 100_000 * case.faults.len() as u64);
                let violation = |kind| FoundViolation {
                    kind,
                    at_ms: end_ms,
                    description: String::new(),
                };
                let worst = conditions.par2_from.filter(|from| end_ms >= *from);
                let worst = worst.map(|_| violation(ViolationKind::WorstPar2));
                let broken = is_broken && conditions.include(ViolationKind::Termination);
                Judgement {
                    violation: broken
                        .then(|| violation(ViolationKind::Termination))
                        .or(worst),
                    complete: true,
                    end_ms,
                    ..Judgement::default()
                }
            };
            Ok(cases.iter().map(judgement).collect())
        }

        fn note(&mut self, line: &str) {
            self.notes.push(line.to_owned());
        }
    }

    fn hunted(text: &str, kind: &'static str) -> (Vec<AllocatorResult>, Rule) {
        let plan = HuntPlan::parse("plan.toml", text, |_| Ok(default_scenario())).unwrap();
        let mut rule = Rule {
            kind,
            judged: 0,
            notes: Vec::new(),
        };
        (hunt(&plan, &mut rule).unwrap(), rule)
    }

    #[test]
    fn each_search_ends_at_its_first_violation_and_its_finding_is_shrunk() {
        let (results, rule) = hunted("budget = { runs = 500 }\nseeds = 3\n", "babble");
        let [result] = &results[..] else {
            panic!("{results:?}")
        };
        let [fault_free, uniform, guided] = &result.searches[..] else {
            panic!("{result:?}")
        };
        assert_eq!((fault_free.runs, &fault_free.finding), (3, &None));
        for search in [uniform, guided] {
            let finding = search.finding.as_ref().unwrap();
            assert!(finding.run <= search.runs && search.runs < finding.run + BATCH);
            assert_eq!(finding.kind, ViolationKind::Termination);
            let least = &finding.shrunk.case;
            assert_eq!(
                (least.faults.len(), least.scenario.robots.len()),
                (1, 1),
                "{least:?}"
            );
        }
        assert_eq!(rule.notes.len(), 2);
    }

    #[test]
    fn the_budget_is_exact_and_nothing_is_found_without_a_violation() {
        let (results, rule) = hunted(
            "budget = { runs = 37 }\nmethods = ['guided']\nseeds = 3\n",
            "no-such",
        );
        assert_eq!((results[0].searches[1].runs, rule.judged), (37, 40));
        assert_eq!(results[0].searches[1].finding, None);
    }

    #[test]
    fn the_worst_par2_time_uses_all_runs_and_keeps_the_team() {
        let text = "budget = { runs = 64 }\nobjective = 'par2'\nseeds = 3\n[faults]\nmax = 3\n";
        let (results, _) = hunted(text, "no-such");
        for search in &results[0].searches[1..] {
            let finding = search.finding.as_ref().unwrap();
            assert_eq!((search.runs, finding.kind), (64, ViolationKind::WorstPar2));
            assert_eq!(search.worst_par2, SimTime(600_000));
            let least = &finding.shrunk.case;
            assert_eq!((least.faults.len(), least.scenario.robots.len()), (3, 3));
        }
    }

    #[test]
    fn the_shipped_plans_are_valid() {
        for text in [
            include_str!("../../hunts/waste.toml"),
            include_str!("../../hunts/broken-rules.toml"),
            include_str!("../../hunts/incomplete.toml"),
        ] {
            HuntPlan::parse("plan.toml", text, |_| unreachable!()).unwrap();
        }
    }
}

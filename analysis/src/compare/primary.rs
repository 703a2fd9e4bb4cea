//! The metric that ranks the runs of a scenario. Comparisons, searches of parameters and checks take it from here.

use scenario::limits::check_known;
use scenario::mission::data::Objective;
use scenario::{Problem, Scenario};

use super::metrics::Metric;
use crate::distinct;
use crate::sweep::comparison::OwnFigure;
use crate::sweep::design::MISSION;
use crate::sweep::plan::{Plan, StatedMetric};

/// Returns the metric that the mission of a scenario declares for it.
#[must_use]
pub fn of_scenario(scenario: &Scenario) -> Metric {
    let objective = scenario.mission().objective(scenario);
    match (OwnFigure::new(objective), objective) {
        (Some(own), _) => Metric::Own(own),
        (None, Objective::Done) => Metric::Done,
        (None, _) => Metric::Par2,
    }
}

/// Returns the metric that the plan states for the mission of a run, and otherwise that of its scenario.
///
/// # Errors
/// Returns an error if the plan states a metric that does not exist.
pub fn of_run(plan: &Plan, run: usize, scenario: &Scenario) -> Result<Metric, Problem> {
    let declared = of_scenario(scenario);
    let mut cells = plan.design.columns().zip(plan.design.cells(run));
    let mission = cells.find(|(column, _)| *column == MISSION);
    let mission = mission.map(|(_, cell)| cell.to_string());
    let mut stated = plan.metrics.iter();
    let Some(stated) = stated.find(|stated| Some(&stated.mission) == mission.as_ref()) else {
        return Ok(declared);
    };
    let StatedMetric {
        mission,
        metric,
        line,
    } = stated;
    let known = distinct([declared].into_iter().chain(Metric::ALL));
    let names: Vec<String> = known.iter().map(Metric::name).collect();
    let names = names.iter().map(String::as_str);
    let at = ["missions", mission, "metric"];
    check_known(at, "there is no metric", metric, names)
        .map_err(|problem| problem.on_line(*line))?;
    // The check guarantees that the name is known.
    let found = known.into_iter().find(|known| known.name() == *metric);
    Ok(found.unwrap_or(Metric::Par2))
}

#[cfg(test)]
mod tests {
    use missions::Registry;

    use super::*;
    use crate::testkit;

    fn ranked_by(text: &str) -> (String, bool) {
        let metric = of_scenario(&testkit::scenario(text));
        (metric.name(), metric.more_is_better())
    }

    #[test]
    fn every_built_in_scenario_has_the_metric_of_its_class() {
        let done = ["janitorial", "long-endurance", "vrptw"];
        for mission in Registry::current().vocabulary().missions {
            for scenario in mission.vocabulary().scenarios {
                let expected = match scenario.name {
                    "foraging" => ("items_per_hour", true),
                    "cmommt" | "cmommt-crowded" => ("observed", true),
                    name if done.contains(&name) => ("done", true),
                    _ => ("par2_s", false),
                };
                let found = ranked_by(scenario.text);
                assert_eq!((found.0.as_str(), found.1), expected, "{}", scenario.name);
            }
        }
    }

    #[test]
    fn deadlines_values_and_returning_work_change_the_metric() {
        let service = |kind: &str, point: &str| {
            ranked_by(&format!(
                "[service]\n[[service.kinds]]\nname = 'k'\nwork_s = {{ min = 1, max = 1 }}\n{kind}\n\
                 [[service.points]]\nkind = 'k'\nx_m = 3.0\ny_m = 3.0\n{point}\n\
                 [[robots]]\nname = 'a'\n"
            ))
            .0
        };
        for (kind, point, expected) in [
            ("", "", "par2_s"),
            ("", "arrival_s = 5.0\nopens_s = 9.0", "par2_s"),
            ("deadline_s = { min = 9, max = 9 }", "", "done"),
            ("period_s = 60", "", "done"),
            ("", "deadline_s = 9.0", "done"),
            ("", "value = 2.0", "value_collected"),
            (
                "deadline_s = { min = 9, max = 9 }",
                "value = 2.0",
                "value_collected",
            ),
        ] {
            assert_eq!(service(kind, point), expected, "{kind} {point}");
        }
        assert_eq!(ranked_by("[waste]\nrespawn = true").0, "items_per_hour");
        assert_eq!(ranked_by("[waste]").0, "par2_s");
    }

    #[test]
    fn a_plan_states_the_metric_of_a_mission() {
        let plan = |metric: &str| {
            let text = format!("[missions.a]\n[missions.b]\nmetric = '{metric}'\n");
            Plan::parse("p.toml", &text, |_| unreachable!("no scenario has a name")).unwrap()
        };
        let scenario = testkit::scenario("[waste]");
        let of = |plan: &Plan, run| of_run(plan, run, &scenario);
        let stated = plan("done");
        assert_eq!(of(&stated, 0), Ok(Metric::Par2));
        assert_eq!(of(&stated, 1), Ok(Metric::Done));
        assert_ne!(stated.digest(), plan("expired").digest());
        let error = of(&plan("finished"), 1).unwrap_err().to_string();
        assert!(
            error.contains("missions.b.metric: there is no metric 'finished'"),
            "{error}"
        );
    }
}

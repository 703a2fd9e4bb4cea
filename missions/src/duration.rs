//! Missions with a stated duration.

use scenario::{Problem, Scenario};

/// Returns a problem for a mission that lasts longer than the run, and is therefore never complete.
pub(crate) fn beyond_limit(
    scenario: &Scenario,
    section: &'static str,
    duration_s: f64,
) -> Option<Problem> {
    let limit_s = scenario.limit_s;
    let what = format!("the mission lasts {duration_s} s, longer than limit_s, {limit_s} s");
    let remedy = "shorten it, or allow more time";
    (duration_s > limit_s).then(|| Problem::at([section, "duration_s"], what, remedy))
}

#[cfg(test)]
mod tests {
    use crate::fixtures::parse;

    #[test]
    fn a_mission_that_lasts_longer_than_the_run_gives_a_warning() {
        for (section, more) in [("observe", ""), ("waste", "respawn = true\n")] {
            let warnings = |limit_s: f64| {
                let text = format!("limit_s = {limit_s:?}\n[{section}]\n{more}duration_s = 60.0\n");
                let scenario = parse(&text);
                let warnings = scenario.mission().warnings(&scenario, &[]);
                let mut lines = warnings.iter().map(ToString::to_string);
                lines.find(|line| line.contains("duration_s"))
            };
            assert_eq!(warnings(60.0), None, "{section}");
            let expected = format!(
                "{section}.duration_s: the mission lasts 60 s, longer than limit_s, 59.5 s; shorten it, or allow more time"
            );
            assert_eq!(warnings(59.5), Some(expected));
        }
    }
}

//! Push in files: the scenario section `[push]`, the tasks and the terms.

mod check;
mod family;
mod faults;
mod parameters;
mod section;
#[cfg(test)]
mod tests;
mod warnings;

pub use family::family;
pub use faults::{BAR_STUCK, STUCK_S};
pub use section::{BarSection, PushSection};

use scenario::fault::Order;
use scenario::ids::TaskId;
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::mission::prelude::*;

use crate::push::bar::{BarEnd, end};

pub const MAX_BARS: usize = scenario::MAX_TASKS;

/// The places of a robot that pushes, as distances from the end of the bar, in lengths of it. The places after the
/// first are for a blocked first place.
pub const PUSH_PLACES: [f32; 3] = [0.075, 0.28, 0.18];

pub const PUSH: Mission = Mission::new(
    "push",
    "long bars that robots push over a line, with strokes at the two ends in turn",
    &Push,
);

#[derive(Debug)]
struct Push;

#[must_use]
pub fn bar_and_end(task: TaskId) -> (usize, BarEnd) {
    (task.index() / 2, BarEnd::BOTH[task.index() % 2])
}

impl MissionData for Push {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<PushSection>(text)
    }

    fn dependencies(&self, _: &Scenario) -> TaskDependencies {
        TaskDependencies {
            cross_schedule: Some("a push is due only after one at the other end of the bar"),
            ..TaskDependencies::default()
        }
    }

    fn family(&self, robots: usize, size: usize) -> Option<Scenario> {
        Some(family(robots, size))
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        parameters::all()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            scenarios: &builtin_scenarios!["parker-box"],
            size_option: Some("bars"),
            faults: faults::ALL,
            devices: &["bar", "touch"],
            measuring_devices: &["bar"],
            events: &["pushed", "slipped", "arrived"],
            effects: &["pushed"],
            verbs: &[("pushes", "pushed"), ("slips", "slipped")],
            bulletins: ["stroke", "second"],
            columns: const {
                &[
                    Column::real("left_m").with_label("left end advanced"),
                    Column::real("right_m").with_label("right end advanced"),
                    Column::real("skew_rad"),
                    Column::done("bars_arrived", "arrived"),
                    Column::left("bars_left"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let section = PushSection::of(scenario);
        // The catalog may be requested before the number of bars is checked.
        let bars = 0..section.bars.len().min(MAX_BARS);
        one_behavior_each(bars.flat_map(|bar| {
            BarEnd::BOTH.map(|end| format!("push({})", section.name_of(bar, Some(end))))
        }))
    }

    /// A robot is impatient for the end at which it starts, and leaves the other one to teammates for some seconds.
    fn default_alliance_params(
        &self,
        scenario: &Scenario,
        robot: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        let section = PushSection::of(scenario);
        let (bar, which) = bar_and_end(behavior.task);
        let pose = section.bars[bar].pose();
        let is_own = robot.start.is_some_and(|start| {
            let start = start.position();
            let way = |which| end(&pose, which, section.length_m).distance(start);
            way(which) < way(which.other())
        });
        DefaultAllianceParams {
            broadcast_rate_hz: 2.0,
            ceased_after_s: 3.0,
            fast_impatience: if is_own { 50.0 } else { 12.5 },
            slow_impatience: 2.0,
            willing_to_affect_s: 20.0,
            before_yielding_s: 30.0,
            before_giving_up_s: 60.0,
        }
    }

    fn check_order(&self, scenario: &Scenario, order: &Order) -> Result<(), Problem> {
        let Some(when) = &order.when else {
            return Ok(());
        };
        let section = PushSection::of(scenario);
        let ends = match when.what.as_str() {
            "pushes" => BarEnd::BOTH.map(Some).to_vec(),
            "slips" => vec![None],
            _ => return Ok(()),
        };
        let name = |bar: usize| ends.iter().map(move |end| section.name_of(bar, *end));
        let exists = |object: &str| {
            let mut names = (0..section.bars.len()).flat_map(name);
            names.any(|name| name == object)
        };
        let example = section.name_of(0, ends[0]);
        when.check_object(
            exists,
            format!("name a bar or an end of it, such as {example}"),
        )
    }

    fn warnings(&self, scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
        warnings::warnings(scenario, starts)
    }

    /// A unit leads away from one end, along the bar to the other, and includes a stroke there.
    fn work_unit_s<'a>(&'a self, scenario: &'a Scenario) -> WorkUnit<'a> {
        let section = PushSection::of(scenario);
        Box::new(|body, _, _| {
            let way_m = section.length_m + 4.0 * body.radius_m;
            let turns_s = 3.0 * 180.0 / body.turn_deg_s;
            f64::from(way_m / body.speed_m_s + turns_s + section.stroke_m / body.push_m_s)
        })
    }

    fn behavior_properties(&self, _: &Scenario, _: &BehaviorSpec) -> BehaviorProperties {
        BehaviorProperties {
            is_long_running: true,
            ..BehaviorProperties::default()
        }
    }

    /// An object in a bar's way may stop it for ever.
    fn expected_properties(&self, _: &Scenario) -> ExpectedProperties {
        ExpectedProperties::default()
    }

    fn free_areas(&self, scenario: &Scenario) -> Vec<[Vec2; 2]> {
        let section = PushSection::of(scenario);
        let behind_m = section.half_width_m + 4.0 * scenario.body.radius_m;
        let before_m = section.half_width_m + section.skew_m;
        let beside_m = section.length_m / 2.0 + 3.0 * scenario.body.radius_m;
        let lane = |bar: &BarSection| {
            [
                Vec2::new(bar.x_m - behind_m, bar.y_m - beside_m),
                Vec2::new(bar.goal_x_m + before_m, bar.y_m + beside_m),
            ]
        };
        section.bars.iter().map(lane).collect()
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check(scenario)
    }
}

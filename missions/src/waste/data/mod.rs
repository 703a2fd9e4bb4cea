//! The hazardous waste clean-up (thesis §4.1) in scenario files.

mod check;
mod family;
mod faults;
mod figures;
mod kinds;
pub mod notes;
mod parameters;
mod promises;
mod section;
#[cfg(test)]
mod tests;
mod warnings;
mod work;

pub use check::MAX_SPILLS;
pub use family::family;
pub use faults::{ADD_WASTE, MOVE_WASTE};
pub use figures::{
    ITEMS_DELIVERED, ITEMS_PER_HOUR, ItemCounts, LAST_REPORT, LATENESS_MAX_MS, LATENESS_MEAN_MS,
    REPORTS_MADE, WasteFigures, WasteRow,
};
pub use kinds::BehaviorKind;
pub use section::{Deposit, ReportSite, Spill, Spot, WasteSection};
pub(super) use section::{INSIDE_DEPOSIT_M, report_site};
pub(super) use work::{EMPTY_EXPIRES, sweep_cells};

use glam::Vec2;
use scenario::fault::{MissionFault, Order};
use scenario::mission::columns::Column;
use scenario::mission::data::{
    BehaviorProperties, DefaultAllianceParams, IsSearched, MissionData, MissionVocabulary,
    Objective, TaskDependencies, WorkUnit,
};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::mission::registry::Mission;
use scenario::mission::registry::read_section;
use scenario::mission::section::{MissionSection, Section};
use scenario::{BehaviorSpec, Body, ParameterSpec, Problem, Robot, Scenario, Setup, UntypedTable};

use crate::duration::beyond_limit;

#[must_use]
pub fn default_scenario() -> Scenario {
    // Cannot fail: the section has no required key, and a test reads it.
    #[allow(clippy::expect_used)]
    Scenario::for_mission(WASTE).expect("the section has no required key")
}

#[must_use]
pub fn default_setup(seed: u64) -> Setup {
    // Cannot fail: scenario and built-in values are constant, and a test resolves them.
    #[allow(clippy::expect_used)]
    let resolved =
        Setup::resolve(default_scenario(), seed, None).expect("the default scenario is valid");
    resolved.setup
}

pub const WASTE: Mission = Mission::new(
    "waste",
    "hazardous waste clean-up: find the spills, carry their items to a deposit, report (thesis 4.1)",
    &WasteData,
);

/// Ranks runs of foraging by their deliveries, because every run takes the whole duration.
const FORAGING: Objective = Objective::Figure {
    name: ITEMS_PER_HOUR,
    figure: ITEMS_PER_HOUR,
    more_is_better: true,
    meaning: "Items delivered per hour of simulated time.",
};

#[derive(Debug)]
struct WasteData;

impl MissionData for WasteData {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<WasteSection>(text)
    }

    /// Hides the number of items from the robots.
    fn withhold(&self, section: &mut MissionSection) {
        if let Some(waste) = section.values_mut::<WasteSection>() {
            for spill in &mut waste.spills {
                spill.items = 0;
            }
        }
    }

    fn dependencies(&self, scenario: &Scenario) -> TaskDependencies {
        let is_searched = !WasteSection::of(scenario).border_known;
        TaskDependencies {
            cross_schedule: is_searched.then_some(
                "robots move spills after a robot has found the places (find-locations)",
            ),
            ..TaskDependencies::default()
        }
    }

    fn team(&self) -> Vec<Robot> {
        let robot = |(name, side_sensor): (&str, bool)| Robot {
            name: name.to_owned(),
            side_sensor,
            ..Robot::default()
        };
        [("blue", true), ("gold", false), ("green", false)]
            .map(robot)
            .to_vec()
    }

    fn family(&self, robots: usize, size: usize) -> Option<Scenario> {
        Some(family::family(robots, size))
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        parameters::all()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            scenarios: &builtin_scenarios![
                "waste-cleanup",
                "thesis-no-interruption",
                "thesis-trapped-robot",
                "parker-specialised",
                "foraging",
                "puck-moving",
                "puck-moving-unaware",
                "reference",
            ],
            scenario_name: Some("waste-cleanup"),
            size_option: Some("spills"),
            faults: faults::ALL,
            devices: &["waste", "spill-zone", "report-site", "gripper"],
            measuring_devices: &["waste"],
            notes: &notes::NAMES,
            optional_devices: &[Robot::SIDE_BORDER],
            events: &[
                "picked",
                "pick-failed",
                "dropped",
                "delivered",
                "respawned",
                "reported",
                "position-update",
                "locations-learned",
                "locations-withdrawn",
                "spill-empty",
                "put-down",
            ],
            verbs: &[
                ("picks", "picked"),
                ("drops", "dropped"),
                ("delivers", "delivered"),
                ("reports", "reported"),
                ("finds", "position-update"),
            ],
            bulletins: ["position", "withdrawal"],
            columns: const {
                &[
                    Column::left("items_in_spills"),
                    Column::left("items_carried"),
                    Column::left("items_on_floor"),
                    Column::done("items_delivered", "delivered"),
                    Column::time(LAST_REPORT, "reported"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn objective(&self, scenario: &Scenario) -> Objective {
        if WasteSection::of(scenario).respawn {
            FORAGING
        } else {
            Objective::Time
        }
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        kinds::catalog(scenario)
    }

    /// Checks whether a robot has a behavior. Following the walls needs the side sensor.
    fn has_behavior(&self, robot: &Robot, behavior: &BehaviorSpec) -> bool {
        BehaviorKind::from_spec(behavior) != BehaviorKind::FindLocationsMethodical
            || robot.has_device(Robot::SIDE_BORDER)
    }

    fn default_alliance_params(
        &self,
        _scenario: &Scenario,
        _robot: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        BehaviorKind::from_spec(behavior).built_in()
    }

    fn work_unit_s<'a>(&'a self, scenario: &'a Scenario) -> WorkUnit<'a> {
        let ways = work::Ways::new(scenario);
        Box::new(move |body, _, behavior| ways.unit_s(body, BehaviorKind::from_spec(behavior)))
    }

    fn check_order(&self, scenario: &Scenario, order: &Order) -> Result<(), Problem> {
        if let Some(when) = &order.when {
            faults::check_trigger(when)?;
        }
        faults::check(scenario.limit_s, order)
    }

    fn max_event_interval_s(&self, scenario: &Scenario, column: &str) -> Option<f64> {
        (column == LAST_REPORT).then(|| WasteSection::of(scenario).report_period_s)
    }

    fn expected_properties(&self, scenario: &Scenario) -> ExpectedProperties {
        promises::promises(scenario)
    }

    fn items_added(&self, fault: &MissionFault) -> usize {
        if fault.name == ADD_WASTE {
            fault.get("items").unwrap_or(1.0) as usize
        } else {
            0
        }
    }

    fn is_searched<'a>(&self, scenario: &'a Scenario) -> IsSearched<'a> {
        promises::in_view_of_work(scenario)
    }

    fn search_s(&self, scenario: &Scenario, body: &Body) -> Option<f64> {
        Some(work::search_s(scenario, body))
    }

    fn behavior_properties(
        &self,
        scenario: &Scenario,
        behavior: &BehaviorSpec,
    ) -> BehaviorProperties {
        let kind = BehaviorKind::from_spec(behavior);
        let period_s = WasteSection::of(scenario).report_period_s;
        BehaviorProperties {
            recurrence_s: (kind == BehaviorKind::ReportProgress).then_some(period_s),
            is_long_running: matches!(kind, BehaviorKind::MoveSpill(_)),
            ..BehaviorProperties::default()
        }
    }

    fn free_areas(&self, scenario: &Scenario) -> Vec<[Vec2; 2]> {
        promises::kept_free(scenario)
    }

    fn warnings(&self, scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
        let duration_s = WasteSection::of(scenario).duration_s;
        let late = duration_s.and_then(|duration_s| beyond_limit(scenario, "waste", duration_s));
        let mut found = warnings::warnings(scenario, starts);
        found.extend(late);
        found
    }

    fn check_places(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check_places(scenario)
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check(scenario)
    }
}

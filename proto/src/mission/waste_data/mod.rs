//! The hazardous waste clean-up (thesis §4.1) in files.

mod check;
mod family;
mod kinds;
mod parameters;
mod section;
mod work;

pub(crate) use check::MAX_ITEMS_IN_ALL;
pub use check::MAX_SPILLS;
pub use kinds::BehaviorKind;
pub use section::{Deposit, ReportSite, Spill, Spot, WasteSection};

use super::data::{BuiltIn, Mission, MissionData, Terms};
use crate::scenario::{BehaviorSpec, Body, ParameterSpec, Problem, Robot, Scenario};

/// The waste clean-up.
pub const WASTE: Mission = Mission(&WasteData);

#[derive(Debug)]
struct WasteData;

impl MissionData for WasteData {
    fn name(&self) -> &'static str {
        "waste"
    }

    fn about(&self) -> &'static str {
        "hazardous waste clean-up: find the spills, carry their items to a deposit, report (thesis 4.1)"
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        parameters::all()
    }

    fn terms(&self) -> Terms {
        Terms {
            devices: &["waste", "spill-zone", "report-site", "gripper"],
            optional_devices: &[Robot::SIDE_BORDER],
            faults: &["waste", "move-waste"],
            events: &[
                "picked",
                "pick-failed",
                "dropped",
                "delivered",
                "reported",
                "position-update",
                "locations-learned",
                "locations-withdrawn",
                "spill-empty",
                "put-down",
            ],
            bulletins: ["position", "withdrawal"],
            columns: &[
                "items_in_spills",
                "items_carried",
                "items_on_floor",
                "items_delivered",
                "last_report_ms",
            ],
        }
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        kinds::catalog(scenario)
    }

    /// Following the walls takes the side sensor.
    fn has_behavior(&self, robot: &Robot, behavior: &BehaviorSpec) -> bool {
        BehaviorKind::of(behavior) != BehaviorKind::FindLocationsMethodical
            || robot.has_device(Robot::SIDE_BORDER)
    }

    fn built_in(&self, _scenario: &Scenario, behavior: &BehaviorSpec) -> BuiltIn {
        BehaviorKind::of(behavior).built_in()
    }

    fn unit_s(&self, scenario: &Scenario, body: &Body, behavior: &BehaviorSpec) -> f64 {
        work::unit_s(scenario, body, BehaviorKind::of(behavior))
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check(&scenario.waste)
    }
}

//! The world side of the waste clean-up (thesis §4.1.1).
//!
//! - `items`: the contents of the floor. `gripper`: picking up and putting down. `sensing`: the sensor readings.
//! - `placing`: faults that add or move items. `log`: tables, figures and view.
//!
//! # Decisions that the thesis leaves open
//! - Obstacles and robots do not block the waste sensor. Only its range limits it.
//! - Items in a deposit can be sensed, but not picked up.
//! - An item lies within reach of a gripper at the start and after each drop, if there is such a place.

mod gripper;
mod item_faults;
mod items;
mod log;
mod sensing;
#[cfg(test)]
pub(crate) mod tests;

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use glam::Vec2;
use proto::mission::items::{Gripper, ItemsAction, ItemsReading};
use proto::mission::{Action, SensorReading};
use proto::tick::Outcome;
use proto::view::View;
use scenario::fault::MissionFault;
use scenario::ids::{ItemId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Catalog, Scenario, Setup};

use world_server::mission::{FigureValue, MissionWorld, StepEvents, TeamFigures, Validity};
use world_server::world::{ChangeError, CircleCache, Floor};

use crate::waste::data::{BehaviorKind, WasteSection, report_site};

pub use item_faults::PlaceError;
pub use items::Item;

use items::WasteFloor;
use log::Reports;

const PICKED: &str = "picked";
const PICK_FAILED: &str = "pick-failed";
const DROPPED: &str = "dropped";
const DELIVERED: &str = "delivered";
const RESPAWNED: &str = "respawned";
const REPORTED: &str = "reported";

#[derive(Clone, Debug)]
pub struct Waste {
    floor: WasteFloor,
    robots: Vec<Cleaner>,
    reports: Reports,
    kinds: Vec<BehaviorKind>,
}

#[derive(Clone, Debug, Default)]
struct Cleaner {
    carrying: Option<ItemId>,
    caches: Caches,
    delivered: u32,
    reports_made: u32,
}

/// The cached surroundings of one robot, which are no state.
#[derive(Debug, Default)]
struct Caches {
    /// The number of the zone at the robot's center, and a circle in which it is valid.
    zone: CircleCache,
    /// A circle in which no waste is in range.
    wasteless: CircleCache,
    /// The value of [`Floor::placement_count`] for which the two caches are valid.
    jumps: AtomicU32,
}

impl Clone for Caches {
    fn clone(&self) -> Self {
        Self {
            zone: self.zone.clone(),
            wasteless: self.wasteless.clone(),
            jumps: self.jumps.load(Relaxed).into(),
        }
    }
}

/// Returns the kind of each task. All behaviors of a task have the same kind here.
fn kinds(catalog: &Catalog) -> Vec<BehaviorKind> {
    let mut kinds: Vec<Option<BehaviorKind>> = vec![None; catalog.tasks.len()];
    for set in &catalog.sets {
        kinds[set.task.index()].get_or_insert_with(|| BehaviorKind::from_spec(set));
    }
    kinds.into_iter().flatten().collect()
}

impl MissionWorld for Waste {
    fn new(setup: &Setup, floor: &Floor) -> Self {
        Self {
            floor: WasteFloor::new(&setup.scenario, setup.seed, floor),
            robots: vec![Cleaner::default(); floor.robot_count()],
            reports: Reports::new(WasteSection::of(&setup.scenario)),
            kinds: kinds(&setup.catalog),
        }
    }

    fn start_area(scenario: &Scenario) -> [Vec2; 2] {
        report_site(scenario)
    }

    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        let ItemsAction {
            gripper,
            report: report_progress,
        } = action.items();
        self.apply_gripper(robot, gripper, floor, happened);
        if report_progress && self.floor.is_report_site(floor.pose(robot).position) {
            self.reports.add(floor.now());
            self.robots[robot.index()].reports_made += 1;
            happened.push_mission_event(REPORTED, Some(robot));
        }
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity {
        self.read_devices(robot, floor, sensed.items_mut());
        Validity::UntilChange
    }

    fn release_load(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut StepEvents) {
        self.drop_carried(robot, floor, happened);
    }

    fn change(
        &mut self,
        fault: &MissionFault,
        floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        self.apply_fault(fault, floor)
    }

    fn copy_device(&self, device: &str, from: &SensorReading, to: &mut SensorReading) {
        let (from, to) = (from.items(), to.items_mut());
        match device {
            "waste" => to.items.clone_from(&from.items),
            "spill-zone" => to.zone = from.zone,
            "report-site" => to.at_site = from.at_site,
            "gripper" => to.holding = from.holding,
            _ => {}
        }
    }

    fn settle(&mut self, _: &mut Floor, _: &mut StepEvents) {
        if let Some(foraging) = &mut self.floor.foraging {
            foraging.step();
        }
    }

    /// Adds errors to the waste sensor and sorts its items again. The other devices return no lengths.
    fn add_error(
        &self,
        device: &str,
        sensed: &mut SensorReading,
        error_m: &mut dyn FnMut() -> f32,
    ) {
        if device == "waste"
            && let ItemsReading {
                items: Some(items), ..
            } = sensed.items_mut()
        {
            for item in items.iter_mut() {
                item.x += error_m();
                item.y += error_m();
            }
            items.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        }
    }

    fn remove_disabled(&self, actuator: &str, action: &mut Action) {
        if actuator == "gripper" {
            let gripper = Gripper::Keep;
            *action = ItemsAction {
                gripper,
                ..action.items()
            }
            .into();
        }
    }

    /// Checks whether a task is useful. A search always is. A load belongs to the spill where it was picked up.
    fn has_work(&self, task: TaskId, robot: RobotId, floor: &Floor) -> bool {
        match self.kinds[task.index()] {
            BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => true,
            BehaviorKind::MoveSpill(spill) => {
                self.floor.has_waste_of_spill(spill, self.load(robot))
            }
            BehaviorKind::ReportProgress => self.reports.is_due(floor.now()),
        }
    }

    fn end(&self, now: SimTime) -> Option<Outcome> {
        self.floor.is_complete(now).then_some(Outcome::Complete)
    }

    fn load(&self, robot: RobotId) -> Option<ItemId> {
        self.robots[robot.index()].carrying
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.write_row(row);
    }

    fn state_hash(&self) -> u64 {
        let report = self.reports.last().map_or(u64::MAX, |time| time.0);
        // Any large odd factor distributes the bits of the time over the hash.
        self.floor.hash() ^ report.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }

    fn figures(&self, figures: &mut TeamFigures) {
        self.write_figures(figures);
    }

    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        self.write_view(floor.now(), view);
    }

    fn check_invariants(&self, _floor: &Floor) -> Result<(), String> {
        for (id, item) in self.floor.items().iter().enumerate() {
            let item_id = Some(ItemId(id as u32));
            if let Some(robot) = item.carrier
                && self.load(robot) != item_id
            {
                return Err(format!(
                    "item-{id} has the carrier {robot}, but that robot does not carry it"
                ));
            }
        }
        let carried = self
            .robots
            .iter()
            .filter(|robot| robot.carrying.is_some())
            .count();
        let counts = self.floor.counts();
        if carried != counts.carried as usize {
            return Err(format!("{carried} robots carry {} items", counts.carried));
        }
        if counts.total() as usize != self.floor.items().len() {
            return Err(format!(
                "the counts add up to {} of {} items",
                counts.total(),
                self.floor.items().len()
            ));
        }
        Ok(())
    }
}

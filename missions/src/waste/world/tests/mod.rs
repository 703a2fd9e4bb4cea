//! Spills, gripper, deposit and report site.

mod actuators;
mod floor;
mod sensors;

use std::any::Any;

use floor::{
    BLUE, GOLD, REPORT, acts, assert_at, drive, position, robots, room, run, solid, spill, world,
};
use glam::Vec2;
use proto::readings::Actuation;
use proto::view::{MarkRole, Work};
use run_log::recorder::Event;
use scenario::Room;
use world_server::interruption::Interruption;
use world_server::world::World;

use super::*;
use crate::waste::data::{ItemCounts, WasteSection, default_setup};

pub(crate) fn waste(world: &World) -> &Waste {
    let mission: &dyn Any = world.mission();
    mission.downcast_ref().expect("the mission is the clean-up")
}

fn items_mut(world: &mut World) -> (&mut Waste, &mut Floor) {
    let (mission, floor) = world.mission_mut();
    let mission: &mut dyn Any = mission;
    (
        mission.downcast_mut().expect("the mission is the clean-up"),
        floor,
    )
}

/// Shortcuts for a world whose mission is the clean-up.
pub(crate) trait CleanUp {
    fn item_counts(&self) -> ItemCounts;
    fn items(&self) -> &[Item];
    fn carrying(&self, robot: RobotId) -> Option<ItemId>;
    fn is_complete(&self) -> bool;
    fn add_item(&mut self, near: Vec2) -> Result<ItemId, PlaceError>;
    fn move_item(&mut self, item: ItemId, near: Vec2) -> Result<Vec2, PlaceError>;
}

impl CleanUp for World {
    fn item_counts(&self) -> ItemCounts {
        waste(self).floor.counts()
    }

    fn items(&self) -> &[Item] {
        waste(self).floor.items()
    }

    fn carrying(&self, robot: RobotId) -> Option<ItemId> {
        self.mission().load(robot)
    }

    fn is_complete(&self) -> bool {
        self.mission().end(self.now()).is_some()
    }

    fn add_item(&mut self, near: Vec2) -> Result<ItemId, PlaceError> {
        let (waste, floor) = items_mut(self);
        waste.add_item(near, floor)
    }

    fn move_item(&mut self, item: ItemId, near: Vec2) -> Result<Vec2, PlaceError> {
        let (waste, floor) = items_mut(self);
        waste.move_item(item, near, floor)
    }
}

fn view(world: &World) -> View {
    let mut view = View::default();
    world.mission().add_to_view(world, &mut view);
    view
}

/// Makes a step and formats each event as kind, rank and subject.
fn step(world: &mut World, commands: &[Option<Actuation>]) -> Vec<String> {
    let summary = |event: &Event| {
        let rank = event.robot.map_or(u32::MAX, |robot| robot.0);
        format!("{} {rank} {}", event.kind, event.subject)
    };
    world.step(commands).iter().map(summary).collect()
}

fn row(world: &World) -> Vec<FigureValue> {
    let mut row = Vec::new();
    world.mission().row(&mut row);
    row
}

/// Returns the place of a dropped item from the only event.
#[track_caller]
pub(crate) fn dropped_at(events: &[Event]) -> Vec2 {
    let [event] = events else {
        panic!("{events:?}");
    };
    assert_eq!(event.kind.to_string(), DROPPED);
    let numbers = event.detail.split(' ');
    let numbers = numbers.map(|number| number.parse().unwrap());
    Vec2::from_slice(&numbers.collect::<Vec<f32>>())
}

/// Creates a world with one item at the center of the upper spill, (4, 6), and robots at the given starts.
fn one_item(starts: &[(f32, f32, f32)]) -> World {
    world(|scenario| {
        robots(starts)(scenario);
        spill(scenario, (4.0, 6.0), 1, 1e-5);
        scenario.body.reach_m = 0.2;
    })
}

#[test]
fn with_foraging_delivered_items_return_until_time_runs_out() {
    let mut places = Vec::new();
    let mut world = world(|scenario| {
        robots(&[(9.0, 4.5, 0.0)])(scenario);
        spill(scenario, (9.0, 4.5), 1, 0.3);
        // The gripper reaches the whole spill from the middle of the adjacent deposit.
        scenario.body.reach_m = 0.5;
        let waste = WasteSection::of_mut(scenario);
        waste.deposit.radius_m = 0.2;
        waste.deposit.x_fraction = 9.25 / 12.0;
        (waste.respawn, waste.duration_s) = (true, Some(3.0));
    });
    let lying = ItemCounts {
        in_spills: 1,
        ..ItemCounts::default()
    };
    for delivered in 1..=20 {
        assert_eq!(
            step(&mut world, &[acts(Gripper::Pick)]),
            ["picked 0 item-0"]
        );
        let dropped = step(&mut world, &[acts(Gripper::Drop)]);
        assert_eq!(dropped, ["delivered 0 item-0", "respawned 0 item-0"]);
        assert_eq!(world.item_counts(), lying);
        let place = world.items()[0].position;
        assert!(place.distance(Vec2::new(9.0, 4.5)) <= 0.3, "{place}");
        places.push(place);
        world.mission().check_invariants(&world).unwrap();
        assert_eq!(row(&world)[3], FigureValue::Count(delivered));
    }
    places.dedup();
    assert_eq!(places.len(), 20, "each item returns to another place");
    let mut figures = TeamFigures::new(1);
    world.mission().figures(&mut figures);
    let hours = world.now().as_secs_f64() / 3600.0;
    let per_hour = figures.mission.get("items_per_hour");
    assert_eq!(per_hour, FigureValue::Real(20.0 / hours));
    while world.now() < SimTime::from_secs_f64(3.0) {
        assert!(!world.is_complete());
        world.step(&[drive(0.0, 0.0)]);
    }
    assert!(world.is_complete());
}

/// Ground truth, in contrast to a robot's knowledge: a spill is due while an item belongs to it, or for its carrier. A
/// report is due after its period.
#[test]
fn tasks_are_due_according_to_the_ground_truth() {
    let setup = default_setup(1);
    let due_for = |world: &World, robot: RobotId| {
        let tasks = (0..setup.catalog.tasks.len() as u32).map(TaskId);
        let due = tasks.filter(|task| world.mission().has_work(*task, robot, world));
        due.map(|task| setup.catalog.task_name(task).to_owned())
            .filter(|name| name != "find-locations")
            .collect::<Vec<String>>()
    };
    let due = |world: &World| due_for(world, GOLD);
    let mut world = world(|scenario| {
        robots(&[(3.7, 6.0, 0.0), (0.3, 4.5, 0.0)])(scenario);
        spill(scenario, (4.0, 6.0), 1, 1e-5);
        WasteSection::of_mut(scenario).report_period_s = 0.5;
        scenario.body.reach_m = 0.2;
    });
    assert_eq!(due(&world), ["move-spill(top)"]);
    world.step(&[acts(Gripper::Pick), None]);
    assert_eq!(due(&world), [""; 0]);
    assert_eq!(due_for(&world, BLUE), ["move-spill(top)"]);
    world.step(&[acts(Gripper::Drop), None]);
    assert_eq!(due(&world), ["move-spill(top)"]);
    let item = ItemId(0);
    world.move_item(item, Vec2::new(7.0, 4.0)).unwrap();
    assert_eq!(due(&world), ["move-spill(bottom)"]);
    world.move_item(item, Vec2::new(9.6, 4.5)).unwrap();
    while world.now() < SimTime(500) {
        assert_eq!(due(&world), [""; 0]);
        world.step(&[None, None]);
    }
    assert_eq!(due(&world), ["report-progress"]);
    world.step(&[None, acts(REPORT)]);
    assert_eq!(due(&world), [""; 0]);
}

/// The gripper reaches from the edge of the body, before the body moves. Of two robots the one of lower rank gets the
/// item.
#[test]
fn the_gripper_picks_up_an_item_within_reach() {
    let (picks, fails) = ("picked 0 item-0", "pick-failed 0 ");
    for (x, expected) in [(3.6001, picks), (3.5998, fails)] {
        let mut world = one_item(&[(x, 6.0, 180.0)]);
        assert_eq!(step(&mut world, &[acts(Gripper::Pick)]), [expected]);
    }
    let mut world = one_item(&[(3.7, 6.0, 0.0), (4.3, 6.0, 180.0)]);
    let events = step(&mut world, &[acts(Gripper::Pick), acts(Gripper::Pick)]);
    assert_eq!(events, [picks, "pick-failed 1 "]);
    let mut world = one_item(&[(3.61, 6.0, 180.0)]);
    let speed_m_s = 0.5;
    let command = acts(Gripper::Pick).map(|command| Actuation {
        speed_m_s,
        ..command
    });
    assert_eq!(step(&mut world, &[command]), [picks]);
    assert_at(position(&world, BLUE), 3.585, 6.0);
    // With the default reach, a dead body on an item does not cover it: a teammate reaches below the body.
    let mut world = self::world(|scenario| {
        robots(&[(4.0, 6.0, 0.0), (3.5, 6.0, 0.0)])(scenario);
        spill(scenario, (4.0, 6.0), 1, 1e-5);
    });
    run(&mut world, 20, &[None, drive(0.5, 0.0)]);
    let events = step(&mut world, &[None, acts(Gripper::Pick)]);
    assert_eq!(events, ["picked 1 item-0"]);
}

#[test]
fn an_item_dropped_at_a_wall_falls_beside_the_robot() {
    let mut world = world(|scenario| {
        robots(&[(3.7, 6.0, 0.0)])(scenario);
        spill(scenario, (4.0, 6.0), 1, 0.05);
        scenario.body.reach_m = 0.3;
    });
    world.step(&[acts(Gripper::Pick)]);
    world.add_obstacle(&solid(3.95, 4.0, 0.5, 4.0));
    let at = dropped_at(&world.release_load(BLUE));
    // The first direction, in steps of 22.5 degrees, in which the item clears the wall at x = 3.95.
    let angle = 45.0_f32.to_radians();
    assert_at(at, 3.7 + 0.251 * angle.cos(), 6.0 + 0.251 * angle.sin());
    assert_eq!(world.release_load(BLUE), []);
}

#[test]
fn an_item_dropped_in_a_corner_stays_inside_and_reachable() {
    let corners = [(0.202, 0.202, 225.0), (0.202, 8.798, 135.0)];
    for (x, y, heading) in corners.into_iter().chain([(11.798, 0.202, -45.0)]) {
        let mut world = world(|scenario| {
            robots(&[(x, y, heading)])(scenario);
            spill(scenario, (x, y), 1, 0.05);
        });
        world.step(&[acts(Gripper::Pick)]);
        let at = dropped_at(&world.release_load(BLUE));
        let from_wall = at.min(Vec2::new(12.0, 9.0) - at).min_element();
        assert!(from_wall >= 0.05, "{at}");
        assert_eq!(world.item_counts().total(), 1);
    }
}

#[test]
fn items_of_a_spill_under_obstacles_move_to_reachable_places() {
    let covered = world(|scenario| scenario.obstacles = vec![solid(3.0, 5.0, 2.0, 2.0)]);
    let counts = covered.item_counts();
    assert_eq!(
        (counts.in_spills, counts.on_floor, counts.total()),
        (12, 12, 24)
    );
    for item in &covered.items()[..12] {
        let outside = (item.position - Vec2::new(4.0, 6.0)).abs().max_element() - 1.0;
        assert!((0.05..0.2).contains(&outside), "{}", item.position);
    }
    // If no place is reachable, the number of items stays the same.
    let full = world(|scenario| {
        robots(&[(1.0, 1.0, 0.0)])(scenario);
        WasteSection::of_mut(scenario).spills[0].items = 3;
        scenario.room = Room::of_size(2.0, 2.0);
        scenario.obstacles = vec![solid(1.21, 0.0, 1.0, 2.0), solid(0.0, 1.21, 2.0, 1.0)];
    });
    assert_eq!(full.item_counts().total(), 3);
}

#[test]
fn no_item_starts_where_no_robot_can_grip_it() {
    // The spill lies in a slot of 0.3 m, 1 m from both of its ends. Bodies are 0.4 m wide.
    let world = world(|scenario| {
        WasteSection::of_mut(scenario).spill_radius_m = 0.1;
        scenario.obstacles = vec![solid(3.0, 5.0, 0.85, 2.0), solid(4.15, 5.0, 0.85, 2.0)];
    });
    let reach = 0.45;
    for item in &world.items()[..12] {
        let Vec2 { x, y } = item.position;
        let deep = (3.0..5.0).contains(&x) && (5.0 + reach..7.0 - reach).contains(&y);
        assert!(!deep, "({x}, {y})");
    }
}

#[test]
fn items_that_begin_in_the_deposit_are_delivered() {
    let world = world(|scenario| {
        for spill in &mut WasteSection::of_mut(scenario).spills {
            (spill.x_fraction, spill.y_fraction) = (0.8, 0.5);
        }
    });
    let counts = world.item_counts();
    assert_eq!((counts.delivered, counts.total()), (24, 24));
    assert!(world.is_complete());
    // A mission without items is not complete.
    assert!(!room(&[(1.0, 1.0, 0.0)], &[]).is_complete());
}

#[test]
fn a_report_counts_only_on_the_site_and_colors_it_for_a_while() {
    let mut away = room(&[(3.0, 4.5, 0.0)], &[]);
    assert_eq!(away.step(&[acts(REPORT)]), []);
    let site = |world: &World| (row(world)[4], view(world).marks[0].work.clone());
    assert_eq!(site(&away), (FigureValue::None, None));

    let mut world = room(&[(0.3, 4.5, 0.0)], &[]);
    world.step(&[None]);
    assert_eq!(step(&mut world, &[acts(REPORT)]), ["reported 0 "]);
    let reported = FigureValue::Count(50);
    // The color lasts 5 s.
    while world.now().0 < 5050 {
        assert_eq!(site(&world), (reported, Work::left_or_done(false)));
        world.step(&[None]);
    }
    assert_eq!(site(&world), (reported, None));
}

#[test]
fn the_state_covers_everything_that_later_steps_depend_on() {
    let mut world = one_item(&[(3.7, 6.0, 0.0)]);
    let mut states = vec![world.mission().state_hash()];
    let mut then = |world: &World| {
        let state = world.mission().state_hash();
        assert!(!states.contains(&state));
        states.push(state);
    };
    world.step(&[acts(Gripper::Pick)]);
    then(&world);
    world.release_load(BLUE);
    then(&world);
    world.move_item(ItemId(0), Vec2::new(2.0, 2.0)).unwrap();
    then(&world);
    world.add_item(Vec2::new(2.0, 2.0)).unwrap();
    then(&world);
    let (waste, floor) = items_mut(&mut world);
    waste.reports.add(floor.now());
    then(&world);
}

#[test]
fn the_view_contains_zones_with_progress_and_items() {
    let mut world = one_item(&[(3.7, 6.0, 0.0)]);
    let marks = |world: &World| -> Vec<(String, MarkRole, Option<Work>)> {
        let marks = view(world).marks.into_iter();
        marks
            .map(|mark| (mark.label, mark.role, mark.work))
            .collect()
    };
    let mark = |label: &str, role, work| (label.to_owned(), role, work);
    let items = |left| Work::new(left, 1.0, "items");
    let expected = [
        mark("report site", MarkRole::Target, None),
        mark("deposit", MarkRole::Goal, None),
        mark("spill (top)", MarkRole::Zone, items(1.0)),
        mark("spill (bottom)", MarkRole::Zone, None),
    ];
    assert_eq!(marks(&world), expected);
    world.step(&[acts(Gripper::Pick)]);
    assert_eq!(marks(&world)[2].2, items(0.0));
    let items = view(&world).items;
    let carriers: Vec<_> = items.iter().map(|item| item.carrier).collect();
    assert_eq!(carriers, [Some(BLUE)]);
    assert_eq!(world.mission().check_invariants(&world), Ok(()));
}

#[test]
fn faults_add_and_move_waste_which_stays_after_the_fault() {
    let mut world = World::new(&default_setup(1), crate::waste::MISSION.world);
    let mut apply = |json: &str| {
        let fault = serde_json::from_str(json).unwrap();
        let mut fault = Interruption::from_fault(&fault, &default_setup(1).roster);
        let begun = fault.begin(&mut world).unwrap();
        fault.end(&mut world);
        let last = world.items().last().unwrap().position;
        (
            begun.map_err(|error| error.to_string()),
            world.items().len(),
            last,
        )
    };
    let (added, items, _) = apply(r#"{"waste":{"x_m":6,"y_m":7,"items":2}}"#);
    assert_eq!(added.unwrap(), "item-24 6 7, item-25 6.1 7");
    assert_eq!(items, 26);
    let (moved, _, last) = apply(r#"{"move-waste":{"item":25,"x_m":2,"y_m":1}}"#);
    assert_eq!(moved.unwrap(), "item-25 2 1");
    assert_eq!(last, Vec2::new(2.0, 1.0));
    let (none, ..) = apply(r#"{"move-waste":{"item":26,"x_m":2,"y_m":1}}"#);
    assert_eq!(none.unwrap_err(), "there is no item-26");
}

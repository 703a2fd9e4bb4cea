//! Single steps of the controller, with readings and messages made by hand. The closed-loop tests run whole missions.

mod locations;

use crate::waste::data::default_setup;
use crate::waste::data::notes;
use std::f32::consts::PI;

use proto::mission::SensorReading;
use proto::mission::items::{
    Fact, Gripper, ItemsBulletin, ItemsReading, Locations, SensedItems, Withdrawal, Zone,
};
use proto::readings::{Pose, Readings};
use scenario::ids::TaskId;

use proto::team::{
    Broadcast, BroadcastContent, BulletinKind, BulletinSubject, Heartbeat, TaskState,
};

use super::*;
use robot_agent::body::goal::length;

const ME: RobotId = RobotId(0);
const MATE: RobotId = RobotId(1);
const FIND: TaskId = TaskId(0);
const TOP: TaskId = TaskId(1);
/// The deposit and the upper spill of the default room.
const DEPOSIT: Vec2 = Vec2::new(9.6, 4.5);
const SPILL: Vec2 = Vec2::new(4.0, 6.0);

struct Robot {
    mission: WasteController,
    now: SimTime,
}

/// Creates the controller of a robot of a scenario.
fn mission(robot: RobotId, setup: &Setup) -> WasteController {
    WasteController::new(robot, setup, &Arc::new(Map::of(&setup.scenario)))
}

fn robot() -> Robot {
    Robot {
        mission: mission(ME, &default_setup(1)),
        now: SimTime::ZERO,
    }
}

/// Creates a robot that has received the locations.
fn informed() -> Robot {
    let mut robot = robot();
    robot.perceive(&at(Vec2::ONE), &[update(MATE, SimTime::ZERO)]);
    robot
}

impl Robot {
    fn perceive(&mut self, readings: &Readings, received: &[Broadcast]) -> Perception {
        self.now = self.now + SimTime(50);
        let received: Vec<_> = received.iter().cloned().map(Arc::new).collect();
        let mut perception = Perception::default();
        self.mission
            .perceive(self.now, readings, &received, &mut perception);
        perception
    }

    fn act(&mut self, active: Option<&str>, readings: &Readings) -> StepOutput {
        let set = active.map(|name| self.set(name));
        self.act_on(set, readings)
    }

    /// Acts on the last perceived readings.
    fn act_on(&mut self, set: Option<BehaviorId>, readings: &Readings) -> StepOutput {
        let mut action = StepOutput::default();
        self.mission.act(self.now, set, readings, &mut action);
        action
    }

    fn step(&mut self, active: Option<&str>, readings: &Readings) -> (Perception, StepOutput) {
        (self.perceive(readings, &[]), self.act(active, readings))
    }

    fn set(&self, name: &str) -> BehaviorId {
        self.mission.briefing.catalog.find_behavior(name).unwrap()
    }

    /// Returns the names of the applicable sets.
    fn applicable(&mut self, readings: &Readings) -> Vec<String> {
        let applicable = self.perceive(readings, &[]).applicable;
        let sets = self.mission.briefing.own_behaviors.iter().zip(applicable);
        let sets = sets.filter(|(_, applicable)| *applicable);
        let catalog = &self.mission.briefing.catalog;
        sets.map(|(set, _)| catalog.behavior_name(set.id).to_owned())
            .collect()
    }
}

/// Returns the readings of a robot whose devices all work, with nothing near.
fn at(position: Vec2) -> Readings {
    Readings {
        pose: Some(Pose {
            position,
            heading_rad: 0.0,
        }),
        front_border: Some(None),
        side_border: Some(None),
        proximity: Some(Default::default()),
        mission: SensorReading::Items(ItemsReading {
            items: Some(SensedItems::new()),
            zone: Some(Zone::None),
            at_site: Some(false),
            holding: Some(false),
        }),
        ..Readings::default()
    }
}

/// Changes the readings of the mission's devices.
fn with(mut readings: Readings, change: impl FnOnce(&mut ItemsReading)) -> Readings {
    change(readings.mission.items_mut());
    readings
}

/// Returns readings with an item in the gripper.
fn holding(position: Vec2) -> Readings {
    with(at(position), |sensed| sensed.holding = Some(true))
}

/// Returns readings in the middle of the spill, with an item at a distance ahead.
fn at_waste(ahead_m: f32) -> Readings {
    with(at(SPILL), |sensed| {
        sensed.items = Some([Vec2::new(ahead_m, 0.0)].into_iter().collect());
        sensed.zone = Some(Zone::Source);
    })
}

fn broadcast(sender: RobotId, sent: SimTime, body: BroadcastContent) -> Broadcast {
    Broadcast {
        sender,
        incarnation: 1,
        tick: 0,
        index: 0,
        seq: 0,
        sent,
        body,
    }
}

fn update(finder: RobotId, seen: SimTime) -> Broadcast {
    let locations = Fact {
        value: Locations {
            min: Vec2::ZERO,
            max: Vec2::new(12.0, 9.0),
        },
        seen_by: finder,
        seen,
    };
    let about = BulletinSubject {
        task: FIND,
        set: BehaviorId(0),
        progress: 0,
    };
    let update = ItemsBulletin::PositionUpdate(locations);
    broadcast(
        finder,
        seen,
        BroadcastContent::Bulletin(update.into_bulletin(Some(about))),
    )
}

fn heartbeat(position: Vec2, carrying: bool, task: TaskId, sent: SimTime) -> Broadcast {
    let body = BroadcastContent::Heartbeat(Heartbeat {
        state: TaskState::Executing,
        since: SimTime::ZERO,
        set: Some(BehaviorId(0)),
        task: Some(task),
        progress: 0,
        position: Some(position),
        carrying,
        shared_knowledge: SharedKnowledge::default(),
    });
    broadcast(MATE, sent, body)
}

#[test]
fn methodical_needs_an_intact_side_sensor() {
    let broken = Readings {
        side_border: None,
        ..at(Vec2::ONE)
    };
    assert_eq!(robot().applicable(&broken), ["find-locations-wander"]);
}

#[test]
fn without_a_position_nothing_is_applicable_and_nothing_moves() {
    let lost = Readings {
        pose: None,
        ..at(Vec2::ONE)
    };
    assert!(robot().applicable(&lost).is_empty());
    let mut robot = informed();
    assert!(robot.applicable(&lost).is_empty());
    for set in [
        "find-locations-methodical",
        "move-spill(top)",
        "report-progress",
    ] {
        assert_eq!(robot.act(Some(set), &lost).actuation, Default::default());
    }
}

#[test]
fn the_controller_runs_without_any_one_device() {
    let dead = Readings::default();
    for kind in 0..5 {
        let mut robot = informed();
        robot.perceive(&dead, &[]);
        robot.act_on(Some(BehaviorId(kind)), &dead);
        let only_position = Readings {
            pose: Some(Pose::default()),
            ..Readings::default()
        };
        robot.perceive(&only_position, &[]);
        robot.act_on(Some(BehaviorId(kind)), &only_position);
    }
}

#[test]
fn blocked_ways_to_the_site_set_reporting_aside_for_a_while() {
    let mut robot = informed();
    robot.now = SimTime(200_000);
    // The robot makes no progress toward the site.
    let away = at(Vec2::new(3.0, 4.5));
    let report = "report-progress".to_owned();
    let steps = (0..20 * 600).take_while(|_| {
        robot.act(Some("report-progress"), &away);
        robot.applicable(&away).contains(&report)
    });
    assert!(steps.count() < 20 * 600);
    assert!(robot.mission.memory.locations().is_some());
    robot.now = robot.now + SimTime(180_000);
    assert!(robot.applicable(&away).contains(&report));
}

#[test]
fn a_delivery_is_progress_after_the_gripper_reads_empty() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    let inside = with(holding(DEPOSIT - Vec2::new(0.8, 0.0)), |sensed| {
        sensed.zone = Some(Zone::Target)
    });
    let (_, action) = robot.step(Some("move-spill(top)"), &inside);
    assert_eq!(action.actuation.action.items().gripper, Gripper::Drop);
    // The gripper did not open.
    assert!(
        robot
            .step(Some("move-spill(top)"), &inside)
            .0
            .progressed
            .is_empty()
    );
    let empty = with(inside, |sensed| sensed.holding = Some(false));
    assert_eq!(
        robot.step(Some("move-spill(top)"), &empty).0.progressed,
        [TOP]
    );
    assert!(
        robot
            .step(Some("move-spill(top)"), &empty)
            .0
            .progressed
            .is_empty()
    );
}

#[test]
fn a_load_is_not_dropped_with_the_back_to_the_deposit() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    let mut outward = holding(DEPOSIT - Vec2::new(0.8, 0.0));
    outward.mission.items_mut().zone = Some(Zone::Target);
    outward.pose.as_mut().unwrap().heading_rad = PI;
    let (_, action) = robot.step(Some("move-spill(top)"), &outward);
    assert_eq!(action.actuation.action.items().gripper, Gripper::Keep);
    assert!(action.actuation.turn_rad_s != 0.0);
}

#[test]
fn a_failed_grip_is_not_repeated_forever() {
    let mut robot = informed();
    let refused = at_waste(0.3);
    let grips = (0..20).filter(|_| {
        let (_, action) = robot.step(Some("move-spill(top)"), &refused);
        action.actuation.action.items().gripper == Gripper::Pick
    });
    assert_eq!(grips.count(), 1);
}

#[test]
fn a_hibernating_set_puts_down_its_load_and_notes_the_place() {
    for active in [None, Some("report-progress"), Some("move-spill(bottom)")] {
        let mut robot = informed();
        robot.step(Some("move-spill(top)"), &at_waste(0.3));
        let place = Vec2::new(6.0, 5.0);
        robot.step(Some("move-spill(top)"), &holding(place));
        let (_, action) = robot.step(active, &holding(place));
        assert_eq!(action.actuation.action.items().gripper, Gripper::Drop);
        assert!(action.notes.iter().any(|note| note.kind == notes::PUT_DOWN));
        let loose = &robot.mission.memory.knowledge().loose;
        assert_eq!(loose.len(), 1);
        assert!(loose[0].value.present && length(loose[0].value.at - place) < 0.3);
    }
}

#[test]
fn a_carried_load_keeps_its_set_applicable() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    robot
        .mission
        .memory
        .observe_spill(0, true, robot.now + SimTime(50));
    let sets = robot.applicable(&holding(Vec2::new(6.0, 5.0)));
    assert!(sets.contains(&"move-spill(top)".to_owned()));
}

#[test]
fn a_spill_is_empty_when_it_and_the_way_were_seen_empty() {
    let mut robot = informed();
    let seen = with(at(SPILL), |sensed| sensed.zone = Some(Zone::Source));
    let (_, action) = robot.step(Some("move-spill(top)"), &seen);
    assert!(action.notes.is_empty());
    let (_, action) = robot.step(Some("move-spill(top)"), &at(DEPOSIT - Vec2::new(0.8, 0.0)));
    assert_eq!(action.notes[0].kind, notes::SPILL_EMPTY);
    assert_eq!(robot.applicable(&at(DEPOSIT)), ["move-spill(bottom)"]);
    // A loose item nearer to this spill makes the task applicable again.
    robot
        .mission
        .memory
        .observe_loose(Vec2::new(5.0, 6.0), true, robot.now);
    assert_eq!(robot.applicable(&at(DEPOSIT)).len(), 2);
}

#[test]
fn a_loose_item_belongs_to_the_nearest_spill() {
    let robot = robot();
    let border = Locations {
        min: Vec2::ZERO,
        max: Vec2::new(12.0, 9.0),
    };
    let realms = Realms::default();
    let places = robot.mission.briefing.map.places(&border, &realms);
    assert_eq!(places.nearest_spill(Vec2::new(8.0, 4.6)), 0);
    assert_eq!(places.nearest_spill(Vec2::new(8.0, 4.4)), 1);
}

#[test]
fn unreachable_waste_in_view_does_not_block_the_other_spill() {
    let mut robot = informed();
    // The robot makes no progress toward the item.
    let in_sight = at_waste(0.6);
    let steps = (0..20 * 1800).take_while(|_| {
        robot.step(Some("move-spill(top)"), &in_sight);
        !robot.mission.memory.is_set_aside(0, robot.now)
    });
    assert!(steps.count() < 20 * 1800);
    let sets = robot.applicable(&in_sight);
    assert_eq!(sets, ["move-spill(bottom)", "report-progress"]);
}

#[test]
fn the_last_place_of_a_silent_carrier_is_searched() {
    let mut robot = informed();
    let here = at(Vec2::ONE);
    let last_place = Vec2::new(6.0, 6.0);
    robot.perceive(&here, &[heartbeat(last_place, true, TOP, robot.now)]);
    robot.now = robot.now + SimTime(20_000);
    robot.perceive(&here, &[]);
    let loose: Vec<Vec2> = robot.mission.memory.loose().collect();
    // The place lies a little farther on the way to the deposit.
    assert_eq!(loose.len(), 1);
    let heartbeat_way = 0.5;
    assert!(length(loose[0] - last_place) <= heartbeat_way);
    assert!(length(loose[0] - DEPOSIT) < length(last_place - DEPOSIT));
}

#[test]
fn a_failed_search_removes_the_place() {
    let mut robot = informed();
    let place = Vec2::new(6.0, 6.0);
    robot.mission.memory.observe_loose(place, true, robot.now);
    robot.perceive(&at(place + Vec2::new(0.5, 0.0)), &[]);
    assert_eq!(robot.mission.memory.loose().count(), 0);
    assert!(!robot.mission.memory.knowledge().loose[0].value.present);
}

#[test]
fn waste_in_the_deposit_belongs_to_no_task() {
    let mut robot = informed();
    let readings = with(at(DEPOSIT), |sensed| {
        sensed.items = Some([Vec2::new(0.3, 0.0)].into_iter().collect())
    });
    robot.perceive(&readings, &[]);
    assert!(robot.mission.memory.knowledge().loose.is_empty());
    let action = robot.act(Some("move-spill(top)"), &readings);
    assert_eq!(action.actuation.action.items().gripper, Gripper::Keep);
}

#[test]
fn a_full_waste_sensor_proves_nothing_about_what_is_farther_away() {
    let mut robot = informed();
    let place = Vec2::new(7.6, 4.5);
    robot.mission.memory.observe_loose(place, true, robot.now);
    let mut crowded = at(Vec2::new(8.3, 4.5));
    // Eight items in the deposit are nearer than the place.
    crowded.mission.items_mut().items = Some(
        (0..8)
            .map(|index| Vec2::new(0.4, 0.01 * index as f32))
            .collect(),
    );
    robot.perceive(&crowded, &[]);
    assert_eq!(robot.mission.memory.loose().count(), 1);
    crowded.mission.items_mut().items.as_mut().unwrap().pop();
    robot.perceive(&crowded, &[]);
    assert_eq!(robot.mission.memory.loose().count(), 0);
}

#[test]
fn an_idle_robot_makes_room_for_a_working_teammate() {
    let mut robot = informed();
    let here = at(Vec2::new(3.0, 3.0));
    let mate = |x| heartbeat(Vec2::new(x, 3.0), false, TOP, SimTime(50));
    robot.perceive(&here, &[mate(4.0)]);
    assert_eq!(robot.act(None, &here).actuation, Default::default());
    robot.perceive(&here, &[mate(2.5)]);
    assert!(robot.act(None, &here).actuation.speed_m_s > 0.0);
}

//! Single steps of the controller, with readings and messages made by hand. The closed-loop tests run whole missions.

mod locations;

use std::f32::consts::PI;

use proto::mission::SensorReading;
use proto::mission::items::{
    Fact, Gripper, ItemsBulletin, ItemsReading, Locations, SensedItems, Withdrawal, Zone,
};
use proto::readings::{Pose, Readings};
use proto::team::{
    Broadcast, BroadcastContent, BulletinKind, BulletinSubject, Heartbeat, TaskState,
};
use robot_agent::body::goal::length;
use scenario::ids::TaskId;

use super::*;
use crate::waste::data::{default_setup, notes};

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

fn robot() -> Robot {
    robot_of(&default_setup(1))
}

fn robot_of(setup: &Setup) -> Robot {
    Robot {
        mission: WasteController::new(ME, setup, &Arc::new(Map::of(&setup.scenario))),
        now: SimTime::ZERO,
    }
}

/// Creates a robot that has received the locations.
fn informed() -> Robot {
    let mut robot = robot();
    robot.perceive(&at(Vec2::ONE), &[update(MATE, SimTime::ZERO)]);
    robot
}

/// Creates a robot that has received the locations and then gripped an item of the upper spill.
fn laden() -> Robot {
    let mut robot = informed();
    assert_eq!(robot.move_top(&at_waste(0.3)).1, Gripper::Pick);
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

    /// Makes a step of moving the upper spill. Returns the tasks with progress, the gripper and the rest of the output.
    fn move_top(&mut self, readings: &Readings) -> (Vec<TaskId>, Gripper, StepOutput) {
        let (perception, output) = self.step(Some("move-spill(top)"), readings);
        let gripper = output.actuation.action.items().gripper;
        (perception.progressed, gripper, output)
    }

    fn loose(&self) -> Vec<Vec2> {
        self.mission.memory.loose().collect()
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

fn room() -> Locations {
    Locations {
        min: Vec2::ZERO,
        max: Vec2::new(12.0, 9.0),
    }
}

fn update(finder: RobotId, seen: SimTime) -> Broadcast {
    let about = BulletinSubject {
        task: FIND,
        set: BehaviorId(0),
        progress: 0,
    };
    let update = ItemsBulletin::PositionUpdate(Fact {
        value: room(),
        seen_by: finder,
        seen,
    });
    let update = BroadcastContent::Bulletin(update.into_bulletin(Some(about)));
    broadcast(finder, seen, update)
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

/// Methodical search needs an intact side sensor, everything needs a position, and no dead device stops the controller.
#[test]
fn the_controller_runs_without_any_one_device() {
    let broken = Readings {
        side_border: None,
        ..at(Vec2::ONE)
    };
    assert_eq!(robot().applicable(&broken), ["find-locations-wander"]);
    let lost = Readings {
        pose: None,
        ..at(Vec2::ONE)
    };
    assert!(robot().applicable(&lost).is_empty());
    let mut without_position = informed();
    assert!(without_position.applicable(&lost).is_empty());
    let dead = Readings::default();
    let only_position = Readings {
        pose: Some(Pose::default()),
        ..Readings::default()
    };
    for set in (0..5).map(BehaviorId) {
        let output = without_position.act_on(Some(set), &lost);
        assert_eq!(output.actuation, Default::default());
        let mut robot = informed();
        for readings in [&dead, &only_position] {
            robot.perceive(readings, &[]);
            robot.act_on(Some(set), readings);
        }
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
    let mut robot = laden();
    let mut inside = holding(DEPOSIT - Vec2::new(0.8, 0.0));
    inside.mission.items_mut().zone = Some(Zone::Target);
    // A load is not dropped with the back to the deposit.
    let mut outward = inside.clone();
    outward.pose.as_mut().unwrap().heading_rad = PI;
    let (_, gripper, output) = robot.move_top(&outward);
    assert_eq!(gripper, Gripper::Keep);
    assert!(output.actuation.turn_rad_s != 0.0);
    assert_eq!(robot.move_top(&inside).1, Gripper::Drop);
    // The gripper did not open.
    assert_eq!(robot.move_top(&inside).0, []);
    let empty = with(inside, |sensed| sensed.holding = Some(false));
    assert_eq!(robot.move_top(&empty).0, [TOP]);
    assert_eq!(robot.move_top(&empty).0, []);
}

#[test]
fn a_failed_grip_is_not_repeated_forever() {
    let mut robot = laden();
    let refused = at_waste(0.3);
    assert!((0..20).all(|_| robot.move_top(&refused).1 != Gripper::Pick));
}

#[test]
fn a_hibernating_set_puts_down_its_load_and_notes_the_place() {
    for active in [None, Some("report-progress"), Some("move-spill(bottom)")] {
        let mut robot = laden();
        let place = Vec2::new(6.0, 5.0);
        robot.move_top(&holding(place));
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
    let mut robot = laden();
    let soon = robot.now + SimTime(50);
    robot.mission.memory.observe_spill(0, true, soon);
    let sets = robot.applicable(&holding(Vec2::new(6.0, 5.0)));
    assert!(sets.contains(&"move-spill(top)".to_owned()));
}

#[test]
fn a_spill_is_empty_when_it_and_the_way_were_seen_empty() {
    let mut robot = informed();
    let seen = with(at(SPILL), |sensed| sensed.zone = Some(Zone::Source));
    assert!(robot.move_top(&seen).2.notes.is_empty());
    let (.., action) = robot.move_top(&at(DEPOSIT - Vec2::new(0.8, 0.0)));
    assert_eq!(action.notes[0].kind, notes::SPILL_EMPTY);
    assert_eq!(robot.applicable(&at(DEPOSIT)), ["move-spill(bottom)"]);
    // A loose item nearer to this spill makes the task applicable again.
    let item = Vec2::new(5.0, 6.0);
    robot.mission.memory.observe_loose(item, true, robot.now);
    assert_eq!(robot.applicable(&at(DEPOSIT)).len(), 2);
}

#[test]
fn unreachable_waste_in_view_does_not_block_the_other_spill() {
    let mut robot = informed();
    // The robot makes no progress toward the item.
    let in_sight = at_waste(0.6);
    let steps = (0..20 * 1800).take_while(|_| {
        robot.move_top(&in_sight);
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
    let [loose] = robot.loose()[..] else {
        panic!("{:?}", robot.loose());
    };
    // The place lies a little farther on the way to the deposit.
    let heartbeat_way = 0.5;
    assert!(length(loose - last_place) <= heartbeat_way);
    assert!(length(loose - DEPOSIT) < length(last_place - DEPOSIT));
}

#[test]
fn a_failed_search_removes_the_place() {
    let mut robot = informed();
    let place = Vec2::new(6.0, 6.0);
    robot.mission.memory.observe_loose(place, true, robot.now);
    robot.perceive(&at(place + Vec2::new(0.5, 0.0)), &[]);
    assert_eq!(robot.loose(), []);
    assert!(!robot.mission.memory.knowledge().loose[0].value.present);
}

#[test]
fn waste_in_the_deposit_belongs_to_no_task() {
    let mut robot = informed();
    let readings = with(at(DEPOSIT), |sensed| {
        sensed.items = Some([Vec2::new(0.3, 0.0)].into_iter().collect())
    });
    assert_eq!(robot.move_top(&readings).1, Gripper::Keep);
    assert!(robot.mission.memory.knowledge().loose.is_empty());
}

#[test]
fn a_full_waste_sensor_proves_nothing_about_what_is_farther_away() {
    let mut robot = informed();
    let place = Vec2::new(7.6, 4.5);
    robot.mission.memory.observe_loose(place, true, robot.now);
    // Items in the deposit are nearer than the place.
    for (items, loose) in [(8, 1), (7, 0)] {
        let crowded = with(at(Vec2::new(8.3, 4.5)), |sensed| {
            let items = (0..items).map(|index| Vec2::new(0.4, 0.01 * index as f32));
            sensed.items = Some(items.collect());
        });
        robot.perceive(&crowded, &[]);
        assert_eq!(robot.loose().len(), loose);
    }
}

#[test]
fn an_idle_robot_makes_room_for_a_working_teammate() {
    let mut robot = informed();
    let here = at(Vec2::new(3.0, 3.0));
    for (x, makes_room) in [(4.0, false), (2.5, true)] {
        let mate = heartbeat(Vec2::new(x, 3.0), false, TOP, SimTime(50));
        robot.perceive(&here, &[mate]);
        let actuation = robot.act(None, &here).actuation;
        assert_eq!(actuation.speed_m_s > 0.0, makes_room);
        assert_eq!(actuation != Default::default(), makes_room);
    }
}

//! The mission's step, with readings and messages made by hand. Whole missions are driven in the closed-loop tests.

use crate::waste::data::notes;
use crate::waste::data::{BehaviorKind, default_setup};
use std::f32::consts::PI;

use alliance_proto::ids::TaskId;
use alliance_proto::mission::Sensed;
use alliance_proto::mission::items::{
    Fact, Gripper, ItemsBulletin, ItemsSensed, Locations, SensedItems, Withdrawal, Zone,
};
use alliance_proto::readings::{Pose, Readings};

use alliance_proto::team::{About, Broadcast, BulletinKind, Content, Heartbeat, TaskState};

use super::*;
use robot_agent::body::goal::length;

const ME: RobotId = RobotId(0);
const MATE: RobotId = RobotId(1);
const FIND: TaskId = TaskId(0);
const TOP: TaskId = TaskId(1);
const REPORT: TaskId = TaskId(3);
/// The deposit and the upper spill of the default room.
const DEPOSIT: Vec2 = Vec2::new(9.6, 4.5);
const SPILL: Vec2 = Vec2::new(4.0, 6.0);

struct Robot {
    mission: WasteMission,
    now: SimTime,
}

/// A robot of the default scenario with these readings at the next steps.
fn mission(robot: RobotId, setup: &Setup) -> WasteMission {
    WasteMission::new(robot, setup, &Arc::new(Map::of(&setup.scenario)))
}

fn robot() -> Robot {
    Robot {
        mission: mission(ME, &default_setup(1)),
        now: SimTime::ZERO,
    }
}

/// A robot that has been told where things are.
fn informed() -> Robot {
    let mut robot = robot();
    robot.perceive(&at(Vec2::ONE), &[update(MATE, SimTime::ZERO)]);
    robot
}

impl Robot {
    fn perceive(&mut self, readings: &Readings, heard: &[Broadcast]) -> Perception {
        self.now = self.now + SimTime(50);
        let heard: Vec<_> = heard.iter().cloned().map(Arc::new).collect();
        let mut perception = Perception::default();
        self.mission
            .take_in(self.now, readings, &heard, &mut perception);
        perception
    }

    fn act(&mut self, active: Option<&str>, readings: &Readings) -> Action {
        let set = active.map(|name| self.set(name));
        self.act_on(set, readings)
    }

    /// On what it has perceived last.
    fn act_on(&mut self, set: Option<BehaviorId>, readings: &Readings) -> Action {
        let mut action = Action::default();
        self.mission.carry_out(self.now, set, readings, &mut action);
        action
    }

    fn step(&mut self, active: Option<&str>, readings: &Readings) -> (Perception, Action) {
        (self.perceive(readings, &[]), self.act(active, readings))
    }

    fn set(&self, name: &str) -> BehaviorId {
        self.mission.briefing.catalog.behavior_named(name).unwrap()
    }

    /// Names of the applicable sets.
    fn applicable(&mut self, readings: &Readings) -> Vec<String> {
        let applicable = self.perceive(readings, &[]).applicable;
        let sets = self.mission.briefing.own_behaviors.iter().zip(applicable);
        let sets = sets.filter(|(_, applicable)| *applicable);
        let catalog = &self.mission.briefing.catalog;
        sets.map(|(set, _)| catalog.behavior_name(set.id).to_owned())
            .collect()
    }
}

/// All devices work, and there is nothing near.
fn at(position: Vec2) -> Readings {
    Readings {
        pose: Some(Pose {
            position,
            heading_rad: 0.0,
        }),
        front_border: Some(None),
        side_border: Some(None),
        proximity: Some(Default::default()),
        mission: Sensed::Items(ItemsSensed {
            items: Some(SensedItems::new()),
            zone: Some(Zone::None),
            at_site: Some(false),
            holding: Some(false),
        }),
        ..Readings::default()
    }
}

/// The same readings, but for what the mission's devices tell.
fn with(mut readings: Readings, change: impl FnOnce(&mut ItemsSensed)) -> Readings {
    change(readings.mission.items_mut());
    readings
}

/// The same, with something in the gripper.
fn holding(position: Vec2) -> Readings {
    with(at(position), |sensed| sensed.holding = Some(true))
}

/// In the middle of the spill, with waste that near ahead.
fn at_waste(ahead_m: f32) -> Readings {
    with(at(SPILL), |sensed| {
        sensed.items = Some([Vec2::new(ahead_m, 0.0)].into_iter().collect());
        sensed.zone = Some(Zone::Source);
    })
}

fn broadcast(sender: RobotId, sent: SimTime, body: Content) -> Broadcast {
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
    let about = About {
        task: FIND,
        set: BehaviorId(0),
        progress: 0,
    };
    let update = ItemsBulletin::PositionUpdate(locations);
    broadcast(finder, seen, Content::Bulletin(update.about(Some(about))))
}

fn heartbeat(position: Vec2, carrying: bool, task: TaskId, sent: SimTime) -> Broadcast {
    let body = Content::Heartbeat(Heartbeat {
        state: TaskState::Executing,
        since: SimTime::ZERO,
        set: Some(BehaviorId(0)),
        task: Some(task),
        progress: 0,
        position: Some(position),
        carrying,
        lore: Lore::default(),
    });
    broadcast(MATE, sent, body)
}

#[test]
fn without_locations_only_finding_them_is_applicable() {
    assert_eq!(
        robot().applicable(&at(Vec2::ONE)),
        ["find-locations-methodical", "find-locations-wander"]
    );
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
fn no_device_is_indispensable_to_the_program() {
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
fn with_locations_both_spills_are_applicable() {
    let mut robot = informed();
    assert_eq!(
        robot.applicable(&at(Vec2::ONE)),
        ["move-spill(top)", "move-spill(bottom)"]
    );
}

#[test]
fn reporting_is_applicable_when_the_period_has_passed() {
    let mut robot = informed();
    robot.now = SimTime(119_900);
    assert_eq!(robot.applicable(&at(Vec2::ONE)).len(), 2);
    assert_eq!(
        robot.applicable(&at(Vec2::ONE)).last().unwrap(),
        "report-progress"
    );
}

#[test]
fn a_report_is_made_on_the_site_and_is_progress() {
    let mut robot = informed();
    let off_site = at(Vec2::new(3.0, 4.5));
    let (_, action) = robot.step(Some("report-progress"), &off_site);
    assert!(!action.actuation.deed.items().report);
    let on_site = with(at(Vec2::new(0.4, 4.5)), |sensed| {
        sensed.at_site = Some(true)
    });
    robot.now = SimTime(200_000);
    let (_, action) = robot.step(Some("report-progress"), &on_site);
    assert!(action.actuation.deed.items().report);
    let perception = robot.perceive(&on_site, &[]);
    assert_eq!(perception.progressed, [REPORT]);
    assert_eq!(
        robot.mission.memory.knowledge().last_report.unwrap().seen,
        robot.now
    );
    assert_eq!(robot.applicable(&on_site).len(), 2);
}

#[test]
fn when_the_ways_to_the_site_are_closed_it_leaves_reporting_alone_for_a_while() {
    let mut robot = informed();
    robot.now = SimTime(200_000);
    // It does not get any nearer.
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
fn waste_in_reach_is_picked_up_and_carried_toward_the_deposit() {
    let mut robot = informed();
    let far = robot
        .step(Some("move-spill(top)"), &at_waste(0.6))
        .1
        .actuation;
    assert_eq!(
        (far.deed.items().gripper, far.speed_m_s),
        (Gripper::Keep, 0.5)
    );
    let near = robot
        .step(Some("move-spill(top)"), &at_waste(0.3))
        .1
        .actuation;
    assert_eq!(
        (near.deed.items().gripper, near.speed_m_s),
        (Gripper::Pick, 0.0)
    );
    let carry = robot
        .step(Some("move-spill(top)"), &holding(SPILL))
        .1
        .actuation;
    // The deposit is ahead, to the right.
    assert!(carry.turn_rad_s < 0.0);
    assert!(robot.mission.is_laden());
}

#[test]
fn a_delivery_is_progress_when_it_is_seen_to_have_worked() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    let inside = with(holding(DEPOSIT - Vec2::new(0.8, 0.0)), |sensed| {
        sensed.zone = Some(Zone::Target)
    });
    let (_, action) = robot.step(Some("move-spill(top)"), &inside);
    assert_eq!(action.actuation.deed.items().gripper, Gripper::Drop);
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
fn it_does_not_let_go_with_its_back_to_the_deposit() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    let mut outward = holding(DEPOSIT - Vec2::new(0.8, 0.0));
    outward.mission.items_mut().zone = Some(Zone::Target);
    outward.pose.as_mut().unwrap().heading_rad = PI;
    let (_, action) = robot.step(Some("move-spill(top)"), &outward);
    assert_eq!(action.actuation.deed.items().gripper, Gripper::Keep);
    assert!(action.actuation.turn_rad_s != 0.0);
}

#[test]
fn a_failed_grip_is_not_repeated_forever() {
    let mut robot = informed();
    let refused = at_waste(0.3);
    let grips = (0..20).filter(|_| {
        let (_, action) = robot.step(Some("move-spill(top)"), &refused);
        action.actuation.deed.items().gripper == Gripper::Pick
    });
    assert_eq!(grips.count(), 1);
}

#[test]
fn when_its_set_hibernates_it_puts_its_load_down_and_says_where() {
    for active in [None, Some("report-progress"), Some("move-spill(bottom)")] {
        let mut robot = informed();
        robot.step(Some("move-spill(top)"), &at_waste(0.3));
        let place = Vec2::new(6.0, 5.0);
        robot.step(Some("move-spill(top)"), &holding(place));
        let (_, action) = robot.step(active, &holding(place));
        assert_eq!(action.actuation.deed.items().gripper, Gripper::Drop);
        assert!(action.notes.iter().any(|note| note.kind == notes::PUT_DOWN));
        let loose = &robot.mission.memory.knowledge().loose;
        assert_eq!(loose.len(), 1);
        assert!(loose[0].value.present && length(loose[0].value.at - place) < 0.3);
    }
}

#[test]
fn a_load_that_is_carried_keeps_its_set_applicable() {
    let mut robot = informed();
    robot.step(Some("move-spill(top)"), &at_waste(0.3));
    robot
        .mission
        .memory
        .see_spill(0, true, robot.now + SimTime(50));
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
    // Something loose nearer to it makes it work again.
    robot
        .mission
        .memory
        .see_loose(Vec2::new(5.0, 6.0), true, robot.now);
    assert_eq!(robot.applicable(&at(DEPOSIT)).len(), 2);
}

#[test]
fn a_loose_item_is_the_work_of_the_nearer_spill() {
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
fn where_no_spill_is_sensed_the_locations_are_withdrawn() {
    let mut robot = informed();
    let (_, action) = robot.step(Some("move-spill(top)"), &at(SPILL));
    let withdrawal = Withdrawal {
        finder: MATE,
        seen: SimTime::ZERO,
    };
    assert_eq!(
        action.bulletins,
        [ItemsBulletin::Withdrawal(withdrawal).about(None)]
    );
    assert_eq!(robot.mission.memory.knowledge().withdrawn, [withdrawal]);
    assert_eq!(robot.applicable(&at(SPILL)).len(), 2);
    // Hearsay does not bring it back.
    let perception = robot.perceive(&at(SPILL), &[update(MATE, SimTime::ZERO)]);
    assert!(perception.notes.is_empty());
}

#[test]
fn it_goes_where_a_spill_should_be_before_it_says_that_there_is_none() {
    let mut setup = default_setup(1);
    setup.scenario.sensors.item_range_m = 5.0;
    let mut robot = Robot {
        mission: mission(ME, &setup),
        now: SimTime::ZERO,
    };
    robot.perceive(&at(Vec2::ONE), &[update(MATE, SimTime::ZERO)]);
    // All of it is in sight from here.
    let beside = at(SPILL - Vec2::new(2.0, 0.0));
    let (_, action) = robot.step(Some("move-spill(top)"), &beside);
    assert_eq!(action.bulletins, []);
    assert!(action.actuation.speed_m_s > 0.0);
    let (_, action) = robot.step(Some("move-spill(top)"), &at(SPILL));
    assert_eq!(action.bulletins.len(), 1);
    assert_eq!(action.bulletins[0].kind, BulletinKind::Second);
}

#[test]
fn a_spill_that_is_only_seen_from_outside_may_be_there() {
    let mut robot = informed();
    let beside = at(SPILL - Vec2::new(1.0, 0.0));
    // In fifteen minutes it has found each way into it closed.
    for _ in 0..20 * 900 {
        let (_, action) = robot.step(Some("move-spill(top)"), &beside);
        assert_eq!(action.bulletins, []);
    }
}

#[test]
fn what_it_sees_and_finds_no_way_to_does_not_keep_it_from_the_other_spill() {
    let mut robot = informed();
    // It does not get any nearer.
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
fn a_robot_that_is_boxed_in_withdraws_nothing() {
    let mut robot = informed();
    // In ten minutes it has found the way to each point of the spill closed.
    for _ in 0..20 * 600 {
        let (_, action) = robot.step(Some("move-spill(top)"), &at(Vec2::ONE));
        assert_eq!(action.bulletins, []);
    }
}

#[test]
fn a_finder_whose_update_was_withdrawn_stands_back_until_another_tries() {
    let mut robot = robot();
    robot.mission.memory.find(
        Locations {
            min: Vec2::ZERO,
            max: Vec2::ONE,
        },
        SimTime(10),
    );
    let withdrawal = ItemsBulletin::Withdrawal(Withdrawal {
        finder: ME,
        seen: SimTime(10),
    });
    let withdrawal = Content::Bulletin(withdrawal.about(None));
    let here = at(Vec2::ONE);
    robot.perceive(&here, &[broadcast(MATE, SimTime(10), withdrawal)]);
    assert!(robot.applicable(&here).is_empty());
    let mate = heartbeat(Vec2::ONE, false, FIND, robot.now);
    robot.perceive(&here, &[mate]);
    assert_eq!(robot.applicable(&here).len(), 2);
}

#[test]
fn the_last_place_of_a_silent_carrier_becomes_one_to_search() {
    let mut robot = informed();
    let here = at(Vec2::ONE);
    let last_place = Vec2::new(6.0, 6.0);
    robot.perceive(&here, &[heartbeat(last_place, true, TOP, robot.now)]);
    robot.now = robot.now + SimTime(20_000);
    robot.perceive(&here, &[]);
    let loose: Vec<Vec2> = robot.mission.memory.loose().collect();
    // A little farther on its way to the deposit.
    assert_eq!(loose.len(), 1);
    let heartbeat_way = 0.5;
    assert!(length(loose[0] - last_place) <= heartbeat_way);
    assert!(length(loose[0] - DEPOSIT) < length(last_place - DEPOSIT));
}

#[test]
fn a_place_that_was_searched_in_vain_is_no_longer_one_to_search() {
    let mut robot = informed();
    let place = Vec2::new(6.0, 6.0);
    robot.mission.memory.see_loose(place, true, robot.now);
    robot.perceive(&at(place + Vec2::new(0.5, 0.0)), &[]);
    assert_eq!(robot.mission.memory.loose().count(), 0);
    assert!(!robot.mission.memory.knowledge().loose[0].value.present);
}

#[test]
fn waste_in_the_deposit_is_nobodys_work() {
    let mut robot = informed();
    let readings = with(at(DEPOSIT), |sensed| {
        sensed.items = Some([Vec2::new(0.3, 0.0)].into_iter().collect())
    });
    robot.perceive(&readings, &[]);
    assert!(robot.mission.memory.knowledge().loose.is_empty());
    let action = robot.act(Some("move-spill(top)"), &readings);
    assert_eq!(action.actuation.deed.items().gripper, Gripper::Keep);
}

#[test]
fn a_full_waste_sensor_proves_nothing_about_what_is_farther_away() {
    let mut robot = informed();
    let place = Vec2::new(7.6, 4.5);
    robot.mission.memory.see_loose(place, true, robot.now);
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
fn idle_it_makes_room_for_a_teammate_at_work() {
    let mut robot = informed();
    let here = at(Vec2::new(3.0, 3.0));
    let mate = |x| heartbeat(Vec2::new(x, 3.0), false, TOP, SimTime(50));
    robot.perceive(&here, &[mate(4.0)]);
    assert_eq!(robot.act(None, &here).actuation, Default::default());
    robot.perceive(&here, &[mate(2.5)]);
    assert!(robot.act(None, &here).actuation.speed_m_s > 0.0);
}

#[test]
fn the_sets_are_those_of_the_catalog() {
    let robot = robot();
    let kinds: Vec<BehaviorKind> = robot
        .mission
        .briefing
        .own_behaviors
        .iter()
        .map(|set| set.kind)
        .collect();
    assert_eq!(kinds[0], BehaviorKind::FindLocationsMethodical);
    assert_eq!(kinds.len(), 5);
    let gold = mission(MATE, &default_setup(1));
    assert_eq!(gold.briefing.own_behaviors.len(), 4);
}

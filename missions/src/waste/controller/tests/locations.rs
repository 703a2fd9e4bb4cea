//! Withdrawals of locations that observations contradict.

use super::*;

#[test]
fn locations_are_withdrawn_if_no_spill_is_sensed_there() {
    let mut robot = informed();
    let (.., action) = robot.move_top(&at(SPILL));
    let withdrawal = Withdrawal {
        finder: MATE,
        seen: SimTime::ZERO,
    };
    assert_eq!(
        action.bulletins,
        [ItemsBulletin::Withdrawal(withdrawal).into_bulletin(None)]
    );
    assert_eq!(robot.mission.memory.knowledge().withdrawn, [withdrawal]);
    assert_eq!(robot.applicable(&at(SPILL)).len(), 2);
    // A message does not restore the withdrawn locations.
    let perception = robot.perceive(&at(SPILL), &[update(MATE, SimTime::ZERO)]);
    assert!(perception.notes.is_empty());
}

#[test]
fn a_robot_visits_the_expected_place_before_it_withdraws_locations() {
    let mut setup = default_setup(1);
    setup.scenario.sensors.item_range_m = 5.0;
    let mut robot = robot_of(&setup);
    robot.perceive(&at(Vec2::ONE), &[update(MATE, SimTime::ZERO)]);
    // The whole spill is in view from this place.
    let beside = at(SPILL - Vec2::new(2.0, 0.0));
    let (.., action) = robot.move_top(&beside);
    assert_eq!(action.bulletins, []);
    assert!(action.actuation.speed_m_s > 0.0);
    let (.., action) = robot.move_top(&at(SPILL));
    assert_eq!(action.bulletins.len(), 1);
    assert_eq!(action.bulletins[0].kind, BulletinKind::Second);
}

/// Within 15 minutes the robot has found each way into the spill blocked, from outside or boxed in.
#[test]
fn a_view_from_outside_does_not_disprove_the_locations() {
    for place in [SPILL - Vec2::new(1.0, 0.0), Vec2::ONE] {
        let mut robot = informed();
        for _ in 0..20 * 900 {
            assert_eq!(robot.move_top(&at(place)).2.bulletins, []);
        }
    }
}

#[test]
fn a_finder_whose_update_was_withdrawn_stands_back_until_another_tries() {
    let mut robot = robot();
    robot.mission.memory.find(room(), SimTime(10));
    let withdrawal = ItemsBulletin::Withdrawal(Withdrawal {
        finder: ME,
        seen: SimTime(10),
    });
    let withdrawal = BroadcastContent::Bulletin(withdrawal.into_bulletin(None));
    let here = at(Vec2::ONE);
    robot.perceive(&here, &[broadcast(MATE, SimTime(10), withdrawal)]);
    assert!(robot.applicable(&here).is_empty());
    let mate = heartbeat(Vec2::ONE, false, FIND, robot.now);
    robot.perceive(&here, &[mate]);
    assert_eq!(robot.applicable(&here).len(), 2);
}

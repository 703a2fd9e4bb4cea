//! Kills, suspensions and starts by the scenario.

use super::*;

#[test]
fn a_robot_that_is_killed_after_a_tick_counts_once_more_without_broadcasts() {
    for order in [Simultaneous, InOrder] {
        let mut barrier = Watched::running(3, order).barrier;
        step_all(&mut barrier);
        finish(&mut barrier);
        barrier.kill_after_tick(RobotId(0));
        let received = step_all(&mut barrier);
        assert!(
            received
                .iter()
                .any(|(_, senders)| senders.contains(&RobotId(1)))
        );
        barrier.agent_lost(RobotId(0), 1, true);
        let gathered = finish(&mut barrier);
        assert!(gathered.counted[0]);
        let death = Input::Gone {
            robot: "robot-0".to_owned(),
            incarnation: 1,
            last_counted: Some(1),
            listed: false,
            moment: None,
            scripted: true,
        };
        assert_eq!(gathered.inputs, [death], "{order:?}");
        for (robot, senders) in step_all(&mut barrier) {
            assert!(
                !senders.contains(&RobotId(0)),
                "{robot} receives it, {order:?}"
            );
        }
    }
}

#[test]
fn a_suspended_robot_is_out_until_it_is_readmitted() {
    let mut barrier = Watched::running(2, Simultaneous).barrier;
    step_all(&mut barrier);
    finish(&mut barrier);
    barrier.suspend(RobotId(1));
    assert_eq!(step_all(&mut barrier).len(), 1);
    let stray = report(RobotId(1), 1, barrier.tick(), 0);
    assert_eq!(barrier.report(&stray), Verdict::Stale);
    let out = Input::StallBegin {
        robot: "robot-1".to_owned(),
        scripted: true,
    };
    assert_eq!(finish(&mut barrier).inputs, [out]);
    barrier.readmit(RobotId(1));
    let received = step_all(&mut barrier);
    assert_eq!(
        received[1],
        (RobotId(1), Vec::new()),
        "received nothing until now"
    );
    let back = Input::StallEnd {
        robot: "robot-1".to_owned(),
        moment: None,
        scripted: true,
    };
    assert_eq!(finish(&mut barrier).inputs, [back]);
}

/// Returns a barrier at tick 1 after the death of the second of two robots.
fn after_a_death() -> Barrier {
    let mut barrier = Watched::running(2, Simultaneous).barrier;
    step_all(&mut barrier);
    barrier.agent_lost(RobotId(1), 1, true);
    finish(&mut barrier);
    barrier
}

/// Ends a tick in which the scenario has started the second robot again.
#[track_caller]
fn check_join(barrier: &mut Barrier) {
    let joined = Input::Join {
        robot: "robot-1".to_owned(),
        incarnation: 2,
        moment: None,
        scripted: true,
    };
    assert_eq!(finish(barrier).inputs, [joined]);
}

#[test]
fn an_agent_that_has_already_arrived_is_admitted_when_it_is_expected() {
    let mut barrier = after_a_death();
    let (robot, incarnation, first) = barrier.invite("robot-1").unwrap();
    barrier.arrive(robot, incarnation);
    assert!(barrier.is_joining(robot));
    assert_eq!(first, 2, "without expect, with the next tick");
    barrier.expect(robot);
    assert_eq!(barrier.presence(robot), Presence::Present);
    assert_eq!(step_all(&mut barrier).len(), 2);
    check_join(&mut barrier);
}

#[test]
fn a_tick_waits_for_an_agent_that_is_expected() {
    let mut barrier = after_a_death();
    barrier.expect(RobotId(1));
    assert!(barrier.next_recipient(&All(2)).is_none() && !barrier.is_complete());
    let (robot, incarnation, first) = barrier.invite("robot-1").unwrap();
    assert_eq!(
        (robot, incarnation, first),
        (RobotId(1), 2, 1),
        "in this tick"
    );
    barrier.arrive(robot, incarnation);
    assert_eq!(step_all(&mut barrier).len(), 2);
    check_join(&mut barrier);
}

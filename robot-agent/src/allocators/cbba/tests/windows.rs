//! The score with time windows (Ponda et al. 2010).

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::utility::DISCOUNT_PER_S;
use crate::allocator::{Allocator, Choice, Decision, Input, TaskBrief};
use crate::allocators::cbba::{Cbba, CbbaConfig};
use crate::fixtures;

/// Task 0 is at the robot's place and opens in 50 s. Task 1 is open and 20 s away. Each takes 10 s of work. The wait for
/// task 0 costs nothing, and its bid is the larger one, but the robot does task 1 before.
#[test]
fn a_wait_before_the_window_costs_nothing() {
    let brief = TaskBrief {
        max_robots: 1,
        priority: 0,
        unit_s: 60.0,
        robots: vec![RobotId(0)],
        coalition: None,
    };
    let me = fixtures::self_state(RobotId(0), 1, [brief.clone(), brief].into());
    let mut robot = Cbba::new(&me, &CbbaConfig::default());
    let choices = [
        Choice {
            opens_in_s: 50.0,
            ..fixtures::choice(0, 60.0)
        },
        fixtures::choice(1, 30.0),
    ];
    let seconds = |after: &[TaskId], task: TaskId| match (after, task) {
        ([], TaskId(0)) => Some(60.0),
        // Work, the way back, and the work in the window.
        ([TaskId(1)], TaskId(0)) => Some(20.0 + 10.0),
        ([TaskId(0)], TaskId(1)) => Some(20.0 + 10.0),
        _ => Some(30.0),
    };
    let input = Input {
        applicable: &[true, true],
        choices: &choices,
        seconds: &seconds,
        ..fixtures::input(SimTime(1000), RobotId(0))
    };
    let mut decision = Decision::default();
    robot.step(&input, &mut decision);
    let bid = |s: f64| libm::pow(DISCOUNT_PER_S, s) as f32;
    let beliefs = &robot.0.beliefs;
    let expected = [(TaskId(0), bid(10.0)), (TaskId(1), bid(30.0))];
    assert_eq!(robot.0.bundle.bids(beliefs), expected);
    assert_eq!(robot.0.bundle.path(beliefs), [TaskId(1), TaskId(0)]);
    assert_eq!(decision.active, Some(choices[1].behavior));
}

//! Losses, their detection, and takeovers.

use super::*;

#[test]
fn a_death_its_detection_and_its_takeover() {
    let made = death();
    let metrics = made.metrics();
    let task = made.task(TOP);
    assert_eq!(
        metrics.failures,
        [Failure {
            at: at(30.0),
            robot: GOLD,
            loss: Loss::Died,
            returned_at: None,
            orphan: Some(OrphanedTask {
                task,
                // Last received at 28.5 s, and τ = 5 s.
                detection: Some(Detection {
                    at: at(33.5),
                    robot: GREEN,
                    sign: DetectionSign::Silence,
                }),
                aftermath: OrphanOutcome::TakenOver {
                    at: at(45.0),
                    by: BLUE,
                },
            }),
        }]
    );
    let takeover = Takeover {
        at: at(45.0),
        task,
        from: GOLD,
        robot: BLUE,
        idle_since: at(30.0),
        cause: TakeoverCause::Lost(Loss::Died),
    };
    assert_eq!(takeover.latency(), at(15.0));
    assert_eq!(metrics.takeovers, [takeover]);
}

/// Gold is stopped at 30 s during its stint and continues at `back`.
fn stop(back: f64) -> Made {
    let mut made = Made::run(60.0);
    made.during("blue", 0.0, 60.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("gold", back, 60.0, Some(TOP));
    made.claim(29.5, "blue", "gold", TOP);
    made.event(30.0, "stalled", "gold", ["", "", ""]);
    made.event(back, "back", "gold", ["", "", ""]);
    made
}

#[test]
fn a_stopped_robot_that_comes_back() {
    for (back, detected) in [(40.0, Some(34.5)), (34.5, None), (33.0, None)] {
        let metrics = stop(back).metrics();
        let [failure] = metrics.failures.as_slice() else {
            panic!("{:?}", metrics.failures)
        };
        assert_eq!(
            (failure.loss, failure.returned_at),
            (Loss::Stopped, Some(at(back)))
        );
        let orphan = failure.orphan.as_ref().unwrap();
        assert_eq!(orphan.aftermath, OrphanOutcome::Resumed { at: at(back) });
        assert_eq!(orphan.detection.map(|found| found.at), detected.map(at));
        assert_eq!(metrics.takeovers, []);
        assert_eq!(metrics.robots[GOLD].present, at(20.0 + 60.0 - back));
    }
}

#[test]
fn a_stand_in_for_a_stopped_robot_takes_over_and_gives_back() {
    let mut made = Made::run(60.0);
    made.during("blue", 10.0, 30.0, Some(TOP));
    made.during("blue", 50.0, 60.0, Some(TOP));
    made.during("gold", 0.0, 40.0, None);
    made.during("gold", 40.0, 51.0, Some(TOP));
    made.event(30.0, "stalled", "blue", ["", "", ""]);
    made.event(50.0, "back", "blue", ["", "", ""]);
    made.event(51.0, "waiting", "gold", [TOP, "arbitration", TOP]);
    let metrics = made.metrics();
    let facts: Vec<_> = metrics
        .takeovers
        .iter()
        .map(|takeover| (takeover.at, takeover.robot, takeover.latency()))
        .collect();
    assert_eq!(facts, [(at(40.0), GOLD, at(10.0))]);
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.duplicate, Some(spans([(50.0, 51.0)])));
}

#[test]
fn a_claim_that_is_withdrawn_takes_nothing_over() {
    // Gold claims blue's task and yields; later blue yields to green.
    let mut made = Made::run(60.0);
    made.during("blue", 10.0, 40.0, Some(TOP));
    made.during("gold", 0.0, 20.0, None);
    made.during("gold", 20.0, 21.0, Some(TOP));
    made.during("green", 0.0, 45.0, None);
    made.during("green", 45.0, 60.0, Some(TOP));
    made.event(21.0, "waiting", "gold", [TOP, "arbitration", TOP]);
    made.event(40.0, "hibernated", "blue", [TOP, "acquiesced-psi", TOP]);
    let takeovers = made.metrics().takeovers;
    let facts: Vec<_> = takeovers
        .iter()
        .map(|takeover| (takeover.from, takeover.robot, takeover.latency()))
        .collect();
    assert_eq!(facts, [(BLUE, GREEN, at(35.0))]);
}

/// Green bids for a task for one step, gold executes it and dies, and green bids again. Then blue takes over for good.
#[test]
fn a_claim_of_one_step_is_no_takeover_and_the_lost_robot_is_the_predecessor() {
    let mut made = Made::run(60.0);
    made.during("green", 5.0, 5.5, Some(TOP));
    made.during("green", 5.5, 33.0, None);
    made.during("green", 33.0, 33.5, Some(TOP));
    made.during("green", 33.5, 60.0, None);
    made.during("gold", 0.0, 10.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.event(5.5, "hibernated", "green", [TOP, "outbid", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    made.event(33.5, "hibernated", "green", [TOP, "outbid", TOP]);
    let metrics = made.metrics();
    let task = made.task(TOP);
    let takeover = Takeover {
        at: at(45.0),
        task,
        from: GOLD,
        robot: BLUE,
        idle_since: at(30.0),
        cause: TakeoverCause::Lost(Loss::Died),
    };
    assert_eq!(metrics.takeovers, [takeover]);
    let orphan = metrics.failures[0].orphan.as_ref().unwrap();
    assert_eq!(
        orphan.aftermath,
        OrphanOutcome::TakenOver {
            at: at(45.0),
            by: BLUE
        }
    );
    // The facts, the losses and the takeovers of the page have the same number.
    let page = made.page();
    for text in [
        "mean 15.00 s, longest 15.00 s (of 1)",
        "blue took over after 15.00 s",
        "<td>15.00 s</td><td class=\"text\">gold died</td>",
    ] {
        assert!(page.contains(text), "no '{text}' in {page}");
    }
}

/// A teammate that shared the task left it before the loss: the lost robot executed it last.
#[test]
fn the_robot_that_executed_the_task_last_is_the_predecessor() {
    let mut made = Made::run(60.0);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 15.0, None);
    made.during("blue", 15.0, 20.0, Some(TOP));
    made.during("blue", 20.0, 60.0, None);
    made.during("green", 0.0, 40.0, None);
    made.during("green", 40.0, 60.0, Some(TOP));
    made.event(20.0, "hibernated", "blue", [TOP, "acquiesced-psi", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let metrics = made.metrics();
    let facts: Vec<_> = metrics
        .takeovers
        .iter()
        .map(|takeover| (takeover.from, takeover.robot, takeover.cause.clone()))
        .collect();
    assert_eq!(
        facts,
        [
            (GOLD, BLUE, TakeoverCause::StillActive),
            (GOLD, GREEN, TakeoverCause::Lost(Loss::Died))
        ]
    );
}

/// A task for two robots has no takeovers; its loss names the next robot all the same.
#[test]
fn a_shared_task_is_continued_without_a_takeover() {
    let mut made = Made::with(60.0, |scenario| {
        let section = TaskSection {
            max_robots: Some(2),
            ..TaskSection::default()
        };
        scenario.tasks.insert(TOP.to_owned(), section);
    });
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let metrics = made.metrics();
    assert_eq!(metrics.takeovers, []);
    let orphan = metrics.failures[0].orphan.as_ref().unwrap();
    assert_eq!(
        orphan.aftermath,
        OrphanOutcome::Continued {
            at: at(45.0),
            by: BLUE
        }
    );
}

#[test]
fn a_robot_lost_without_a_task_leaves_no_orphan() {
    let mut made = Made::run(20.0);
    made.during("blue", 0.0, 20.0, None);
    made.during("gold", 0.0, 10.0, None);
    made.event(10.0, "gone", "gold", ["", "", ""]);
    assert_eq!(made.metrics().failures[0].orphan, None);
}

#[test]
fn impatience_and_activation_are_signs_too() {
    // Blue's impatience rises at 32 s, before τ has passed.
    let mut made = Made::run(60.0);
    made.rows("blue", 0.0, 32.0, |row| row.impatience = 0.1);
    made.during("blue", 32.0, 60.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.claim(29.5, "blue", "gold", TOP);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let detection = |made: &Made| {
        let orphan = made.metrics().failures[0].orphan.clone();
        orphan
            .unwrap()
            .detection
            .map(|found| (found.at, found.sign))
    };
    assert_eq!(
        detection(&made),
        Some((at(32.0), DetectionSign::Impatience))
    );

    // Green has received nothing from gold, and its own turn was due.
    made.during("green", 0.0, 31.0, None);
    made.during("green", 31.0, 60.0, Some(TOP));
    assert_eq!(
        detection(&made),
        Some((at(31.0), DetectionSign::Activation))
    );
}

#[test]
fn a_shared_task_is_covered_and_an_abandoned_one_is_not() {
    let mut made = Made::run(60.0);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let aftermath = |made: &Made| made.metrics().failures[0].orphan.clone().unwrap().aftermath;
    assert_eq!(aftermath(&made), OrphanOutcome::Abandoned);
    made.during("blue", 20.0, 40.0, Some(TOP));
    assert_eq!(aftermath(&made), OrphanOutcome::Covered { by: BLUE });
}

/// Blue executes the upper spill's task from 10 s, delivers last before 30 s and leaves at 50 s for `reason`. Gold
/// activates it at 52 s.
fn handover(reason: &str) -> Made {
    let mut made = Made::run(60.0);
    made.during("blue", 0.0, 10.0, None);
    made.during("blue", 10.0, 50.0, Some(TOP));
    made.during("blue", 50.0, 60.0, None);
    made.during("gold", 0.0, 52.0, None);
    made.during("gold", 52.0, 60.0, Some(TOP));
    made.event(29.5, "delivered", "blue", ["item-1", "", ""]);
    made.event(50.0, "hibernated", "blue", [TOP, reason, TOP]);
    made
}

#[test]
fn a_handover_counts_from_the_latest_effect() {
    for reason in ["acquiesced-psi", "gave-up-lambda", "reset-by gold"] {
        let made = handover(reason);
        assert_eq!(
            made.metrics().takeovers,
            [Takeover {
                at: at(52.0),
                task: made.task(TOP),
                from: BLUE,
                robot: GOLD,
                idle_since: at(30.0),
                cause: TakeoverCause::Left(reason.to_owned()),
            }]
        );
    }
    assert_eq!(handover("not-applicable").metrics().takeovers, []);
}

#[test]
fn a_robot_alone_and_a_run_without_a_tick() {
    let alone = |scenario: &mut Scenario| {
        scenario.robots = vec![Robot {
            name: "solo".to_owned(),
            ..Robot::default()
        }];
    };
    let mut made = Made::with(60.0, alone);
    made.during("solo", 0.0, 30.0, Some(TOP));
    made.event(30.0, "gone", "solo", ["", "", ""]);
    let orphan = made.metrics().failures[0].orphan.clone().unwrap();
    assert_eq!(
        (orphan.detection, orphan.aftermath),
        (None, OrphanOutcome::Abandoned)
    );

    let metrics = Made::with(0.0, alone).metrics();
    assert_eq!(metrics.robots[0].idle_share(), 0.0);
    assert_eq!(metrics.robots[0].activations_per_min(), 0.0);
    assert_eq!(metrics.stints.len(), 0);
    assert_eq!(metrics.recurring[0].overdue, SimTime::ZERO);
}

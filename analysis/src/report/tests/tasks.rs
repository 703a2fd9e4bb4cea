//! Times of tasks and robots.

use super::*;

#[test]
fn a_task_is_orphaned_unless_a_robot_is_productive_on_it() {
    let made = death();
    let metrics = made.metrics();
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.applicable, spans([(0.0, 60.0)]));
    // Gold was productive from 10 to 20 s, blue from 45 to 55 s.
    assert_eq!(top.orphan, spans([(0.0, 10.0), (20.0, 45.0), (55.0, 60.0)]));
    assert_eq!(top.unattended, spans([(0.0, 10.0), (30.0, 45.0)]));
    assert_eq!(top.duplicate, Some(Spans::default()));
    let bottom = &metrics.tasks[made.task(BOTTOM).index()];
    assert_eq!(bottom.orphan, spans([(0.0, 60.0)]));
    assert_eq!(bottom.unattended, bottom.orphan);
    // Never applicable to any robot.
    let report = &metrics.tasks[made.task(REPORT).index()];
    let none = Spans::default();
    assert_eq!((&report.applicable, &report.orphan), (&none, &none));
}

#[test]
fn stints_with_their_effects_and_ends() {
    let stints = death().metrics().stints;
    let facts: Vec<_> = stints
        .iter()
        .map(|stint| (stint.robot, stint.effects.clone(), stint.end.clone()))
        .collect();
    assert_eq!(
        facts,
        [
            (GOLD, vec![at(20.0)], StintEnd::Lost(Loss::Died, at(30.0))),
            (BLUE, vec![at(55.0)], StintEnd::Ongoing),
        ]
    );
}

/// Two robots execute one task from 15 to 20 s. The named one delivers last.
fn both(max_robots: u32, last: &str) -> Made {
    let mut made = shared(30.0, max_robots);
    made.add(&format!(
        "
        blue 10 20 top
        gold 0 15 -
        gold 15 25 top
        11.5 delivered blue
        17.5 delivered {last}
        20 hibernated blue acquiesced-psi
        "
    ));
    made
}

#[test]
fn two_robots_on_an_exclusive_task_count_as_duplicate() {
    let made = both(1, "gold");
    let metrics = made.metrics();
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.duplicate, Some(spans([(15.0, 20.0)])));
    let takeover = &metrics.takeovers[0];
    assert_eq!(takeover.cause, TakeoverCause::StillActive);
    assert_eq!(takeover.latency(), at(3.0));
    // A robot that delivers after the other one's activation has not been replaced.
    assert_eq!(both(1, "blue").metrics().takeovers, []);

    let made = both(2, "gold");
    let metrics = made.metrics();
    assert_eq!(metrics.tasks[made.task(TOP).index()].duplicate, None);
    assert_eq!(metrics.takeovers, []);
}

#[test]
fn shares_and_rates_count_the_time_in_which_a_robot_took_part() {
    let mut made = death();
    let figures = RobotFigures {
        messages_sent: 60,
        bytes_sent: 6_000,
        ..RobotFigures::default()
    };
    made.figures.robots.insert("gold".to_owned(), figures);
    let metrics = made.metrics();
    let gold = &metrics.robots[GOLD];
    assert_eq!((gold.present, gold.idle), (at(30.0), at(10.0)));
    assert_eq!(gold.idle_share(), 1.0 / 3.0);
    assert_eq!(gold.activations_per_min(), 2.0);
    let sent = SentTotals {
        messages: 60,
        bytes: 6_000,
    };
    assert_eq!(gold.sent, Some(sent));
    assert_eq!(sent.per_s(gold.present), (2.0, 200.0));
    assert_eq!(metrics.robots[GREEN].idle_share(), 1.0);
    assert_eq!(metrics.makespan, Some(at(60.0)));

    // A killed run has no record of its sent messages.
    made.outcome = RunOutcome::Running;
    let metrics = made.metrics();
    assert_eq!((metrics.robots[GOLD].sent, metrics.makespan), (None, None));
    made.outcome = RunOutcome::Ended(Outcome::TimeLimit);
    assert_eq!(made.metrics().makespan, None);
}

#[test]
fn lateness_of_reports() {
    let mut made = Made::run(600.0);
    for (seconds, robot) in [(130.0, "green"), (200.0, "gold"), (400.0, "green")] {
        made.event(seconds, "reported", robot, "");
    }
    let metrics = made.metrics();
    let [reports] = metrics.recurring.as_slice() else {
        panic!("{:?}", metrics.recurring)
    };
    let made = |seconds, by, interval, late| Occurrence {
        at: at(seconds),
        by: Some(by),
        interval: at(interval),
        late: at(late),
    };
    assert_eq!(
        reports.moments,
        [
            made(130.0, GREEN, 130.0, 10.0),
            made(200.0, GOLD, 70.0, 0.0),
            made(400.0, GREEN, 200.0, 80.0),
        ]
    );
    // The next report was due at 520 s.
    assert_eq!(reports.overdue, at(80.0));
}

#[test]
fn a_push_stroke_is_an_effect_and_observation_is_a_continuous_one() {
    let push = shipped("parker-box", 30.0);
    assert!(push.stints.len() > 8, "{:?}", push.stints);
    let ended = push
        .stints
        .iter()
        .filter(|stint| stint.end != StintEnd::Ongoing);
    for stint in ended {
        assert_eq!(stint.effects, [stint.span.to], "{stint:?}");
    }
    for task in &push.tasks {
        assert!(task.applicable.total() > task.orphan.total());
    }
    let observe = shipped("cmommt", 30.0);
    for task in &observe.tasks {
        assert_eq!(task.orphan, task.unattended);
        assert!(task.applicable.total() > task.orphan.total());
    }
}

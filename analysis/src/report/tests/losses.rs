//! Losses, their detection, and takeovers.

use super::*;

/// Compares the losses and takeovers of a hand-made log of 60 s.
#[track_caller]
fn check(log: &str, expected: &[&str]) {
    assert_eq!(Made::of(60.0, log).facts(), expected);
}

#[test]
fn a_death_its_detection_and_its_takeover() {
    let made = death();
    // Last received at 28.5 s, and τ = 5 s.
    let loss =
        "30.000 s gold Died, Silence of green 33.500 s, TakenOver { at: SimTime(45000), by: 0 }";
    let takeover = "45.000 s gold to blue, 30.000 s, Lost(Died)";
    assert_eq!(made.facts(), [loss, takeover]);
    let takeover = &made.metrics().takeovers[0];
    assert_eq!(
        (takeover.task, takeover.latency()),
        (made.task(TOP), at(15.0))
    );
}

#[test]
fn a_stopped_robot_that_comes_back() {
    for (back, detected) in [(40.0, ", Silence of blue 34.500 s"), (34.5, ""), (33.0, "")] {
        let log = format!(
            "
            blue 0 60 -
            gold 10 30 top
            gold {back} 60 top
            30 stalled gold
            {back} back gold
            "
        );
        let mut made = Made::of(60.0, &log);
        made.claim(29.5, "blue", "gold", TOP);
        let back_ms = at(back).0;
        let loss = format!(
            "30.000 s gold Stopped, back {back:.3} s{detected}, Resumed {{ at: SimTime({back_ms}) }}"
        );
        assert_eq!(made.facts(), [loss]);
        assert_eq!(made.metrics().robots[GOLD].present, at(20.0 + 60.0 - back));
    }
}

#[test]
fn a_stand_in_for_a_stopped_robot_takes_over_and_gives_back() {
    let made = Made::of(
        60.0,
        "
        blue 10 30 top
        blue 50 60 top
        gold 0 40 -
        gold 40 51 top
        30 stalled blue
        45 picked gold
        50 back blue
        51 waiting gold arbitration
        ",
    );
    let takeover = "40.000 s blue to gold, 30.000 s, Lost(Stopped)";
    assert_eq!(made.facts()[1..], [takeover]);
    let top = &made.metrics().tasks[made.task(TOP).index()];
    assert_eq!(top.duplicate, Some(spans([(50.0, 51.0)])));
}

/// Gold claims blue's task and yields; later blue yields to green.
#[test]
fn a_claim_that_is_withdrawn_takes_nothing_over() {
    check(
        "
        blue 10 40 top
        gold 0 20 -
        gold 20 21 top
        green 0 45 -
        green 45 60 top
        21 waiting gold arbitration
        40 hibernated blue acquiesced-psi
        ",
        &["45.000 s blue to green, 10.000 s, Left(\"acquiesced-psi\")"],
    );
}

/// Green bids for a task for one step, gold executes it and dies, and green bids again. Then blue takes over for good.
#[test]
fn a_claim_of_one_step_is_no_takeover_and_the_lost_robot_is_the_predecessor() {
    let made = Made::of(
        60.0,
        "
        green 5 5.5 top
        green 5.5 33 -
        green 33 33.5 top
        green 33.5 60 -
        gold 0 10 -
        gold 10 30 top
        blue 0 45 -
        blue 45 60 top
        5.5 hibernated green outbid
        30 gone gold
        33.5 hibernated green outbid
        ",
    );
    let loss =
        "30.000 s gold Died, Activation of green 33.000 s, TakenOver { at: SimTime(45000), by: 0 }";
    let takeover = "45.000 s gold to blue, 30.000 s, Lost(Died)";
    assert_eq!(made.facts(), [loss, takeover]);
    // The facts, the losses and the takeovers of the page have the same number.
    let page = made.page();
    for text in [
        "gold died at 30.00 s while it executed move-spill(top); blue took over after 15.00 s.",
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
    check(
        "
        gold 10 30 top
        blue 0 15 -
        blue 15 20 top
        blue 20 60 -
        green 0 40 -
        green 40 60 top
        20 hibernated blue acquiesced-psi
        30 gone gold
        ",
        &[
            "30.000 s gold Died, Activation of green 40.000 s, TakenOver { at: SimTime(40000), by: 2 }",
            "15.000 s gold to blue, 10.000 s, StillActive",
            "40.000 s gold to green, 30.000 s, Lost(Died)",
        ],
    );
}

/// A task for two robots has no takeovers; its loss names the next robot all the same.
#[test]
fn a_shared_task_is_continued_without_a_takeover() {
    let mut made = shared(60.0, 2);
    made.add(
        "
        gold 10 30 top
        blue 0 45 -
        blue 45 60 top
        30 gone gold
        ",
    );
    let loss =
        "30.000 s gold Died, Activation of blue 45.000 s, Continued { at: SimTime(45000), by: 0 }";
    assert_eq!(made.facts(), [loss]);
}

#[test]
fn a_robot_lost_without_a_task_leaves_no_orphan() {
    check(
        "
        blue 0 20 -
        gold 0 10 -
        10 gone gold
        ",
        &["10.000 s gold Died"],
    );
}

#[test]
fn impatience_and_activation_are_signs_too() {
    // Blue's impatience rises at 32 s, before τ has passed.
    let mut made = Made::run(60.0);
    made.rows("blue", 0.0, 32.0, |row| row.impatience = 0.1);
    made.add(
        "
        blue 32 60 -
        gold 10 30 top
        30 gone gold
        ",
    );
    made.claim(29.5, "blue", "gold", TOP);
    let impatience = "30.000 s gold Died, Impatience of blue 32.000 s, Abandoned";
    assert_eq!(made.facts(), [impatience]);

    // Green has received nothing from gold, and its own turn was due.
    made.add(
        "
        green 0 31 -
        green 31 60 top
        ",
    );
    let activation = "30.000 s gold Died, Activation of green 31.000 s, ";
    assert!(made.facts()[0].starts_with(activation));
}

#[test]
fn a_shared_task_is_covered_and_an_abandoned_one_is_not() {
    let alone = "
        gold 10 30 top
        30 gone gold
    ";
    check(alone, &["30.000 s gold Died, Abandoned"]);
    let covered = Made::of(60.0, &format!("{alone}\n blue 20 40 top")).facts();
    assert!(covered[0].ends_with("Covered { by: 0 }"), "{covered:?}");
}

/// Blue executes the upper spill's task from 10 s, delivers last before 30 s and leaves at 50 s. Gold activates it at
/// 52 s.
#[test]
fn a_handover_counts_from_the_latest_effect() {
    let log = |reason: &str| {
        format!(
            "
            blue 0 10 -
            blue 10 50 top
            blue 50 60 -
            gold 0 52 -
            gold 52 60 top
            29.5 delivered blue
            50 hibernated blue {reason}
            "
        )
    };
    for reason in ["acquiesced-psi", "gave-up-lambda", "reset-by gold"] {
        let takeover = format!("52.000 s blue to gold, 30.000 s, Left({reason:?})");
        check(&log(reason), &[&takeover]);
    }
    check(&log("not-applicable"), &[]);
}

#[test]
fn one_of_several_losses_with_a_takeover() {
    let made = Made::of(
        60.0,
        "
        gold 10 30 top
        green 0 20 -
        blue 0 45 -
        blue 45 60 top
        20 gone green
        30 gone gold
        ",
    );
    let sentence = "2 losses of robots, 1 of them at a task; 1 task was taken over, after 15.00 s.";
    let page = made.page();
    assert!(page.contains(sentence), "{page}");
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
    made.add(
        "
        solo 0 30 top
        30 gone solo
        ",
    );
    assert_eq!(made.facts(), ["30.000 s solo Died, Abandoned"]);

    let metrics = Made::with(0.0, alone).metrics();
    assert_eq!(metrics.robots[0].idle_share(), 0.0);
    assert_eq!(metrics.robots[0].activations_per_min(), 0.0);
    assert_eq!(metrics.stints.len(), 0);
    assert_eq!(metrics.recurring[0].overdue, SimTime::ZERO);
}

/// The detection that the views show is that of the report.
#[test]
fn views_show_the_detection_of_the_report() {
    let text = "limit_s = 120.0\n[[faults.timeline]]\nfault.kill = 'gold'\nat_s = 75.0\n";
    let log = testkit::run(testkit::setup(testkit::scenario(text)));
    let setup = &log.run.setup;
    let history = History::read(&log).unwrap();
    let metrics = Metrics::compute(&history, &log.run);
    let failure = &metrics.failures[0];
    let orphan = failure.orphan.as_ref().unwrap();
    let detection = orphan.detection.unwrap();
    let mut watch = DetectionWatch::new(setup);
    let mut events = Vec::new();
    // A live run at full speed shows only some views.
    let mut sparse = (DetectionWatch::new(setup), Vec::new());
    retrace_into(&log, LogLevel::Off, MemoryLog::default(), |simulation| {
        let view = simulation.view();
        events.extend(watch.see(&view));
        if simulation.tick().is_multiple_of(40) {
            sparse.1.extend(sparse.0.see(&view));
        }
    })
    .unwrap();
    let [event] = &sparse.1[..] else {
        panic!("{:?}", sparse.1);
    };
    let about = event.detail.strip_prefix("about ").unwrap();
    assert!(about.ends_with(" s after its death"), "{about}");
    let [event] = &events[..] else {
        panic!("{events:?}");
    };
    let name = |rank: usize| setup.scenario.robots[rank].name.as_str();
    assert_eq!(
        (event.t_ms, event.robot.as_str()),
        (detection.at, name(detection.robot))
    );
    assert_eq!(event.subject, history.catalog.task_name(orphan.task));
    assert_eq!(event.reason, "gold");
    let delay = detection.at.since(failure.at);
    let delay = format!("{:.2} s after its death", delay.as_secs_f64());
    assert_eq!(event.detail, delay);
}

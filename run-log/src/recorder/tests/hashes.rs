//! Hashes are the same at every log level, and each section has its own.

use scenario::testkit::default_setup;
use std::collections::BTreeMap;

use proto::mission::Action;

use super::*;

/// Returns the hashes of ticks.csv by (tick, robot, section), without those of tables and of the run.
fn hashes(ticks: &[OwnedTick]) -> BTreeMap<(Tick, String, String), u64> {
    let (run, memory) = log(LogLevel::Full, ticks);
    let log = read(run, memory);
    let rows: Vec<TickRow> = log.rows().unwrap();
    rows.into_iter()
        .filter(|row| row.section != RUN_SECTION && !row.section.contains('.'))
        .map(|row| ((row.tick, row.robot, row.section), row.hash.0))
        .collect()
}

/// Returns the (robot, section) pairs of tick 1 that `change` changes. Checks that the run's hash changes and other ticks do not.
fn changed(change: impl FnOnce(&mut OwnedTick)) -> Vec<String> {
    let before = sample();
    let mut after = before.clone();
    change(&mut after[1]);
    let run = |ticks: &[OwnedTick]| log(LogLevel::Off, ticks).0.hash.unwrap();
    assert_ne!(run(&before), run(&after));
    let (before, after) = (hashes(&before), hashes(&after));
    let keys = before
        .keys()
        .chain(after.keys())
        .cloned()
        .collect::<std::collections::BTreeSet<_>>();
    let differ = keys
        .into_iter()
        .filter(|key| before.get(key) != after.get(key));
    differ
        .map(|(tick, robot, section)| {
            assert_eq!(tick, 1);
            format!("{robot} {section}")
        })
        .collect()
}

#[test]
fn level_does_not_change_the_hash() {
    let hash = |level| log(level, &sample()).0.hash.unwrap();
    for level in LogLevel::ALL {
        assert_eq!(hash(LogLevel::Full), hash(level), "{level:?}");
    }
}

#[test]
fn flushes_do_not_change_the_log() {
    let mut recorder =
        Recorder::new(&default_setup(7), LogLevel::Summary, MemoryLog::default()).unwrap();
    for tick in sample() {
        tick.record(&mut recorder).unwrap();
        recorder.flush().unwrap();
    }
    let run = recorder
        .finish(Outcome::TimeLimit, Ending::default())
        .unwrap();
    assert_eq!(
        (run, recorder.into_sink()),
        log(LogLevel::Summary, &sample())
    );
}

#[test]
fn the_hash_is_available_after_every_tick() {
    let ticks = sample();
    let mut recorder =
        Recorder::new(&default_setup(7), LogLevel::Off, MemoryLog::default()).unwrap();
    for (index, tick) in ticks.iter().enumerate() {
        tick.record(&mut recorder).unwrap();
        let (run, _) = log(LogLevel::Full, &ticks[..=index]);
        assert_eq!(Some(recorder.hash()), run.hash);
    }
}

#[test]
fn every_bit_of_a_float_counts() {
    for bit in 0..32 {
        let flip = |value: &mut f32| *value = f32::from_bits(value.to_bits() ^ (1 << bit));
        assert_eq!(
            changed(|tick| flip(&mut tick.robots[2].0.pose.position.x)),
            ["world state"]
        );
        assert_eq!(
            changed(|tick| flip(&mut tick.blue().1.actuation.turn_rad_s)),
            ["blue commands"]
        );
        let change_sensor = |tick: &mut OwnedTick| {
            let mut at = Vec2::new(0.5, -0.25);
            flip(&mut at.y);
            tick.blue().0.mission = SensorReading::new(at);
        };
        assert_eq!(changed(change_sensor), ["blue readings"]);
    }
    for bit in 0..64 {
        let flip = |value: &mut f64| *value = f64::from_bits(value.to_bits() ^ (1 << bit));
        assert_eq!(
            changed(|tick| flip(&mut tick.blue().1.motivations[1].impatience)),
            ["blue motivations"]
        );
    }
}

#[test]
fn every_part_counts_in_its_section() {
    type Change = fn(&mut OwnedTick);
    fn received(tick: &mut OwnedTick) -> &mut Reception {
        &mut tick.blue().1.receptions[0]
    }
    fn summary(tick: &mut OwnedTick) -> &mut BroadcastSummary {
        received(tick).content.as_mut().unwrap()
    }
    let stall = |tick: &mut OwnedTick| {
        tick.inputs.push(Input::StallBegin {
            robot: "gold".to_owned(),
            scripted: false,
        });
    };
    let open = |tick: &mut OwnedTick| {
        tick.blue().1.actuation.action = Action::Open(proto::mission::Bytes::default());
    };
    let sections: [(&str, &[Change]); 7] = [
        (
            "blue readings",
            &[
                |tick| tick.blue().0.mission = SensorReading::Nothing,
                |tick| tick.blue().0.pose = Some(Pose::default()),
            ],
        ),
        ("blue commands", &[open]),
        (
            "blue messages",
            &[
                |tick| tick.blue().1.broadcasts ^= 1,
                |tick| received(tick).at.0 ^= 1,
                |tick| received(tick).delivery = Delivery::Lost,
                |tick| summary(tick).seq ^= 1,
                |tick| summary(tick).state = None,
                |tick| summary(tick).progress = Some(5),
            ],
        ),
        (
            "blue motivations",
            &[
                |tick| tick.blue().1.motivations[0].acquiescence ^= true,
                |tick| tick.blue().1.changes[0].reason = Reason::WaitOver,
                |tick| tick.blue().1.notes[0].detail.push('.'),
            ],
        ),
        (
            "world events",
            &[
                |tick| tick.events[0].kind = EventKind::Mission("dropped"),
                |tick| tick.events[0].robot = None,
                |tick| tick.events[0].subject.push('1'),
                |tick| tick.events[0].reason.push('1'),
                |tick| tick.events[0].detail.push('1'),
                |tick| tick.events.clear(),
            ],
        ),
        (
            "world state",
            &[
                |tick| tick.robots[0].0.carrying ^= true,
                |tick| tick.robots[0].0.active = None,
                |tick| tick.robots[0].0.energy_j = None,
                |tick| tick.mission_state ^= 1,
            ],
        ),
        ("world inputs", &[|tick| tick.inputs.clear(), stall]),
    ];
    for (section, changes) in sections {
        for (number, change) in changes.iter().enumerate() {
            assert_eq!(changed(change), [section], "{section} {number}");
        }
    }
    let gold = [
        "gold commands",
        "gold messages",
        "gold motivations",
        "gold readings",
    ];
    assert_eq!(changed(|tick| tick.robots[1].1 = None), gold);
}

//! A team on several threads has the same bytes as on one, with faults of messages, devices and processes.

#![allow(clippy::unwrap_used)] // Clippy exempts test functions only, not their helpers.

use in_process::{Team, joins_of, threads_for};
use missions::Registry;
use run_log::{LogLevel, MemoryLog};
use scenario::ids::RobotId;
use scenario::{Scenario, Setup};

/// Some allocators: without and with messages, with auctions, consensus and ground truth.
const ALLOCATORS: [&str; 5] = ["alliance", "nearest-silent", "murdoch", "cbba", "oracle"];

/// Returns a mission of 70 robots, which are three chunks, the last one incomplete.
fn setup(mission: &str, allocator: &str, with_sensor_faults: bool) -> Setup {
    let vocabulary = Registry::built_in().vocabulary();
    let mut missions = vocabulary.missions.iter();
    let mission = missions.find(|known| known.scenario_name() == mission);
    let mut scenario = mission.unwrap().family(70, 40).unwrap();
    scenario.allocator = Some(allocator.to_owned());
    scenario.limit_s = 6.0;
    let [killed, stopped, blind] = [1, 33, 65].map(|rank: usize| &scenario.robots[rank].name);
    let mut faults = format!(
        "[[faults.timeline]]\nat_s = 0.5\nfor_s = 4.0\nfault.drop = {{ p = 0.3 }}\n\
         [[faults.timeline]]\nat_s = 1.0\nfault.delay = {{ delay_s = 0.3, jitter_s = 0.2 }}\n\
         [[faults.timeline]]\nat_s = 1.0\nfor_s = 2.0\nfault.kill = {killed:?}\n\
         [[faults.timeline]]\nat_s = 1.5\nfor_s = 1.0\nfault.pause = {stopped:?}\n\
         [[faults.timeline]]\nat_s = 2.0\nfault.actuator = {{ robot = {blind:?}, mode = {{ slowed = 0.4 }} }}\n"
    );
    if with_sensor_faults {
        faults += &format!(
            "[[faults.timeline]]\nat_s = 2.0\nfor_s = 2.0\n\
             fault.sensor = {{ robot = {blind:?}, device = \"position\", mode = {{ noise = {{ m = 0.1, deg = 2.0 }} }} }}\n"
        );
    }
    let text = format!("{}\n{faults}", scenario.to_toml().unwrap());
    let scenario = Scenario::parse("s.toml", &text, &vocabulary).unwrap();
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Returns the hash of a run, and the bytes of its log, written by the calling thread.
fn run(setup: &Setup, threads: usize) -> (String, MemoryLog) {
    let mut team = Team::new(setup.clone(), LogLevel::Full, MemoryLog::default()).unwrap();
    team.use_threads(threads).unwrap();
    let (_, recorder) = team.run().unwrap();
    (recorder.hash(), recorder.into_sink())
}

/// Returns the bytes of a run's log, written by a thread of its own.
fn run_in_background(setup: &Setup, threads: usize) -> (String, MemoryLog) {
    let mut team = Team::new(setup.clone(), LogLevel::Full, MemoryLog::default()).unwrap();
    team.use_threads(threads).unwrap();
    let mut team = team.into_background(true).unwrap();
    let outcome = loop {
        if let Some(outcome) = team.tick().unwrap() {
            break outcome;
        }
    };
    let (_, recorder) = team.end(outcome).unwrap();
    (recorder.hash(), recorder.into_sink())
}

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let vocabulary = Registry::built_in().vocabulary();
    for mission in vocabulary.missions.iter() {
        for (index, allocator) in ALLOCATORS.into_iter().enumerate() {
            // Readings are sensed on all threads only until the first fault of a sensor.
            let setup = setup(mission.scenario_name(), allocator, index % 2 == 0);
            let name = format!("{}, {allocator}", mission.scenario_name());
            let alone = run(&setup, 1);
            let run_file = &alone.1.documents[&run_log::Document::Run];
            assert!(run_file.contains("\"hits\": 1"), "{name}: the kill");
            for threads in [2, 5] {
                assert!(run(&setup, threads) == alone, "{name}: {threads} threads");
            }
            assert!(run_in_background(&setup, 3) == alone, "{name}: background");
        }
    }
}

/// Robots that step in order leave the threads unused, and so do ticks with outside inputs.
#[test]
fn ordered_steps_and_repeated_inputs_have_the_same_bytes() {
    let mut in_order = setup("waste-cleanup", "alliance", true);
    in_order.step_order = scenario::StepOrder::InOrder;
    assert!(run(&in_order, 1) == run(&in_order, 2));
    let setup = setup("waste-cleanup", "alliance", false);
    let repeat = |threads| {
        let mut inputs = joins_of(&setup);
        inputs.push(run_log::InputLine {
            tick: 20,
            input: run_log::Input::StallBegin {
                robot: setup.scenario.robots[7].name.clone(),
                scripted: false,
            },
        });
        let sink = MemoryLog::default();
        let mut team = Team::with_inputs(setup.clone(), inputs, LogLevel::Full, sink).unwrap();
        team.use_threads(threads).unwrap();
        let (_, recorder) = team.run().unwrap();
        (recorder.hash(), recorder.into_sink())
    };
    let alone = repeat(1);
    assert!(alone != run(&setup, 1), "the input has an effect");
    assert!(repeat(2) == alone);
}

/// Ranks and tasks need more than 16 bits here. The robots turn at once.
#[test]
fn ranks_and_tasks_of_more_than_16_bits_run_on_any_number_of_threads() {
    const ROBOTS: usize = 66_000;
    let vocabulary = Registry::built_in().vocabulary();
    let mut missions = vocabulary.missions.iter();
    let waste = missions.find(|mission| mission.scenario_name() == "waste-cleanup");
    let mut scenario = waste.unwrap().family(ROBOTS, 66_000).unwrap();
    scenario.allocator = Some("nearest-silent".to_owned());
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    assert!(setup.catalog.tasks.len() > 66_000);
    let steps = |threads| {
        let mut team = Team::new(setup.clone(), LogLevel::Off, MemoryLog::default()).unwrap();
        team.use_threads(threads).unwrap();
        let pose = |team: &Team<_>, rank| team.simulation().world().pose(RobotId(rank));
        let starts: Vec<_> = (0..ROBOTS as u32).map(|rank| pose(&team, rank)).collect();
        for _ in 0..10 {
            assert_eq!(team.tick().unwrap(), None);
        }
        let moved = (0..)
            .zip(&starts)
            .filter(|(rank, start)| pose(&team, *rank) != **start);
        let moved = moved.count();
        assert!(moved > ROBOTS / 2, "{moved} robots move");
        team.hash()
    };
    assert_eq!(steps(1), steps(2));
}

#[test]
fn small_teams_use_one_thread() {
    let threads = [3, 100, 255, 256, 1_000, 10_000].map(|robots| threads_for(robots, 4));
    assert_eq!(threads, [1, 1, 1, 2, 4, 4]);
    assert_eq!(threads_for(10_000, 1), 1);
}

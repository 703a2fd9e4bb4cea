//! The contents of logs, and reports of missions and allocators without motivations.

use super::*;

#[test]
fn only_reductions_of_motivation_count_as_resets() {
    let mut made = Made::run(10.0);
    made.rows("blue", 0.0, 1.0, |row| row.motivation = 5.0);
    for (from, level) in [(1.0, 0.0), (1.5, 0.0)] {
        made.rows("blue", from, from + 0.5, |row| {
            row.impatience_reset = false;
            row.motivation = level;
        });
    }
    let sets = &made.history.robots[BLUE].sets;
    for set in sets {
        let resets: Vec<SimTime> = set.resets.iter().map(|reset| reset.at).collect();
        assert_eq!(resets, [at(1.0)], "{}", set.name);
        assert_eq!(set.levels.len(), 4);
    }
}

#[test]
fn each_reset_names_its_sender() {
    let (history, _) = run_of(testkit::setup(testkit::shipped("thesis-no-interruption")));
    let mut count = 0;
    for (rank, robot) in history.robots.iter().enumerate() {
        for reset in robot.sets.iter().flat_map(|set| &set.resets) {
            assert!(!reset.by.is_empty(), "{} at {}", robot.name, reset.at);
            assert!(!reset.by.contains(&rank), "{} at {}", robot.name, reset.at);
            count += 1;
        }
    }
    assert!(count > 10, "{count} resets");
}

#[test]
fn rows_of_another_run_are_refused() {
    let mut history = Made::run(10.0).history;
    let error = history.add_motivation(&motivation(0, "red", TOP));
    assert_eq!(
        error.unwrap_err().to_string(),
        "motivations.csv has a row about 'red', which is not in run.json"
    );
    let error = history.add_utility(&utility(0, "sing", 0.5));
    assert_eq!(
        error.unwrap_err().to_string(),
        "allocation.csv has a row about 'sing', which is not in run.json"
    );
}

/// Blue has two behavior sets that find the locations, with different utilities.
#[test]
fn each_behavior_set_has_its_own_utilities() {
    let mut history = Made::run(10.0).history;
    for (t_ms, set, level) in [
        (0, "find-locations-methodical", 0.5),
        (0, "find-locations-wander", 0.25),
        (50, "find-locations-wander", 1.0),
    ] {
        history.add_utility(&utility(t_ms, set, level)).unwrap();
    }
    let levels = |name: &str| {
        let mut sets = history.robots[0].sets.iter();
        sets.find(|set| set.name == name).unwrap().levels.clone()
    };
    assert_eq!(levels("find-locations-methodical"), [(SimTime(0), 0.5)]);
    let wander = [(SimTime(0), 0.25), (SimTime(50), 1.0)];
    assert_eq!(levels("find-locations-wander"), wander);
}

/// Reports a mission that this program does not contain, with a map, figures and tables.
#[test]
fn the_report_of_an_external_mission_shows_its_marks_columns_and_events() {
    let mut run = visit::run_file();
    run.result.mission.add("places_visited", 3_u32);
    let tables = [(Table::Mission, visit::TABLE.as_bytes().to_vec())];
    let log = RunLog::from_tables(Path::new(""), run, tables.into());
    let mut made = Made::run(60.0);
    made.history.catalog = Arc::clone(&log.run.setup.catalog);
    made.history.mission = log.rows().unwrap();
    made.history.marks = visit::marks().to_vec();
    for robot in ["blue", "gold", "green"] {
        made.history.add_pose(&pose(robot)).unwrap();
    }
    for (seconds, robot) in [(10.0, "blue"), (20.0, "gold")] {
        made.event(seconds, "visited", robot, "");
    }
    let metrics = Metrics::compute(&made.history, &log.run);
    let [visits] = metrics.recurring.as_slice() else {
        panic!("{:?}", metrics.recurring)
    };
    assert_eq!((visits.event, visits.moments.len()), ("visited", 2));
    // The next visit is due after 15 s.
    assert_eq!(visits.overdue, at(25.0));

    let figures = figures(&made.history, &metrics, &FigureSelection::default())
        .unwrap()
        .figures;
    let svg = |name: &str| {
        let mut figures = figures.iter();
        &figures.find(|figure| figure.name == name).expect(name).svg
    };
    for label in ["place", "home", "box", "rope"] {
        assert!(svg("map").contains(&format!("{label}\n")), "{label}");
    }
    for label in ["places left", "places visited"] {
        assert!(svg("mission").contains(label), "{label}");
    }
    assert!(svg("mission-way-m").contains("way m"));
    assert!(svg("every-visited").contains("gold: in time"));
    let (page, _) = page(&RunSection {
        run: &log.run,
        history: &made.history,
        metrics: &metrics,
        figures,
        undrawn: Vec::new(),
        made: MadeHow::default(),
    });
    for text in [
        "3 of 5 places visited",
        "Events: visited",
        "Wanted period: 15 s",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

fn pose(robot: &str) -> PoseRow {
    PoseRow {
        t_ms: SimTime::ZERO,
        robot: robot.to_owned(),
        x_m: 1.0,
        y_m: 1.0,
        heading_rad: 0.0,
        speed_m_s: 0.0,
        carrying: false,
        behavior_set: String::new(),
        energy: None,
    }
}

#[test]
fn utilities_are_drawn_where_there_are_no_motivations() {
    let scenario = Scenario {
        allocator: Some("nearest".to_owned()),
        limit_s: 60.0,
        ..default_scenario()
    };
    let (history, run) = run_of(testkit::setup(scenario));
    let whole = Span {
        from: SimTime::ZERO,
        to: history.end,
    };
    for robot in &history.robots {
        assert_eq!(robot.measure, LevelUnit::Utility);
        assert_eq!(robot.present.iter().collect::<Vec<_>>(), [whole]);
        assert!(robot.sets.iter().any(|set| !set.levels.is_empty()));
        let active = robot.active();
        assert!(active.total() > at(30.0), "{}: {active:?}", robot.name);
    }
    // The events show the same activations.
    let set = |robot: &str, name: &str| {
        let robot = &history.robots[history.rank(robot).unwrap()];
        robot.sets.iter().find(|set| set.name == name).unwrap()
    };
    for event in history.events_of("activated") {
        let begins = set(&event.robot, &event.subject)
            .active
            .contains(event.t_ms);
        assert!(begins, "{event:?}");
    }
    let metrics = Metrics::compute(&history, &run);
    let figures = figures(&history, &metrics, &FigureSelection::default())
        .unwrap()
        .figures;
    let mut figures = figures.iter();
    let blue = figures.find(|figure| figure.name == "robot-blue").unwrap();
    assert!(blue.caption.starts_with("Utility of"), "{}", blue.caption);
    assert!(blue.svg.contains("utility u") && !blue.svg.contains("threshold"));
}

use missions::waste::data::{WasteSection, default_scenario};
use scenario::Preset;

use super::*;
use crate::sweep::design::Cell;
use crate::testkit;

fn parse(text: &str) -> anyhow::Result<Plan> {
    Plan::parse("plan.toml", text, |name| {
        anyhow::ensure!(
            name == "mine",
            "'{name}' is neither a built-in scenario nor a file"
        );
        Ok(testkit::scenario("name = 'mine'\nlimit_s = 9.0"))
    })
}

/// Returns the scenario of a run.
fn scenario(plan: &Plan, run: usize) -> Scenario {
    Scenario::from_table(&plan.scenario(run).unwrap(), &vocabulary()).unwrap()
}

fn runs(plan: &Plan) -> Vec<String> {
    (0..plan.design.runs().unwrap())
        .map(|run| {
            let cells: Vec<String> = plan.design.cells(run).map(Cell::to_string).collect();
            cells.join(" ")
        })
        .collect()
}

#[test]
fn an_empty_plan_is_one_run_of_the_default_mission() {
    let plan = parse("").unwrap();
    assert_eq!(runs(&plan), ["1"]);
    assert_eq!(scenario(&plan, 0), default_scenario());
}

#[test]
fn grid_list_presets_faults_and_seeds_are_combined() {
    let plan = parse(
        "scenario = 'mine'\nlimit_s = 5.0\nseeds = { from = 3, to = 4 }\npresets = ['team', 'par98']\n\
         [grid]\nroom.width_m = [12.0, 20.0]\n'waste.spills.0.items' = [2]\n\
         [[list]]\nbody.speed_m_s = 0.5\nbody.turn_deg_s = 90\n\
         [[list]]\nbody = { turn_deg_s = 45, speed_m_s = 0.25 }\n\
         [faults.none]\n[faults.kill]\ntimeline = [{ fault.kill = 'gold', at_s = 1.0 }]\n",
    )
    .unwrap();
    let columns: Vec<&str> = plan.design.columns().collect();
    assert_eq!(
        columns.join(" "),
        "room.width_m waste.spills.0.items body.speed_m_s body.turn_deg_s preset faults seed"
    );
    let runs = runs(&plan);
    assert_eq!(runs.len(), 2 * 2 * 2 * 2 * 2);
    assert_eq!(runs[0], "12 2 0.5 90 team kill 3");
    assert_eq!(runs[31], "20 2 0.25 45 par98 none 4");
    let scenario = scenario(&plan, 29);
    assert_eq!(runs[29], "20 2 0.25 45 par98 kill 4");
    assert_eq!(plan.design.seed(29), 4);
    assert_eq!(scenario.name, "mine");
    assert_eq!(scenario.limit_s, 5.0);
    let body = scenario.body;
    assert_eq!((scenario.room.width_m, body.turn_deg_s), (20.0, 45.0));
    let spills = &WasteSection::of(&scenario).spills;
    assert_eq!((spills[0].items, spills[1].items), (2, 12));
    assert_eq!(scenario.alliance.preset, Preset::Par98);
    assert_eq!(scenario.faults.timeline.len(), 1);
}

#[test]
fn a_class_of_faults_sets_keys_of_the_scenario() {
    let classes = "[faults.faded.set]\nradio.fading = { d0_m = 5.0, path_loss_exponent = 3.0 }\n\
         [faults.near.set]\nradio.range_m = 2.0\n[faults.nearer.set]\nradio.range_m = 1.0\n";
    for missions in ["", "[missions.one]\nscenario = 'mine'\n"] {
        let plan = parse(&format!("{missions}{classes}")).unwrap();
        let columns: Vec<&str> = plan.design.columns().collect();
        assert_eq!(columns[columns.len() - 2..], ["faults", "seed"]);
        let radios = (0..3).map(|run| scenario(&plan, run).radio);
        let radios: Vec<::scenario::Radio> = radios.collect();
        assert_eq!(radios[0].fading.map(|fading| fading.d0_m), Some(5.0));
        assert_eq!(
            (radios[1].range_m, radios[2].range_m),
            (Some(2.0), Some(1.0))
        );
        assert_eq!((radios[0].range_m, radios[1].fading), (None, None));
        for (wrong, expected) in [
            ("[faults.far.set]\nradio.range_m = 0.0\n", "radio.range_m"),
            (
                "[grid]\nradio.range_m = [3.0]\n",
                "varies the same key; vary each key in one place",
            ),
        ] {
            let error = parse(&format!("{missions}{classes}{wrong}")).unwrap_err();
            let error = format!("{error:#}");
            assert!(
                error.contains("plan.toml:") && error.contains(expected),
                "{error}"
            );
        }
    }
}

#[test]
fn random_points_with_an_inline_scenario() {
    let plan = parse(
        "seeds = [5]\nscenario = { name = 'here', robots = [{ name = 'solo', side_sensor = true }] }\n\
         [random]\nn = 50\nseed = 2\nbody.speed_m_s = { min = 0.2, max = 0.8 }\nstep_ms = { min = 20, max = 40 }\n\
         alliance.defaults.ceased_after_s = { min = 2, max = 100, log = true }\n\
         'alliance.sets.move-spill(top).fast_impatience' = { choose = [5.0, 10.0] }\n",
    )
    .unwrap();
    assert_eq!(plan.design.runs(), Some(50));
    for run in 0..50 {
        let scenario = scenario(&plan, run);
        assert_eq!(scenario.robots.len(), 1);
        assert!((0.2..=0.8).contains(&scenario.body.speed_m_s));
        assert!((20..=40).contains(&scenario.step_ms));
        let set = &scenario.alliance.sets["move-spill(top)"];
        assert!([Some(5.0), Some(10.0)].contains(&set.fast_impatience));
    }
}

#[test]
fn random_missions_depend_only_on_the_seed() {
    let plan = parse(
        "seeds = 3\ncheck = true\n[grid]\nbody.speed_m_s = [0.5, 1.0]\n\
         [random_mission]\nrobots = { min = 2, max = 8 }\nobstacles = { min = 3, max = 3 }\n\
         faults = { min = 5, max = 5, until_s = 60.0 }\n",
    )
    .unwrap();
    assert!(plan.check);
    let scenario = |run| scenario(&plan, run);
    assert_eq!(scenario(0).faults.timeline.len(), 5);
    assert_eq!(scenario(0).obstacles.len(), 3);
    assert_ne!(scenario(0).obstacles, scenario(1).obstacles);
    let mut faster = scenario(1);
    faster.body.speed_m_s = 1.0;
    assert_eq!(faster, scenario(4));
}

#[test]
fn each_seed_draws_a_start_and_a_layout() {
    let text = "seeds = 3\nrandomise = ['start', 'layout']\n[grid]\nbody.speed_m_s = [0.5, 1.0]\n";
    let plan = parse(text).unwrap();
    let scenario = |run| scenario(&plan, run);
    assert_ne!(scenario(0).robots, scenario(1).robots);
    let spills = |run| WasteSection::of(&scenario(run)).spills.clone();
    assert_ne!(spills(0), spills(1));
    let mut faster = scenario(1);
    faster.body.speed_m_s = 1.0;
    assert_eq!(faster, scenario(4));
    // A search executes a run with other seeds.
    assert_eq!(plan.scenario_of_seed(0, 2), plan.scenario(1));
    let only_layout = parse(&text.replace("'start', ", "")).unwrap();
    let robots = |plan: &Plan| self::scenario(plan, 0).robots;
    assert_eq!(robots(&only_layout), robots(&parse("").unwrap()));
    assert_ne!(plan.digest(), only_layout.digest());
}

#[test]
fn the_digest_ignores_comments_and_table_order() {
    let digest = |text: &str| parse(text).unwrap().digest();
    let plan = digest("seeds = 2\n[grid]\nstep_ms = [50, 25]\n");
    assert_eq!(
        plan,
        digest("# more\nseeds = [1, 2]\ngrid = { step_ms = [50, 25] }\n")
    );
    for other in [
        "seeds = 3\n[grid]\nstep_ms = [50, 25]\n",
        "seeds = 2\n[grid]\nstep_ms = [25, 50]\n",
        "seeds = 2\nlimit_s = 9.0\n[grid]\nstep_ms = [50, 25]\n",
        "seeds = 2\ncheck = true\n[grid]\nstep_ms = [50, 25]\n",
        "seeds = 2\n[grid]\nstep_ms = [50, 25]\n[random_mission]\nrobots = { min = 1, max = 2 }\n",
        "seeds = 2\n[grid]\nstep_ms = [50, 25]\n[hypotheses.h]\nat_most = 1.0\n",
    ] {
        assert_ne!(plan, digest(other), "{other}");
    }
    let kill = |robot: &str| format!("[faults.a]\ntimeline = [{{ fault.kill = '{robot}' }}]");
    assert_ne!(digest(&kill("gold")), digest(&kill("blue")));
    let claim = |most: &str| format!("[hypotheses.h]\nat_most = {most}\n");
    assert_ne!(digest(&claim("1.0")), digest(&claim("2.0")));
}

/// The last plan misspells a key of a scenario, and the three before it are scenarios.
#[test]
fn mistakes_give_one_line() {
    let plans = [
        "seeds = ",
        "[grod]\n",
        "\nseeds = 0\n",
        "seeds = 'all'\n",
        "seeds = [3, 3]\n",
        "presets = ['tam']\n",
        "scenario = 'other'\n",
        "limit_s = -1.0\n",
        "[scenario]\n\n[scenario.room]\nwidht_m = 3\n",
        "[grid]\nalliance.defaults.ceased_after = [4.0]\n",
        "[grid]\nstep_ms = 50\n",
        "[grid]\nstep_ms = []\n",
        "[grid]\nstep_ms = [50,\n-1]\n",
        "[grid]\n'waste.spills.7.items' = [1]\n",
        "[grid]\nbody.speed_m_s = [0.5]\n[[list]]\nbody = { speed_m_s = 0.2 }\n",
        "presets = ['team']\n[grid]\nalliance.preset = ['team']\n",
        "[[list]]\nstep_ms = 50\n[[list]]\nlimit_s = 9.0\n",
        "[random]\nstep_ms = { min = 20, max = 50 }\n",
        "[random]\nn = 3\n",
        "[random]\nn = 3\nstep_ms = { min = 50, max = 20 }\n",
        "[random]\nn = 3\nstep_ms = { min = 20, mx = 20 }\n",
        "[random]\nn = 3\nstep_ms = { min = 20, max = 9999 }\n",
        "[random]\nn = 3\nbody.speed_m_s = { min = 0.0, max = 1.0, log = true }\n",
        "[faults.a]\ntimeline = [{ fault.kill = 'glod' }]\n",
        "[random_mission]\nrobots = { min = 0, max = 2 }\n",
        "[random_mission]\nrobots = { min = 1, max = 2 }\n[grid]\n'robots.0.name' = ['blue']\n",
        "[random_mission]\nfaults = { min = 1, max = 2, until = 9.0 }\n",
        "randomise = ['places']\n",
        "randomise = ['start']\n[grid]\n'robots.0.start.x_m' = [1.0]\n",
        "[faults.a]\ntimline = []\n",
        "seeds = 1000\n[random]\nn = 1001\nstep_ms = { choose = [50] }\n",
        "name = 'a'\n[waste]\nspill_radius_m = 1\n",
        "[[robots]]\nname = 'a'\n",
        "limit_s = 9\nalliance.threshold = 50\nroom.width_m = 9\n",
        "seeds = 2\nroom.width_m = 9\n",
    ];
    let answers = plans.map(|plan| {
        let error = format!("{:#}", parse(plan).unwrap_err());
        assert_eq!(error.lines().count(), 1, "{error}");
        format!("{plan}  => {error}\n\n")
    });
    insta::assert_snapshot!(answers.concat());
}

#[test]
fn faults_after_the_end_of_a_run_give_a_note() {
    let late = "timeline = [{ fault.kill = 'gold', at_s = 60.0 }]";
    let end = "'kill gold' is due at 60 s, not before the end of the run,";
    for (text, expected) in [
        (
            format!("limit_s = 60.0\n[faults.late]\n{late}\n"),
            vec![format!("plan.toml:2: faults.timeline[0].at_s: {end} 60 s")],
        ),
        (format!("limit_s = 61.0\n[faults.late]\n{late}\n"), vec![]),
        (
            format!("[grid]\nlimit_s = [50.0,\n70.0]\n[scenario.faults]\n{late}\n"),
            vec![format!("plan.toml:2: faults.timeline[0].at_s: {end} 50 s")],
        ),
        (
            format!("limit_s = 9.0\n[scenario.faults]\n{late}\n"),
            vec![format!("plan.toml: faults.timeline[0].at_s: {end} 9 s")],
        ),
        (
            format!("[missions.short]\nset.limit_s = 9.0\n[faults.late]\n{late}\n"),
            vec![format!("plan.toml:3: faults.timeline[0].at_s: {end} 9 s")],
        ),
    ] {
        let expected = expected
            .iter()
            .map(|note| format!("{note}; choose an earlier time"));
        assert_eq!(
            parse(&text).unwrap().notes,
            expected.collect::<Vec<_>>(),
            "{text}"
        );
    }
}

#[test]
fn a_robot_that_a_fault_moves_into_an_obstacle_gives_a_note() {
    let to = |x_m: f32| {
        let text = format!(
            "[scenario]\nobstacles = [{{ x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 0.5 }}]\n[faults.jump]\n\
             timeline = [{{ fault.move-robot = {{ robot = 'gold', x_m = {x_m}, y_m = 4.2 }}, at_s = 1.0 }}]\n"
        );
        parse(&text).unwrap().notes
    };
    let place = "the place is outside the border or on an obstacle of the scenario";
    assert_eq!(
        to(6.2),
        [format!(
            "plan.toml:3: faults.timeline[0].fault.move-robot: {place}; choose another place"
        )]
    );
    assert_eq!(to(7.2), [""; 0]);
}

#[test]
fn missions_with_their_faults_keep_file_order() {
    let plan = parse(
        "limit_s = 5.0\nseeds = [7]\n[grid]\nallocator = ['nearest', 'static']\n\
         [missions.wide]\nscenario = 'mine'\nset = { room.width_m = 20.0 }\n\
         [missions.five]\nrobots = 5\nsize = 4\n\
         [missions.five.faults.dead]\ntimeline = [{ fault.kill = 'r5' }]\n\
         [faults.none]\n[faults.dead]\ntimeline = [{ fault.kill = 'gold' }]\n",
    )
    .unwrap();
    let runs = runs(&plan);
    assert_eq!(
        runs[..3],
        [
            "wide dead nearest 7",
            "wide dead static 7",
            "wide none nearest 7"
        ]
    );
    assert_eq!((runs.len(), &*runs[7]), (8, "five none static 7"));
    let scenario = |run| scenario(&plan, run);
    let (wide, five) = (scenario(1), scenario(5));
    assert_eq!(
        (wide.name.as_str(), wide.limit_s, wide.room.width_m),
        ("mine", 5.0, 20.0)
    );
    assert_eq!(wide.allocator.as_deref(), Some("static"));
    assert_eq!((five.robots.len(), five.limit_s), (5, 5.0));
    assert_eq!(WasteSection::of(&five).spills.len(), 4);
    let victim = |scenario: &Scenario| match &scenario.faults.timeline[0].fault {
        scenario::fault::Fault::Kill(robot) => robot.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!([victim(&wide), victim(&five)], ["gold", "r5"]);
    assert!(scenario(7).faults.is_empty());
}

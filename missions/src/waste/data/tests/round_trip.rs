//! A setup crosses the bus and is stored in run.json as JSON, without the change of a bit.

use proptest::prelude::*;
use scenario::{Energy, Setup, SetupFile};

use crate::Registry;
use crate::fixtures::{parse, resolve};
use crate::waste::data::{WasteSection, default_scenario, default_setup};

fn through_json(setup: &Setup) -> Setup {
    let json = serde_json::to_string(setup).unwrap();
    let file: SetupFile = serde_json::from_str(&json).unwrap();
    file.read(&Registry::built_in().vocabulary()).unwrap()
}

#[test]
fn the_default() {
    let setup = default_setup(u64::MAX);
    assert_eq!(through_json(&setup), setup);
}

proptest! {
    #[test]
    fn any_numbers(
        seed: u64,
        single in prop::num::f32::POSITIVE | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO,
        double in prop::num::f64::POSITIVE | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
    ) {
        let mut setup = default_setup(seed);
        setup.scenario.limit_s = double;
        setup.scenario.room.width_m = single;
        WasteSection::of_mut(&mut setup.scenario).spills[0].x_fraction = -single;
        setup.scenario.energy = Some(Energy { idle_w: single, ..Energy::default() });
        setup.scenario.alliance.defaults.slow_impatience_toward.insert("gold".to_owned(), double);
        setup.alliance.threshold = -double;
        for robot in std::sync::Arc::make_mut(&mut setup.alliance.robots).values_mut() {
            for set in robot.sets.values_mut() {
                set.fast_impatience = double;
                let slow = std::sync::Arc::make_mut(&mut set.slow_impatience);
                slow.values_mut().for_each(|value| *value = double);
            }
        }
        let back = through_json(&setup);
        prop_assert_eq!(back.scenario.room.width_m.to_bits(), single.to_bits());
        prop_assert_eq!(back, setup);
    }

    /// A scenario written as TOML reads back unchanged.
    #[test]
    fn scenario_files(width in 5.0f32..50.0, limit in 1.0f64..1e6, rate in 0.3f64..10.0) {
        let mut scenario = default_scenario();
        scenario.room.width_m = width;
        scenario.limit_s = limit;
        scenario.alliance.defaults.broadcast_rate_hz = Some(rate);
        let text = scenario.to_toml().unwrap();
        prop_assert_eq!(parse(&text), scenario);
    }
}

/// Obstacles, faults and the amount of waste are unknown to robots at the start.
#[test]
fn the_briefing_hides_unknown_facts_from_robots() {
    let text = "[[obstacles]]\nx_m = 3\ny_m = 3\nwidth_m = 1\nheight_m = 1\n\
                [[faults.timeline]]\nat_s = 9\nfault.kill = 'gold'\n[[waste.spills]]\nname = 'only'\nitems = 7";
    let setup = resolve(parse(text));
    let briefed = setup.for_robots().scenario;
    assert!(briefed.obstacles.is_empty() && briefed.faults.is_empty());
    let [spill] = &WasteSection::of(&briefed).spills[..] else {
        panic!("{briefed:?}")
    };
    assert_eq!((spill.name.as_str(), spill.items), ("only", 0));
    assert_eq!(WasteSection::of(&setup.scenario).spills[0].items, 7);
    assert_eq!(setup.for_robots().catalog, setup.catalog);
}

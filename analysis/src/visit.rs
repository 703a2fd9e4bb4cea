//! A test mission outside the built-in ones: places that robots visit repeatedly.

use std::sync::Arc;

use glam::Vec2;
use proto::view::{Mark, MarkOutline, MarkRole, Work};
use run_log::{LogLevel, RunFile};
use scenario::mission::columns::Column;
use scenario::mission::data::{MissionData, MissionVocabulary};
use scenario::mission::registry::Mission;
use scenario::mission::registry::read_section;
use scenario::mission::section::Section;
use scenario::testkit::default_setup;
use scenario::{BehaviorSpec, ParameterSpec, Problem, Scenario, UntypedTable};

pub const VISIT: Mission = Mission::new("visit", "places to be visited", &Visit);

/// The mission.csv of this mission after three visits.
pub const TABLE: &str = "\
t_ms,places_left,places_visited,last_visit_ms,way_m
0,5,0,,
10000,4,1,10000,2.5
20000,2,3,20000,7
";

#[derive(Debug)]
struct Visit;

impl MissionData for Visit {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<std::collections::BTreeMap<String, u32>>(text)
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        Vec::new()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            devices: &[],
            optional_devices: &[],
            measuring_devices: &[],
            notes: &[],
            events: &["visited"],
            verbs: &[("visits", "visited")],
            bulletins: ["first", "second"],
            columns: const {
                &[
                    Column::left("places_left"),
                    Column::done("places_visited", "visited"),
                    Column::time("last_visit_ms", "visited"),
                    Column::real("way_m"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn catalog(&self, _: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        (Vec::new(), Vec::new())
    }

    fn max_event_interval_s(&self, _: &Scenario, column: &str) -> Option<f64> {
        (column == "last_visit_ms").then_some(15.0)
    }

    fn check(&self, _: &Scenario) -> Result<(), Problem> {
        Ok(())
    }
}

/// Returns a run.json for this mission.
pub fn run_file() -> RunFile {
    let mut setup = default_setup(1);
    Arc::make_mut(&mut setup.catalog).mission = VISIT;
    RunFile {
        version: String::new(),
        log: LogLevel::Off,
        hash: None,
        outcome: run_log::RunOutcome::Running,
        branch: None,
        unscripted: false,
        faults: Vec::new(),
        build: String::new(),
        agent_builds: std::collections::BTreeMap::new(),
        controllers: std::collections::BTreeMap::new(),
        result: run_log::Figures::default(),
        setup,
    }
}

/// Returns one mark of each outline.
pub fn marks() -> [Mark; 4] {
    let (from, to) = (Vec2::new(2.0, 2.0), Vec2::new(5.0, 6.0));
    let mark = |label: &str, role, work, outline| Mark {
        id: label.to_owned(),
        outline,
        role,
        work,
        label: label.to_owned(),
    };
    let half_width_m = 0.2;
    let bar = MarkOutline::Bar {
        from,
        to,
        half_width_m,
    };
    let disc = MarkOutline::Disc {
        center: to,
        radius_m: 0.3,
    };
    let (min, max) = (from, to);
    [
        mark("place", MarkRole::Target, Work::left_or_done(true), disc),
        mark(
            "home",
            MarkRole::Goal,
            None,
            MarkOutline::Rectangle { min, max },
        ),
        mark("box", MarkRole::Item, Work::new(1.0, 2.0, "m"), bar),
        mark("rope", MarkRole::Link, None, MarkOutline::Line { from, to }),
    ]
}

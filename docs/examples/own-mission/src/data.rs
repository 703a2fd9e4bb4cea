//! What visit is in files: `[visit]` of a scenario, its tasks and its words.

use alliance_proto::fault::{FaultArgument, FaultRange, FaultSpec};
use alliance_proto::ids::TaskId;
use alliance_proto::mission::columns::Column;
use alliance_proto::mission::data::{Mission, MissionData, Terms};
use alliance_proto::mission::section::{Section, section};
use alliance_proto::scenario::ParameterDefault::{Number, Required};
use alliance_proto::scenario::{
    BehaviorSpec, ParameterRange, ParameterSpec, Path, Problem, Scenario, Unread, limits,
};
use serde::{Deserialize, Serialize};

pub const VISIT: Mission = Mission(&Visit);

/// A fault of its own, and how far it reaches where that is not said.
pub const TOUCH: &str = "touch";
pub const WITHIN_M: f64 = 0.5;

/// `[visit]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitSection {
    pub places: Vec<Place>,
    #[serde(default = "reach_m")]
    pub reach_m: f32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    pub name: String,
    pub x_m: f32,
    pub y_m: f32,
}

fn reach_m() -> f32 {
    0.3
}

impl VisitSection {
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.mission.values().expect("a scenario of visit")
    }
}

#[derive(Debug)]
struct Visit;

impl MissionData for Visit {
    fn name(&self) -> &'static str {
        "visit"
    }

    fn about(&self) -> &'static str {
        "places to be touched once"
    }

    fn section(&self, text: Unread<'_>) -> Result<Box<dyn Section>, Problem> {
        section::<VisitSection>(text)
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        let length = ParameterRange::Above(0.0, 1e3);
        let place = ParameterRange::Within(0.0, 1e3);
        [
            ("places.name", "", Required, "names the place and its task", ParameterRange::Other("a name")),
            ("places.x_m", "m", Required, "where it is", place.clone()),
            ("places.y_m", "m", Required, "where it is", place),
            ("reach_m", "m", Number(0.3), "from how far it can be touched", length),
        ]
        .map(|(key, unit, default, about, range)| ParameterSpec { key, unit, default, about, range })
        .to_vec()
    }

    fn terms(&self) -> Terms {
        Terms {
            devices: &["touch"],
            events: &["visited"],
            verbs: &[("visits", "visited")],
            columns: const { &[Column::done("visited", "visited"), Column::left("left")] },
            ..Terms::NONE
        }
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let places = VisitSection::of(scenario).places.iter();
        let names: Vec<String> = places.map(|place| format!("visit({})", place.name)).collect();
        let behavior = |(kind, name): (u32, &String)| {
            BehaviorSpec { name: name.clone(), task: TaskId(kind as u16), kind }
        };
        let behaviors = (0..).zip(&names).map(behavior).collect();
        (names, behaviors)
    }

    fn faults(&self) -> &'static [FaultSpec] {
        const X: FaultArgument =
            FaultArgument { key: "x_m", about: "where, m", range: FaultRange::X, default: None };
        const Y: FaultArgument = FaultArgument { key: "y_m", range: FaultRange::Y, ..X };
        const WITHIN: FaultArgument = FaultArgument {
            key: "within_m",
            about: "how far around it, m",
            range: FaultRange::Within(0.0, 100.0),
            default: Some(WITHIN_M),
        };
        &[FaultSpec {
            name: TOUCH,
            about: "somebody else touches all places there",
            arguments: &[X, Y, WITHIN],
        }]
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        let VisitSection { places, reach_m } = VisitSection::of(scenario);
        let at = Path::of(["visit"]);
        limits::LENGTH.check(at.key("reach_m"), *reach_m)?;
        let at = at.key("places");
        limits::named(&at, places.iter().map(|place| place.name.as_str()), 1000)?;
        let inside = |size_m: f32| limits::closed(0.0, size_m.into(), "m");
        for (index, place) in places.iter().enumerate() {
            let at = at.index(index);
            inside(scenario.room.width_m).check(at.key("x_m"), place.x_m)?;
            inside(scenario.room.height_m).check(at.key("y_m"), place.y_m)?;
        }
        Ok(())
    }
}

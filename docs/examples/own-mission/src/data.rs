//! What visit is in files: `[visit]` of a scenario, its tasks and its words.

use alliance_proto::mission::prelude::ParameterDefault::{Number, Required};
use alliance_proto::mission::prelude::ParameterRange::{Above, List, Name, X, Y};
use alliance_proto::mission::prelude::*;
use serde::{Deserialize, Serialize};

pub const VISIT: Mission = Mission::new("visit", "places to be touched once", &Visit);

/// How far the fault `touch` reaches where that is not said.
pub const WITHIN_M: f64 = 0.5;

/// `[visit]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitSection {
    pub places: Vec<Place>,
    pub reach_m: f32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    pub name: String,
    pub x_m: f32,
    pub y_m: f32,
}

impl VisitSection {
    pub fn at(&self, place: usize) -> Vec2 {
        Vec2::new(self.places[place].x_m, self.places[place].y_m)
    }
}

#[derive(Debug)]
struct Visit;

impl MissionData for Visit {
    fn section(&self, text: Unread<'_>) -> Result<Box<dyn Section>, Problem> {
        section::<VisitSection>(text)
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        vec![
            ParameterSpec::new("places", "", Required, "what is to be touched", List(1, 300)),
            ParameterSpec::new("places.name", "", Required, "names the place and its task", Name),
            ParameterSpec::new("places.x_m", "m", Required, "where it is", X),
            ParameterSpec::new("places.y_m", "m", Required, "where it is", Y),
            ParameterSpec::new("reach_m", "m", Number(0.3), "from how far", Above(0.0, 1e3)),
        ]
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

    fn faults(&self) -> &'static [FaultSpec] {
        const ARGUMENTS: &[FaultArgument] = &[
            FaultArgument::new("x_m", "where, m", FaultRange::X, None),
            FaultArgument::new("y_m", "where, m", FaultRange::Y, None),
            FaultArgument::new("within_m", "how far around it, m", FaultRange::Within(0.0, 100.0), Some(WITHIN_M)),
        ];
        &[FaultSpec { name: "touch", about: "somebody else touches all places there", arguments: ARGUMENTS }]
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let places = scenario.section::<VisitSection>().places.iter();
        one_behavior_each(places.map(|place| format!("visit({})", place.name)))
    }
}

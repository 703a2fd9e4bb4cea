//! The data of the visit mission: section `[visit]` of a scenario, its tasks and its terms.

use scenario::mission::prelude::ParameterDefault::{Number, Required};
use scenario::mission::prelude::ParameterRange::{Above, List, Name, X, Y};
use scenario::mission::prelude::*;
use serde::{Deserialize, Serialize};

pub const VISIT: Mission = Mission::new("visit", "places that a robot touches once", &Visit);

/// The default radius of the fault `touch`, in m.
pub const WITHIN_M: f64 = 0.5;

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

const FAULTS: &[FaultSpec] = &[FaultSpec {
    name: "touch",
    about: "marks all places within the radius as visited",
    arguments: &[
        FaultArgument::new("x_m", "the position, m", FaultRange::X, None),
        FaultArgument::new("y_m", "the position, m", FaultRange::Y, None),
        FaultArgument::new(
            "within_m",
            "the radius around the position, m",
            FaultRange::Within(0.0, 100.0),
            Some(WITHIN_M),
        ),
    ],
}];

impl VisitSection {
    pub fn at(&self, place: usize) -> Vec2 {
        Vec2::new(self.places[place].x_m, self.places[place].y_m)
    }
}

#[derive(Debug)]
struct Visit;

impl MissionData for Visit {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<VisitSection>(text)
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        vec![
            ParameterSpec::new("places", "", Required, "the places to touch", List(1, 300)),
            ParameterSpec::new(
                "places.name",
                "",
                Required,
                "the name of the place and of its task",
                Name,
            ),
            ParameterSpec::new("places.x_m", "m", Required, "the position", X),
            ParameterSpec::new("places.y_m", "m", Required, "the position", Y),
            ParameterSpec::new(
                "reach_m",
                "m",
                Number(0.3),
                "the distance from which a robot can touch a place",
                Above(0.0, 1e3),
            ),
        ]
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            faults: FAULTS,
            devices: &["touch"],
            events: &["visited"],
            verbs: &[("visits", "visited")],
            columns: const { &[Column::done("visited", "visited"), Column::left("left")] },
            ..MissionVocabulary::NONE
        }
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let places = scenario.section::<VisitSection>().places.iter();
        one_behavior_each(places.map(|place| format!("visit({})", place.name)))
    }
}

//! Selection of a scenario's mission by the section that the scenario contains.

use serde::Deserialize;
use serde_json::Map;
use toml::de::DeTable;

use super::error::Problem;
use super::obstacle::Zone;
use super::path::KeyPath;
use super::team::{self, KINDS, ROBOTS};
use super::toml_value::{EditedTable, TomlValue};
use super::unread::UntypedTable;
use super::{Scenario, Vocabulary};
use crate::mission::registry::{Mission, NO_MISSION};
use crate::mission::section::MissionSection;

/// The key of a scenario file for zones, which are obstacles in a scenario.
const ZONES: &str = "zones";

impl Scenario {
    /// Creates the scenario that states only its mission.
    pub fn for_mission(mission: Mission) -> Result<Self, Problem> {
        Self::default().completed(mission, UntypedTable::missing(mission.name()), |_| false)
    }

    /// Reads a scenario from TOML without checks. Short forms become the robots and obstacles for which they stand.
    pub(super) fn from_toml(file: &DeTable<'_>, vocabulary: &Vocabulary) -> Result<Self, Problem> {
        let mission = mission_of(|key| file.contains_key(key), vocabulary)?;
        let name = mission.name();
        let missions = vocabulary.missions.iter().map(|mission| mission.name());
        let others: Vec<&str> = [KINDS, ZONES].into_iter().chain(missions).collect();
        let mut frame = Self::deserialize(EditedTable {
            table: file,
            left_out: &[name, ROBOTS, KINDS, ZONES],
            others: &others,
            implied: &[],
        })?;
        frame.robots = team::read(file, &frame.body)?;
        if let Some(zones) = file.get(ZONES) {
            let at = KeyPath::new([ZONES]);
            let read = Vec::<Zone>::deserialize(TomlValue(zones.get_ref()));
            let zones = read.map_err(|problem| problem.under(&at))?;
            for (index, zone) in zones.into_iter().enumerate() {
                frame.obstacles.push(zone.obstacle(&at.index(index))?);
            }
        }
        let section = match file.get(name) {
            Some(section) => UntypedTable::toml(name, section.get_ref()),
            None => UntypedTable::missing(name),
        };
        frame.completed(mission, section, |key| file.contains_key(key))
    }

    /// Reads a scenario from a JSON object without checks.
    pub(super) fn from_json(
        mut file: Map<String, serde_json::Value>,
        vocabulary: &Vocabulary,
    ) -> Result<Self, Problem> {
        let mission = mission_of(|key| file.contains_key(key), vocabulary)?;
        let name = mission.name();
        let stated: Vec<String> = file.keys().cloned().collect();
        let section = file.remove(name);
        let frame = Self::deserialize(serde_json::Value::Object(file))
            .map_err(|error| Problem::of_value(error.to_string(), "see the reference scenario"))?;
        let section = match &section {
            Some(section) => UntypedTable::json(name, section),
            None => UntypedTable::missing(name),
        };
        frame.completed(mission, section, |key| {
            stated.iter().any(|name| name == key)
        })
    }

    /// Adds the mission's section and its defaults to the scenario.
    fn completed(
        self,
        mission: Mission,
        section: UntypedTable<'_>,
        is_stated: impl Fn(&str) -> bool,
    ) -> Result<Self, Problem> {
        let mut scenario = Self {
            mission: MissionSection::read(mission, section)?,
            ..self
        };
        if !is_stated("name") {
            scenario.name = mission.scenario_name().to_owned();
        }
        if !is_stated("robots") {
            scenario.robots = mission.team();
        }
        Ok(scenario)
    }
}

/// Returns the mission whose section is present, or else the first known mission.
fn mission_of(has: impl Fn(&str) -> bool, vocabulary: &Vocabulary) -> Result<Mission, Problem> {
    let mut stated = vocabulary
        .missions
        .iter()
        .filter(|mission| has(mission.name()));
    let first = stated.next();
    if let (Some(first), Some(second)) = (first, stated.next()) {
        let what = format!("the scenario has a section [{}] too", first.name());
        let remedy = "a scenario has one mission: remove one of the sections";
        return Err(Problem::at([second.name()], what, remedy));
    }
    let mission = first.or(vocabulary.missions.first());
    Ok(mission.copied().unwrap_or(NO_MISSION))
}

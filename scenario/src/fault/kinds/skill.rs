//! The fault `skill`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};
use crate::limits::check_known;
use crate::{Problem, Robot, name_remedy};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "skill",
        about: "Reduce a skill of a robot without informing its controller",
        arguments: &[
            FaultArgument::ROBOT,
            FaultArgument::at(
                "skill",
                "Name of the skill in the scenario",
                FaultRange::Skill,
            ),
            FaultArgument::at(
                "share",
                "Remaining share of the skill, 0 to 1",
                FaultRange::SHARE,
            ),
        ],
    },
    group: FaultGroup::Robot,
    takes_role: false,
    check,
    examples: &[(
        r#"{"skill": {"robot": "gold", "skill": "dust", "share": 0.3}}"#,
        "a skill is reduced to this share; the controller gets no signal of it. Only in missions with skills",
    )],
    commands: &[("skill gold weld 0.5", "half its skill")],
    ..FaultKind::OF_ROBOT
};

/// A decline of a robot's skill.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkillFault {
    pub robot: String,
    /// The mission's name of the skill.
    pub skill: String,
    /// The remaining share of the skill, 0 to 1.
    pub share: f64,
}

impl Target for SkillFault {
    fn robot(&self) -> Option<&str> {
        Some(&self.robot)
    }
}

/// Checks that the robot has the skill. Only an existing skill can get worse.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Skill(SkillFault { robot, skill, .. }) = fault else {
        return Ok(());
    };
    let field = ["fault", "skill", "skill"];
    let scenario = checker.scenario;
    let known = checker.catalog.mission.skills(scenario);
    let known = known.iter().map(String::as_str);
    check_known(field, "there is no skill", skill, known)?;
    let has = |robot: &&Robot| robot.skill(skill).unwrap_or(1.0) > 0.0;
    let able = scenario.robots.iter().filter(has);
    let able = able.map(|robot| robot.name.as_str());
    if able.clone().any(|able| able == robot) {
        return Ok(());
    }
    let what = format!("'{robot}' has no skill '{skill}'");
    let remedy = format!("name one that has it: {}", name_remedy(robot, able));
    Err(Problem::at(field, what, remedy))
}

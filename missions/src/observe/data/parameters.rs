//! The keys of `[observe]`, for people and for checks.

use alliance_proto::scenario::ParameterDefault::{Number, Text, Whole};
use alliance_proto::scenario::ParameterRange::{self, Above, Choice, Within};
use alliance_proto::scenario::ParameterSpec;

use super::MAX_TARGETS;

pub(super) fn all() -> Vec<ParameterSpec> {
    let length = Above(0.0, 1e3);
    let speed = Within(0.0, 1e3);
    vec![
        ParameterSpec::new(
            "n",
            "",
            Whole(5),
            "how many targets there are",
            ParameterRange::Whole(1, MAX_TARGETS as i64),
        ),
        ParameterSpec::new(
            "slowest_m_s",
            "m/s",
            Number(0.0),
            "a target's speed is drawn once, from here",
            speed.clone(),
        ),
        ParameterSpec::new("fastest_m_s", "m/s", Number(0.15), "to here", speed),
        ParameterSpec::new(
            "turn_hz",
            "1/s",
            Number(0.05),
            "how often a target turns, at random times; the edge of the region turns it back",
            Within(0.0, 10.0),
        ),
        ParameterSpec::new(
            "turn_deg",
            "deg",
            Number(90.0),
            "how far it turns at most, to either side: drawn",
            Within(0.0, 180.0),
        ),
        ParameterSpec::new(
            "region",
            "",
            Text("disc"),
            "where targets are: the largest disc in the middle of the room, or all of it",
            Choice(&["disc", "room"]),
        ),
        ParameterSpec::new(
            "range_m",
            "m",
            Number(2.6),
            "how far a robot senses targets, from its center; a target in it is observed",
            length.clone(),
        ),
        ParameterSpec::new(
            "predict_m",
            "m",
            Number(3.0),
            "up to where a robot counts on targets that it remembers or hears of",
            length.clone(),
        ),
        ParameterSpec::new(
            "target_near_m",
            "m",
            Number(0.4),
            "nearer targets repel a robot, farther ones attract it",
            length.clone(),
        ),
        ParameterSpec::new(
            "target_full_m",
            "m",
            Number(0.8),
            "targets attract in full from here to range_m, and at predict_m no more",
            length.clone(),
        ),
        ParameterSpec::new(
            "robot_near_m",
            "m",
            Number(1.25),
            "nearer robots repel a robot in full",
            length.clone(),
        ),
        ParameterSpec::new(
            "robot_far_m",
            "m",
            Number(2.0),
            "farther robots do not repel it",
            length,
        ),
        ParameterSpec::new(
            "policy",
            "",
            Text("a-cmommt"),
            "robots stay, move at random, or follow the forces; with all weights 1, or as shared_weight says",
            Choice(&["fixed", "random", "local", "a-cmommt"]),
        ),
        ParameterSpec::new(
            "shared_weight",
            "",
            Number(0.25),
            "a-cmommt: weight of a target that a teammate sees, too; of others it is 1",
            Within(0.0, 1.0),
        ),
        ParameterSpec::new(
            "duration_s",
            "s",
            Number(120.0),
            "when the mission is complete",
            Above(0.0, 1e6),
        ),
    ]
}

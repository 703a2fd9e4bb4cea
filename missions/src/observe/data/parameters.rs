//! The parameters of `[observe]`, for documentation and for checks.

use scenario::ParameterDefault::{Number, Text, Whole};
use scenario::ParameterRange::{self, Above, Choice, Within};
use scenario::ParameterSpec;

use super::MAX_TARGETS;

pub(super) fn all() -> Vec<ParameterSpec> {
    let length =
        |key, default, about| ParameterSpec::new(key, "m", Number(default), about, Above(0.0, 1e3));
    let speed = |key, default, about| {
        ParameterSpec::new(key, "m/s", Number(default), about, Within(0.0, 1e3))
    };
    vec![
        ParameterSpec::new(
            "n",
            "",
            Whole(5),
            "number of targets",
            ParameterRange::Whole(1, MAX_TARGETS as i64),
        ),
        speed(
            "slowest_m_s",
            0.0,
            "lower end of the range from which each target's speed is drawn once",
        ),
        speed(
            "fastest_m_s",
            0.15,
            "upper end of the range of target speeds",
        ),
        ParameterSpec::new(
            "turn_hz",
            "1/s",
            Number(0.05),
            "mean rate of a target's turns, at random times; a target bounces off the edge of the region",
            Within(0.0, 10.0),
        ),
        ParameterSpec::new(
            "turn_deg",
            "deg",
            Number(90.0),
            "largest turn to either side; each turn is drawn at random",
            Within(0.0, 180.0),
        ),
        ParameterSpec::new(
            "region",
            "",
            Text("disc"),
            "area of the targets: the largest disc in the middle of the room, or the entire room",
            Choice(&["disc", "room"]),
        ),
        length(
            "range_m",
            2.6,
            "distance from a robot's center within which it senses targets; a sensed target is observed",
        ),
        length(
            "predict_m",
            3.0,
            "largest distance of remembered or reported targets that attract a robot",
        ),
        length(
            "target_near_m",
            0.4,
            "distance below which a target repels a robot and above which it attracts",
        ),
        length(
            "target_full_m",
            0.8,
            "distance from which a target attracts fully, up to range_m; the attraction ends at predict_m",
        ),
        length(
            "robot_near_m",
            1.25,
            "distance below which a robot repels another fully",
        ),
        length(
            "robot_far_m",
            2.0,
            "distance above which a robot does not repel another",
        ),
        ParameterSpec::new(
            "policy",
            "",
            Text("a-cmommt"),
            "robots stay, move at random, or follow the forces: with all weights 1 (local), or with shared_weight (a-cmommt)",
            Choice(&["fixed", "random", "local", "a-cmommt"]),
        ),
        ParameterSpec::new(
            "shared_weight",
            "",
            Number(0.25),
            "a-cmommt: weight of a target that a teammate sees, too; other targets have weight 1",
            Within(0.0, 1.0),
        ),
        ParameterSpec::new(
            "duration_s",
            "s",
            Number(120.0),
            "time after which the mission is complete",
            Above(0.0, 1e6),
        ),
    ]
}

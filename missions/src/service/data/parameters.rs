//! The keys of `[service]`, for people and for checks.

use alliance_proto::scenario::ParameterDefault::{Flag, Number, Required, Text, Whole, Words};
use alliance_proto::scenario::ParameterRange::{Above, Choice, List, Name, Other, Within, X, Y};
use alliance_proto::scenario::{ParameterRange, ParameterSpec};

use super::{MAX_KINDS, MAX_POINTS};

/// Longest time, s.
const LONGEST_S: f64 = 1e6;

pub(super) fn all() -> Vec<ParameterSpec> {
    let most = MAX_POINTS as i64;
    let time = Above(0.0, LONGEST_S);
    let later = Within(0.0, LONGEST_S);
    vec![
        ParameterSpec::new(
            "tasks",
            "",
            Text("points"),
            "a task per point, serve(p7), or per kind, serve(garbage): the nearest first",
            Choice(&["points", "kinds"]),
        ),
        ParameterSpec::new(
            "known",
            "",
            Text("all"),
            "a board tells each robot of all points that it has tasks for, or each sees them",
            Choice(&["all", "sight"]),
        ),
        ParameterSpec::new(
            "reach_m",
            "m",
            Number(0.3),
            "from how far a robot can work on a point; 1000 takes travel out of it",
            Above(0.0, 1e3),
        ),
        ParameterSpec::new(
            "sight_m",
            "m",
            Number(3.0),
            "how far robots see points where there is no board",
            Above(0.0, 1e3),
        ),
        ParameterSpec::new(
            "spare",
            "",
            Whole(0),
            "tasks for points that faults add, where each point is a task",
            ParameterRange::Whole(0, most),
        ),
        ParameterSpec::new(
            "duration_s",
            "s",
            Words("for ever"),
            "no point arrives or comes back from then on",
            time.clone(),
        ),
        ParameterSpec::new(
            "uncovered",
            "",
            Flag(false),
            "whether it is meant that nobody can do some of the tasks",
            ParameterRange::Flag,
        ),
        ParameterSpec::new(
            "kinds",
            "",
            Required,
            "the kinds of work",
            List(1, MAX_KINDS),
        ),
        ParameterSpec::new(
            "kinds.name",
            "",
            Required,
            "names the kind and the skill that it takes",
            Name,
        ),
        ParameterSpec::new(
            "kinds.work_s",
            "",
            Required,
            "how long a point takes a robot of skill 1: drawn",
            Other("a table of min and max"),
        ),
        ParameterSpec::new("kinds.work_s.min", "s", Required, "the least", time.clone()),
        ParameterSpec::new("kinds.work_s.max", "s", Required, "the most", time.clone()),
        ParameterSpec::new(
            "kinds.workers",
            "",
            Whole(1),
            "how many robots can work on a point at once",
            ParameterRange::Whole(1, 100),
        ),
        ParameterSpec::new(
            "kinds.kept",
            "",
            Flag(true),
            "whether work that is left unfinished stays done; else each robot makes its own attempt, lost when it leaves",
            ParameterRange::Flag,
        ),
        ParameterSpec::new(
            "kinds.deadline_s",
            "",
            Words("none"),
            "how long after its arrival a point expires: drawn",
            Other("a table of min and max"),
        ),
        ParameterSpec::new(
            "kinds.deadline_s.min",
            "s",
            Required,
            "the least",
            time.clone(),
        ),
        ParameterSpec::new(
            "kinds.deadline_s.max",
            "s",
            Required,
            "the most",
            time.clone(),
        ),
        ParameterSpec::new(
            "kinds.period_s",
            "s",
            Words("never"),
            "how long after its arrival a point comes back",
            Within(1.0, LONGEST_S),
        ),
        ParameterSpec::new(
            "points",
            "",
            Words("none"),
            "points at known places: p0, p1, …",
            List(0, MAX_POINTS),
        ),
        ParameterSpec::new(
            "points.kind",
            "",
            Required,
            "what there is to do",
            Other("the name of a kind"),
        ),
        ParameterSpec::new("points.x_m", "m", Required, "where it is", X),
        ParameterSpec::new("points.y_m", "m", Required, "where it is", Y),
        ParameterSpec::new(
            "points.arrival_s",
            "s",
            Number(0.0),
            "when it arrives",
            later.clone(),
        ),
        ParameterSpec::new(
            "points.work_s",
            "s",
            Words("as its kind says"),
            "how long it takes a robot of skill 1",
            time,
        ),
        ParameterSpec::new(
            "random",
            "",
            Words("none"),
            "points that are drawn, anywhere in the room",
            List(0, 1000),
        ),
        ParameterSpec::new(
            "random.n",
            "",
            Required,
            "how many",
            ParameterRange::Whole(1, most),
        ),
        ParameterSpec::new(
            "random.kind",
            "",
            Words("the kinds take turns"),
            "what there is to do",
            Other("the name of a kind"),
        ),
        ParameterSpec::new(
            "random.at_s",
            "s",
            Number(0.0),
            "when they arrive, or begin to",
            later,
        ),
        ParameterSpec::new(
            "random.rate_hz",
            "Hz",
            Number(0.0),
            "how many arrive per second on average (Poisson); 0: all at once",
            Within(0.0, 1e3),
        ),
    ]
}

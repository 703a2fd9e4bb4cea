//! The keys of `[service]` with their defaults, ranges and descriptions.

use scenario::ParameterDefault::{Flag, Number, Required, Text, Whole, Words};
use scenario::ParameterRange::{Above, Choice, List, Name, Other, Within, X, Y};
use scenario::{ParameterRange, ParameterSpec};

use super::{MAX_KINDS, MAX_POINTS};

/// The longest time that a key accepts, s.
const LONGEST_S: f64 = 1e6;
/// The shortest duration, s. The run measures times in whole milliseconds.
const SHORTEST_S: f64 = 0.001;

pub(super) fn all() -> Vec<ParameterSpec> {
    let most = MAX_POINTS as i64;
    let time = Within(SHORTEST_S, LONGEST_S);
    let later = Within(0.0, LONGEST_S);
    vec![
        ParameterSpec::new(
            "tasks",
            "",
            Text("points"),
            "one task per point, serve(p7), or per kind, serve(garbage): nearest point first",
            Choice(&["points", "kinds"]),
        ),
        ParameterSpec::new(
            "known",
            "",
            Text("all"),
            "source of knowledge: a board with all points of a robot's tasks, or the robot's own sight",
            Choice(&["all", "sight"]),
        ),
        ParameterSpec::new(
            "reach_m",
            "m",
            Number(0.3),
            "maximum distance from which a robot can work on a point; 1000 removes travel",
            Above(0.0, 1e3),
        ),
        ParameterSpec::new(
            "sight_m",
            "m",
            Number(3.0),
            "range at which robots see points if there is no board",
            Above(0.0, 1e3),
        ),
        ParameterSpec::new(
            "spare",
            "",
            Whole(0),
            "number of tasks reserved for points that faults add, if each point is a task",
            ParameterRange::Whole(0, most),
        ),
        ParameterSpec::new(
            "duration_s",
            "s",
            Words("for ever"),
            "time from which no point arrives or comes back",
            time.clone(),
        ),
        ParameterSpec::new(
            "uncovered",
            "",
            Flag(false),
            "whether tasks that no robot can do are allowed",
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
            "name of the kind and of the required skill",
            Name,
        ),
        ParameterSpec::new(
            "kinds.work_s",
            "",
            Required,
            "work of a point for a robot of skill 1, drawn from a range",
            Other("a table of min and max"),
        ),
        ParameterSpec::new("kinds.work_s.min", "s", Required, "minimum", time.clone()),
        ParameterSpec::new("kinds.work_s.max", "s", Required, "maximum", time.clone()),
        ParameterSpec::new(
            "kinds.workers",
            "",
            Whole(1),
            "number of robots that can work on a point at once",
            ParameterRange::Whole(1, 100),
        ),
        ParameterSpec::new(
            "kinds.kept",
            "",
            Flag(true),
            "whether unfinished work is kept; otherwise each robot makes its own attempt, which is lost when it leaves",
            ParameterRange::Flag,
        ),
        ParameterSpec::new(
            "kinds.deadline_s",
            "",
            Words("none"),
            "time from arrival to expiration of a point, drawn from a range",
            Other("a table of min and max"),
        ),
        ParameterSpec::new(
            "kinds.deadline_s.min",
            "s",
            Required,
            "minimum",
            time.clone(),
        ),
        ParameterSpec::new(
            "kinds.deadline_s.max",
            "s",
            Required,
            "maximum",
            time.clone(),
        ),
        ParameterSpec::new(
            "kinds.period_s",
            "s",
            Words("never"),
            "time from arrival to the next arrival of a point",
            Within(1.0, LONGEST_S),
        ),
        ParameterSpec::new(
            "points",
            "",
            Words("none"),
            "points at given places: p0, p1, …",
            List(0, MAX_POINTS),
        ),
        ParameterSpec::new(
            "points.kind",
            "",
            Required,
            "kind of work",
            Other("the name of a kind"),
        ),
        ParameterSpec::new("points.x_m", "m", Required, "place of the point", X),
        ParameterSpec::new("points.y_m", "m", Required, "place of the point", Y),
        ParameterSpec::new(
            "points.arrival_s",
            "s",
            Number(0.0),
            "arrival time",
            later.clone(),
        ),
        ParameterSpec::new(
            "points.work_s",
            "s",
            Words("drawn as for its kind"),
            "work for a robot of skill 1",
            time,
        ),
        ParameterSpec::new(
            "random",
            "",
            Words("none"),
            "points at random places in the room",
            List(0, 1000),
        ),
        ParameterSpec::new(
            "random.n",
            "",
            Required,
            "number of points",
            ParameterRange::Whole(1, most),
        ),
        ParameterSpec::new(
            "random.kind",
            "",
            Words("the kinds take turns"),
            "kind of work",
            Other("the name of a kind"),
        ),
        ParameterSpec::new(
            "random.at_s",
            "s",
            Number(0.0),
            "time of their arrival, or of the first possible arrival",
            later,
        ),
        ParameterSpec::new(
            "random.rate_hz",
            "Hz",
            Number(0.0),
            "mean number of arrivals per second (Poisson process); 0: all at once",
            Within(0.0, 1e3),
        ),
    ]
}

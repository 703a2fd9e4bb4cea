//! The keys of `[service]` with their defaults, ranges and descriptions.

use scenario::ParameterDefault::{Flag, Number, Required, Text, Whole, Words};
use scenario::ParameterRange::{Above, Choice, List, Name, Other, Within, X, Y};
use scenario::limits::LONGEST_S;
use scenario::{ParameterRange, ParameterSpec};

use super::{MAX_KINDS, MAX_POINTS};

/// The longest work of a point, s.
const LONGEST_WORK_S: f64 = 1e6;
/// The shortest duration, s. The run measures times in whole milliseconds.
const SHORTEST_S: f64 = 0.001;

/// The largest priority and, negative, the smallest.
const MOST_PRIORITY: i64 = 1_000_000;

pub(super) fn all() -> Vec<ParameterSpec> {
    let most = MAX_POINTS as i64;
    let required = |key, about, range| ParameterSpec::new(key, "", Required, about, range);
    let place = |key, range| ParameterSpec::new(key, "m", Required, "place of the point", range);
    let charger =
        |key, range| ParameterSpec::new(key, "m", Required, "place of the charger", range);
    let list = |key, about, most| ParameterSpec::new(key, "", Words("none"), about, List(0, most));
    let length =
        |key, default, about| ParameterSpec::new(key, "m", Number(default), about, Above(0.0, 1e3));
    let time = |key, default, about| {
        let range = Within(SHORTEST_S, LONGEST_S);
        ParameterSpec::new(key, "s", default, about, range)
    };
    let work = |key, default, about| {
        let range = Within(SHORTEST_S, LONGEST_WORK_S);
        ParameterSpec::new(key, "s", default, about, range)
    };
    let later = |key, about| {
        let range = Within(0.0, LONGEST_S);
        ParameterSpec::new(key, "s", Number(0.0), about, range)
    };
    let flag = |key, default, about| {
        ParameterSpec::new(key, "", Flag(default), about, ParameterRange::Flag)
    };
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
        length(
            "reach_m",
            0.3,
            "maximum distance from which a robot can work on a point; 1000 removes travel",
        ),
        length(
            "sight_m",
            3.0,
            "range at which robots see points if there is no board",
        ),
        ParameterSpec::new(
            "spare",
            "",
            Whole(0),
            "number of tasks reserved for points that faults add, if each point is a task",
            ParameterRange::Whole(0, most),
        ),
        time(
            "duration_s",
            Words("for ever"),
            "time from which no drawn point arrives and no point comes back",
        ),
        flag(
            "uncovered",
            false,
            "whether tasks that no robot can do are allowed",
        ),
        ParameterSpec::new(
            "costs",
            "",
            Text("line"),
            "estimated way to a point: straight, or the shortest one around the obstacles, which robots receive as a map",
            Choice(&["line", "path"]),
        ),
        time(
            "coalition_wait_s",
            Words("30"),
            "longest time that a robot waits at a point for the robots of its other slots",
        ),
        ParameterSpec::new(
            "reserve",
            "",
            Words("0.2"),
            "share of the energy capacity at which a robot drives to a charger",
            Within(0.0, 0.9),
        ),
        required("kinds", "the kinds of work", List(1, MAX_KINDS)),
        required(
            "kinds.name",
            "name of the kind and of the required skill",
            Name,
        ),
        required(
            "kinds.work_s",
            "work of a point for a robot of skill 1, drawn from a range",
            Other("a table of min and max"),
        ),
        work("kinds.work_s.min", Required, "minimum"),
        work("kinds.work_s.max", Required, "maximum"),
        ParameterSpec::new(
            "kinds.workers",
            "",
            Whole(1),
            "number of robots that can work on a point at once",
            ParameterRange::Whole(1, 100),
        ),
        flag(
            "kinds.kept",
            true,
            "whether unfinished work is kept; otherwise each robot makes its own attempt, which is lost when it leaves",
        ),
        ParameterSpec::new(
            "kinds.deadline_s",
            "",
            Words("none"),
            "time from arrival to expiration of a point, drawn from a range",
            Other("a table of min and max"),
        ),
        time("kinds.deadline_s.min", Required, "minimum"),
        time("kinds.deadline_s.max", Required, "maximum"),
        ParameterSpec::new(
            "kinds.period_s",
            "s",
            Words("never"),
            "time from arrival to the next arrival of a point",
            Within(1.0, LONGEST_S),
        ),
        list("points", "points at given places: p0, p1, …", MAX_POINTS),
        required("points.kind", "kind of work", Other("the name of a kind")),
        place("points.x_m", X),
        place("points.y_m", Y),
        later("points.arrival_s", "arrival time"),
        work(
            "points.work_s",
            Words("drawn as for its kind"),
            "work for a robot of skill 1",
        ),
        ParameterSpec::new(
            "points.name",
            "",
            Words("p0, p1, …"),
            "name by which other points refer to it",
            Name,
        ),
        ParameterSpec::new(
            "points.opens_s",
            "s",
            Words("at its arrival"),
            "time from arrival to the earliest work; robots receive it before and may wait at the place",
            Within(0.0, LONGEST_S),
        ),
        time(
            "points.deadline_s",
            Words("drawn as for its kind"),
            "time from arrival to expiration; robots receive it before",
        ),
        ParameterSpec::new(
            "points.value",
            "",
            Words("1"),
            "reward of the point if it is done in its window",
            Within(1e-3, 1e9),
        ),
        ParameterSpec::new(
            "points.priority",
            "",
            Words("0"),
            "priority of its task; a higher one goes first",
            ParameterRange::Whole(-MOST_PRIORITY, MOST_PRIORITY),
        ),
        ParameterSpec::new(
            "points.after",
            "",
            Words("none"),
            "points that must be done before this one arrives; if one of them expires, it expires, too",
            Other("a list of names of points"),
        ),
        ParameterSpec::new(
            "points.needs",
            "",
            Words("one robot with the skill of its kind"),
            "numbers of robots by skill; work proceeds only while all of them are at the place",
            Other("a table of skills with whole numbers from 1 to 16"),
        ),
        ParameterSpec::new(
            "points.deliver_to",
            "m",
            Words("nowhere"),
            "place to which the robot that has done the work carries a load; the point is done there",
            Other("a place in the room, [x, y]"),
        ),
        ParameterSpec::new(
            "points.demand",
            "",
            Words("0"),
            "part of a robot's capacity that it takes: up to the delivery, or else for the rest of the run",
            Within(0.0, 1e9),
        ),
        list("random", "points at random places in the room", 1000),
        required(
            "random.n",
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
        later(
            "random.at_s",
            "time of their arrival, or of the first possible arrival",
        ),
        ParameterSpec::new(
            "random.rate_hz",
            "Hz",
            Number(0.0),
            "mean number of arrivals per second (Poisson process); 0: all at once",
            Within(0.0, 1e3),
        ),
        list(
            "chargers",
            "places at which robots charge their batteries",
            1000,
        ),
        charger("chargers.x_m", X),
        charger("chargers.y_m", Y),
        ParameterSpec::new(
            "chargers.rate_w",
            "W",
            Required,
            "power for each robot",
            Above(0.0, 1e6),
        ),
        ParameterSpec::new(
            "chargers.slots",
            "",
            Whole(1),
            "number of robots that charge at once",
            ParameterRange::Whole(1, 100),
        ),
    ]
}

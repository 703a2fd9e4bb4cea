//! Valid values of `[service]` that contradict each other or the time limit.

use glam::Vec2;
use scenario::{KeyPath, Problem, Scenario};

use super::check::beyond_the_team;
use super::ways::{Ways, skill};
use super::{Kind, Point, ServiceSection, loads};

/// Returns a problem for each point or kind whose work cannot be done in the run.
pub(super) fn warnings(scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
    let section = ServiceSection::of(scenario);
    let at = KeyPath::new(["service"]);
    let limit = ("limit_s", Some(scenario.limit_s));
    let mut found = Vec::new();
    for (index, kind) in section.kinds.iter().enumerate() {
        let at = at.key("kinds").index(index);
        let least_s = kind.work_s.min / strength(scenario, kind);
        // A kind without an able robot has its own check.
        if least_s.is_finite() {
            found.extend(of_kind(scenario, kind, least_s, &at));
        }
    }
    let points = section.points.iter().zip(section.kinds_of_points());
    for (index, (point, kind)) in points.enumerate() {
        let kind = &section.kinds[kind];
        let work_s = point.work_s.unwrap_or(kind.work_s.min);
        let least_s = work_s / strength_at(scenario, point, kind);
        let opens_s = point.opens_s.unwrap_or_default();
        let done_s = point.arrival_s + opens_s + least_s;
        let at = at.key("points").index(index);
        if let Some(deadline_s) = point.deadline_s
            && least_s.is_finite()
            && opens_s + least_s > deadline_s
        {
            let what = format!(
                "the work of p{index} takes at least {}, but its window lasts {:.1} s",
                in_words(least_s),
                deadline_s - opens_s
            );
            let remedy = "reduce the work, or give it more time";
            found.push(Problem::at(at.key("deadline_s"), what, remedy));
        }
        let at = at.key("arrival_s");
        let arrives = format!("p{index} arrives at {} s", point.arrival_s);
        if let Some(late) = too_late([limit], point.arrival_s) {
            found.push(Problem::at(at, format!("{arrives}, {late}"), EARLIER));
        } else if done_s.is_finite() && done_s > scenario.limit_s {
            let limit_s = scenario.limit_s;
            let what = format!(
                "{arrives} and cannot be done before {done_s:.2} s, after limit_s, {limit_s} s"
            );
            found.push(Problem::at(at, what, EARLIER));
        }
    }
    for (index, batch) in section.random.iter().enumerate() {
        let at = at.key("random").index(index);
        let last_s = match batch.rate_hz {
            0.0 => batch.at_s,
            rate_hz => batch.at_s + f64::from(batch.n) / rate_hz,
        };
        let ends = [("service.duration_s", section.duration_s), limit];
        if let Some(late) = too_late(ends, batch.at_s) {
            let what = format!("the points arrive from {} s on, {late}", batch.at_s);
            found.push(Problem::at(at.key("at_s"), what, EARLIER));
        } else if let Some(late) = too_late(ends, last_s) {
            let what = format!("the last point arrives at about {last_s:.0} s, {late}");
            let remedy = "increase it, or give fewer points";
            found.push(Problem::at(at.key("rate_hz"), what, remedy));
        }
    }
    found.extend(loads::too_much(scenario));
    if section.uncovered {
        found.extend(beyond_the_team(scenario));
    }
    found.extend(without_a_way(scenario, starts));
    found
}

/// Returns a problem for each stated point to which no able robot has a way at the start, for each charger to which no
/// robot has one, and for drawn points if they may lie at such a place.
fn without_a_way(scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
    let section = ServiceSection::of(scenario);
    let Some(ways) = Ways::new(scenario, starts) else {
        return Vec::new();
    };
    let at = KeyPath::new(["service"]);
    let remedy = "move the obstacles, or let a robot start there";
    let mut found = Vec::new();
    let points = section.points.iter().zip(section.kinds_of_points());
    for (index, (point, kind)) in points.enumerate() {
        let (x_m, y_m) = (point.x_m, point.y_m);
        let place = Vec2::new(x_m, y_m);
        let skills: Vec<&String> = section.skills_of(index as u32, kind).collect();
        if !ways.lead_to(&skills, place, None) {
            let what = match skills.len() {
                1 => format!("obstacles leave no way to p{index} at ({x_m}, {y_m})"),
                count => format!(
                    "obstacles leave no way to p{index} at ({x_m}, {y_m}) for all {count} robots that it needs"
                ),
            };
            found.push(Problem::at(at.key("points").index(index), what, remedy));
        } else if let Some([x_m, y_m]) = point.deliver_to
            && !ways.lead_to(&skills, place, Some(Vec2::new(x_m, y_m)))
        {
            let what =
                format!("obstacles leave no way from p{index} to its delivery at ({x_m}, {y_m})");
            let at = at.key("points").index(index).key("deliver_to");
            found.push(Problem::at(at, what, remedy));
        }
    }
    for (index, charger) in section.chargers.iter().enumerate() {
        if !ways.lead_any_robot_to(charger.place()) {
            let (x_m, y_m) = (charger.x_m, charger.y_m);
            let what = format!("obstacles leave no way to the charger c{index} at ({x_m}, {y_m})");
            found.push(Problem::at(at.key("chargers").index(index), what, remedy));
        }
    }
    for (index, batch) in section.random.iter().enumerate() {
        let kind = batch.kind.as_ref().map(|name| section.kind_named(name));
        let mut kinds = 0..section.kinds.len();
        let is_cut_off = kinds.any(|place| {
            kind.is_none_or(|kind| kind == Some(place))
                && !ways.lead_everywhere(&section.kinds[place].name)
        });
        if is_cut_off {
            let what =
                "obstacles leave no way to a part of the room, and points may be drawn there";
            found.push(Problem::at(at.key("random").index(index), what, remedy));
        }
    }
    found
}

const EARLIER: &str = "let it arrive earlier, or allow more time";

/// Returns in words why a point that arrives at this time cannot be done; `None` if it is before all of these ends, by
/// key.
fn too_late<const N: usize>(ends: [(&str, Option<f64>); N], arrival_s: f64) -> Option<String> {
    let mut ends = ends.into_iter();
    ends.find_map(|(key, end_s)| {
        let end_s = end_s.filter(|end_s| arrival_s >= *end_s)?;
        Some(format!("not before {key}, {end_s} s"))
    })
}

/// Returns the skills of the best robots together that may work at a point of this kind at once.
fn strength(scenario: &Scenario, kind: &Kind) -> f64 {
    let mut skills: Vec<f64> = scenario
        .robots
        .iter()
        .map(|robot| skill(robot, &kind.name))
        .collect();
    skills.sort_by(|a, b| b.total_cmp(a));
    // Each robot has to do its own attempt if unfinished work is lost.
    let workers = if kind.kept { kind.workers as usize } else { 1 };
    skills.iter().take(workers).sum()
}

/// Returns the pace of the best robots at a point: of the slowest slot, if the point has slots.
fn strength_at(scenario: &Scenario, point: &Point, kind: &Kind) -> f64 {
    if !point.has_needs() {
        return strength(scenario, kind);
    }
    let best = |name: &String| {
        let robots = scenario.robots.iter();
        robots.map(|robot| skill(robot, name)).fold(0.0, f64::max)
    };
    point.needs.keys().map(best).fold(f64::INFINITY, f64::min)
}

/// Formats a time, s. A long one has the form of a power of ten.
fn in_words(span_s: f64) -> String {
    if span_s < 1e7 {
        format!("{span_s:.1} s")
    } else {
        format!("{span_s:.0e} s")
    }
}

/// Returns the contradictions of a kind whose points take at least `least_s`.
fn of_kind(scenario: &Scenario, kind: &Kind, least_s: f64, at: &KeyPath) -> Vec<Problem> {
    let limit_s = scenario.limit_s;
    let least = in_words(least_s);
    let mut found = Vec::new();
    if least_s > limit_s {
        let what = format!("a point takes at least {least}, more than limit_s, {limit_s} s");
        found.push(Problem::at(
            at.key("work_s"),
            what,
            "reduce the work, or allow more time",
        ));
        return found;
    }
    let mut add = |key: &str, what: String| {
        found.push(Problem::at(
            at.key(key),
            what,
            "reduce the work, or give it more time",
        ));
    };
    if let Some(deadline_s) = &kind.deadline_s
        && deadline_s.max < least_s
    {
        let after_s = deadline_s.max;
        add(
            "deadline_s",
            format!("a point expires after at most {after_s} s, but takes at least {least}"),
        );
    }
    if let Some(period_s) = kind.period_s
        && period_s < least_s
    {
        add(
            "period_s",
            format!("a point comes back after {period_s} s, but takes at least {least}"),
        );
    }
    if let (Some(deadline_s), Some(period_s)) = (&kind.deadline_s, kind.period_s)
        && deadline_s.min > period_s
    {
        let (min_s, key) = (deadline_s.min, at.key("deadline_s"));
        let what = format!(
            "a deadline of at least {min_s} s has no effect: a point expires when it comes back, after period_s, {period_s} s"
        );
        found.push(Problem::at(
            key,
            what,
            "omit it, or write less than period_s",
        ));
    }
    for (rank, robot) in scenario.robots.iter().enumerate() {
        let alone_s = kind.work_s.min / skill(robot, &kind.name);
        if alone_s.is_finite() && kind.workers <= 1 && alone_s > limit_s {
            let at = KeyPath::new(["robots"])
                .index(rank)
                .key("skills")
                .key(&kind.name);
            let what = format!(
                "'{}' takes at least {} for a point, more than limit_s, {limit_s} s",
                robot.name,
                in_words(alone_s)
            );
            found.push(Problem::at(at, what, "increase the skill, or write 0"));
        }
    }
    found
}

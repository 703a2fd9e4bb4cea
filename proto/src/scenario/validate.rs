//! Ranges and names: what is wrong with a scenario whatever its geometry and parameters are.

use std::collections::BTreeMap;
use std::fmt::Display;

use super::alliance::BehaviorSection;
use super::catalog::Catalog;
use super::error::{Problem, instead};
use super::path::Path;
use super::{Scenario, WasteSection};
use crate::fault::Campaign;
use crate::keys::is_name;

/// Most robots of a scenario. Ranks, which are 16-bit numbers, would allow more.
pub const MAX_ROBOTS: usize = 10_000;
/// Most spills of a scenario, and most deposits.
pub const MAX_SPILLS: usize = 10_000;
/// Most items of a spill.
const MAX_ITEMS: u32 = 1000;
/// Most items of all spills, and most that a fault strews in the course of a run.
pub(crate) const MAX_ITEMS_IN_ALL: u32 = 200_000;
/// Most random faults that a mission may be expected to see.
const MAX_RANDOM_FAULTS: f64 = 1e5;

/// The numbers that a key may have.
struct Limits {
    from: f64,
    /// Whether `from` itself is not among them.
    open: bool,
    to: f64,
    unit: &'static str,
}

const fn above_zero(to: f64, unit: &'static str) -> Limits {
    Limits {
        from: 0.0,
        open: true,
        to,
        unit,
    }
}

const fn closed(from: f64, to: f64, unit: &'static str) -> Limits {
    Limits {
        from,
        open: false,
        to,
        unit,
    }
}

const LENGTH: Limits = above_zero(1e3, "m");
const FRACTION: Limits = closed(0.0, 1.0, "");
const PENETRABILITY: Limits = closed(0.0, 100.0, "");
const TIME: Limits = above_zero(1e9, "s");
const POWER: Limits = closed(0.0, 1e9, "W");

impl Limits {
    /// Refuses a number at `path` that is not among these; NaN never is.
    fn check<T: Copy + Display + Into<f64>>(&self, path: Path, number: T) -> Result<(), Problem> {
        let value: f64 = number.into();
        let high_enough = if self.open {
            value > self.from
        } else {
            value >= self.from
        };
        if high_enough && value <= self.to {
            return Ok(());
        }
        let low = match (self.open, self.from) {
            (true, from) => format!("above {from}"),
            (false, from) => format!("at least {from}"),
        };
        let remedy = format!("it must be {low} and at most {} {}", self.to, self.unit);
        Err(Problem::at(
            path,
            format!("{number} is out of range"),
            remedy.trim_end(),
        ))
    }
}

/// Refuses the first mistake of a scenario, in the order of its fields. The catalog is made once it can be.
pub(super) fn validate(scenario: &Scenario) -> Result<Catalog, Problem> {
    name(Path::of(["name"]), &scenario.name)?;
    let step_ms = scenario.step_ms;
    if !(1..=500).contains(&step_ms) {
        let what = format!("{step_ms} is out of range");
        let remedy = "it must be at least 1 and at most 500 ms";
        return Err(Problem::at(Path::of(["step_ms"]), what, remedy));
    }
    TIME.check(Path::of(["limit_s"]), scenario.limit_s)?;

    LENGTH.check(Path::of(["room", "width_m"]), scenario.room.width_m)?;
    LENGTH.check(Path::of(["room", "height_m"]), scenario.room.height_m)?;

    let body = &scenario.body;
    LENGTH.check(Path::of(["body", "radius_m"]), body.radius_m)?;
    above_zero(1e3, "m/s").check(Path::of(["body", "speed_m_s"]), body.speed_m_s)?;
    above_zero(3600.0, "deg/s").check(Path::of(["body", "turn_deg_s"]), body.turn_deg_s)?;
    LENGTH.check(Path::of(["body", "reach_m"]), body.reach_m)?;
    PENETRABILITY.check(
        Path::of(["body", "robot_penetrability"]),
        body.robot_penetrability,
    )?;

    let sensors = &scenario.sensors;
    LENGTH.check(
        Path::of(["sensors", "border_range_m"]),
        sensors.border_range_m,
    )?;
    LENGTH.check(
        Path::of(["sensors", "avoidance_range_m"]),
        sensors.avoidance_range_m,
    )?;
    LENGTH.check(
        Path::of(["sensors", "waste_range_m"]),
        sensors.waste_range_m,
    )?;

    if let Some(energy) = &scenario.energy {
        above_zero(1e12, "J").check(Path::of(["energy", "capacity_j"]), energy.capacity_j)?;
        POWER.check(Path::of(["energy", "idle_w"]), energy.idle_w)?;
        POWER.check(Path::of(["energy", "drive_w"]), energy.drive_w)?;
    }
    if let Some(range_m) = scenario.radio.range_m {
        above_zero(1e4, "m").check(Path::of(["radio", "range_m"]), range_m)?;
    }
    waste(&scenario.waste)?;
    let catalog = Catalog::of(scenario);
    robots(scenario, &catalog)?;
    obstacles(scenario)?;
    tasks(scenario, &catalog)?;
    faults(scenario)?;
    alliance(scenario, &catalog)?;
    Ok(catalog)
}

fn name(path: Path, name: &str) -> Result<(), Problem> {
    if is_name(name) {
        return Ok(());
    }
    let remedy =
        "use at most 32 letters, digits, '-' and '_', with a letter or a digit first".to_owned();
    Err(Problem::at(path, format!("'{name}' is not a name"), remedy))
}

/// Checks how many things a list has, and that their names are names, each there once.
fn named<'a>(
    list: &Path,
    names: impl ExactSizeIterator<Item = &'a str>,
    most: usize,
) -> Result<(), Problem> {
    if !(1..=most).contains(&names.len()) {
        let what = format!("{} entries", names.len());
        return Err(Problem::at(list.clone(), what, format!("give 1 to {most}")));
    }
    let mut first = BTreeMap::new();
    for (index, each) in names.enumerate() {
        let path = list.index(index).key("name");
        name(path.clone(), each)?;
        if let Some(first) = first.insert(each, index) {
            let what = format!("'{each}' is already the name of {list}[{first}]");
            return Err(Problem::at(path, what, "give each its own name"));
        }
    }
    Ok(())
}

fn waste(waste: &WasteSection) -> Result<(), Problem> {
    let at = Path::of(["waste"]);
    let spills = at.key("spills");
    named(
        &spills,
        waste.spills.iter().map(|spill| spill.name.as_str()),
        MAX_SPILLS,
    )?;
    for (index, spill) in waste.spills.iter().enumerate() {
        let at = spills.index(index);
        closed(0.0, f64::from(MAX_ITEMS), "").check(at.key("items"), spill.items)?;
        FRACTION.check(at.key("x_fraction"), spill.x_fraction)?;
        FRACTION.check(at.key("y_fraction"), spill.y_fraction)?;
    }
    // At most so many spills of so many items: no overflow.
    let items: u32 = waste.spills.iter().map(|spill| spill.items).sum();
    if items > MAX_ITEMS_IN_ALL {
        let what = format!("{items} items in all");
        return Err(Problem::at(
            spills,
            what,
            format!("give at most {MAX_ITEMS_IN_ALL}"),
        ));
    }
    LENGTH.check(at.key("spill_radius_m"), waste.spill_radius_m)?;
    LENGTH.check(at.key("item_radius_m"), waste.item_radius_m)?;
    if waste.item_radius_m > waste.spill_radius_m {
        let what = format!(
            "an item of radius {} m is larger than a spill",
            waste.item_radius_m
        );
        let remedy = format!(
            "it must be at most spill_radius_m, {} m",
            waste.spill_radius_m
        );
        return Err(Problem::at(at.key("item_radius_m"), what, remedy));
    }
    let deposit = at.key("deposit");
    LENGTH.check(deposit.key("radius_m"), waste.deposit.radius_m)?;
    FRACTION.check(deposit.key("x_fraction"), waste.deposit.x_fraction)?;
    FRACTION.check(deposit.key("y_fraction"), waste.deposit.y_fraction)?;
    let further = at.key("further_deposits");
    if waste.further_deposits.len() >= MAX_SPILLS {
        let what = format!("{} entries", waste.further_deposits.len());
        let remedy = format!("give at most {}", MAX_SPILLS - 1);
        return Err(Problem::at(further, what, remedy));
    }
    for (index, spot) in waste.further_deposits.iter().enumerate() {
        let at = further.index(index);
        FRACTION.check(at.key("x_fraction"), spot.x_fraction)?;
        FRACTION.check(at.key("y_fraction"), spot.y_fraction)?;
    }
    let site = at.key("report_site");
    LENGTH.check(site.key("width_m"), waste.report_site.width_m)?;
    LENGTH.check(site.key("height_m"), waste.report_site.height_m)?;
    closed(0.0, 1e9, "s").check(site.key("color_s"), waste.report_site.color_s)?;
    TIME.check(at.key("report_period_s"), waste.report_period_s)
}

fn robots(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let robots = Path::of(["robots"]);
    named(&robots, names(scenario), MAX_ROBOTS)?;
    if scenario.robots.iter().all(|robot| robot.absent) {
        let what = "all robots are absent";
        let remedy = "let at least one be there from the start";
        return Err(Problem::at(robots, what, remedy));
    }
    for (index, robot) in scenario.robots.iter().enumerate() {
        for (number, task) in robot.tasks.iter().enumerate() {
            if catalog.task_named(task).is_none() {
                let at = robots.index(index).key("tasks").index(number);
                let tasks = catalog.tasks.iter().map(|task| task.name.as_str());
                known("task", task, tasks, &at)?;
            }
        }
        let Some(start) = &robot.start else { continue };
        let at = robots.index(index).key("start");
        let inside = |size: f32| closed(0.0, size.into(), "m");
        inside(scenario.room.width_m).check(at.key("x_m"), start.x_m)?;
        inside(scenario.room.height_m).check(at.key("y_m"), start.y_m)?;
        closed(-360.0, 360.0, "deg").check(at.key("heading_deg"), start.heading_deg)?;
    }
    Ok(())
}

fn obstacles(scenario: &Scenario) -> Result<(), Problem> {
    const PLACE: Limits = closed(-1e4, 1e4, "m");
    const SIZE: Limits = above_zero(1e4, "m");
    for (index, obstacle) in scenario.obstacles.iter().enumerate() {
        let at = Path::of(["obstacles"]).index(index);
        PLACE.check(at.key("x_m"), obstacle.x_m)?;
        PLACE.check(at.key("y_m"), obstacle.y_m)?;
        SIZE.check(at.key("width_m"), obstacle.width_m)?;
        SIZE.check(at.key("height_m"), obstacle.height_m)?;
        PENETRABILITY.check(at.key("penetrability"), obstacle.penetrability)?;
    }
    Ok(())
}

fn faults(scenario: &Scenario) -> Result<(), Problem> {
    let at = Path::of(["faults", "timeline"]);
    let mut first = BTreeMap::new();
    for (index, order) in scenario.faults.timeline.iter().enumerate() {
        let at = at.index(index);
        order.check(scenario).map_err(|error| {
            let path = error
                .field
                .iter()
                .fold(at.clone(), |path, key| path.key(key));
            Problem::at(path, error.what, error.remedy)
        })?;
        if let Some(id) = &order.id
            && let Some(first) = first.insert(id, index)
        {
            let what = format!("'{id}' is already the id of faults.timeline[{first}]");
            return Err(Problem::at(at.key("id"), what, "give each its own id"));
        }
        if let Some(id) = &order.id
            && id.starts_with(Campaign::ID_PREFIX)
            && scenario.faults.random.is_some()
        {
            let prefix = Campaign::ID_PREFIX;
            let what = format!("'{id}' may become the id of a random fault");
            let remedy = format!("let it not begin with '{prefix}'");
            return Err(Problem::at(at.key("id"), what, remedy));
        }
    }
    match &scenario.faults.random {
        Some(campaign) => random_faults(scenario, campaign),
        None => Ok(()),
    }
}

fn random_faults(scenario: &Scenario, campaign: &Campaign) -> Result<(), Problem> {
    let at = Path::of(["faults", "random"]);
    TIME.check(at.key("mtbf_s"), campaign.mtbf_s)?;
    TIME.check(at.key("mttr_s"), campaign.mttr_s)?;
    let mix = &campaign.mix;
    let weights = [
        ("kill", mix.kill),
        ("pause", mix.pause),
        ("link", mix.link),
        ("sensor", mix.sensor),
        ("actuator", mix.actuator),
        ("power", mix.power),
        ("babble", mix.babble),
    ];
    for (kind, weight) in weights {
        closed(0.0, 1e6, "").check(at.key("mix").key(kind), weight)?;
    }
    if weights.iter().all(|(_, weight)| *weight == 0.0) {
        let what = "no kind of fault is left";
        return Err(Problem::at(at.key("mix"), what, "set one above 0"));
    }
    let rate = scenario.robots.len() as f64 / (campaign.mtbf_s + campaign.mttr_s);
    let expected = rate * scenario.limit_s;
    if expected > MAX_RANDOM_FAULTS {
        let what = format!("about {expected:.0} faults are to be expected until limit_s");
        let remedy = format!("make it longer, or limit_s shorter, for at most {MAX_RANDOM_FAULTS}");
        return Err(Problem::at(at.key("mtbf_s"), what, remedy));
    }
    Ok(())
}

fn tasks(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let tasks = || catalog.tasks.iter().map(|task| task.name.as_str());
    for (name, section) in &scenario.tasks {
        let at = Path::of(["tasks"]).key(name);
        known("task", name, tasks(), &at)?;
        closed(1.0, f64::from(u32::MAX), "").check(at.key("max_robots"), section.max_robots)?;
    }
    Ok(())
}

fn alliance(scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let at = Path::of(["alliance"]);
    let section = &scenario.alliance;
    teammates(scenario, &section.defaults, None, &at.key("defaults"))?;
    for (set, values) in &section.sets {
        let at = at.key("sets").key(set);
        known(
            "behavior set",
            set,
            catalog.sets.iter().map(|set| set.name.as_str()),
            &at,
        )?;
        teammates(scenario, values, None, &at)?;
    }
    for (name, of_robot) in &section.robots {
        let at = at.key("robots").key(name);
        known("robot", name, names(scenario), &at)?;
        teammates(
            scenario,
            &of_robot.defaults,
            Some(name),
            &at.key("defaults"),
        )?;
        for (set, values) in &of_robot.sets {
            let at = at.key("sets").key(set);
            let robot = scenario.robots.iter().find(|robot| robot.name == *name);
            let sets = robot
                .into_iter()
                .flat_map(|robot| catalog.behaviors_of(robot));
            let what = format!("behavior set of {name}");
            known(&what, set, sets.map(|set| catalog.behavior_name(set)), &at)?;
            teammates(scenario, values, Some(name), &at)?;
        }
    }
    Ok(())
}

/// Refuses a section that names a teammate who does not exist; the robot that owns the section is none of its own.
fn teammates(
    scenario: &Scenario,
    section: &BehaviorSection,
    owner: Option<&str>,
    at: &Path,
) -> Result<(), Problem> {
    let toward = [
        ("slow_impatience_toward", &section.slow_impatience_toward),
        (
            "willing_to_affect_toward_s",
            &section.willing_to_affect_toward_s,
        ),
    ];
    for (key, by_teammate) in toward {
        for teammate in by_teammate.keys() {
            let others = names(scenario).filter(|name| Some(*name) != owner);
            known("teammate", teammate, others, &at.key(key).key(teammate))?;
        }
    }
    Ok(())
}

/// The robots' names.
fn names(scenario: &Scenario) -> impl ExactSizeIterator<Item = &str> {
    scenario.robots.iter().map(|robot| robot.name.as_str())
}

/// Refuses a name that is not among the known ones.
fn known<'a>(
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a str>,
    at: &Path,
) -> Result<(), Problem> {
    let known: Vec<&str> = known.collect();
    if known.contains(&name) {
        return Ok(());
    }
    let what = format!("there is no {what} '{name}'");
    Err(Problem::at(at.clone(), what, instead(name, known)))
}

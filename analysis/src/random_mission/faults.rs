//! Random fault plans: orders of every kind of fault for a scenario's timeline.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::fault::{
    Corruption, Device, EventTrigger, Fault, FaultKind, FaultRange, FaultSpec, LinkEnd,
    LinkSelection, ModeForm, ModeSize, MoveRobot, Order, RangeFault, SkillFault, TriggerEvent,
};
use scenario::ids::BehaviorId;
use scenario::{Catalog, Obstacle, Robot, Scenario};
use serde::{Deserialize, Serialize};
use world_server::faults::campaign::{random_actuator_fault, random_sensor_fault};

use super::CountRange;

/// Longest duration of a fault, s.
const LONGEST_S: f64 = 60.0;
/// Shortest duration of a fault, s.
const SHORTEST_S: f64 = 0.5;
/// Share of faults that wait for an event.
const BY_EVENT: f64 = 0.1;
/// Share of timed faults that start before the first tick.
const AT_ONCE: f64 = 0.05;
/// Share of timed faults that recur.
const PERIODIC: f64 = 0.02;
/// Share of faults that never heal, of those that do not recur.
const PERMANENT: f64 = 0.12;

/// The number and the time limit of random faults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomFaults {
    pub min: u32,
    pub max: u32,
    /// The time by which all timed faults have begun, and have healed if they heal, s of simulated time.
    pub until_s: f64,
}

impl RandomFaults {
    pub(super) fn between(&self) -> CountRange {
        CountRange {
            min: self.min,
            max: self.max,
        }
    }
}

/// A kind of random faults.
#[derive(Clone, Copy)]
enum Draw {
    Common(&'static FaultKind),
    /// Any fault that the mission defines.
    Mission,
}

/// Returns the kinds of faults, which have equal probability. Faults of the mission count twice.
fn draws(has_skills: bool) -> Vec<Draw> {
    let is_skill = |kind: &&FaultKind| kind.spec.name == "skill";
    let (skill, others): (Vec<&'static FaultKind>, Vec<_>) =
        Fault::KINDS.into_iter().partition(is_skill);
    let common = others.into_iter().flat_map(|kind: &'static FaultKind| {
        let missions = if kind.spec.name == "move-robot" { 2 } else { 0 };
        let missions = std::iter::repeat_n(Draw::Mission, missions);
        missions.chain([Draw::Common(kind)])
    });
    let skill = skill.into_iter().filter(|_| has_skills);
    common.chain(skill.map(Draw::Common)).collect()
}

/// Rounds a position down to two decimals, so that it never lies beyond the border.
fn written(place_m: f32) -> f64 {
    (f64::from(place_m) * 100.0).floor() / 100.0
}

/// Draws a random timeline, sorted by time. Orders that wait for an event come last.
#[must_use]
pub fn timeline(faults: &RandomFaults, scenario: &Scenario, rng: &mut ChaCha8Rng) -> Vec<Order> {
    let count = faults.between().draw(rng);
    let sampler = FaultSampler::new(scenario, faults.until_s, |_| true);
    let mut orders = Vec::new();
    while orders.len() < count as usize {
        orders.extend(sampler.attempt(rng));
    }
    sort(&mut orders);
    orders
}

/// Sorts a timeline by time. Orders that wait for an event come last.
pub fn sort(orders: &mut [Order]) {
    orders.sort_by_key(|order| (order.at_s.is_none(), order.at()));
}

/// Returns the names of all faults that a scenario can have: those of every mission, then those of its own mission.
pub fn names(scenario: &Scenario) -> impl Iterator<Item = &'static str> {
    let of_mission = scenario.mission().vocabulary().faults.iter();
    let common = Fault::COMMON_NAMES.into_iter();
    common.chain(of_mission.map(|spec| spec.name))
}

/// A source of random orders for one scenario, of all kinds of faults or of some.
pub struct FaultSampler<'a> {
    scenario: &'a Scenario,
    until_s: f64,
    draws: Vec<Draw>,
    mission_faults: Vec<FaultSpec>,
}

impl<'a> FaultSampler<'a> {
    /// Creates a sampler of the faults whose names `is_allowed` accepts. All timed faults begin before `until_s`.
    #[must_use]
    pub fn new(scenario: &'a Scenario, until_s: f64, is_allowed: impl Fn(&str) -> bool) -> Self {
        let mission = scenario.mission();
        let all = mission.vocabulary().faults.iter();
        let mission_faults: Vec<FaultSpec> =
            all.filter(|spec| is_allowed(spec.name)).copied().collect();
        let is_drawn = |draw: &Draw| match draw {
            Draw::Common(kind) => is_allowed(kind.spec.name),
            Draw::Mission => !mission_faults.is_empty() || mission.vocabulary().faults.is_empty(),
        };
        let mut draws = draws(!mission.skills(scenario).is_empty());
        draws.retain(is_drawn);
        Self {
            scenario,
            until_s,
            draws,
            mission_faults,
        }
    }

    /// Draws an order. Returns `None` if the drawn fault has no possible target, or no room.
    pub fn attempt(&self, rng: &mut ChaCha8Rng) -> Option<Order> {
        if self.draws.is_empty() {
            return None;
        }
        let mut dice = self.dice(rng);
        let fault = match dice.any(&self.draws) {
            Draw::Common(kind) => dice.fault(&kind.spec),
            Draw::Mission => dice.mission_fault(),
        };
        let order = fault.map(|fault| dice.order(fault, self.until_s));
        order.filter(|order| self.fits(order))
    }

    /// Draws a fault of the same kind with other targets and values.
    pub fn redraw(&self, fault: &Fault, rng: &mut ChaCha8Rng) -> Option<Fault> {
        let mut dice = self.dice(rng);
        match fault.kind() {
            Some(kind) => dice.fault(&kind.spec),
            None => dice.mission_fault(),
        }
    }

    /// Returns whether the mission has room for the order, such as another point.
    #[must_use]
    pub fn fits(&self, order: &Order) -> bool {
        self.scenario
            .mission()
            .check_order(self.scenario, order)
            .is_ok()
    }

    fn dice<'d>(&'d self, rng: &'d mut ChaCha8Rng) -> Dice<'d> {
        Dice {
            rng,
            scenario: self.scenario,
            mission_faults: &self.mission_faults,
        }
    }
}

/// The random draws for one mission.
struct Dice<'a> {
    rng: &'a mut ChaCha8Rng,
    scenario: &'a Scenario,
    /// The mission's own faults that may be drawn.
    mission_faults: &'a [FaultSpec],
}

impl Dice<'_> {
    fn order(&mut self, fault: Fault, until_s: f64) -> Order {
        let lasts = !fault.is_instantaneous();
        let mut order = Order::now(fault);
        if self.rng.random_bool(BY_EVENT) {
            order.when = Some(self.event());
            if lasts && !self.rng.random_bool(PERMANENT) {
                order.for_s = Some(self.between(SHORTEST_S, LONGEST_S));
            }
            return order;
        }
        let at_s = if self.rng.random_bool(AT_ONCE) {
            0.0
        } else {
            self.between(0.0, until_s - SHORTEST_S)
        };
        order.at_s = Some(at_s);
        let longest_s = LONGEST_S.min(until_s - at_s);
        if self.rng.random_bool(PERIODIC) {
            let every_s = self.between(20.0, 60.0);
            order.every_s = Some(every_s);
            order.for_s = lasts.then(|| self.between(SHORTEST_S, every_s / 2.0));
        } else if lasts && !self.rng.random_bool(PERMANENT) {
            order.for_s = Some(self.between(SHORTEST_S.min(longest_s), longest_s));
        }
        order
    }

    fn event(&mut self) -> EventTrigger {
        let robot = self.robot().name;
        let verbs: Vec<&str> = TriggerEvent::verbs(self.scenario.mission()).collect();
        let mut when = EventTrigger {
            robot: self.rng.random_bool(0.5).then_some(robot),
            what: self.any(&verbs).to_owned(),
            subject: None,
        };
        if when.has_behavior_set_subject() && self.rng.random_bool(0.5) {
            when.subject = self.set_of(when.robot.as_deref());
        }
        when
    }

    /// Draws the name of a behavior set of `robot`, or of any robot.
    fn set_of(&mut self, robot: Option<&str>) -> Option<String> {
        let catalog = Catalog::new(self.scenario);
        let mut robots = self.scenario.robots.iter();
        let sets: Vec<BehaviorId> = match robots.find(|spec| robot == Some(&spec.name)) {
            Some(robot) => catalog.behaviors_of(robot).collect(),
            None => (0..catalog.sets.len() as u32).map(BehaviorId).collect(),
        };
        (!sets.is_empty()).then(|| catalog.behavior_name(self.any(&sets)).to_owned())
    }

    fn robot(&mut self) -> Robot {
        let robots = &self.scenario.robots;
        robots[self.rng.random_range(0..robots.len())].clone()
    }

    fn absent_robot(&mut self) -> Option<String> {
        let absent: Vec<&Robot> = self
            .scenario
            .robots
            .iter()
            .filter(|robot| robot.absent)
            .collect();
        let place = (!absent.is_empty()).then(|| self.rng.random_range(0..absent.len()));
        place.map(|place| absent[place].name.clone())
    }

    fn link(&mut self) -> LinkSelection {
        let (from, to) = (self.endpoint(), self.endpoint());
        // A robot does not receive its own messages.
        let to = if to == from { LinkEnd::All } else { to };
        LinkSelection { from, to }
    }

    fn endpoint(&mut self) -> LinkEnd {
        let robot = self.robot().name;
        if self.rng.random_bool(0.5) {
            LinkEnd::All
        } else {
            LinkEnd::Robot(robot)
        }
    }

    /// Draws the groups of a partition: each robot is in one of two groups or in none.
    fn groups(&mut self) -> [Vec<String>; 2] {
        let mut groups = [Vec::new(), Vec::new(), Vec::new()];
        for robot in &self.scenario.robots {
            let group = self.any(&[0, 0, 1, 1, 2]);
            groups[group].push(robot.name.clone());
        }
        let [one, other, _] = groups;
        [one, other]
    }

    /// Draws a mode of failure with its size, in the form of files.
    fn mode(&mut self, form: &ModeForm) -> toml::Value {
        let mode = self.any(form.modes);
        let size: toml::Value = match mode.size {
            ModeSize::None => return mode.name.into(),
            ModeSize::Number(range) => self.between(range.from, range.to).into(),
            ModeSize::Word(words) => self.any(words).into(),
            ModeSize::Error { .. } => {
                toml::Table::from_iter([("m".to_owned(), self.between(0.05, 0.5).into())]).into()
            }
        };
        toml::Table::from_iter([(mode.name.to_owned(), size)]).into()
    }

    /// Draws a place within the border, m.
    fn place(&mut self) -> (f32, f32) {
        let room = self.scenario.room;
        let (low, high) = (room.low(), room.high());
        let mut along = |low: f32, high: f32| self.between(low.into(), high.into()) as f32;
        let (x_m, y_m) = (along(low.x, high.x), along(low.y, high.y));
        (x_m.min(high.x), y_m.min(high.y))
    }

    /// Draws a fault that reduces a skill of a robot, if the robot has any.
    fn worse_skill(&mut self) -> Option<SkillFault> {
        let robot = self.robot();
        let mut skills = self.scenario.mission().skills(self.scenario);
        skills.retain(|skill| robot.skill(skill).unwrap_or(1.0) > 0.0);
        Some(SkillFault {
            skill: (!skills.is_empty()).then(|| self.any(&skills))?,
            robot: robot.name,
            share: self.between(0.0, 1.0),
        })
    }

    /// Draws a fault of every mission. Returns `None` if the mission has no possible target. The kinds that have an arm
    /// here draw from narrower ranges than their declarations allow, so that they are likely to have an effect.
    fn fault(&mut self, spec: &FaultSpec) -> Option<Fault> {
        Some(match spec.name {
            "add" => Fault::Add(self.absent_robot()?),
            "range" => {
                let range_m = self.between(1.0, 8.0) as f32;
                Fault::Range(RangeFault { range_m })
            }
            "corrupt" => {
                let LinkSelection { from, to } = self.link();
                // Messages have some hundred bits.
                let p = self.between(0.000_1, 0.01);
                let checksum = self.rng.random_bool(0.5);
                Fault::Corrupt(Corruption {
                    from,
                    to,
                    p,
                    checksum,
                })
            }
            "sensor" => {
                let robot = self.robot();
                random_sensor_fault(self.rng, &robot, self.scenario.mission())
            }
            "actuator" => {
                let robot = self.robot();
                random_actuator_fault(self.rng, &robot, self.scenario.mission())
            }
            "skill" => Fault::Skill(self.worse_skill()?),
            "obstacle" => {
                let (x_m, y_m) = self.place();
                Fault::Obstacle(Obstacle {
                    x_m,
                    y_m,
                    width_m: self.between(0.2, 1.5) as f32,
                    height_m: self.between(0.2, 1.5) as f32,
                    penetrability: self.any(&[0.0, 0.0, 0.0, 0.3, 2.0]),
                })
            }
            "move-robot" => {
                let (x_m, y_m) = self.place();
                Fault::MoveRobot(MoveRobot {
                    robot: self.robot().name,
                    x_m,
                    y_m,
                    heading_deg: self.any(&[None, Some(-90.0), Some(33.0)]),
                })
            }
            _ => {
                let place = match spec.place() {
                    Some(_) => self.place(),
                    None => (0.0, 0.0),
                };
                return self.any_of(spec, place);
            }
        })
    }

    /// Draws one of the mission's own faults, if there are any.
    fn mission_fault(&mut self) -> Option<Fault> {
        let specs = self.mission_faults;
        let spec = (!specs.is_empty()).then(|| self.any(specs))?;
        let place = self.place_of_interest();
        self.any_of(&spec, place)
    }

    /// Draws any values for the arguments of a fault at a place, m. Returns `None` if the scenario has no value for an
    /// argument.
    fn any_of(&mut self, spec: &FaultSpec, (x_m, y_m): (f32, f32)) -> Option<Fault> {
        let mission = self.scenario.mission();
        let mut values = toml::Table::new();
        let mut link = None;
        let mut has_groups = true;
        for argument in spec.arguments {
            let value: toml::Value = match argument.range {
                FaultRange::X => written(x_m).into(),
                FaultRange::Y => written(y_m).into(),
                // A share of at least a tenth has an effect.
                FaultRange::SHARE => self.between(0.1, 1.0).into(),
                FaultRange::Within(from, to) => self.between(from, to).into(),
                FaultRange::Above(to) => self.between(to / 100.0, to).into(),
                FaultRange::Time if argument.default.is_some() => self.any(&[0.0, 0.5, 2.0]).into(),
                FaultRange::Time => self.between(0.0, 3.0).into(),
                // An existing item, or the first id that does not exist.
                FaultRange::Item => {
                    let items = mission.expected_properties(self.scenario).items as u32;
                    f64::from(self.rng.random_range(0..=items)).into()
                }
                // At most two more than the minimum.
                FaultRange::Whole(from, to) => {
                    let most = to.min(from.saturating_add(2));
                    f64::from(self.rng.random_range(from..=most)).into()
                }
                FaultRange::Name => {
                    let names = mission.fault_names(self.scenario, argument.key);
                    self.any(&names).into()
                }
                FaultRange::Robot => self.robot().name.into(),
                FaultRange::Choice(choices) => self.any(choices).0.into(),
                // The ends of a link are drawn together.
                FaultRange::From => {
                    let LinkSelection { from, to } = self.link();
                    link = Some(to);
                    from.as_str().into()
                }
                FaultRange::To => link.take().unwrap_or_default().as_str().into(),
                FaultRange::Flag => self.rng.random_bool(0.3).into(),
                FaultRange::Device => {
                    let devices: Vec<&str> = Device::names_for(mission).collect();
                    self.any(&devices).into()
                }
                FaultRange::Skill => {
                    let skills = mission.skills(self.scenario);
                    (!skills.is_empty()).then(|| self.any(&skills))?.into()
                }
                FaultRange::Groups => {
                    let groups = self.groups();
                    has_groups = groups.iter().all(|group| !group.is_empty());
                    groups.map(toml::Value::from).to_vec().into()
                }
                FaultRange::Mode(form) => self.mode(&form),
            };
            values.insert(argument.key.to_owned(), value);
        }
        let fault = Fault::from_values(spec.name, values).ok();
        fault.filter(|_| has_groups)
    }

    /// Draws a place within the border, m. Half of the draws give a place where robots look for items.
    fn place_of_interest(&mut self) -> (f32, f32) {
        const TRIES: usize = 30;
        let anywhere = self.place();
        if self.rng.random_bool(0.5) {
            return anywhere;
        }
        let is_searched = self.scenario.mission().is_searched(self.scenario);
        for _ in 0..TRIES {
            let place = self.place();
            if is_searched(place.into()) {
                return place;
            }
        }
        anywhere
    }

    fn any<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.rng.random_range(0..all.len())].clone()
    }

    /// Draws a number, rounded to two decimals for readability.
    fn between(&mut self, from: f64, to: f64) -> f64 {
        let value = if from < to {
            self.rng.random_range(from..to)
        } else {
            from
        };
        (value * 100.0).round() / 100.0
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use missions::waste::data::{default_scenario, default_setup};
    use rand_chacha::rand_core::SeedableRng;

    use super::*;

    fn orders(until_s: f64) -> Vec<Order> {
        let faults = RandomFaults {
            min: 20,
            max: 20,
            until_s,
        };
        let scenario = default_scenario();
        let of = |seed| timeline(&faults, &scenario, &mut ChaCha8Rng::seed_from_u64(seed));
        (0..200).flat_map(of).collect()
    }

    #[test]
    fn everything_has_healed_in_time_but_what_never_does() {
        let setup = default_setup(1);
        for until_s in [1.0, 5.0, 240.0] {
            for order in orders(until_s) {
                order.check(&setup.scenario, &setup.catalog).unwrap();
                let Some(at_s) = order.at_s else {
                    assert!(order.when.is_some());
                    assert!(order.for_s.is_none() || !order.fault.is_instantaneous());
                    continue;
                };
                let ends_s = at_s + order.for_s.unwrap_or_default();
                assert!(
                    order.every_s.is_some() || ends_s <= until_s + 0.01,
                    "{order:?}"
                );
            }
        }
    }

    #[test]
    fn triggers_of_every_kind_and_waste_anywhere() {
        let orders = orders(240.0);
        let whens = || orders.iter().filter_map(|order| order.when.as_ref());
        for verb in TriggerEvent::verbs(default_scenario().mission()) {
            let with_verb = || whens().filter(|when| when.what == verb);
            assert!(with_verb().any(|when| when.robot.is_some() && when.subject.is_none()));
            assert!(with_verb().any(|when| when.robot.is_none()));
            let about_a_set = with_verb().any(EventTrigger::has_behavior_set_subject);
            assert_eq!(with_verb().any(|when| when.subject.is_some()), about_a_set);
        }
        assert!(orders.iter().any(|order| order.at_s == Some(0.0)));
        let room = default_scenario().room;
        let strewn = |x_m: f64, y_m: f64| {
            let mission = default_scenario().mission();
            !mission.is_searched(&default_scenario())(Vec2::new(x_m as f32, y_m as f32))
        };
        let places = orders.iter().filter_map(|order| match &order.fault {
            Fault::Mission(fault) => Some((fault.get("x_m")?, fault.get("y_m")?)),
            _ => None,
        });
        let places: Vec<(f64, f64)> = places.collect();
        assert!(places.iter().any(|&(x_m, y_m)| strewn(x_m, y_m)));
        let (width_m, height_m) = (f64::from(room.width_m), f64::from(room.height_m));
        let inside = |&(x_m, y_m): &(f64, f64)| x_m <= width_m && y_m <= height_m;
        assert!(places.iter().all(inside));
    }

    #[test]
    fn no_place_is_beyond_a_border_that_reads_as_more_than_it_is() {
        let border_m = 9.11_f32;
        assert!(f64::from(border_m) < 9.11 && written(border_m) <= f64::from(border_m));
    }

    #[test]
    fn shares_of_waiting_recurring_and_permanent_faults() {
        let orders = orders(240.0);
        let share = |which: fn(&Order) -> bool| {
            orders.iter().filter(|order| which(order)).count() as f64 / orders.len() as f64
        };
        let near = |share: f64, wanted: f64| assert!((share - wanted).abs() < 0.03, "{share}");
        near(share(|order| order.when.is_some()), BY_EVENT);
        near(share(|order| order.every_s.is_some()), PERIODIC);
        let stays = |order: &Order| {
            order.when.is_none() && order.for_s.is_none() && !order.fault.is_instantaneous()
        };
        near(share(stays), PERMANENT * 20.0 / 25.0);
    }
}

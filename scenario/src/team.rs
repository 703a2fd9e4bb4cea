//! The team of a scenario file: kinds of robots, and blocks `[[robots]]` of one or several robots.
//!
//! ```toml
//! [kinds.scout]
//! side_sensor = true
//! speed_m_s = 0.8
//!
//! [[robots]]
//! kind = "scout"      # the robots scout1, scout2 and scout3
//! count = 3
//! ```
//!
//! A kind contains keys of a block. A key that the block states itself replaces the whole value of the kind. A scenario
//! in memory and in a log contains one robot after the other, without kinds.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::error::Problem;
use super::limits::{check_known, check_name, whole};
use super::path::{KeyPath, PathStep};
use super::toml_value::{EditedTable, TomlValue};
use super::validate::MAX_ROBOTS;
use super::{Body, Robot, Start};

/// The key of the blocks.
pub(super) const ROBOTS: &str = "robots";
/// The key of the kinds.
pub(super) const KINDS: &str = "kinds";

const NAME: &str = "name";
const KIND: &str = "kind";
const COUNT: &str = "count";
const START: &str = "start";

/// The distance between the centers of neighboring robots of a block with a start, in radii of the body.
const SPACING_RADII: f64 = 4.0;

/// Returns the robots of all blocks, in rank order. Values are not checked beyond their types.
///
/// # Errors
/// Returns the first mistake of a kind or of a block, with its key in the file.
pub(super) fn read(file: &DeTable<'_>, body: &Body) -> Result<Vec<Robot>, Problem> {
    check_kinds(file)?;
    let mut robots = Vec::new();
    let blocks = match file.get(ROBOTS).map(Spanned::get_ref) {
        Some(DeValue::Array(blocks)) => blocks,
        Some(other) => {
            let refused = Vec::deserialize(TomlValue(other));
            return refused.map_err(|problem| problem.under([ROBOTS]));
        }
        None => return Ok(robots),
    };
    let mut first: BTreeMap<String, usize> = BTreeMap::new();
    for index in 0..blocks.len() {
        let at = KeyPath::new([ROBOTS]).index(index);
        let block = Block::read(file, blocks, index).map_err(|problem| problem.under(&at))?;
        if let Some(count) = block.count
            && robots.len() + count > MAX_ROBOTS
        {
            let what = format!("{count} more robots are too many");
            let remedy = format!("a team has 1 to {MAX_ROBOTS} robots in all");
            return Err(Problem::at(at.key(COUNT), what, remedy));
        }
        let robot = block.robot()?;
        for number in 0..block.count.unwrap_or(1) {
            let name = block.numbered(&robot.name, number);
            if let Some(first) = first.insert(name.clone(), index) {
                let what = format!("'{name}' is already the name of {ROBOTS}[{first}]");
                return Err(Problem::at(at.key(NAME), what, "give each its own name"));
            }
            let start = robot.start.map(|start| block.spread(start, number, body));
            robots.push(Robot {
                name,
                start,
                ..robot.clone()
            });
        }
    }
    Ok(robots)
}

/// Returns a problem of a scenario that was read from this file, with the key in the file: of the block of a robot, or
/// of its kind.
pub(super) fn as_stated(file: &DeTable<'_>, mut problem: Problem) -> Problem {
    let [PathStep::Key(list), PathStep::Index(rank), rest @ ..] = &problem.place.key.0[..] else {
        return problem;
    };
    let (true, Some((block, number))) = (list == ROBOTS, find_block(file, *rank)) else {
        return problem;
    };
    let key = match rest {
        [PathStep::Key(key), ..] => key.as_str(),
        _ => "",
    };
    let name = block.name().map(|name| block.numbered(name, number));
    if let (START, Some(_), Some(name)) = (key, block.count, name)
        && !problem.problem.contains(&name)
    {
        problem.problem += &format!(" for '{name}'");
    }
    problem.place.key = block.place(key).join(KeyPath(rest.to_vec()));
    problem
}

/// Returns the block of the robot with this rank, and the robot's number in the block, from 0.
fn find_block<'t>(file: &'t DeTable<'t>, rank: usize) -> Option<(Block<'t>, usize)> {
    let DeValue::Array(blocks) = file.get(ROBOTS)?.get_ref() else {
        return None;
    };
    let mut before = 0;
    for index in 0..blocks.len() {
        let block = Block::read(file, blocks, index).ok()?;
        let count = block.count.unwrap_or(1);
        if rank < before + count {
            return Some((block, rank - before));
        }
        before += count;
    }
    None
}

/// Rejects the first kind that no robot could have.
fn check_kinds(file: &DeTable<'_>) -> Result<(), Problem> {
    let Some(kinds) = file.get(KINDS) else {
        return Ok(());
    };
    let checked = match kinds.get_ref() {
        DeValue::Table(kinds) => kinds.iter().try_for_each(|(name, kind)| {
            let name = name.get_ref();
            check_kind(name, kind).map_err(|problem| problem.under([name.as_ref()]))
        }),
        other => BTreeMap::<String, Robot>::deserialize(TomlValue(other)).map(|_| ()),
    };
    checked.map_err(|problem| problem.under([KINDS]))
}

fn check_kind(name: &str, kind: &Spanned<DeValue<'_>>) -> Result<(), Problem> {
    check_name((), name)?;
    let DeValue::Table(stated) = kind.get_ref() else {
        return Robot::deserialize(TomlValue(kind.get_ref())).map(|_| ());
    };
    if stated.contains_key(NAME) {
        let remedy = "name the robots in [[robots]]";
        return Err(Problem::at([NAME], "a kind names no robot", remedy));
    }
    let mut named = stated.clone();
    insert_name(&mut named, name, kind);
    let read = Robot::deserialize(EditedTable {
        table: &named,
        left_out: &[],
        others: &[],
        implied: &[NAME],
    });
    read.map(|_| ())
}

/// Adds a name to the table of a robot, at the place of another value.
fn insert_name<'t>(table: &mut DeTable<'t>, name: &str, at: &Spanned<DeValue<'_>>) {
    let name = DeValue::String(name.to_owned().into());
    table.insert(
        Spanned::new(at.span(), NAME.into()),
        Spanned::new(at.span(), name),
    );
}

/// A table of `[[robots]]` with its kind.
struct Block<'t> {
    index: usize,
    /// The table as it was parsed.
    value: &'t Spanned<DeValue<'t>>,
    stated: &'t DeTable<'t>,
    kind: Option<(&'t str, &'t DeTable<'t>)>,
    /// The stated number of robots, 1 or more. Only then, the names have numbers.
    count: Option<usize>,
}

impl<'t> Block<'t> {
    /// Reads the kind and the count of a block. Errors have keys below the block.
    fn read(file: &'t DeTable<'t>, blocks: &'t DeArray<'t>, index: usize) -> Result<Self, Problem> {
        let value = &blocks[index];
        let stated = match value.get_ref() {
            DeValue::Table(stated) => stated,
            other => {
                let refused = Robot::deserialize(TomlValue(other));
                let what = "the block is no table";
                return Err(refused.map_or_else(|problem| problem, |_| Problem::of_value(what, "")));
            }
        };
        let kind = match stated.get(KIND).map(Spanned::get_ref) {
            Some(DeValue::String(name)) => Some(find_kind(file, name)?),
            Some(other) => {
                let refused = String::deserialize(TomlValue(other)).map(|_| None);
                refused.map_err(|problem| problem.under([KIND]))?
            }
            None => None,
        };
        let count = stated.get(COUNT).map(|count| read_count(count.get_ref()));
        let count = count.transpose();
        Ok(Self {
            index,
            value,
            stated,
            kind,
            count: count.map_err(|problem| problem.under([COUNT]))?,
        })
    }

    /// Returns the robot that the block and its kind describe, without number. Errors have keys of the file.
    fn robot(&self) -> Result<Robot, Problem> {
        let mut merged = self.kind.map(|(_, kind)| kind.clone()).unwrap_or_default();
        merged.extend(self.stated.clone());
        if let (Some((kind, _)), false) = (self.kind, merged.contains_key(NAME)) {
            insert_name(&mut merged, kind, self.value);
        }
        let short_forms = &[KIND, COUNT];
        let read = Robot::deserialize(EditedTable {
            table: &merged,
            left_out: short_forms,
            others: short_forms,
            implied: &[],
        });
        read.map_err(|problem| {
            let place = match problem.place.key.0.first() {
                Some(PathStep::Key(key)) => self.place(key),
                _ => self.place(""),
            };
            problem.under(&place)
        })
    }

    /// Returns the place in the file that states a key: the kind if only it does, and else the block.
    fn place(&self, key: &str) -> KeyPath {
        match self.kind {
            Some((name, kind)) if kind.contains_key(key) && !self.stated.contains_key(key) => {
                KeyPath::new([KINDS, name])
            }
            _ => KeyPath::new([ROBOTS]).index(self.index),
        }
    }

    /// Returns the name without number: by default that of the kind.
    fn name(&self) -> Option<&str> {
        let stated = self.stated.get(NAME);
        let stated = stated.and_then(|name| name.get_ref().as_str());
        stated.or(self.kind.map(|(name, _)| name))
    }

    /// Returns the name of a robot of the block, counted from 0.
    fn numbered(&self, name: &str, number: usize) -> String {
        match self.count {
            Some(_) => format!("{name}{}", number + 1),
            None => name.to_owned(),
        }
    }

    /// Returns the start of a robot of the block, counted from 0: its place in a square grid around `start`, in rows of
    /// increasing x from the top to the bottom, rounded to mm.
    fn spread(&self, start: Start, number: usize, body: &Body) -> Start {
        let Some(count) = self.count else {
            return start;
        };
        let columns = (count as f64).sqrt().ceil() as usize;
        let rows = count.div_ceil(columns);
        let spacing_m = SPACING_RADII * f64::from(body.radius_m);
        let offset_m =
            |place: usize, places: usize| (place as f64 - (places as f64 - 1.0) / 2.0) * spacing_m;
        let rounded = |place_m: f64| ((place_m * 1000.0).round() / 1000.0) as f32;
        Start {
            x_m: rounded(f64::from(start.x_m) + offset_m(number % columns, columns)),
            y_m: rounded(f64::from(start.y_m) - offset_m(number / columns, rows)),
            ..start
        }
    }
}

/// Returns a kind of the file by its name.
fn find_kind<'t>(
    file: &'t DeTable<'t>,
    name: &'t str,
) -> Result<(&'t str, &'t DeTable<'t>), Problem> {
    let kinds = match file.get(KINDS).map(Spanned::get_ref) {
        Some(DeValue::Table(kinds)) => Some(kinds),
        _ => None,
    };
    let names = kinds.into_iter().flatten();
    let names = names.map(|(name, _)| name.get_ref().as_ref());
    check_known([KIND], "there is no kind", name, names)?;
    match kinds
        .and_then(|kinds| kinds.get(name))
        .map(Spanned::get_ref)
    {
        Some(DeValue::Table(kind)) => Ok((name, kind)),
        _ => Err(Problem::at(
            [KIND],
            "the kind is no table",
            "write [kinds.NAME]",
        )),
    }
}

fn read_count(value: &DeValue<'_>) -> Result<usize, Problem> {
    let count = u32::deserialize(TomlValue(value))?;
    whole(1, MAX_ROBOTS as i64, "").check((), count)?;
    Ok(count as usize)
}

#[cfg(test)]
mod tests {
    use crate::testkit::{refusals, vocabulary};
    use crate::{Problem, Scenario};

    fn read(text: &str) -> Result<Scenario, Problem> {
        Scenario::parse("s.toml", text, &vocabulary())
    }

    /// Asserts that a short text and a long one are the same scenario.
    fn assert_equal(short: &str, long: &str) {
        let parse = |text: &str| read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(parse(short), parse(long));
    }

    #[test]
    fn a_robot_has_the_keys_of_its_kind_and_may_override_each() {
        assert_equal(
            "drill = {}
            [kinds.scout]
            side_sensor = true
            speed_m_s = 0.8
            tasks = ['find', 'report']
            skills = { lift = 2.0 }
            start = { x_m = 1, y_m = 2 }
            [[robots]]
            kind = 'scout'
            [[robots]]
            name = 'old'
            kind = 'scout'
            side_sensor = false
            speed_m_s = 0.2
            tasks = ['find']
            skills = {}
            start = { x_m = 3, y_m = 2, heading_deg = 90 }",
            "drill = {}
            [[robots]]
            name = 'scout'
            side_sensor = true
            speed_m_s = 0.8
            tasks = ['find', 'report']
            skills = { lift = 2.0 }
            start = { x_m = 1, y_m = 2 }
            [[robots]]
            name = 'old'
            speed_m_s = 0.2
            tasks = ['find']
            skills = {}
            start = { x_m = 3, y_m = 2, heading_deg = 90 }",
        );
    }

    #[test]
    fn counted_robots_have_numbers_and_stand_in_a_grid() {
        assert_equal(
            "drill = {}
            body.radius_m = 0.1
            [[robots]]
            name = 'a'
            count = 5
            start = { x_m = 2, y_m = 3, heading_deg = 45 }
            [[robots]]
            name = 'b'
            count = 1",
            "drill = {}
            body.radius_m = 0.1
            robots = [
                { name = 'a1', start = { x_m = 1.6, y_m = 3.2, heading_deg = 45 } },
                { name = 'a2', start = { x_m = 2.0, y_m = 3.2, heading_deg = 45 } },
                { name = 'a3', start = { x_m = 2.4, y_m = 3.2, heading_deg = 45 } },
                { name = 'a4', start = { x_m = 1.6, y_m = 2.8, heading_deg = 45 } },
                { name = 'a5', start = { x_m = 2.0, y_m = 2.8, heading_deg = 45 } },
                { name = 'b1' },
            ]",
        );
    }

    #[test]
    fn a_zone_is_an_obstacle_that_robots_can_enter() {
        assert_equal(
            "drill = {}
            [[zones]]
            x_m = 5
            y_m = 4
            width_m = 2
            height_m = 1
            speed_factor = 0.5
            [[obstacles]]
            x_m = 1
            y_m = 1
            width_m = 1
            height_m = 1",
            "drill = {}
            obstacles = [
                { x_m = 1, y_m = 1, width_m = 1, height_m = 1 },
                { x_m = 5, y_m = 4, width_m = 2, height_m = 1, penetrability = 0.5 },
            ]",
        );
    }

    #[test]
    fn mistakes_are_reported_at_the_kind_or_the_block() {
        let scout = "[kinds.scout]\nspeed_m_s = 0.5\n";
        let zone = "[[zones]]\nx_m = 1\ny_m = 1\nwidth_m = 1\nheight_m = 1\n";
        let texts = [
            "kinds = 3".to_owned(),
            "kinds.scout = 3".to_owned(),
            "[kinds.'a b']".to_owned(),
            "[kinds.scout]\nname = 'a'".to_owned(),
            "[kinds.scout]\n\nsped_m_s = 0.5".to_owned(),
            "[kinds.scout]\ncount = 3".to_owned(),
            "[kinds.scout]\nspeed_m_s = 'fast'".to_owned(),
            "[kinds.scout]\ntasks = []".to_owned(),
            format!("{scout}[[robots]]\nkind = 'scuot'"),
            "[[robots]]\nkind = 'scout'".to_owned(),
            format!("{scout}[[robots]]\nkind = 3"),
            format!("{scout}[[robots]]\nkind = 'scout'\ncuont = 3"),
            format!("{scout}[[robots]]\nname = 'a'\ncount = 0"),
            format!("{scout}[[robots]]\nname = 'a'\ncount = 2.5"),
            format!("{scout}[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\ncount = 1000000"),
            format!("{scout}[[robots]]\ncount = 3"),
            format!("{scout}[[robots]]\nname = 'a b'\ncount = 3"),
            format!("{scout}[[robots]]\nname = 'scout2'\n[[robots]]\nkind = 'scout'\ncount = 3"),
            // Values are checked per robot and reported where the file states them.
            "[kinds.scout]\nspeed_m_s = 0\n[[robots]]\nname = 'a'\ncount = 3\n[[robots]]\nkind = 'scout'".to_owned(),
            format!("{scout}[[robots]]\nname = 'a'\ncount = 3\n[[robots]]\nkind = 'scout'\nspeed_m_s = -1"),
            "[kinds.scout]\ntasks = ['find', 'dance']\n[[robots]]\nkind = 'scout'\ncount = 2".to_owned(),
            "[kinds.scout]\ntasks = ['move(top)']\nskills = { lift = 0 }\n[[robots]]\nkind = 'scout'".to_owned(),
            "[kinds.scout.start]\nx_m = 0.3\ny_m = 2\n[[robots]]\nkind = 'scout'\ncount = 4".to_owned(),
            "[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\ncount = 4\nstart = { x_m = 0.5, y_m = 2 }".to_owned(),
            "[[robots]]\nname = 'a'\ncount = 2\n[[robots]]\nname = 'b'\ncount = 9\nstart = { x_m = 1, y_m = 1 }\n\
             [[robots]]\nname = 'c'\nstart = { x_m = 1, y_m = 1 }".to_owned(),
            "zones = 3".to_owned(),
            zone.to_owned(),
            format!("{zone}speed = 0.5"),
            format!("{zone}speed_factor = 0.1"),
            format!("{zone}speed_factor = 101"),
            format!("{zone}speed_factor = 'slow'"),
            format!("{zone}speed_factor = 0.5\n[[zones]]\nx_m = 1\ny_m = 1\nwidth_m = 0\nheight_m = 1\nspeed_factor = 2"),
            "[[zones]]\nx_m = 1".to_owned(),
        ];
        let texts = texts.map(|text| format!("drill = {{}}\n{text}"));
        insta::assert_snapshot!(refusals("s.toml", texts, read));
    }
}

//! The file that says what is varied.

use std::collections::BTreeMap;
use std::fmt;

use alliance_proto::fault::Faults;
use alliance_proto::scenario::{Preset, Scenario, ScenarioError, Setup, Step, TomlFile};
use anyhow::{Context, bail};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Value;
use world_server::world::start_poses;
use xxhash_rust::xxh3::xxh3_64;

use super::design::{Cell, Change, Design, FAULTS, Factor, Level, PRESET, SEED, change};
use super::sampling::{Distribution, draw};

/// More than anybody runs; every run's row is held in memory.
const MAX_RUNS: usize = 1_000_000;

/// A sweep.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The scenario that is varied, every default filled in.
    base: toml::Table,
    /// Its runs.
    pub design: Design,
}

/// The file, as it is written.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct File {
    scenario: Option<Source>,
    limit_s: Option<f64>,
    seeds: Seeds,
    presets: Vec<Preset>,
    faults: BTreeMap<String, Faults>,
    grid: toml::Table,
    list: Vec<toml::Table>,
    random: Option<toml::Table>,
}

/// The scenario, by name or file, or in place.
enum Source {
    Named(String),
    Here(Box<Scenario>),
}

/// The seeds.
struct Seeds(Vec<i64>);

impl Default for Seeds {
    fn default() -> Self {
        Self(vec![1])
    }
}

/// A value, and where the file has it.
struct Leaf {
    at: Vec<Step>,
    path: Vec<String>,
    value: Value,
}

/// What the file states of a factor, each to be tried by itself.
struct Stated {
    at: Vec<Step>,
    changes: Vec<Change>,
}

impl Plan {
    /// Reads a plan. `scenario` finds one by its name or file; `file_name` is for error messages. Each value is tried on the
    /// scenario by itself, so that what is left to fail are values that do not go together.
    ///
    /// # Errors
    /// The first mistake, in one line: where, what, and what would be right.
    pub fn parse(
        file_name: &str,
        text: &str,
        scenario: impl FnOnce(&str) -> anyhow::Result<Scenario>,
    ) -> anyhow::Result<Self> {
        let file = TomlFile::parse(file_name, text)?;
        let contents: File = file.to()?;
        let place = |at: &[Step]| format!("{file_name}:{}", file.line_of(at));

        let mut base = match contents.scenario {
            None => Scenario::default(),
            Some(Source::Named(name)) => {
                scenario(&name).with_context(|| place(&[key("scenario")]))?
            }
            Some(Source::Here(scenario)) => *scenario,
        };
        if let Some(limit_s) = contents.limit_s {
            base.limit_s = limit_s;
        }
        // By its text: so a float of 32 bits is 0.2 there, too.
        let base: toml::Table = toml::from_str(&toml::to_string(&base)?)?;
        let source = match contents.limit_s {
            Some(_) => [key("limit_s")],
            None => [key("scenario")],
        };
        Scenario::from_table(&base).with_context(|| place(&source))?;

        let mut factors = Vec::new();
        let mut stated = Vec::new();
        let mut columns = Vec::new();
        for leaf in leaves(&file, &[key("grid")], contents.grid, |_| false) {
            columns.push((leaf.at.clone(), leaf.path.clone()));
            factors.push(grid(&file, leaf, &mut stated)?);
        }
        factors.extend(list(&file, contents.list, &mut stated, &mut columns)?);
        if let Some(random) = contents.random {
            factors.extend(sample(&file, random, &mut stated, &mut columns)?);
        }
        if !contents.presets.is_empty() {
            columns.push((vec![key("presets")], path("alliance.preset")));
            factors.push(presets(&file, &contents.presets)?);
        }
        if !contents.faults.is_empty() {
            columns.push((vec![key("faults")], path("faults")));
            factors.push(faults(contents.faults, &mut stated)?);
        }
        factors.push(seeds(&file, contents.seeds)?);
        disjoint(&file, &columns)?;
        for Stated { at, changes } in &stated {
            let mut table = base.clone();
            for each in changes {
                change(&mut table, each)
                    .map_err(anyhow::Error::msg)
                    .with_context(|| place(at))?;
            }
            Scenario::from_table(&table).with_context(|| place(at))?;
        }

        let design = Design { factors };
        if design.runs().is_none_or(|runs| runs > MAX_RUNS) {
            let sizes: Vec<String> = design
                .factors
                .iter()
                .map(|factor| factor.levels.len().to_string())
                .collect();
            bail!(
                "{file_name}: {} runs are more than {MAX_RUNS}; take fewer values, or draw some under [random]",
                sizes.join(" x ")
            );
        }
        Ok(Self { base, design })
    }

    /// Tells this plan from one that would give other runs; comments and order of tables do not matter, the program's version
    /// does.
    #[must_use]
    pub fn digest(&self) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let whole = format!("{version}\n{}\n{:?}", self.base, self.design);
        format!("{:016x}", xxh3_64(whole.as_bytes()))
    }

    /// The scenario that is varied, as a file.
    #[must_use]
    pub fn base(&self) -> String {
        self.base.to_string()
    }

    /// The scenario of a run, every default filled in.
    ///
    /// # Errors
    /// When the run's settings do not go together.
    pub fn scenario(&self, run: usize) -> Result<toml::Table, String> {
        let mut table = self.base.clone();
        for level in self.design.levels(run) {
            for each in &level.changes {
                change(&mut table, each)?;
            }
        }
        Ok(table)
    }
}

/// Everything that a run needs.
///
/// # Errors
/// What is wrong with the scenario.
pub fn setup(scenario: &toml::Table, seed: u64) -> anyhow::Result<Setup> {
    let scenario = Scenario::from_table(scenario)?;
    start_poses(&scenario)?;
    Ok(Setup::resolve(scenario, seed, None)?.setup)
}

fn key(key: &str) -> Step {
    Step::Key(key.to_owned())
}

fn path(text: &str) -> Vec<String> {
    text.split('.').map(str::to_owned).collect()
}

/// All values below a table, in the order of their lines. Keys may be written as tables or with dots, also within quotes. A
/// table is a value itself where `ends` says so.
fn leaves(
    file: &TomlFile<'_>,
    at: &[Step],
    table: toml::Table,
    ends: fn(&toml::Table) -> bool,
) -> Vec<Leaf> {
    fn collect(
        at: &[Step],
        way: &[String],
        table: toml::Table,
        ends: fn(&toml::Table) -> bool,
        found: &mut Vec<Leaf>,
    ) {
        for (name, value) in table {
            let at = [at, &[key(&name)]].concat();
            let path = [way, &path(&name)].concat();
            match value {
                Value::Table(table) if !ends(&table) => {
                    collect(&at, &path, table, ends, found);
                }
                value => found.push(Leaf { at, path, value }),
            }
        }
    }
    let mut found = Vec::new();
    collect(at, &[], table, ends, &mut found);
    found.sort_by_cached_key(|leaf| (file.line_of(&leaf.at), leaf.path.clone()));
    found
}

/// A key of `[grid]` with its values.
fn grid(
    file: &TomlFile<'_>,
    leaf: Leaf,
    stated: &mut Vec<Stated>,
) -> Result<Factor, ScenarioError> {
    let Leaf { at, path, value } = leaf;
    let Value::Array(values) = value else {
        let what = format!("{value} is no list of values");
        return Err(file.mistake(&at, what, format!("write [{value}], or more of them")));
    };
    distinct(file, &at, &values)?;
    let mut levels = Vec::new();
    for (place, value) in values.into_iter().enumerate() {
        let level = Level::of(&path, value);
        stated.push(Stated {
            at: [&at[..], &[Step::Index(place)]].concat(),
            changes: level.changes.clone(),
        });
        levels.push(level);
    }
    Ok(Factor {
        columns: vec![path.join(".")],
        levels,
    })
}

impl Level {
    /// One key with one value.
    fn of(path: &[String], value: Value) -> Self {
        Self {
            cells: vec![Cell::of(&value)],
            changes: vec![Change {
                path: path.to_vec(),
                value,
            }],
        }
    }

    /// Several together.
    fn together(levels: impl IntoIterator<Item = Self>) -> Self {
        let mut all = Self {
            cells: Vec::new(),
            changes: Vec::new(),
        };
        for level in levels {
            all.cells.extend(level.cells);
            all.changes.extend(level.changes);
        }
        all
    }
}

/// The places that the swept keys have in the file and in the scenario.
type Columns = Vec<(Vec<Step>, Vec<String>)>;

/// The points of `[[list]]`.
fn list(
    file: &TomlFile<'_>,
    points: Vec<toml::Table>,
    stated: &mut Vec<Stated>,
    columns: &mut Columns,
) -> Result<Option<Factor>, ScenarioError> {
    let mut factor: Option<Factor> = None;
    for (place, point) in points.into_iter().enumerate() {
        let at = [key("list"), Step::Index(place)];
        let mut leaves = leaves(file, &at, point, |_| false);
        // Points may have their keys in any order.
        leaves.sort_by(|a, b| a.path.cmp(&b.path));
        let names: Vec<String> = leaves.iter().map(|leaf| leaf.path.join(".")).collect();
        if names.is_empty() {
            let remedy = "write a key of the scenario with its value";
            return Err(file.mistake(&at, "the point is empty", remedy));
        }
        let known = factor.get_or_insert_with(|| {
            let places = leaves.iter();
            columns.extend(places.map(|leaf| (leaf.at.clone(), leaf.path.clone())));
            Factor {
                columns: names.clone(),
                levels: Vec::new(),
            }
        });
        if known.columns != names {
            let what = format!("the point has the keys {}", names.join(", "));
            let remedy = format!("all need those of the first, {}", known.columns.join(", "));
            return Err(file.mistake(&at, what, remedy));
        }
        let level = Level::together(
            leaves
                .into_iter()
                .map(|leaf| Level::of(&leaf.path, leaf.value)),
        );
        if known.levels.contains(&level) {
            return Err(file.mistake(&at, "the point is there already", "state it once"));
        }
        stated.push(Stated {
            at: at.to_vec(),
            changes: level.changes.clone(),
        });
        known.levels.push(level);
    }
    Ok(factor)
}

/// The points that `[random]` asks for.
fn sample(
    file: &TomlFile<'_>,
    mut table: toml::Table,
    stated: &mut Vec<Stated>,
    columns: &mut Columns,
) -> Result<Option<Factor>, ScenarioError> {
    let at = [key("random")];
    let mut number = |name: &str, default: Option<i64>| {
        let at = [key("random"), key(name)];
        match (table.remove(name), default) {
            (Some(Value::Integer(number)), _) if number >= 0 => Ok(number as u64),
            (Some(value), _) => Err(file.mistake(
                &at,
                format!("{value} does not fit"),
                "write a whole number that is not negative",
            )),
            (None, Some(default)) => Ok(default as u64),
            (None, None) => Err(file.mistake(&at, "the key is missing", "say how many points")),
        }
    };
    let (count, seed) = (number("n", None)?, number("seed", Some(1))?);
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    if !(1..=MAX_RUNS).contains(&count) {
        let what = format!("{count} points do not fit");
        let remedy = format!("write a number from 1 to {MAX_RUNS}");
        return Err(file.mistake(&[key("random"), key("n")], what, remedy));
    }
    let states_range = |table: &toml::Table| {
        let mut keys = ["min", "max", "choose"].iter();
        keys.any(|key| table.contains_key(*key))
    };
    let leaves = leaves(file, &at, table, states_range);
    if leaves.is_empty() {
        let remedy = "write a key of the scenario with { min = …, max = … } or { choose = […] }";
        return Err(file.mistake(&at, "nothing is drawn", remedy));
    }
    let mut names = Vec::new();
    let mut drawn = Vec::new();
    for leaf in leaves {
        let distribution = distribution(file, &leaf)?;
        for value in distribution.stated() {
            stated.push(Stated {
                at: leaf.at.clone(),
                changes: Level::of(&leaf.path, value).changes,
            });
        }
        let name = leaf.path.join(".");
        let values = draw(seed, &name, &distribution, count).into_iter();
        drawn.push(
            values
                .map(|value| Level::of(&leaf.path, value))
                .collect::<Vec<_>>(),
        );
        names.push(name);
        columns.push((leaf.at, leaf.path));
    }
    let point = |place: usize| Level::together(drawn.iter().map(|levels| levels[place].clone()));
    Ok(Some(Factor {
        columns: names,
        levels: (0..count).map(point).collect(),
    }))
}

fn distribution(file: &TomlFile<'_>, leaf: &Leaf) -> Result<Distribution, ScenarioError> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Range {
        min: Option<Value>,
        max: Option<Value>,
        #[serde(default)]
        log: bool,
        choose: Option<Vec<Value>>,
    }
    let forms = "write { min = …, max = … }, with log = true if you like, or { choose = […] }";
    let mistake = |what: String| file.mistake(&leaf.at, what, forms);
    let range: Range = leaf
        .value
        .clone()
        .try_into()
        .map_err(|_| mistake(format!("{} says not what to draw", leaf.value)))?;
    match range {
        Range {
            min: None,
            max: None,
            log: false,
            choose: Some(values),
        } => {
            distinct(file, &leaf.at, &values)?;
            Ok(Distribution::Choice(values))
        }
        Range {
            min: Some(Value::Integer(min)),
            max: Some(Value::Integer(max)),
            log: false,
            choose: None,
        } if min < max => Ok(Distribution::Integer(min, max)),
        Range {
            min: Some(min),
            max: Some(max),
            log,
            choose: None,
        } => match (Cell::of(&min).number(), Cell::of(&max).number()) {
            (Some(min), Some(max)) if min < max && !log => Ok(Distribution::Even(min, max)),
            (Some(min), Some(max)) if min < max && min > 0.0 => Ok(Distribution::Log(min, max)),
            (Some(_), Some(_)) if log => Err(mistake(format!(
                "from {min} to {max} is no range of positive numbers"
            ))),
            _ => Err(mistake(format!(
                "from {min} to {max} is no range of numbers"
            ))),
        },
        _ => Err(mistake(format!("{} says not what to draw", leaf.value))),
    }
}

fn presets(file: &TomlFile<'_>, presets: &[Preset]) -> Result<Factor, ScenarioError> {
    let names: Vec<Value> = presets
        .iter()
        .filter_map(|preset| Value::try_from(preset).ok())
        .collect();
    distinct(file, &[key("presets")], &names)?;
    Ok(Factor {
        columns: vec![PRESET.to_owned()],
        levels: names
            .into_iter()
            .map(|name| Level::of(&path("alliance.preset"), name))
            .collect(),
    })
}

/// Each plan takes the place of the scenario's faults.
fn faults(plans: BTreeMap<String, Faults>, stated: &mut Vec<Stated>) -> anyhow::Result<Factor> {
    let mut levels = Vec::new();
    for (name, faults) in plans {
        // By its text, as the scenario itself.
        let value: toml::Table = toml::from_str(&toml::to_string(&faults)?)?;
        let changes = vec![Change {
            path: path("faults"),
            value: Value::Table(value),
        }];
        stated.push(Stated {
            at: vec![key("faults"), key(&name)],
            changes: changes.clone(),
        });
        levels.push(Level {
            cells: vec![Cell::Text(name)],
            changes,
        });
    }
    Ok(Factor {
        columns: vec![FAULTS.to_owned()],
        levels,
    })
}

fn seeds(file: &TomlFile<'_>, Seeds(seeds): Seeds) -> Result<Factor, ScenarioError> {
    let values: Vec<Value> = seeds.iter().copied().map(Value::Integer).collect();
    distinct(file, &[key("seeds")], &values)?;
    Ok(Factor {
        columns: vec![SEED.to_owned()],
        levels: seeds
            .into_iter()
            .map(|seed| Level {
                cells: vec![Cell::Integer(seed)],
                changes: Vec::new(),
            })
            .collect(),
    })
}

/// A value that is there twice would count twice.
fn distinct(file: &TomlFile<'_>, at: &[Step], values: &[Value]) -> Result<(), ScenarioError> {
    if values.is_empty() {
        return Err(file.mistake(
            at,
            "the list is empty",
            "write at least one value, or leave the key out",
        ));
    }
    let mut seen = std::collections::BTreeSet::new();
    match values.iter().find(|value| !seen.insert(value.to_string())) {
        Some(value) => Err(file.mistake(
            at,
            format!("{value} is there twice"),
            "state each value once",
        )),
        None => Ok(()),
    }
}

/// Of a key that is varied twice, one value would be overwritten.
fn disjoint(file: &TomlFile<'_>, columns: &Columns) -> Result<(), ScenarioError> {
    for (place, (at, path)) in columns.iter().enumerate() {
        let other = columns[..place]
            .iter()
            .find(|(_, other)| other.starts_with(path) || path.starts_with(other));
        if let Some((other, _)) = other {
            let what = format!("it varies what line {} varies, too", file.line_of(other));
            return Err(file.mistake(at, what, "vary each key in one place"));
        }
    }
    Ok(())
}

impl<'de> Deserialize<'de> for Source {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Form;
        impl<'de> Visitor<'de> for Form {
            type Value = Source;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a built-in scenario, a file, or the scenario itself as a table",
                )
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<Source, E> {
                Ok(Source::Named(name.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Source, A::Error> {
                let scenario = Scenario::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Source::Here(Box::new(scenario)))
            }
        }
        deserializer.deserialize_any(Form)
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Range {
            from: i64,
            to: i64,
        }
        struct Form;
        impl Form {
            fn range<E: Error>(from: i64, to: i64) -> Result<Seeds, E> {
                // A million is also the most runs that there can be.
                if 0 <= from && from <= to && to - from < MAX_RUNS as i64 {
                    Ok(Seeds((from..=to).collect()))
                } else {
                    Err(E::custom(format!(
                        "the seeds from {from} to {to} are none, negative, or too many"
                    )))
                }
            }
        }
        impl<'de> Visitor<'de> for Form {
            type Value = Seeds;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of seeds, { from = …, to = … }, or a list of seeds")
            }
            fn visit_i64<E: Error>(self, count: i64) -> Result<Seeds, E> {
                Self::range(1, count)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Seeds, A::Error> {
                let mut seeds = Vec::new();
                while let Some(seed) = sequence.next_element()? {
                    Self::range::<A::Error>(seed, seed)?;
                    seeds.push(seed);
                }
                Ok(Seeds(seeds))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Seeds, A::Error> {
                let Range { from, to } = Range::deserialize(MapAccessDeserializer::new(map))?;
                Self::range(from, to)
            }
        }
        deserializer.deserialize_any(Form)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> anyhow::Result<Plan> {
        Plan::parse("plan.toml", text, |name| {
            anyhow::ensure!(
                name == "mine",
                "'{name}' is neither a built-in scenario nor a file"
            );
            Ok(Scenario::parse("mine.toml", "name = 'mine'\nlimit_s = 9.0").unwrap())
        })
    }

    /// The settings of all runs, a line each.
    fn runs(plan: &Plan) -> Vec<String> {
        (0..plan.design.runs().unwrap())
            .map(|run| {
                let cells: Vec<String> = plan.design.cells(run).map(Cell::to_string).collect();
                cells.join(" ")
            })
            .collect()
    }

    #[track_caller]
    fn refused(text: &str, expected: &str) {
        let said = format!("{:#}", parse(text).unwrap_err());
        assert!(said.starts_with(expected), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }

    #[test]
    fn nothing_varied_is_one_run_of_the_default_mission() {
        let plan = parse("").unwrap();
        assert_eq!(runs(&plan), ["1"]);
        let scenario = Scenario::from_table(&plan.scenario(0).unwrap()).unwrap();
        assert_eq!(scenario, Scenario::default());
    }

    #[test]
    fn grid_list_presets_faults_and_seeds_in_every_combination() {
        let plan = parse(
            "scenario = 'mine'\nlimit_s = 5.0\nseeds = { from = 3, to = 4 }\npresets = ['team', 'par98']\n\
             [grid]\nroom.width_m = [12.0, 20.0]\n'waste.spills.0.items' = [2]\n\
             [[list]]\nbody.speed_m_s = 0.5\nbody.turn_deg_s = 90\n\
             [[list]]\nbody = { turn_deg_s = 45, speed_m_s = 0.25 }\n\
             [faults.none]\n[faults.kill]\ntimeline = [{ fault.kill = 'gold', at_s = 1.0 }]\n",
        )
        .unwrap();
        let columns: Vec<&str> = plan.design.columns().collect();
        assert_eq!(
            columns,
            [
                "room.width_m",
                "waste.spills.0.items",
                "body.speed_m_s",
                "body.turn_deg_s",
                "preset",
                "faults",
                "seed"
            ]
        );
        let runs = runs(&plan);
        assert_eq!(runs.len(), 2 * 2 * 2 * 2 * 2);
        assert_eq!(runs[0], "12 2 0.5 90 team kill 3");
        assert_eq!(runs[31], "20 2 0.25 45 par98 none 4");
        let scenario = Scenario::from_table(&plan.scenario(29).unwrap()).unwrap();
        assert_eq!(runs[29], "20 2 0.25 45 par98 kill 4");
        assert_eq!(plan.design.seed(29), 4);
        assert_eq!(scenario.name, "mine");
        assert_eq!(scenario.limit_s, 5.0);
        assert_eq!(
            (scenario.room.width_m, scenario.body.turn_deg_s),
            (20.0, 45.0)
        );
        assert_eq!(
            (
                scenario.waste.spills[0].items,
                scenario.waste.spills[1].items
            ),
            (2, 12)
        );
        assert_eq!(scenario.alliance.preset, Preset::Par98);
        assert_eq!(scenario.faults.timeline.len(), 1);
    }

    #[test]
    fn points_at_random_and_a_scenario_in_place() {
        let plan = parse(
            "seeds = [5]\nscenario = { name = 'here', robots = [{ name = 'solo', side_sensor = true }] }\n\
             [random]\nn = 50\nseed = 2\nbody.speed_m_s = { min = 0.2, max = 0.8 }\nstep_ms = { min = 20, max = 40 }\n\
             alliance.defaults.ceased_after_s = { min = 1, max = 100, log = true }\n\
             'alliance.sets.move-spill(top).fast_impatience' = { choose = [5.0, 10.0] }\n",
        )
        .unwrap();
        assert_eq!(plan.design.runs(), Some(50));
        for run in 0..50 {
            let scenario = Scenario::from_table(&plan.scenario(run).unwrap()).unwrap();
            assert_eq!(scenario.robots.len(), 1);
            assert!((0.2..=0.8).contains(&scenario.body.speed_m_s));
            assert!((20..=40).contains(&scenario.step_ms));
            let set = &scenario.alliance.sets["move-spill(top)"];
            assert!([Some(5.0), Some(10.0)].contains(&set.fast_impatience));
        }
    }

    #[test]
    fn a_digest_of_what_is_meant() {
        let digest = |text: &str| parse(text).unwrap().digest();
        let plan = digest("seeds = 2\n[grid]\nstep_ms = [50, 25]\n");
        assert_eq!(
            plan,
            digest("# more\nseeds = [1, 2]\ngrid = { step_ms = [50, 25] }\n")
        );
        for other in [
            "seeds = 3\n[grid]\nstep_ms = [50, 25]\n",
            "seeds = 2\n[grid]\nstep_ms = [25, 50]\n",
            "seeds = 2\nlimit_s = 9.0\n[grid]\nstep_ms = [50, 25]\n",
        ] {
            assert_ne!(plan, digest(other), "{other}");
        }
        let kill = |robot: &str| format!("[faults.a]\ntimeline = [{{ fault.kill = '{robot}' }}]");
        assert_ne!(digest(&kill("gold")), digest(&kill("blue")));
    }

    #[test]
    fn mistakes_are_answered_in_one_line() {
        refused("seeds = ", "plan.toml:1: ");
        refused(
            "[grod]\n",
            "plan.toml:1: grod: unknown key; did you mean 'grid'?",
        );
        refused(
            "\nseeds = 0\n",
            "plan.toml:2: seeds: the seeds from 1 to 0 are none",
        );
        refused(
            "seeds = 'all'\n",
            "plan.toml:1: seeds: the string 'all' does not fit; write a number of seeds,",
        );
        refused(
            "seeds = [3, 3]\n",
            "plan.toml:1: seeds: 3 is there twice; state each",
        );
        refused(
            "presets = ['tam']\n",
            "plan.toml:1: presets[0]: there is no choice 'tam'; did you mean 'team'?",
        );
        refused("scenario = 'other'\n", "plan.toml:1: 'other' is neither");
        refused("limit_s = -1.0\n", "plan.toml:1: limit_s: ");
        refused(
            "[scenario]\n\n[scenario.room]\nwidht_m = 3\n",
            "plan.toml:4: scenario.room.widht_m: unknown key; did you mean 'width_m'?",
        );
        refused(
            "[grid]\nalliance.defaults.ceased_after = [4.0]\n",
            "plan.toml:2: alliance.defaults.ceased_after: unknown key; did you mean 'ceased_after_s'?",
        );
        refused(
            "[grid]\nstep_ms = 50\n",
            "plan.toml:2: grid.step_ms: 50 is no list of values; write [50]",
        );
        refused(
            "[grid]\nstep_ms = []\n",
            "plan.toml:2: grid.step_ms: the list is empty",
        );
        refused("[grid]\nstep_ms = [50,\n-1]\n", "plan.toml:3: step_ms: ");
        refused(
            "[grid]\n'waste.spills.7.items' = [1]\n",
            "plan.toml:2: waste.spills.7.items: the array has no place '7'; use a place from 0 to 1",
        );
        refused(
            "[grid]\nbody.speed_m_s = [0.5]\n[[list]]\nbody = { speed_m_s = 0.2 }\n",
            "plan.toml:4: list[0].body.speed_m_s: it varies what line 2 varies, too",
        );
        refused(
            "presets = ['team']\n[grid]\nalliance.preset = ['team']\n",
            "plan.toml:1: presets: it varies what line 3 varies, too",
        );
        refused(
            "[[list]]\nstep_ms = 50\n[[list]]\nlimit_s = 9.0\n",
            "plan.toml:3: list[1]: the point has the keys limit_s;",
        );
        refused(
            "[random]\nstep_ms = { min = 20, max = 50 }\n",
            "plan.toml:1: random.n: the key is missing",
        );
        refused("[random]\nn = 3\n", "plan.toml:1: random: nothing is drawn");
        refused(
            "[random]\nn = 3\nstep_ms = { min = 50, max = 20 }\n",
            "plan.toml:3: random.step_ms: from 50 to 20 is no range",
        );
        refused(
            "[random]\nn = 3\nstep_ms = { min = 20, mx = 20 }\n",
            "plan.toml:3: random.step_ms: ",
        );
        refused(
            "[random]\nn = 3\nstep_ms = { min = 20, max = 9999 }\n",
            "plan.toml:3: step_ms: ",
        );
        refused(
            "[random]\nn = 3\nbody.speed_m_s = { min = 0.0, max = 1.0, log = true }\n",
            "plan.toml:3: random.body.speed_m_s: from",
        );
        refused(
            "[faults.a]\ntimeline = [{ fault.kill = 'glod' }]\n",
            "plan.toml:1: faults.timeline[0].fault.kill: the scenario has no robot 'glod'; did you mean 'gold'?",
        );
        refused(
            "[faults.a]\ntimline = []\n",
            "plan.toml:2: faults.a.timline: unknown key; did you mean 'timeline'?",
        );
        refused(
            "seeds = 1000\n[random]\nn = 1001\nstep_ms = { choose = [50] }\n",
            "plan.toml: 1001 x 1000 runs are more than",
        );
    }
}

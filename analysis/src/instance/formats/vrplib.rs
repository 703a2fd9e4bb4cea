//! VRPLIB's format of vehicle routing problems: lines `KEY: VALUE`, then sections with one row per node
//! (<http://vrp.galgos.inf.puc-rio.br>). Files in the formats of Solomon and Cordeau are recognized by their contents.

use std::collections::BTreeMap;

use scenario::Problem;

use super::super::source::{Depot, Loaded, Source};
use super::vehicles::{Customer, load, numbers, whole};
use super::{cordeau, solomon};

/// The numbers of each node of a section, with the line of the node.
type Rows = BTreeMap<u64, (usize, Vec<f64>)>;

/// Keys without an effect on the tasks.
const IGNORED: &[&str] = &[
    "NAME",
    "COMMENT",
    "TYPE",
    "EDGE_WEIGHT_FORMAT",
    "NODE_COORD_TYPE",
    "DISPLAY_DATA_TYPE",
];
const USED: &[&str] = &[
    "DIMENSION",
    "VEHICLES",
    "CAPACITY",
    "SERVICE_TIME",
    "EDGE_WEIGHT_TYPE",
];
const COORDINATES: &str = "NODE_COORD";
const SECTIONS: &[&str] = &[
    COORDINATES,
    "DEMAND",
    "DEPOT",
    "TIME_WINDOW",
    "SERVICE_TIME",
    "PRIZE",
    "RELEASE_TIME",
];

/// Reads a vehicle routing problem in the format of VRPLIB, Solomon or Cordeau.
///
/// # Errors
/// Returns the first line that does not fit.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    if solomon::is_solomon(source.text) {
        return solomon::read(source);
    }
    if cordeau::is_cordeau(source.text) {
        return cordeau::read(source);
    }
    File::parse(source)?.load()
}

/// The contents of a file: keys and sections with their lines.
struct File<'a> {
    source: Source<'a>,
    keys: BTreeMap<&'a str, (usize, &'a str)>,
    sections: BTreeMap<&'a str, (usize, Rows)>,
    /// The sections that the reader does not use.
    other_sections: Vec<&'a str>,
}

impl<'a> File<'a> {
    fn parse(source: Source<'a>) -> Result<Self, Problem> {
        let mut file = File {
            source,
            keys: BTreeMap::new(),
            sections: BTreeMap::new(),
            other_sections: Vec::new(),
        };
        let mut section = None;
        for (line, text) in (1..).zip(source.text.lines().map(str::trim)) {
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            if text == "EOF" {
                break;
            }
            let head = text.trim_end_matches([' ', ':', '\t']);
            if let Some(name) = head.strip_suffix("_SECTION") {
                section = Some(name);
                if !SECTIONS.contains(&name) {
                    file.other_sections.push(name);
                } else if file.sections.insert(name, (line, Rows::new())).is_some() {
                    let what = format!("{name}_SECTION occurs twice");
                    return Err(source.error(line, what, "keep one of them"));
                }
            } else if let Some((key, value)) = text.split_once(':') {
                file.keys.insert(key.trim(), (line, value.trim()));
            } else if let Some(name) = section {
                file.row(name, line, text)?;
            } else {
                let what = format!("'{text}' is neither a key with a value nor a section");
                return Err(source.error(line, what, "write KEY: VALUE"));
            }
        }
        Ok(file)
    }

    /// Adds a row to a section that the reader uses.
    fn row(&mut self, name: &str, line: usize, text: &str) -> Result<(), Problem> {
        let source = self.source;
        let Some((_, rows)) = self.sections.get_mut(name) else {
            return Ok(());
        };
        let mut row = numbers(source, line, text)?;
        let node = row.remove(0);
        if name == "DEPOT" {
            // The list of depots ends with -1.
            let nodes = std::iter::once(node)
                .chain(row)
                .filter(|node| *node != -1.0);
            for node in nodes {
                rows.insert(whole(source, line, node)?, (line, Vec::new()));
            }
            return Ok(());
        }
        let least = match name {
            COORDINATES | "TIME_WINDOW" => 2,
            _ => 1,
        };
        if row.len() < least {
            let what = format!(
                "a row of {name}_SECTION has {} numbers after the node, not {least}",
                row.len()
            );
            return Err(source.error(line, what, "write all of them"));
        }
        let node = whole(source, line, node)?;
        if let Some((first, _)) = rows.insert(node, (line, row)) {
            let what = format!("node {node} already has a row on line {first}");
            return Err(source.error(line, what, "give each node one row"));
        }
        Ok(())
    }

    /// Returns the number of a key with its line.
    fn number(&self, key: &str) -> Result<Option<(usize, f64)>, Problem> {
        let Some((line, text)) = self.keys.get(key) else {
            return Ok(None);
        };
        match numbers(self.source, *line, text)?.as_slice() {
            [number] => Ok(Some((*line, *number))),
            _ => Err(self.source.error(
                *line,
                format!("{key}: '{text}' is not a number"),
                "give one number",
            )),
        }
    }

    /// Returns the number of a node in a section.
    fn of_node(&self, section: &str, node: u64) -> Option<&[f64]> {
        let (_, rows) = self.sections.get(section)?;
        rows.get(&node).map(|(_, row)| row.as_slice())
    }

    /// Returns the number of vehicles: the key, or the ending of the name, as in `X-n101-k25`.
    fn vehicles(&self) -> Result<Option<usize>, Problem> {
        if let Some((line, number)) = self.number("VEHICLES")? {
            return Ok(Some(whole(self.source, line, number)? as usize));
        }
        let name = self.keys.get("NAME").map_or("", |(_, name)| name);
        let least = name
            .rsplit_once("-k")
            .and_then(|(_, count)| count.parse().ok());
        Ok(least)
    }

    fn load(&self) -> Result<Loaded, Problem> {
        let source = self.source;
        let last = source.text.lines().count().max(1);
        let Some((head, places)) = self.sections.get(COORDINATES) else {
            let what = "NODE_COORD_SECTION is missing";
            let remedy = "a scenario needs the place of each node; distances alone do not suffice";
            return Err(source.error(last, what, remedy));
        };
        if let Some((line, stated)) = self.number("DIMENSION")?
            && stated != places.len() as f64
        {
            let what = format!(
                "DIMENSION is {stated}, and NODE_COORD_SECTION has {} nodes",
                places.len()
            );
            return Err(source.error(line, what, "correct one of them"));
        }
        self.check_nodes(places)?;
        self.check_type()?;
        let no_depot = || source.error(*head, "there is no depot", "add DEPOT_SECTION with a node");
        let depots = match self.sections.get("DEPOT") {
            Some((_, depots)) if !depots.is_empty() => depots.keys().copied().collect(),
            _ => vec![*places.keys().next().ok_or_else(no_depot)?],
        };
        let count = self.vehicles()?;
        let capacity = self.number("CAPACITY")?.map(|(_, capacity)| capacity);
        let share =
            |index: usize| count.map(|count| (count + depots.len() - 1 - index) / depots.len());
        let found = depots.iter().enumerate().map(|(index, node)| {
            // The nodes of all sections exist.
            let place = self.of_node(COORDINATES, *node).unwrap_or(&[0.0, 0.0]);
            Depot {
                x: place[0],
                y: place[1],
                vehicles: share(index),
                capacity,
                closes_s: self.of_node("TIME_WINDOW", *node).map(|window| window[1]),
            }
        });
        let found = found.collect();
        self.check_rows(places, &depots)?;
        let service = self
            .number("SERVICE_TIME")?
            .map_or(0.0, |(_, service)| service);
        let single = |section, node| self.of_node(section, node).map(|row| row[0]);
        let customers = places.iter().filter(|(node, _)| !depots.contains(node));
        let customers = customers.map(|(node, (line, place))| Customer {
            number: *node,
            line: *line,
            x: place[0],
            y: place[1],
            demand: single("DEMAND", *node),
            window: self
                .of_node("TIME_WINDOW", *node)
                .map(|window| [window[0], window[1]]),
            service: single("SERVICE_TIME", *node).unwrap_or(service),
            prize: single("PRIZE", *node),
            release: single("RELEASE_TIME", *node).unwrap_or(0.0),
        });
        let customers: Vec<Customer> = customers.collect();
        let name = self.keys.get("NAME").map_or("", |(_, name)| name);
        let mut loaded = load(name, &customers, found);
        loaded.dropped = self.unused();
        Ok(loaded)
    }

    /// Rejects a problem without what its type needs: the key CAPACITY, or sections.
    fn check_type(&self) -> Result<(), Problem> {
        let Some((line, stated)) = self.keys.get("TYPE") else {
            return Ok(());
        };
        let sections: &[&str] = match *stated {
            "CVRP" => &["DEMAND"],
            "VRPTW" | "CVRPTW" => &["DEMAND", "TIME_WINDOW"],
            _ => return Ok(()),
        };
        let mut missing = sections
            .iter()
            .filter(|name| !self.sections.contains_key(*name));
        let missing = match missing.next() {
            Some(name) => format!("{name}_SECTION"),
            None if self.keys.contains_key("CAPACITY") => return Ok(()),
            None => "CAPACITY".to_owned(),
        };
        let what = format!("TYPE is {stated}, and {missing} is missing");
        Err(self.source.error(*line, what, "add it, or correct TYPE"))
    }

    /// Rejects a section that lacks a customer.
    fn check_rows(&self, places: &Rows, depots: &[u64]) -> Result<(), Problem> {
        for (name, (line, rows)) in &self.sections {
            let customers = places.keys().filter(|node| !depots.contains(node));
            let mut missing = customers.filter(|node| !rows.contains_key(node));
            if *name != "DEPOT"
                && let Some(node) = missing.next()
            {
                let what = format!("node {node} has no row in {name}_SECTION");
                return Err(self.source.error(*line, what, "give each customer one row"));
            }
        }
        Ok(())
    }

    /// Rejects a row for a node without coordinates.
    fn check_nodes(&self, places: &Rows) -> Result<(), Problem> {
        let rows = self.sections.values().flat_map(|(_, rows)| rows);
        let mut rows = rows.filter(|(node, _)| !places.contains_key(node));
        rows.next().map_or(Ok(()), |(node, (line, _))| {
            let what = format!("node {node} has no row in NODE_COORD_SECTION");
            Err(self
                .source
                .error(*line, what, "add its coordinates, or remove this row"))
        })
    }

    /// Returns the keys and sections without an effect, each with a reason.
    fn unused(&self) -> Vec<String> {
        let keys = self
            .keys
            .keys()
            .filter(|key| !IGNORED.contains(key) && !USED.contains(key));
        let keys = keys.map(|key| format!("{key}: no counterpart"));
        let sections = self.other_sections.iter();
        let sections = sections.map(|name| format!("{name}_SECTION: no counterpart"));
        let weights = self.keys.get("EDGE_WEIGHT_TYPE").map(|(_, value)| *value);
        let weights = weights.filter(|weights| *weights != "EUC_2D");
        let weights =
            weights.map(|weights| format!("{weights} distances: robots drive from place to place"));
        keys.chain(sections).chain(weights).collect()
    }
}

//! The best known values of a plan, from a CSV file.

use std::collections::BTreeMap;

use csv::{ReaderBuilder, StringRecord, Trim};
use scenario::{Problem, name_remedy};
use serde::{Deserialize, Serialize};

use super::design::SEED;

/// The column with the name of the metric.
const METRIC: &str = "metric";
/// The column with the value.
const BEST: &str = "best";

/// The best known value of some runs: a row of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BestKnown {
    /// The values of the plan's columns that the runs have.
    pub settings: BTreeMap<String, String>,
    /// The seed of the run; absent for all seeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The metric of the value; absent for the one that ranks the runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metric: Option<String>,
    pub best: f64,
}

impl BestKnown {
    /// Returns whether a block has the settings of the row. `columns` are the names of the block's `settings`.
    #[must_use]
    pub fn fits(&self, columns: &[String], settings: &[String]) -> bool {
        self.settings.iter().all(|(name, stated)| {
            let mut known = columns.iter().zip(settings);
            known.any(|(column, setting)| column == name && setting == stated)
        })
    }
}

/// Reads a file. Its columns are `best`, and optionally `metric`, `seed` and `columns` of the plan. Returns each row with
/// its line.
///
/// # Errors
/// Returns the first mistake with its line.
pub fn read(name: &str, text: &str, columns: &[String]) -> Result<Vec<(u64, BestKnown)>, Problem> {
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let refused = |line: u64, what: String, remedy: String| {
        Problem::with_source(format!("{name}:{line}"), what, remedy)
    };
    let malformed = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        let remedy = "write a row with as many cells as the first one";
        refused(line, "not a row of the table".to_owned(), remedy.to_owned())
    };
    let heads = reader.headers().map_err(malformed)?.clone();
    let allowed = || {
        let own = [BEST, METRIC, SEED].into_iter();
        own.chain(columns.iter().map(String::as_str))
    };
    if let Some(unknown) = heads
        .iter()
        .find(|head| !allowed().any(|name| name == *head))
    {
        let what = format!("the plan has no column '{unknown}'");
        return Err(refused(1, what, name_remedy(unknown, allowed())));
    }
    if !heads.iter().any(|head| head == BEST) {
        let what = format!("the column '{BEST}' is missing");
        return Err(refused(1, what, "add the best known values".to_owned()));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(malformed)?;
        let line = record.position().map_or(1, csv::Position::line);
        let row = row(&heads, &record);
        rows.push((
            line,
            row.map_err(|(what, remedy)| refused(line, what, remedy.to_owned()))?,
        ));
    }
    Ok(rows)
}

/// Returns a row, or its mistake and the remedy. An empty cell states nothing.
fn row(heads: &StringRecord, record: &StringRecord) -> Result<BestKnown, (String, &'static str)> {
    let mut row = BestKnown {
        settings: BTreeMap::new(),
        seed: None,
        metric: None,
        best: f64::NAN,
    };
    for (head, cell) in heads
        .iter()
        .zip(record)
        .filter(|(_, cell)| !cell.is_empty())
    {
        match head {
            BEST => row.best = cell.parse().unwrap_or(f64::NAN),
            METRIC => row.metric = Some(cell.to_owned()),
            SEED => {
                let seed = cell.parse();
                let refused = |_| {
                    (
                        format!("{SEED}: '{cell}' is not a seed"),
                        "write a whole number",
                    )
                };
                row.seed = Some(seed.map_err(refused)?);
            }
            _ => {
                row.settings.insert(head.to_owned(), cell.to_owned());
            }
        }
    }
    if row.best.is_finite() && row.best != 0.0 {
        return Ok(row);
    }
    let what = format!("{BEST}: a gap needs a finite number that is not 0");
    Err((what, "write the best known value"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<String> {
        ["mission", "faults"].map(str::to_owned).to_vec()
    }

    #[test]
    fn a_row_fits_blocks_with_its_settings() {
        let text = "mission, metric, best, seed\nc101, distance_m, 191.3, 2\n, , 5,\n";
        let rows = read("best.csv", text, &columns()).unwrap();
        let [(2, first), (3, second)] = &rows[..] else {
            panic!("{rows:?}")
        };
        assert_eq!(
            (first.seed, first.metric.as_deref()),
            (Some(2), Some("distance_m"))
        );
        let settings = |mission: &str| [mission, "none"].map(str::to_owned);
        assert!(first.fits(&columns(), &settings("c101")));
        assert!(!first.fits(&columns(), &settings("c102")));
        assert!(second.fits(&columns(), &settings("c102")));
        assert_eq!((second.best, second.seed), (5.0, None));
    }

    #[test]
    fn mistakes_have_their_line() {
        let refusals = [
            "mission,worst\na,1\n",
            "mission\na\n",
            "mission,best\na,0\n",
            "mission,best\na,1\nb,much\n",
            "seed,best\none,1\n",
            "mission,best\na\n",
        ];
        let refusals = refusals.map(|text| {
            let refused = read("best.csv", text, &columns()).unwrap_err();
            format!("{refused}\n")
        });
        insta::assert_snapshot!(refusals.concat());
    }
}

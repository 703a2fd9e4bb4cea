//! The journal of a sweep: a header line, then one line of JSON per run, written when the run ends.
//!
//! A killed process leaves at most one incomplete last line, which the reader drops. Each shard writes its own journal; readers
//! combine all journals of a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use serde::{Deserialize, Serialize};

use super::comparison::Comparison;
use super::design::Design;
use super::lines::{LineFile, numbered_lines, parse_line};
use super::run::Row;
use super::shard::Shard;

/// The extension of journal files.
const ENDING: &str = "jsonl";

/// The first line of a journal, which identifies the sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    pub sweep: String,
    /// The version of the program that started the sweep.
    pub version: String,
    /// The digest of the plan ([`super::plan::Plan::digest`]).
    pub digest: String,
    pub design: Design,
    /// True if the invariants of each run are checked.
    pub check: bool,
    /// The data for a comparison of the runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
}

pub type RowsByRun = BTreeMap<usize, Row>;

/// Returns a note if several builds of the program executed the runs, because their rules can differ.
#[must_use]
pub fn note_of_builds(rows: &[Row]) -> Option<String> {
    let builds = rows.iter().map(|row| row.build.as_str());
    let builds: BTreeSet<&str> = builds.filter(|build| !build.is_empty()).collect();
    (builds.len() > 1).then(|| {
        let count = builds.len();
        format!(
            "{count} builds of the program executed the runs; results.csv has the build of each"
        )
    })
}

/// Opens the journal of a shard, or of the entire sweep, for rows. Writes the header of a new one.
///
/// # Errors
/// Returns an error if another process writes the journal, or it cannot be written.
pub fn open(folder: &Path, shard: Option<Shard>, header: &Header) -> anyhow::Result<LineFile> {
    let shard = shard.map_or_else(String::new, |shard| {
        format!("-{shard}").replace('/', "-of-")
    });
    let (mut lines, known) = LineFile::open(folder.join(format!("journal{shard}.{ENDING}")))?;
    if known.is_empty() {
        lines.add(header)?;
    }
    Ok(lines)
}

/// Reads and combines all journals of the folders. Returns `None` without journals. A journal without a header counts as none.
///
/// # Errors
/// Returns an error if journals belong to different sweeps, contain an invalid row, or differ on one run.
pub fn read_all(folders: &[PathBuf]) -> anyhow::Result<Option<(Header, RowsByRun)>> {
    let mut all: Option<(Header, RowsByRun, PathBuf)> = None;
    for path in paths(folders)? {
        let Some((header, rows)) = read(&path)? else {
            continue;
        };
        let Some((known, together, first)) = &mut all else {
            all = Some((header, rows, path));
            continue;
        };
        if *known != header {
            bail!(
                "{} and {} belong to different sweeps; name folders of one plan and one version of the program",
                first.display(),
                path.display()
            );
        }
        for (run, row) in rows {
            let other = together.entry(run).or_insert_with(|| row.clone());
            if other.end != row.end {
                bail!(
                    "{}: run {run} has another result in another journal; different programs wrote them: repeat one of them",
                    path.display()
                );
            }
        }
    }
    Ok(all.map(|(header, rows, _)| (header, rows)))
}

fn paths(folders: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for folder in folders {
        let entries =
            fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
        for entry in entries {
            let path = entry.with_context(|| folder.display().to_string())?.path();
            if path.extension().is_some_and(|ending| ending == ENDING) {
                paths.push(path);
            }
        }
    }
    paths.sort();
    Ok(paths)
}

fn read(path: &Path) -> anyhow::Result<Option<(Header, RowsByRun)>> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&bytes).map_err(|(line, what)| {
        anyhow!(
            "{}:{line}: {what}; remove the line to repeat its run",
            path.display()
        )
    })
}

/// Parses the header and the rows of a journal. Returns `None` without a header. An incomplete last line is dropped.
///
/// # Errors
/// Returns the number of the first invalid line, from 1, and the problem.
pub fn parse(bytes: &[u8]) -> Result<Option<(Header, RowsByRun)>, (usize, String)> {
    let mut lines = numbered_lines(bytes);
    let Some(first) = lines.next() else {
        return Ok(None);
    };
    let header: Header = parse_line(first, "not a journal: ")?;
    let runs = header.design.runs().unwrap_or_default();
    let mut rows = RowsByRun::new();
    for line in lines {
        let row: Row = parse_line(line, "not a row: ")?;
        if row.run >= runs {
            return Err((line.0, format!("there is no run {}", row.run)));
        }
        rows.insert(row.run, row);
    }
    Ok(Some((header, rows)))
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use tempfile::TempDir;

    use super::super::plan::Plan;
    use super::super::run::{Failure, RunResult};
    use super::*;

    fn header(text: &str) -> Header {
        let plan = Plan::parse("plan.toml", text, |_| Ok(default_scenario())).unwrap();
        Header {
            sweep: "plan".to_owned(),
            version: "1".to_owned(),
            digest: plan.digest(),
            // The journal does not contain changes of the scenario.
            design: serde_json::from_str(&serde_json::to_string(&plan.design).unwrap()).unwrap(),
            check: plan.check,
            comparison: None,
        }
    }

    fn row(run: usize, reason: &str) -> Row {
        Row {
            run,
            build: String::new(),
            end: RunResult::Failed(Failure {
                reason: reason.to_owned(),
                scenario: "a = 1\n".to_owned(),
            }),
        }
    }

    #[test]
    fn runs_of_several_builds_have_a_note() {
        let built = |build: &str| Row {
            build: build.to_owned(),
            ..row(0, "a")
        };
        let note = |builds: &[&str]| {
            let rows: Vec<Row> = builds.iter().map(|build| built(build)).collect();
            note_of_builds(&rows)
        };
        assert_eq!(note(&["a", "a", ""]), None);
        let text = "2 builds of the program executed the runs; results.csv has the build of each";
        assert_eq!(note(&["a", "b", "a"]).as_deref(), Some(text));
    }

    const PLAN: &str = "seeds = 9\n[grid]\nbody.speed_m_s = [0.5, 0.1]\n";

    fn all(folder: &TempDir) -> anyhow::Result<Option<(Header, RowsByRun)>> {
        read_all(&[folder.path().to_owned()])
    }

    #[test]
    fn an_incomplete_last_line_is_dropped() {
        let whole = TempDir::new().unwrap();
        let header = header(PLAN);
        let mut journal = open(whole.path(), None, &header).unwrap();
        journal.add(&row(3, "a")).unwrap();
        journal.add(&row(1, "b\nc")).unwrap();
        let bytes = fs::read(whole.path().join("journal.jsonl")).unwrap();
        let ends: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at] == b'\n').collect();
        assert_eq!(ends.len(), 3);
        for cut in 0..=bytes.len() {
            let folder = TempDir::new().unwrap();
            let path = folder.path().join("journal.jsonl");
            fs::write(&path, &bytes[..cut]).unwrap();
            let lines = ends.iter().filter(|end| **end < cut).count();
            match all(&folder).unwrap() {
                None => assert_eq!(lines, 0),
                Some((found, rows)) => {
                    assert_eq!((found, rows.len() + 1), (header.clone(), lines));
                }
            }
            let mut journal = open(folder.path(), None, &header).unwrap();
            journal.add(&row(5, "d")).unwrap();
            let (_, rows) = all(&folder).unwrap().unwrap();
            assert_eq!(rows.len(), lines.max(1));
            assert_eq!(rows[&5], row(5, "d"));
        }
    }

    #[test]
    fn journals_of_shards_are_read_together_and_must_agree() {
        let folder = TempDir::new().unwrap();
        assert_eq!(all(&folder).unwrap(), None);
        let header = header(PLAN);
        for (shard, run) in [("0/2", 0), ("1/2", 1)] {
            let shard = Some(shard.parse().unwrap());
            let mut journal = open(folder.path(), shard, &header).unwrap();
            journal.add(&row(run, "a")).unwrap();
            journal.add(&row(4, "a")).unwrap();
        }
        let (_, rows) = all(&folder).unwrap().unwrap();
        assert_eq!(rows.keys().copied().collect::<Vec<_>>(), [0, 1, 4]);

        let mut journal = open(folder.path(), None, &header).unwrap();
        journal.add(&row(4, "b")).unwrap();
        let error = all(&folder).unwrap_err().to_string();
        assert!(error.contains("run 4 has another result"), "{error}");
        drop(journal);
        fs::remove_file(folder.path().join("journal.jsonl")).unwrap();
        open(folder.path(), None, &self::header("seeds = 9")).unwrap();
        let error = all(&folder).unwrap_err().to_string();
        assert!(error.contains("different sweeps"), "{error}");
    }

    #[test]
    fn a_journal_has_one_writer() {
        let folder = TempDir::new().unwrap();
        let header = header(PLAN);
        let journal = open(folder.path(), None, &header).unwrap();
        let error = open(folder.path(), None, &header).err().unwrap();
        assert!(error.to_string().contains("another process"), "{error}");
        drop(journal);
        open(folder.path(), None, &header).unwrap();
    }

    #[test]
    fn an_invalid_row_is_reported_with_its_line() {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("journal.jsonl");
        let header = serde_json::to_string(&header(PLAN)).unwrap();
        let row = serde_json::to_string(&row(18, "")).unwrap();
        for (text, part) in [
            ("so\n", "journal.jsonl:1: not a journal"),
            (&format!("{header}\nso\n"), "journal.jsonl:2: not a row"),
            (
                &format!("{header}\n{row}\n"),
                "journal.jsonl:2: there is no run 18",
            ),
        ] {
            fs::write(&path, text).unwrap();
            let error = all(&folder).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}

use run_log::recorder::Folder;
use run_log::{PoseRow, RunLog};

use super::*;
use crate::testkit::{setup, shipped};

/// A follower that collects the poses.
#[derive(Default)]
struct Poses(Vec<PoseRow>);

impl Poses {
    fn extend(&mut self, rows: &NewRows) {
        self.0.extend(rows.each_row().map(Result::unwrap));
    }
}

impl Follower for Poses {
    fn tick(&mut self, _: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.extend(rows);
        Ok(())
    }

    fn finish(&mut self, _: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.extend(rows);
        Ok(())
    }
}

/// Runs the default mission for a few seconds into a folder.
fn logged(level: LogLevel) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = shipped("janitorial");
    scenario.limit_s = 5.0;
    let log = Folder::create(folder.path().join("run")).unwrap();
    let team = Team::new(setup(scenario), level, log).unwrap();
    team.run().unwrap();
    folder
}

#[test]
fn a_follower_receives_every_row_of_a_full_and_of_a_compact_log() {
    for level in [LogLevel::Full, LogLevel::Compact] {
        let folder = logged(level);
        let run = folder.path().join("run");
        let mut poses = Poses::default();
        let mut live = LiveRun::open(&run, "--ros").unwrap();
        while live.advance(&mut poses).unwrap() != Progress::Over {}
        let log = RunLog::open(&run, &Registry::built_in().vocabulary()).unwrap();
        let expected: Vec<PoseRow> = log.each_row().map(Result::unwrap).collect();
        assert!(expected.len() > 250, "{} rows", expected.len());
        assert!(poses.0 == expected, "{}", level.as_str());
    }
}

#[test]
fn a_log_without_every_tick_is_refused() {
    for level in [LogLevel::Summary, LogLevel::Off] {
        let folder = logged(level);
        let refused = LiveRun::open(&folder.path().join("run"), "--ros")
            .err()
            .unwrap();
        assert!(refused.is::<Problem>(), "{refused}");
        assert!(
            refused.to_string().contains("add --log compact"),
            "{refused}"
        );
    }
}

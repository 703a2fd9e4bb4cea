//! Properties of user files: any text is read or refused in one line. The fuzz targets and the test over their
//! corpora use them.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use std::sync::LazyLock;

use analysis::replay::replay;
use analysis::sweep::{Plan, parse_journal};
use in_process::Team;
use missions::Registry;
use run_log::{
    AllocationMessageRow, AllocationRow, EventRow, HitRow, LogLevel, MemoryLog, MessageRow,
    MissionRow, MotivationRow, PoseRow, RunFile, RunLog, SentRow, Table, TableRow, TargetRow,
    TickRow,
};
use scenario::{ParameterFile, Profile, Scenario, Setup, Vocabulary};

static VOCABULARY: LazyLock<Vocabulary> = LazyLock::new(|| Registry::built_in().vocabulary());

/// The log of one second of the default mission.
static RUN: LazyLock<RunFile> = LazyLock::new(|| {
    let scenario = Scenario::parse("a.toml", "limit_s = 1.0", &VOCABULARY);
    let setup = Setup::resolve(scenario.expect("a scenario"), 1, None);
    let setup = setup.expect("a setup").setup;
    let team = Team::new(setup, LogLevel::Off, MemoryLog::default()).expect("a team");
    let (_, recorder) = team.run().expect("memory takes everything");
    let log = RunLog::from_memory(&recorder.into_sink(), &VOCABULARY);
    log.expect("a log").run
});

/// Returns the kind of log file that `text` is, named as the corpus files begin, or `None`. Readable inputs are also
/// replayed.
#[must_use]
pub fn log_of(text: &[u8]) -> Option<&'static str> {
    if let Ok(run) = RunFile::parse(text, &VOCABULARY).map_err(one_line) {
        let _ = Setup::resolve(run.setup.scenario, run.setup.seed, None).map_err(one_line);
        return Some("run");
    }
    let log = |table| {
        let tables = BTreeMap::from([(table, text.to_vec())]);
        RunLog::from_tables(Path::new(""), RUN.clone(), tables)
    };
    let inputs = log(Table::Inputs);
    if inputs
        .inputs()
        .map_err(one_line)
        .is_ok_and(|all| !all.is_empty())
    {
        let _ =
            replay(&inputs, LogLevel::Off, |_| {}).map_err(|error| one_line(format!("{error:#}")));
        return Some("inputs");
    }
    let external = log(Table::External);
    if external
        .external_answers()
        .map_err(one_line)
        .is_ok_and(|all| !all.is_empty())
    {
        return Some("foreign");
    }
    fn is_of<R: TableRow>(log: RunLog) -> bool {
        let rows = log.rows::<R>().map_err(one_line);
        rows.is_ok_and(|rows| !rows.is_empty())
    }
    type IsOf = fn(RunLog) -> bool;
    let tables: [(&str, Table, IsOf); 11] = [
        ("motivations", Table::Motivations, is_of::<MotivationRow>),
        ("allocation", Table::Allocation, is_of::<AllocationRow>),
        (
            "allocation-messages",
            Table::AllocationMessages,
            is_of::<AllocationMessageRow>,
        ),
        ("messages", Table::Messages, is_of::<MessageRow>),
        ("sent", Table::Sent, is_of::<SentRow>),
        ("hits", Table::Hits, is_of::<HitRow>),
        ("events", Table::Events, is_of::<EventRow>),
        ("poses", Table::Poses, is_of::<PoseRow>),
        ("ticks", Table::Ticks, is_of::<TickRow>),
        ("targets", Table::Targets, is_of::<TargetRow>),
        ("mission", Table::Mission, is_of::<MissionRow>),
    ];
    let mut tables = tables.into_iter();
    tables.find_map(|(name, table, is_of)| is_of(log(table)).then_some(name))
}

/// Returns whether `text` is a parameter file. A readable file is applied to a scenario or refused.
#[must_use]
pub fn is_parameters(text: &[u8]) -> bool {
    let Ok(parameters) = ParameterFile::parse("a.properties", text).map_err(one_line) else {
        return false;
    };
    let _ = Setup::resolve(RUN.setup.scenario.clone(), 1, Some(&parameters)).map_err(one_line);
    true
}

/// Returns whether `text` is a profile of a learning team. A readable profile survives a round trip, and a run with
/// it completes.
#[must_use]
pub fn is_profile(text: &[u8]) -> bool {
    static LEARNERS: LazyLock<Setup> = LazyLock::new(|| {
        let mut scenario = RUN.setup.scenario.clone();
        scenario.allocator = Some("l-alliance".to_owned());
        Setup::resolve(scenario, 1, None).expect("a setup").setup
    });
    let Ok(text) = str::from_utf8(text) else {
        return false;
    };
    let read = |text: &str| {
        Profile::parse("p.toml", text, &LEARNERS.scenario, &VOCABULARY).map_err(one_line)
    };
    let Ok(profile) = read(text) else {
        return false;
    };
    assert_eq!(read(&profile.to_toml()).as_ref(), Ok(&profile));
    let setup = Setup {
        profile,
        ..LEARNERS.clone()
    };
    let team = Team::new(setup, LogLevel::Off, MemoryLog::default()).expect("a team");
    assert!(team.run().is_ok());
    true
}

#[must_use]
pub fn is_plan(text: &[u8]) -> bool {
    let Ok(text) = str::from_utf8(text) else {
        return false;
    };
    let base = |_: &str| Ok(RUN.setup.scenario.clone());
    let plan = Plan::parse("plan.toml", text, base);
    plan.map_err(|error| one_line(format!("{error:#}"))).is_ok()
}

#[must_use]
pub fn is_journal(text: &[u8]) -> bool {
    let journal = parse_journal(text).map_err(|(_, message)| one_line(message));
    journal.is_ok_and(|journal| journal.is_some())
}

fn one_line(message: impl Display) {
    let message = message.to_string();
    assert!(
        !message.is_empty() && !message.chars().any(char::is_control),
        "{message}"
    );
}

//! The behavior sets of the waste clean-up.

use super::WasteSection;
use scenario::ids::TaskId;
use scenario::mission::data::DefaultAllianceParams;
use scenario::{BehaviorSpec, Scenario};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BehaviorKind {
    FindLocationsMethodical,
    FindLocationsWander,
    /// Carries the items of one spill to the deposit. The value is the index of the spill in the scenario.
    MoveSpill(u32),
    ReportProgress,
}

impl BehaviorKind {
    #[must_use]
    pub fn from_spec(behavior: &BehaviorSpec) -> Self {
        match behavior.kind {
            0 => Self::FindLocationsMethodical,
            1 => Self::FindLocationsWander,
            2 => Self::ReportProgress,
            spill => Self::MoveSpill(spill - 3),
        }
    }

    fn code(self) -> u32 {
        match self {
            Self::FindLocationsMethodical => 0,
            Self::FindLocationsWander => 1,
            Self::ReportProgress => 2,
            Self::MoveSpill(spill) => 3 + spill,
        }
    }

    /// Returns the built-in parameters, which suit the default mission. Longer work gets more patience: moving a spill
    /// most, a report least. Wandering is less reliable than following the walls, so its impatience is lower.
    pub(super) fn built_in(self) -> DefaultAllianceParams {
        let (fast, slow, phi, psi, lambda) = match self {
            Self::FindLocationsMethodical => (20.0, 1.0, 60.0, 120.0, 300.0),
            Self::FindLocationsWander => (5.0, 0.5, 60.0, 120.0, 300.0),
            Self::MoveSpill(_) => (10.0, 0.5, 120.0, 240.0, 480.0),
            Self::ReportProgress => (25.0, 1.0, 60.0, 60.0, 120.0),
        };
        DefaultAllianceParams {
            broadcast_rate_hz: 1.0,
            ceased_after_s: 5.0,
            fast_impatience: fast,
            slow_impatience: slow,
            willing_to_affect_s: phi,
            before_yielding_s: psi,
            before_giving_up_s: lambda,
        }
    }
}

/// Creates tasks and behavior sets: the tasks find-locations, move-spill(NAME) per spill, and report-progress.
/// find-locations has two behavior sets. Every other task has one, with the name of the task.
pub(super) fn catalog(scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
    let spills = WasteSection::of(scenario).spills.iter();
    let move_spill = spills.map(|spill| format!("move-spill({})", spill.name));
    let mut tasks = vec!["find-locations".to_owned()];
    tasks.extend(move_spill);
    tasks.push("report-progress".to_owned());

    let set = |name: &str, task: usize, kind: BehaviorKind| BehaviorSpec {
        name: name.to_owned(),
        task: TaskId(task as u32),
        kind: kind.code(),
        skill: None,
    };
    let last = tasks.len() - 1;
    let methodical = BehaviorKind::FindLocationsMethodical;
    let mut sets = vec![
        set("find-locations-methodical", 0, methodical),
        set(
            "find-locations-wander",
            0,
            BehaviorKind::FindLocationsWander,
        ),
    ];
    sets.extend((1..last).map(|task| {
        let kind = BehaviorKind::MoveSpill(task as u32 - 1);
        set(&tasks[task], task, kind)
    }));
    sets.push(set(&tasks[last], last, BehaviorKind::ReportProgress));
    (tasks, sets)
}

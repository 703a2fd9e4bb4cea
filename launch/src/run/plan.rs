//! The checked inputs of a run, used by both ways to run a mission and by the summary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use analysis::branch::{BranchPlan, HandOver};
use run_log::LogLevel;
use scenario::Setup;

use cluster::start::StartPlan;

use super::observers::ObserverCommand;
use crate::ros::bodies::BridgeSettings;

/// The checked inputs of a run.
pub struct RunPlan {
    pub run: String,
    pub setup: Setup,
    /// The arguments of the world process, without folder and run id.
    pub world_arguments: Vec<String>,
    /// The commands of external controllers, by robot.
    pub controllers: BTreeMap<String, String>,
    pub elsewhere: BTreeSet<String>,
    /// The hosts that the launcher starts, and the keys of this run.
    pub start: Option<StartPlan>,
    /// The processes that publish the run to other tools.
    pub observers: Vec<ObserverCommand>,
    /// The bridge to the bodies; `None` if they move in the world of the run.
    pub bodies: Option<BridgeSettings>,
    /// The run that this one repeats first.
    pub branch: Option<BranchStart>,
    pub folder: PathBuf,
    /// `true` if the run starts paused.
    pub paused: bool,
    pub open: bool,
    /// `true` if the result goes to stdout as JSON.
    pub json: bool,
    /// The value of `--log`, if it was given.
    pub log: Option<LogLevel>,
}

/// A branch and its state at the tick at which processes take over.
pub struct BranchStart {
    pub plan: BranchPlan,
    pub hand_over: HandOver,
    /// The arguments of the world and of the agents that take part at the hand-over.
    pub arguments: Vec<String>,
}

//! What the ways to run a mission are given, and its summary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use alliance_proto::scenario::Setup;

use crate::cluster::start::Start;

/// What is to be run.
pub struct Plan {
    /// Id of the run.
    pub run: String,
    /// Everything that was asked for.
    pub setup: Setup,
    /// The world's command line, but for folder and id.
    pub world_arguments: Vec<String>,
    /// The command of each robot's mind that is a program of its own, by robot.
    pub minds: BTreeMap<String, String>,
    /// The robots whose agents are started on other hosts.
    pub elsewhere: BTreeSet<String>,
    /// Hosts that are started too, and the keys of this run.
    pub start: Option<Start>,
    /// Folder of the log.
    pub folder: PathBuf,
    /// Whether the clock is held at first.
    pub paused: bool,
    /// Whether the page is opened in a browser.
    pub open: bool,
    /// Whether the result goes to stdout as JSON.
    pub json: bool,
}

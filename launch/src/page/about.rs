//! What the page is told of a run once: what does not change while it is shown.

use alliance_proto::scenario::Setup;
use serde_json::{Value, json};

/// Catalog and setup under the names of `GET /api/run`; the rest depends on where the run comes from.
#[must_use]
pub fn about(mode: &str, run: &str, folder: &str, setup: &Setup, log: Value) -> Value {
    let catalog = &setup.catalog;
    let tasks: Vec<Value> = catalog
        .tasks
        .iter()
        .map(|task| {
            json!({"name": task.name, "max_robots": task.max_robots, "priority": task.priority})
        })
        .collect();
    let sets: Vec<Value> = catalog
        .sets
        .iter()
        .map(|set| json!({"name": set.name, "task": set.task}))
        .collect();
    let terms = catalog.mission.terms();
    let mission = json!({
        "name": catalog.mission.name(),
        "columns": terms.columns,
        "events": terms.events,
        "bulletins": terms.bulletins,
    });
    let setup = json!(setup);
    json!({
        "mode": mode,
        "run": run,
        "folder": folder,
        "seed": setup["seed"],
        "scenario": setup["scenario"],
        "alliance": setup["alliance"],
        "catalog": {"tasks": tasks, "sets": sets},
        "mission": mission,
        "log": log,
    })
}

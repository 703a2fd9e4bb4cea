//! Export of a run as a scenario file, with all external influences on its fault timeline.
//!
//! Orders remain unchanged. An immediate order is due at the tick in which it took effect. A cleared fault lasts as
//! long as it did in the run. Robots whose processes ended, stopped or returned without an order get kill, pause and
//! restart faults.

use std::fmt::Write as _;

use anyhow::Context;
use missions::Registry;
use run_log::{Branch, Input, InputLine, RunLog};
use scenario::fault::{Fault, Order};
use scenario::ids::Tick;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

/// The orders and notes of a run, in log order.
struct Done {
    step: SimTime,
    /// The scenario's own orders first, then the operator's orders.
    orders: Vec<Order>,
    /// The number of the scenario's own orders.
    scenario_orders: usize,
    notes: Vec<String>,
    /// The number of messages lost without a fault.
    lost: usize,
    has_random_faults: bool,
    has_external_bodies: bool,
}

/// Returns the scenario file, and notes about facts that it cannot express.
///
/// # Errors
/// Returns an error when the inputs cannot be read or do not fit a scenario.
pub fn from_log(log: &RunLog) -> anyhow::Result<(String, Vec<String>)> {
    let setup = &log.run.setup;
    let mut scenario = setup.scenario.clone();
    let mut done = Done {
        step: SimTime(scenario.step_ms),
        scenario_orders: scenario.faults.timeline.len(),
        orders: std::mem::take(&mut scenario.faults.timeline),
        notes: Vec::new(),
        lost: 0,
        has_random_faults: scenario.faults.random.is_some(),
        has_external_bodies: false,
    };
    for line in log.inputs()? {
        done.take(line);
    }
    for order in &mut done.orders[done.scenario_orders..] {
        // Generated ids are assigned again.
        order.id = order.id.take().filter(|id| !is_generated(id));
    }
    scenario.faults.timeline = done.orders;
    let mut notes = done.notes;
    if done.lost > 0 {
        let lost = match done.lost {
            1 => "1 message was".to_owned(),
            count => format!("{count} messages were"),
        };
        notes.push(format!("{lost} lost without a fault: not exported"));
    }
    if done.has_external_bodies {
        let note = "the bodies moved in another world: in the scenario they move in this one";
        notes.push(note.to_owned());
    }
    let resolved = Setup::resolve(scenario.clone(), setup.seed, None);
    let resolved = resolved.context("the actions on this run do not form a scenario")?;
    if resolved.setup.alliance != setup.alliance {
        notes
            .push("the values of --params are not in the scenario; pass --params again".to_owned());
    }
    if !setup.profile.is_empty() {
        notes.push("the learned values are not in the scenario; pass --profile again".to_owned());
    }
    let text = text(&scenario, setup.seed)?;
    // The text must be readable as a scenario.
    let vocabulary = Registry::current().vocabulary();
    Scenario::parse("scenario", &text, &vocabulary)?;
    Ok((text, notes))
}

/// Returns whether the world generated an id.
fn is_generated(id: &str) -> bool {
    let number = id.strip_prefix('f').unwrap_or_default();
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
}

fn text(scenario: &Scenario, seed: u64) -> anyhow::Result<String> {
    let mut text = String::new();
    writeln!(
        text,
        "# The timeline contains the faults and orders of a run with `--seed {seed}`."
    )?;
    text += &scenario.to_toml()?;
    Ok(text)
}

impl Done {
    fn at_s(&self, tick: Tick) -> f64 {
        SimTime(tick * self.step.0).as_secs_f64()
    }

    fn take(&mut self, line: InputLine) {
        let tick = line.tick;
        match line.input {
            input if input.is_scripted() => {}
            Input::Order { order, .. } => self.ordered(order, tick),
            Input::Clear { ids, .. } => {
                for id in ids {
                    self.cleared(&id, tick);
                }
            }
            Input::Gone {
                robot,
                last_counted,
                ..
            } => {
                let tick = last_counted.map_or(0, |counted| counted.min(tick));
                self.happened(Fault::Kill(robot), tick);
            }
            Input::StallBegin { robot, .. } => self.happened(Fault::Pause(robot), tick),
            Input::StallEnd { robot, .. } => self.happened(Fault::Continue(robot), tick),
            Input::Join {
                robot, incarnation, ..
            } if incarnation > 1 => self.happened(Fault::Restart(robot), tick),
            Input::Lost { .. } => self.lost += 1,
            Input::Branch(branch) => self.branched(branch, tick),
            Input::Body(_) => self.has_external_bodies = true,
            Input::Join { .. } | Input::Failed { .. } => {}
        }
    }

    /// Replaces the faults that have not begun, as a branch does.
    fn branched(&mut self, branch: Branch, tick: Tick) {
        let now_s = self.at_s(tick);
        if let Some(faults) = branch.faults {
            let has_begun =
                |order: &Order| order.when.is_some() || order.at_s.unwrap_or(0.0) < now_s;
            let scenario_orders = self.orders[..self.scenario_orders].iter();
            self.scenario_orders = scenario_orders.filter(|order| has_begun(order)).count();
            self.orders.retain(has_begun);
            let lasting = self.orders.iter();
            let lasting = lasting.filter(|order| order.when.is_some() || order.every_s.is_some());
            let notes = lasting.map(|order| {
                format!(
                    "'{}' was disarmed by a branch at {now_s} s: in the scenario it stays armed",
                    order.fault
                )
            });
            self.notes.extend(notes);
            if self.has_random_faults {
                self.notes.push(format!(
                    "random faults ended with a branch at {now_s} s: in the scenario they go on"
                ));
            }
            for order in faults {
                self.ordered(order, tick);
            }
        }
        for (key, value) in branch.parameters {
            self.notes.push(format!(
                "{key} = {value} from {now_s} s on is not in the scenario"
            ));
        }
    }

    /// Adds a fault that happened without an order.
    fn happened(&mut self, fault: Fault, tick: Tick) {
        self.notes.push(format!(
            "'{fault}' at {} s had an external cause: the scenario repeats its tick, but not its order within the tick",
            self.at_s(tick)
        ));
        let at_s = Some(self.at_s(tick));
        self.orders.push(Order {
            at_s,
            ..Order::now(fault)
        });
    }

    fn ordered(&mut self, mut order: Order, tick: Tick) {
        let now_s = self.at_s(tick);
        if order.when.is_none() {
            order.at_s = Some(order.at_s.map_or(now_s, |at_s| at_s.max(now_s)));
        } else if tick > 0 {
            let fault = &order.fault;
            self.notes.push(format!(
                "'{fault}' was ordered at {now_s} s; in the scenario it waits for its event from the start"
            ));
        }
        self.orders.push(order);
    }

    /// Ends a fault at the time of its clearing: it heals then, or is removed if it had not begun.
    fn cleared(&mut self, id: &str, tick: Tick) {
        let now_s = self.at_s(tick);
        let has_id = |order: &Order| order.id.as_deref() == Some(id);
        let place = self.orders.iter().rposition(has_id);
        let Some((place, order)) = place.map(|place| (place, &mut self.orders[place])) else {
            self.notes.push(format!(
                "the scenario's fault {id} was cleared at {now_s} s: not exported"
            ));
            return;
        };
        match order.at_s {
            Some(at_s) if order.when.is_none() && order.every_s.is_none() => {
                if at_s < now_s {
                    let lasted = now_s - at_s;
                    order.for_s = Some(order.for_s.map_or(lasted, |for_s| for_s.min(lasted)));
                } else {
                    self.orders.remove(place);
                    self.scenario_orders -= usize::from(place < self.scenario_orders);
                }
            }
            _ => self.notes.push(format!(
                "{id} was cleared at {now_s} s: in the scenario it stays armed"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use run_log::Table;
    use serde_json::{Value, json};

    use super::*;
    use crate::testkit;

    fn scenario() -> Scenario {
        Scenario {
            limit_s: 90.0,
            ..default_scenario()
        }
    }

    fn run(scenario: Scenario, inputs: &[(Tick, Value)]) -> RunLog {
        let setup = Setup::resolve(scenario, 3, None).unwrap().setup;
        let inputs = inputs.iter().map(|(tick, input)| InputLine {
            tick: *tick,
            input: serde_json::from_value(input.clone()).unwrap(),
        });
        testkit::run_with(setup, inputs.collect())
    }

    fn order(order: Value) -> Value {
        json!({ "order": { "order": order } })
    }

    fn again(text: &str) -> RunLog {
        run(testkit::scenario(text), &[])
    }

    #[test]
    fn the_scenario_repeats_manual_actions() {
        let gold = json!({ "kill": "gold" });
        let green = json!({ "drop": { "from": "green", "to": "all", "p": 0.4 } });
        let place = json!({ "x_m": 6.0, "y_m": 4.0, "width_m": 0.5, "height_m": 1.0 });
        let obstacle = json!({ "obstacle": place });
        let blue = json!({ "mute": "blue" });
        let inputs = [
            (100, order(json!({ "id": "f1", "fault": gold }))),
            (
                200,
                order(json!({ "id": "f2", "fault": green, "for_s": 30.0 })),
            ),
            (
                200,
                order(json!({ "id": "crate", "fault": obstacle, "at_s": 12.0 })),
            ),
            (
                210,
                order(json!({ "id": "f4", "fault": blue, "at_s": 60.0 })),
            ),
            (300, json!({ "clear": { "ids": ["f1"] } })),
            (400, json!({ "clear": { "ids": ["f4"] } })),
        ];
        let manual = run(scenario(), &inputs);
        let (text, notes) = from_log(&manual).unwrap();
        assert_eq!(notes, [""; 0]);
        let scripted = again(&text);
        let orders = &scripted.run.setup.scenario.faults.timeline;
        let summary = orders
            .iter()
            .map(|order| (order.id.as_deref(), order.at_s, order.for_s));
        assert_eq!(
            summary.collect::<Vec<_>>(),
            [
                (None, Some(5.0), Some(10.0)),
                (None, Some(10.0), Some(30.0)),
                (Some("crate"), Some(12.0), None)
            ]
        );
        // The scenario repeats the run with manual actions, which differs from the run without them.
        let calm = run(scenario(), &[]);
        use Table::{Messages, Mission, Motivations, Poses};
        for table in [Poses, Motivations, Messages, Mission] {
            assert!(manual.table(table) == scripted.table(table), "{table:?}");
        }
        assert!(manual.table(Table::Poses) != calm.table(Table::Poses));
        // A second export gives the same run.
        assert_eq!(
            again(&from_log(&scripted).unwrap().0).run.hash,
            scripted.run.hash
        );
    }

    #[test]
    fn the_scenario_of_a_branch_has_the_faults_of_both_parts() {
        let at = |at_s: f64, fault: Value| {
            let order = json!({ "fault": fault, "at_s": at_s });
            serde_json::from_value::<Order>(order).unwrap()
        };
        let mut with_faults = scenario();
        with_faults.faults.timeline = vec![
            at(3.0, json!({ "mute": "gold" })),
            at(20.0, json!({ "kill": "gold" })),
        ];
        let later = at(8.0, json!({ "deaf": "blue" }));
        let change =
            json!({ "branch": { "faults": [later], "parameters": { "fast_impatience": 9.0 } } });
        let branch = run(with_faults, &[(100, change)]);
        let (text, notes) = from_log(&branch).unwrap();
        assert_eq!(
            notes,
            ["fast_impatience = 9 from 5 s on is not in the scenario"]
        );
        let log = again(&text);
        let orders = log.run.setup.scenario.faults.timeline.iter();
        let found: Vec<String> = orders
            .map(|order| format!("{} {:?}", order.fault, order.at_s))
            .collect();
        assert_eq!(found, ["mute gold Some(3.0)", "deaf blue Some(8.0)"]);
    }

    #[test]
    fn facts_that_a_scenario_cannot_express_are_noted() {
        let inputs = [
            (40, json!({ "stall-begin": { "robot": "green" } })),
            (60, json!({ "stall-end": { "robot": "green" } })),
            (
                100,
                json!({ "gone": { "robot": "gold", "incarnation": 1, "last_counted": 99, "listed": true } }),
            ),
            (
                120,
                order(json!({ "id": "f1", "fault": { "deaf": "blue" }, "when": "any delivers" })),
            ),
        ];
        let (text, notes) = from_log(&run(scenario(), &inputs)).unwrap();
        let outside = "had an external cause: the scenario repeats its tick, but not its order within the tick";
        assert_eq!(
            notes,
            [
                format!("'pause green' at 2 s {outside}"),
                format!("'continue green' at 3 s {outside}"),
                format!("'kill gold' at 4.95 s {outside}"),
                "'deaf blue' was ordered at 6 s; in the scenario it waits for its event from the start"
                    .to_owned(),
            ]
        );
        let log = again(&text);
        let orders = log.run.setup.scenario.faults.timeline.iter();
        let found: Vec<String> = orders
            .map(|order| format!("{} {:?}", order.fault, order.at_s))
            .collect();
        assert_eq!(
            found,
            [
                "pause green Some(2.0)",
                "continue green Some(3.0)",
                "kill gold Some(4.95)",
                "deaf blue None"
            ]
        );
    }
}

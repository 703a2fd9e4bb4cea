//! A run as a scenario file: what was done to it from outside stands on the timeline of its faults.
//!
//! Orders keep their words. What an operator asked for at once is due at the tick from which it was armed, and what was cleared lasts
//! as long as it did; robots whose processes ended, stopped or came back without any order are killed, paused and restarted.

use std::fmt::Write as _;

use alliance_proto::fault::{Fault, Order};
use alliance_proto::ids::Tick;
use alliance_proto::log::{Input, InputLine, RunLog};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::time::SimTime;
use anyhow::Context;
use missions::Registry;

/// What was done, in the order of the log.
struct Done {
    step: SimTime,
    /// First those that the scenario has itself, then those that were given.
    orders: Vec<Order>,
    own: usize,
    notes: Vec<String>,
    /// Messages that were lost though nobody asked for it.
    lost: usize,
}

/// The scenario file, and what of the run it cannot say.
///
/// # Errors
/// When the inputs cannot be read, or no scenario can say what they were.
pub fn of(log: &RunLog) -> anyhow::Result<(String, Vec<String>)> {
    let setup = &log.run.setup;
    let mut scenario = setup.scenario.clone();
    let mut done = Done {
        step: SimTime(scenario.step_ms),
        own: scenario.faults.timeline.len(),
        orders: std::mem::take(&mut scenario.faults.timeline),
        notes: Vec::new(),
        lost: 0,
    };
    for line in log.inputs()? {
        done.take(line);
    }
    for order in &mut done.orders[done.own..] {
        // The names of those that nobody named are given anew.
        order.id = order.id.take().filter(|id| !is_given(id));
    }
    scenario.faults.timeline = done.orders;
    let mut notes = done.notes;
    if done.lost > 0 {
        notes.push(format!(
            "{} messages got lost though nobody asked for it: that is left out",
            done.lost
        ));
    }
    let resolved = Setup::resolve(scenario.clone(), setup.seed, None);
    let resolved = resolved.context("what was done to this run is no scenario")?;
    if resolved.setup.alliance != setup.alliance {
        notes.push("the parameters of --params are not in it: give them again".to_owned());
    }
    if !setup.profile.is_empty() {
        notes.push("what robots had learned before is not in it: --profile again".to_owned());
    }
    let text = text(&scenario, setup.seed)?;
    // It is read as any other scenario is.
    let vocabulary = Registry::of_this_program().vocabulary();
    Scenario::parse("scenario", &text, &vocabulary)?;
    Ok((text, notes))
}

/// Whether the world gave a fault that id.
fn is_given(id: &str) -> bool {
    let number = id.strip_prefix('f').unwrap_or_default();
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
}

fn text(scenario: &Scenario, seed: u64) -> anyhow::Result<String> {
    let mut text = String::new();
    writeln!(
        text,
        "# What was done to a run with `--seed {seed}` is on the timeline here."
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
            Input::Join { .. } | Input::Failed { .. } => {}
        }
    }

    /// What nobody ordered.
    fn happened(&mut self, fault: Fault, tick: Tick) {
        self.notes.push(format!(
            "'{fault}' at {} s came from outside: to the tick, but not to the moment within it",
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
                "'{fault}' was ordered at {now_s} s; here it waits for its event from the start"
            ));
        }
        self.orders.push(order);
    }

    /// Ends a fault as it was ended by hand: it heals then, or never comes.
    fn cleared(&mut self, id: &str, tick: Tick) {
        let now_s = self.at_s(tick);
        let is_it = |order: &Order| order.id.as_deref() == Some(id);
        let place = self.orders.iter().rposition(is_it);
        let Some((place, order)) = place.map(|place| (place, &mut self.orders[place])) else {
            self.notes.push(format!(
                "{id} of the scenario was cleared at {now_s} s: that is left out"
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
                    self.own -= usize::from(place < self.own);
                }
            }
            _ => self.notes.push(format!(
                "{id} was cleared at {now_s} s: here it goes on waiting for its next time"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use alliance_proto::log::{LogLevel, Memory, Table};
    use missions::waste::data::default_scenario;
    use serde_json::{Value, json};

    use super::*;
    use in_process::Team;

    fn scenario() -> Scenario {
        Scenario {
            limit_s: 90.0,
            ..default_scenario()
        }
    }

    fn run(scenario: Scenario, inputs: &[(Tick, Value)]) -> RunLog {
        let setup = Setup::resolve(scenario, 3, None).unwrap().setup;
        let log = |team: Team<Memory>| {
            let (_, recorder) = team.run().unwrap();
            RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap()
        };
        let calm = Team::new(setup.clone(), LogLevel::Full, Memory::default()).unwrap();
        let mut all = log(calm).inputs().unwrap();
        all.extend(inputs.iter().map(|(tick, input)| InputLine {
            tick: *tick,
            input: serde_json::from_value(input.clone()).unwrap(),
        }));
        all.sort_by_key(|line| line.tick);
        log(Team::with_inputs(setup, all, LogLevel::Full, Memory::default()).unwrap())
    }

    fn order(order: Value) -> Value {
        json!({ "order": { "order": order } })
    }

    fn again(text: &str) -> RunLog {
        let vocabulary = Registry::built_in().vocabulary();
        run(Scenario::parse("again", text, &vocabulary).unwrap(), &[])
    }

    #[test]
    fn the_scenario_does_what_was_done_by_hand() {
        let inputs = [
            (
                100,
                order(json!({ "id": "f1", "fault": { "kill": "gold" } })),
            ),
            (
                200,
                order(
                    json!({ "id": "f2", "fault": { "drop": { "from": "green", "to": "all", "p": 0.4 } }, "for_s": 30.0 }),
                ),
            ),
            (
                200,
                order(
                    json!({ "id": "crate", "fault": { "obstacle": { "x_m": 6.0, "y_m": 4.0, "width_m": 0.5, "height_m": 1.0 } }, "at_s": 12.0 }),
                ),
            ),
            (
                210,
                order(json!({ "id": "f4", "fault": { "mute": "blue" }, "at_s": 60.0 })),
            ),
            (300, json!({ "clear": { "ids": ["f1"] } })),
            (400, json!({ "clear": { "ids": ["f4"] } })),
        ];
        let by_hand = run(scenario(), &inputs);
        let (text, notes) = of(&by_hand).unwrap();
        assert_eq!(notes, [""; 0]);
        let by_itself = again(&text);
        let orders = &by_itself.run.setup.scenario.faults.timeline;
        let told = orders
            .iter()
            .map(|order| (order.id.as_deref(), order.at_s, order.for_s));
        assert_eq!(
            told.collect::<Vec<_>>(),
            [
                (None, Some(5.0), Some(10.0)),
                (None, Some(10.0), Some(30.0)),
                (Some("crate"), Some(12.0), None)
            ]
        );
        // Everything went as it had gone by hand, and not as it goes by itself.
        let calm = run(scenario(), &[]);
        for table in [
            Table::Poses,
            Table::Motivations,
            Table::Messages,
            Table::Mission,
        ] {
            assert!(by_hand.table(table) == by_itself.table(table), "{table:?}");
        }
        assert!(by_hand.table(Table::Poses) != calm.table(Table::Poses));
        // Of a scenario nothing is left to be done.
        assert_eq!(
            again(&of(&by_itself).unwrap().0).run.hash,
            by_itself.run.hash
        );
    }

    #[test]
    fn what_a_scenario_cannot_say_is_told() {
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
        let (text, notes) = of(&run(scenario(), &inputs)).unwrap();
        let outside = "came from outside: to the tick, but not to the moment within it";
        assert_eq!(
            notes,
            [
                format!("'pause green' at 2 s {outside}"),
                format!("'continue green' at 3 s {outside}"),
                format!("'kill gold' at 4.95 s {outside}"),
                "'deaf blue' was ordered at 6 s; here it waits for its event from the start"
                    .to_owned(),
            ]
        );
        let log = again(&text);
        let orders = &log.run.setup.scenario.faults.timeline;
        let told: Vec<_> = orders
            .iter()
            .map(|order| (order.fault.to_string(), order.at_s))
            .collect();
        let told: Vec<_> = told
            .iter()
            .map(|(fault, at_s)| (fault.as_str(), *at_s))
            .collect();
        assert_eq!(
            told,
            [
                ("pause green", Some(2.0)),
                ("continue green", Some(3.0)),
                ("kill gold", Some(4.95)),
                ("deaf blue", None)
            ]
        );
    }
}

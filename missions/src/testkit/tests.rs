//! Test missions with one flaw each: the testkit finds the flaw and states the rule.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use robot_agent::mission::prelude::*;
use scenario::testkit::DRILL;
use serde::{Deserialize, Serialize};
use terminal::panics;
use world_server::mission::prelude::*;

use crate::MissionParts;
use crate::testkit::check_mission;

/// The flaws, as values of the const parameter.
const NOTHING: u8 = 0;
const SHARES_A_CELL: u8 = 1;
const HAS_A_STATIC: u8 = 2;
const TRUSTS_MESSAGES: u8 = 3;
const DRIVES_AT_NAN: u8 = 4;
const IS_NOWHERE: u8 = 5;
const REPORTS_A_SECRET: u8 = 6;
const SHOWS_A_SECRET: u8 = 7;
const DIFFERS_BY_RUN: u8 = 8;
const REPORTS_NAN: u8 = 9;
const TRUSTS_ACTIONS: u8 = 10;

/// Runs the testkit on a mission with a bell. Each active robot rings it, and every robot senses whether the count is
/// odd.
fn ring<const FLAW: u8>() {
    let parts = MissionParts::new::<Bell<FLAW>>(DRILL, |_| {
        ControllerConstructor::new(|_, _| Ringer::<FLAW> {
            rung: 0,
            cell: Arc::default(),
        })
    });
    check_mission(parts, "[drill]\n");
}

#[derive(Clone, Serialize)]
struct Bell<const FLAW: u8> {
    /// At most 3.
    rung: u32,
    /// Data that is not part of the state hash.
    #[serde(skip)]
    secret: u32,
}

impl<const FLAW: u8> Bell<FLAW> {
    fn shown(&self, flaw: u8) -> u32 {
        if FLAW == flaw { self.secret } else { self.rung }
    }
}

#[derive(Serialize, Deserialize)]
struct Ring(u8);

impl<const FLAW: u8> MissionWorld for Bell<FLAW> {
    fn new(_: &Setup, _: &Floor) -> Self {
        static RUNS: AtomicU32 = AtomicU32::new(0);
        // Each flaw has its own counter, because the tests run at the same time.
        let rung = match FLAW {
            DIFFERS_BY_RUN => RUNS.fetch_add(1, Relaxed) % 2,
            _ => 0,
        };
        Self { rung, secret: 0 }
    }

    fn act(&mut self, _: RobotId, action: &Action, floor: &mut Floor, _: &mut StepEvents) {
        let Some(Ring(action)) = action.value() else {
            return;
        };
        self.rung = 3.min(self.rung + 1);
        self.secret += 1;
        assert!(
            FLAW != TRUSTS_ACTIONS || action == 1,
            "the action is possible"
        );
        // Every robot senses the ringing.
        floor.invalidate_readings_near(Vec2::ZERO, 100.0);
    }

    fn sense(&self, _: RobotId, _: &Floor, sensed: &mut SensorReading) -> Validity {
        *sensed.value_mut() = self.shown(SHOWS_A_SECRET) % 2 == 1;
        Validity::UntilChange
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        None
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        let shown = self.shown(REPORTS_A_SECRET);
        row.extend([shown, 0, 0, 0].map(FigureValue::from));
        let last = (FLAW == REPORTS_NAN).then_some(f64::NAN);
        row.push(FigureValue::from(last));
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }
}

#[derive(Clone, Debug)]
struct Ringer<const FLAW: u8> {
    rung: u8,
    cell: Arc<AtomicU32>,
}

impl<const FLAW: u8> MissionController for Ringer<FLAW> {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        if FLAW == TRUSTS_MESSAGES {
            let mut shared = received.iter().filter_map(|each| each.shared_knowledge());
            assert!(shared.all(|rung: u8| rung < 2), "the value is at most 1");
        }
        perception
            .applicable
            .extend(input.behaviors.iter().map(|_| true));
    }

    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        static STEPS: AtomicU32 = AtomicU32::new(0);
        let steps = match FLAW {
            SHARES_A_CELL => self.cell.fetch_add(1, Relaxed),
            HAS_A_STATIC => STEPS.fetch_add(1, Relaxed),
            _ => 0,
        };
        output.actuation.turn_rad_s = (steps % 7) as f32 / 7.0;
        if FLAW == DRIVES_AT_NAN && *input.reading::<bool>() {
            output.actuation.speed_m_s = f32::NAN;
        }
        if active.is_some() {
            self.rung = (self.rung + 1) % 2;
            output.actuation.action = Action::new(&Ring(1));
        }
    }

    fn shared_knowledge(&self, _: &ControllerInput<'_>, knowledge: &mut SharedKnowledge) {
        knowledge.set(&self.rung);
    }

    fn position(&self, input: &ControllerInput<'_>) -> Option<Vec2> {
        let factor = if FLAW == IS_NOWHERE { f32::NAN } else { 1.0 };
        input.position().map(|at| at * factor)
    }
}

#[test]
fn each_flaw_is_found_and_a_sound_mission_passes() {
    ring::<NOTHING>();
    let trace = "a step that did not count left a trace";
    let not_finite =
        "returns finite numbers: panicked: the mission's controller returned an invalid speed: NaN";
    let readings = "equal states, but actions change the readings of robot#0";
    let flaws: [(fn(), &str); 10] = [
        (ring::<SHARES_A_CELL>, trace),
        (ring::<HAS_A_STATIC>, trace),
        (ring::<TRUSTS_MESSAGES>, "a controller accepts any input"),
        (ring::<DRIVES_AT_NAN>, not_finite),
        (ring::<IS_NOWHERE>, "reports a finite position"),
        (ring::<REPORTS_A_SECRET>, "equal states have equal rows"),
        (ring::<SHOWS_A_SECRET>, readings),
        (
            ring::<DIFFERS_BY_RUN>,
            "the same inputs give the same bytes",
        ),
        (
            ring::<REPORTS_NAN>,
            "mission.csv contains finite numbers only",
        ),
        (
            ring::<TRUSTS_ACTIONS>,
            "the world accepts any action of the robots",
        ),
    ];
    for (ring, rule) in flaws {
        let message = panics::catch(ring).unwrap_err().to_string();
        assert!(message.contains(rule), "{message}");
    }
}

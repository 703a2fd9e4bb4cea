//! Second half of a step: converts the goal of the active behavior set into commands for the body.

use crate::waste::data::BehaviorKind;
use crate::waste::data::notes;
use proto::mission::items::{Gripper, ItemsAction, ItemsBulletin, Zone};
use proto::readings::Readings;
use scenario::ids::{BehaviorId, TaskId};

use proto::team::BulletinSubject;
use proto::telemetry::{Note, NoteKind};
use scenario::time::SimTime;

use super::briefing::{Briefing, OwnBehavior};
use super::extremes::Extremes;
use super::find::{Methodical, SearchStep};
use super::report::{BlockedWays, ReportStep, errand};
use super::spill::{SpillStep, SpillView, SpillWork};
use super::{Pending, WasteController, places};
use robot_agent::body::goal::length;
use robot_agent::body::{Drive, Goal, Navigator, Status, Surroundings, Teammate};
use robot_agent::mission::StepOutput;

/// The distance that an idle robot keeps from a working teammate, m.
const ROOM_M: f32 = 0.2;

impl WasteController {
    /// Executes the active behavior set on the perceived readings and writes the commands to `output`.
    #[inline]
    pub(super) fn act(
        &mut self,
        now: SimTime,
        active: Option<BehaviorId>,
        readings: &Readings,
        output: &mut StepOutput,
    ) {
        if self.holding && active != self.load_of {
            return self.put_down(now, readings, output);
        }
        let Some(set) = active else {
            self.work = None;
            return self.make_room(now, readings, output);
        };
        let mut own_behaviors = self.briefing.own_behaviors.iter();
        let Some(&OwnBehavior { task, kind, .. }) =
            own_behaviors.find(|behavior| behavior.id == set)
        else {
            return;
        };
        let spill = match kind {
            BehaviorKind::MoveSpill(spill) => Some(spill),
            _ => None,
        };
        self.work.take_if(|work| spill != Some(work.spill()));
        match kind {
            BehaviorKind::FindLocationsMethodical => {
                let search = self.methodical.step(readings);
                self.search(now, set, task, search, readings, output);
            }
            BehaviorKind::FindLocationsWander => {
                let step = SimTime::from_secs_f64(f64::from(self.briefing.chassis.step_s));
                let search = self
                    .wander
                    .step(readings, &self.extremes, step, self.status);
                self.search(now, set, task, search, readings, output);
            }
            BehaviorKind::MoveSpill(spill) => {
                self.move_spill(now, (set, task), spill, readings, output);
            }
            BehaviorKind::ReportProgress => self.report_progress(now, task, readings, output),
        }
    }

    /// Puts down a load whose behavior set hibernates, and records the place.
    fn put_down(&mut self, now: SimTime, readings: &Readings, output: &mut StepOutput) {
        output.actuation.action = Gripper::Drop.into();
        self.work = None;
        let Some(pose) = readings.pose else { return };
        let ahead = self.facing.ahead(pose.heading_rad);
        let at = pose.position + ahead * self.briefing.chassis.radius_m;
        output.notes.push(Note {
            kind: notes::PUT_DOWN,
            detail: format!("at {:.2} {:.2}", at.x, at.y),
        });
        if readings.mission.items().zone == Some(Zone::None) {
            self.memory.observe_loose(at, true, now);
        }
    }

    /// Moves an idle robot away from a near working teammate: the robot may block the teammate's way.
    fn make_room(&mut self, now: SimTime, readings: &Readings, output: &mut StepOutput) {
        let Some(position) = self.position else {
            return;
        };
        let near = 2.0 * self.briefing.chassis.radius_m + ROOM_M;
        let Some(at_work) = self.teammates.nearest_at_work(position, near, now) else {
            return;
        };
        let away = position - at_work;
        let distance = length(away);
        if distance > 0.0 {
            let goal = Goal::Direction(away / distance);
            let drive = drive(&mut self.navigator, &self.briefing, goal, [], readings, now);
            self.apply_drive(drive, output);
        }
    }

    fn search(
        &mut self,
        now: SimTime,
        set: BehaviorId,
        task: TaskId,
        search: SearchStep,
        readings: &Readings,
        output: &mut StepOutput,
    ) {
        let progress = match search {
            SearchStep::Go { goal, progress } => {
                self.go(now, goal, readings, output);
                progress
            }
            SearchStep::Finished { progress } => {
                self.methodical = Methodical::default();
                if let Some(border) = self.extremes.border() {
                    self.extremes = Extremes::default();
                    let locations = self.memory.find(border, now);
                    output.notes.push(Note {
                        kind: notes::POSITION_UPDATE,
                        detail: format!("{} to {}", border.min, border.max),
                    });
                    let about = BulletinSubject {
                        task,
                        set,
                        progress: self.search_progress + u32::from(progress),
                    };
                    let update = ItemsBulletin::PositionUpdate(locations);
                    output.bulletins.push(update.into_bulletin(Some(about)));
                }
                progress
            }
        };
        if progress {
            self.progressed.push(task);
        }
    }

    fn move_spill(
        &mut self,
        now: SimTime,
        (set, task): (BehaviorId, TaskId),
        spill: u32,
        readings: &Readings,
        output: &mut StepOutput,
    ) {
        let places = places(&self.briefing, &self.memory, &self.realms);
        let (Some(sight), Some(places)) = (&self.sight, places) else {
            return;
        };
        let zone = readings.mission.items().zone;
        let view = SpillView {
            now,
            sight,
            holding: self.holding,
            in_deposit: zone.map(|zone| zone == Zone::Target),
            in_spill: zone.map(|zone| zone == Zone::Source),
            status: self.status,
            places: &places,
        };
        let work = self
            .work
            .get_or_insert_with(|| SpillWork::new(spill, &self.briefing, &places));
        match work.step(&self.briefing, &view, &mut self.memory) {
            SpillStep::Go(goal) => self.go(now, goal, readings, output),
            SpillStep::Grip(gripper) => {
                output.actuation.action = gripper.into();
                match gripper {
                    Gripper::Pick => self.load_of = Some(set),
                    _ => self.pending = Some(Pending::Delivery(task)),
                }
            }
            SpillStep::Empty => {
                self.memory.observe_spill(spill, true, now);
                output.notes.push(Note {
                    kind: notes::SPILL_EMPTY,
                    detail: self.briefing.catalog.task_name(task).to_owned(),
                });
            }
            SpillStep::OutOfReach => self.memory.set_aside(spill, now),
            SpillStep::Wrong => self.withdraw(now, output),
        }
    }

    fn report_progress(
        &mut self,
        now: SimTime,
        task: TaskId,
        readings: &Readings,
        output: &mut StepOutput,
    ) {
        let (Some(places), Some(pose)) = (
            places(&self.briefing, &self.memory, &self.realms),
            readings.pose,
        ) else {
            return;
        };
        match errand(
            &places,
            pose.position,
            readings.mission.items().at_site,
            self.briefing.chassis.radius_m,
        ) {
            ReportStep::Go(goal) => {
                self.go(now, goal, readings, output);
                if self.status == Status::Blocked {
                    self.ways_to_site.close(now);
                }
            }
            ReportStep::Report => {
                self.ways_to_site = BlockedWays::default();
                let report = ItemsAction {
                    report: true,
                    ..ItemsAction::default()
                };
                output.actuation.action = report.into();
                self.pending = Some(Pending::Report(task));
            }
            ReportStep::Wrong => self.withdraw(now, output),
        }
    }

    fn withdraw(&mut self, now: SimTime, output: &mut StepOutput) {
        let Some(withdrawal) = self.memory.withdraw() else {
            return;
        };
        if withdrawal.finder == self.briefing.robot {
            self.stands_back_since = Some(now);
        }
        output.notes.push(Note {
            kind: notes::LOCATIONS_WITHDRAWN,
            detail: format!("of {} at {}", withdrawal.finder, withdrawal.seen),
        });
        let message = ItemsBulletin::Withdrawal(withdrawal);
        output.bulletins.push(message.into_bulletin(None));
    }

    fn go(&mut self, now: SimTime, goal: Goal, readings: &Readings, output: &mut StepOutput) {
        let right_of_way = self.teammates.right_of_way(self.briefing.robot, now);
        let drive = drive(
            &mut self.navigator,
            &self.briefing,
            goal,
            right_of_way,
            readings,
            now,
        );
        self.apply_drive(drive, output);
    }

    fn apply_drive(&mut self, drive: Option<Drive>, output: &mut StepOutput) {
        let Some(drive) = drive else { return };
        self.status = drive.status;
        output.actuation = drive.actuation;
        if let Some(side) = drive.detour {
            output.notes.push(Note {
                kind: NoteKind::Detour,
                detail: format!("obstacle to the {}", side.as_str()),
            });
        }
    }
}

/// Computes one step of driving. Returns `None` without a position.
fn drive(
    navigator: &mut Navigator,
    briefing: &Briefing,
    goal: Goal,
    right_of_way: impl IntoIterator<Item = Teammate>,
    readings: &Readings,
    now: SimTime,
) -> Option<Drive> {
    let around = Surroundings::from_readings(readings)?;
    Some(navigator.drive(&briefing.chassis, goal, &around, right_of_way, now))
}

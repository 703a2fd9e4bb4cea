//! First half of a step: updates the robot's knowledge from readings and messages, and derives the applicable
//! behaviors.

use crate::waste::data::BehaviorKind;
use crate::waste::data::notes;
use std::sync::Arc;

use proto::mission::items::{ItemsBulletin, ItemsKnowledge, Zone};
use proto::mission::{Payload, SharedKnowledge};
use proto::readings::Readings;
use scenario::ids::{RobotId, TaskId};

use glam::Vec2;
use proto::team::{Broadcast, BroadcastContent, TaskState};
use proto::telemetry::{Note, NoteKind};
use scenario::time::SimTime;

use super::briefing::OwnBehavior;
use super::extremes::Extremes;
use super::find::Methodical;
use super::memory::SAME_PLACE_M;
use super::sight::FloorView;
use super::teammates::HeartbeatRelevance;
use super::{Pending, WasteController, places};
use robot_agent::body::goal::{is_within, length};
use robot_agent::mission::Perception;

/// The time for which a finder whose update was withdrawn leaves the search to others.
const STANDS_BACK: SimTime = SimTime(60_000);
/// The tolerance for a sensed spill beyond its radius around the computed center, m.
const SPILL_TOLERANCE_M: f32 = 0.2;

const FIND: TaskId = TaskId(0);

impl WasteController {
    /// Merges readings and received messages into the knowledge, and writes the results to `perception`.
    pub(super) fn perceive(
        &mut self,
        now: SimTime,
        readings: &Readings,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        let Perception {
            applicable,
            progressed,
            notes,
        } = perception;
        self.position = readings.pose.map(|pose| pose.position);
        self.see_effects(now, readings);
        for broadcast in received {
            self.receive(now, broadcast, notes);
        }
        for place in self
            .teammates
            .take_silent_carriers(now, self.briefing.silence)
        {
            self.search_later(place, now);
        }
        self.extremes.join(readings, self.briefing.chassis.radius_m);
        self.see_waste(now, readings);
        self.memory.expire(now);
        for task in std::mem::take(&mut self.progressed) {
            self.search_progress += u32::from(task == FIND);
            notes.push(Note {
                kind: NoteKind::Progress,
                detail: self.briefing.catalog.task_name(task).to_owned(),
            });
            progressed.push(task);
        }
        let own_behaviors = self.briefing.own_behaviors.iter();
        applicable.extend(own_behaviors.map(|set| self.is_applicable(set, now, readings)));
    }

    fn see_effects(&mut self, now: SimTime, readings: &Readings) {
        let holding = readings.mission.items().holding.unwrap_or(false);
        match self.pending.take() {
            Some(Pending::Delivery(task)) if self.holding && !holding => self.progressed.push(task),
            Some(Pending::Report(task)) => {
                self.memory.report(now);
                self.progressed.push(task);
            }
            _ => {}
        }
        self.holding = holding;
        if !holding {
            self.load_of = None;
        }
    }

    fn receive(&mut self, now: SimTime, broadcast: &Broadcast, notes: &mut Vec<Note>) {
        match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => {
                let own_behaviors = &self.briefing.own_behaviors;
                let is_own = |task| own_behaviors.iter().any(|set| set.task == task);
                let concern = || heartbeat.task.is_none_or(is_own);
                let news = self.teammates.receive(now, broadcast, heartbeat, concern);
                if let HeartbeatRelevance::Latest { lost } = news {
                    if let Some(place) = lost {
                        self.search_later(place, now);
                    }
                    if heartbeat.task == Some(FIND) && heartbeat.state == TaskState::Executing {
                        self.stands_back_since = None;
                    }
                }
                if let SharedKnowledge::Items(knowledge) = &heartbeat.shared_knowledge
                    && self.merge(knowledge, now)
                {
                    self.adopted_locations(broadcast.sender, notes);
                }
            }
            BroadcastContent::Bulletin(bulletin) => match bulletin.payload {
                Payload::Items(ItemsBulletin::PositionUpdate(locations)) => {
                    if self.memory.merge_locations(locations, now) {
                        self.adopted_locations(broadcast.sender, notes);
                    }
                }
                Payload::Items(ItemsBulletin::Withdrawal(withdrawal)) => {
                    if self.memory.merge_withdrawal(withdrawal) {
                        self.stands_back_since = Some(now);
                    }
                }
                Payload::Open(_) => {}
            },
            BroadcastContent::Allocation(_) => {}
        }
    }

    fn merge(&mut self, received: &ItemsKnowledge, now: SimTime) -> bool {
        // Computed lazily from the previous locations, because few heartbeats contain loose items.
        let (briefing, realms, known) = (&self.briefing, &self.realms, self.memory.locations());
        let concern = |at| {
            known.is_none_or(|known| {
                let places = briefing.map.places(&known.value, realms);
                let spill = places.nearest_spill(at);
                briefing.own_spills.binary_search(&spill).is_ok()
            })
        };
        self.memory.merge(received, now, concern)
    }

    fn adopted_locations(&mut self, from: RobotId, notes: &mut Vec<Note>) {
        self.stands_back_since = None;
        // A search that follows when the locations prove wrong starts from the beginning.
        self.methodical = Methodical::default();
        self.extremes = Extremes::default();
        notes.push(Note {
            kind: notes::LOCATIONS_LEARNED,
            detail: format!("from {from}"),
        });
    }

    /// Records the area where a teammate lost its load: between its last position and the deposit.
    fn search_later(&mut self, last_place: Vec2, now: SimTime) {
        let Some(places) = places(&self.briefing, &self.memory, &self.realms) else {
            return;
        };
        let way = self.briefing.chassis.speed_m_s * self.briefing.heartbeat.as_secs_f64() as f32;
        let offset = places.nearest_deposit(last_place) - last_place;
        let distance = length(offset);
        let ahead = (way / 2.0).min((distance - self.briefing.deposit_radius_m).max(0.0));
        let place = last_place + offset * (ahead / distance.max(ahead).max(f32::EPSILON));
        self.memory.observe_loose(place, true, now);
    }

    /// Records the robot's own observations of spills and loose waste.
    fn see_waste(&mut self, now: SimTime, readings: &Readings) {
        self.sight = None;
        let Some(pose) = readings.pose else { return };
        let ahead = self.facing.ahead(pose.heading_rad);
        let Some(places) = places(&self.briefing, &self.memory, &self.realms) else {
            return;
        };
        let own_spill = |at: Vec2, slack: f32| {
            let nearest = places.nearest_spill(at);
            let radius_m = self.briefing.spill_radius_m + slack;
            is_within(places.spill(nearest) - at, radius_m).then_some(nearest)
        };
        if readings.mission.items().zone == Some(Zone::Source)
            && own_spill(pose.position, SPILL_TOLERANCE_M).is_some()
        {
            self.memory.confirm();
        }
        self.sight = FloorView::of(readings, ahead, &self.briefing, &places);
        let Some(sight) = &self.sight else { return };
        let mut seen = None;
        for &item in &sight.waste {
            match own_spill(item, 0.0) {
                Some(spill) if seen == Some(spill) => {}
                Some(spill) => {
                    self.memory.observe_spill(spill, false, now);
                    seen = Some(spill);
                }
                None => self.memory.observe_loose(item, true, now),
            }
        }
        let gone: Vec<Vec2> = self
            .memory
            .loose()
            .filter(|&place| sight.shows_nothing_at(place, SAME_PLACE_M))
            .collect();
        for place in gone {
            self.memory.observe_loose(place, false, now);
        }
    }

    fn knows_loose(&self, spill: u32) -> bool {
        let places = places(&self.briefing, &self.memory, &self.realms);
        places.is_some_and(|places| {
            let mut loose = self.memory.loose();
            loose.any(|place| places.nearest_spill(place) == spill)
        })
    }

    fn is_applicable(&self, set: &OwnBehavior, now: SimTime, readings: &Readings) -> bool {
        if self.memory.locations().is_none() {
            let sensors_work = readings.pose.is_some() && readings.front_border.is_some();
            let stands_back = self.briefing.team_size > 1
                && self
                    .stands_back_since
                    .is_some_and(|since| now.since(since) < STANDS_BACK);
            return match set.kind {
                BehaviorKind::FindLocationsMethodical => {
                    sensors_work && readings.side_border.is_some() && !stands_back
                }
                BehaviorKind::FindLocationsWander => sensors_work && !stands_back,
                _ => false,
            };
        }
        if readings.pose.is_none() {
            return false;
        }
        match set.kind {
            BehaviorKind::MoveSpill(spill) => {
                let loads = self.holding && self.load_of == Some(set.id);
                let sensed = readings.mission.items();
                let works = sensed.items.is_some() && sensed.holding.is_some();
                let wanted = || !self.memory.counts_as_empty(spill, now) || self.knows_loose(spill);
                works && (loads || !self.memory.is_set_aside(spill, now) && wanted())
            }
            BehaviorKind::ReportProgress => {
                now.since(self.memory.last_report()) >= self.briefing.report_period
                    && !self.ways_to_site.are_set_aside(now)
            }
            _ => false,
        }
    }
}

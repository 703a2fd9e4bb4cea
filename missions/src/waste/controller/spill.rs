//! move-spill(LOC): carry the waste of one spill, and loose waste nearer to it than to another, to the deposit (thesis
//! §4.1.2.2).

use glam::Vec2;
use proto::mission::items::Gripper;
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::briefing::Briefing;
use super::map::KnownPlaces;
use super::memory::{Memory, SAME_PLACE_M};
use super::sight::FloorView;
use super::views::{AT_POINT_M, Views};
use crate::waste::data::INSIDE_DEPOSIT_M;
use robot_agent::body::goal::{is_shorter, is_within, length};
use robot_agent::body::{Goal, Status};

/// The safety margin that is subtracted from the gripper's reach, m.
const REACH_MARGIN_M: f32 = 0.02;
/// The maximum distance between two observations of the same item, m.
const SAME_ITEM_M: f32 = 0.05;
/// The number of unreachable items and views, and failed grips, after which the robot sets the spill aside. The count
/// restarts when the robot holds an item.
const CLOSED_MOST: u32 = 10;
/// The time for which an item that could not be reached or gripped is ignored.
const UNREACHABLE: SimTime = SimTime(10_000);

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SpillStep {
    Go(Goal),
    Grip(Gripper),
    /// No waste is left at the spill or on the way.
    Empty,
    /// Most of the spill, or its waste, is unreachable: obstacles are in the way, or the robot is shut in.
    OutOfReach,
    Wrong,
}

/// The readings and knowledge of one step that the work on a spill uses.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpillView<'a> {
    pub now: SimTime,
    pub sight: &'a FloorView,
    pub holding: bool,
    pub in_deposit: Option<bool>,
    pub in_spill: Option<bool>,
    /// The result of driving in the previous step.
    pub status: Status,
    pub places: &'a KnownPlaces<'a>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpillWork {
    spill: u32,
    deposit: Vec2,
    views: Views,
    /// True if the robot has stood at the expected place of the spill without sensing a spill.
    entered: bool,
    /// True if the robot visited the deposit since it last knew of waste. Together with complete views, the way is
    /// searched.
    from_deposit: bool,
    seen: SmallVec<[Vec2; 12]>,
    /// The places of unreachable items, and the time until which each is ignored.
    unreachable: Vec<(Vec2, SimTime)>,
    target: Target,
    gripped_at: Option<Vec2>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Item(Vec2),
    View(Vec2),
    /// A cell in the search of the spill's area.
    Cell(Vec2),
    Deposit,
}

impl SpillWork {
    pub fn new(spill: u32, briefing: &Briefing, places: &KnownPlaces) -> Self {
        let center = places.spill(spill);
        Self {
            spill,
            deposit: places.deposit_of(spill),
            views: Views::new(center, briefing.spill_radius_m),
            entered: false,
            from_deposit: false,
            seen: SmallVec::new(),
            unreachable: Vec::new(),
            target: Target::Deposit,
            gripped_at: None,
        }
    }

    pub fn spill(&self) -> u32 {
        self.spill
    }

    pub fn step(
        &mut self,
        briefing: &Briefing,
        view: &SpillView,
        memory: &mut Memory,
    ) -> SpillStep {
        self.unreachable.retain(|&(_, until)| view.now < until);
        self.look(briefing, view);
        if let Some(place) = self.gripped_at.take()
            && !view.holding
        {
            memory.count_failure(self.spill);
            self.leave_alone(place, view);
            memory.observe_loose(place, false, view.now);
        }
        if view.status == Status::Blocked {
            self.pass_over(view, memory);
        }
        if view.holding {
            memory.reset_failures(self.spill);
            return self.deliver(briefing, view);
        }
        if memory.failures(self.spill) >= CLOSED_MOST {
            return SpillStep::OutOfReach;
        }
        self.collect(briefing, view, memory)
    }

    fn deliver(&mut self, briefing: &Briefing, view: &SpillView) -> SpillStep {
        self.target = Target::Deposit;
        let at = self.deposit;
        let within = briefing.deposit_radius_m - INSIDE_DEPOSIT_M;
        let offset = at - view.sight.position;
        if length(offset) > within {
            return SpillStep::Go(Goal::Place { at, within });
        }
        if view.in_deposit == Some(false) {
            return SpillStep::Wrong;
        }
        // A load that falls ahead of the robot must fall inside the deposit.
        if offset.dot(view.sight.ahead) < 0.0 && length(offset) > within / 2.0 {
            return SpillStep::Go(Goal::Place {
                at,
                within: within / 2.0,
            });
        }
        self.from_deposit = true;
        SpillStep::Grip(Gripper::Drop)
    }

    fn collect(&mut self, briefing: &Briefing, view: &SpillView, memory: &mut Memory) -> SpillStep {
        let within = briefing.reach_m - REACH_MARGIN_M;
        let Some(at) = self.choose(view, memory) else {
            return self.look_around(briefing, view, memory);
        };
        self.target = Target::Item(at);
        self.views.restart();
        self.from_deposit = false;
        // Any item within reach is taken.
        let nearest = self.seen.iter().chain([&at]).copied();
        let is_near = |item: Vec2| is_within(item - view.sight.position, within);
        let mut in_reach = nearest.filter(|&item| is_near(item));
        if let Some(item) = in_reach.find(|&item| self.belongs_to_spill(view, item)) {
            self.gripped_at = Some(item);
            return SpillStep::Grip(Gripper::Pick);
        }
        SpillStep::Go(Goal::Place { at, within })
    }

    /// Returns the place of the item to fetch. Keeps the previous choice until the item is seen to be missing, so that
    /// the robot does not alternate at an obstacle. Otherwise takes the nearest item that the robot has seen or
    /// expects.
    fn choose(&self, view: &SpillView, memory: &Memory) -> Option<Vec2> {
        if let Target::Item(before) = self.target
            && self.belongs_to_spill(view, before)
            && !view.sight.shows_nothing_at(before, SAME_ITEM_M)
        {
            return Some(before);
        }
        let distance = |place: &Vec2| length(*place - view.sight.position);
        let known = self.seen.iter().copied().chain(memory.loose());
        known
            .filter(|&place| self.belongs_to_spill(view, place))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Looks over the spill and once along the way to the deposit, then searches the spill's area if no other waste is
    /// known. A search in progress takes precedence.
    fn look_around(
        &mut self,
        briefing: &Briefing,
        view: &SpillView,
        memory: &mut Memory,
    ) -> SpillStep {
        if let Some(searching) = self.search(briefing, view, memory) {
            return searching;
        }
        let position = view.sight.position;
        let going = match self.target {
            Target::View(at) => Some(at),
            _ => None,
        };
        if let Some(at) = self.views.next(position, going) {
            self.target = Target::View(at);
            return SpillStep::Go(Goal::Place {
                at,
                within: AT_POINT_M,
            });
        }
        // The robot was all around and sensed no spill, so the locations may be wrong. Views from outside and blocked
        // ways prove nothing: a real spill may lie under an obstacle.
        if view.in_spill.is_some() && !memory.is_confirmed() {
            if self.entered {
                return SpillStep::Wrong;
            }
            if let Some(at) = self.views.center() {
                self.target = Target::View(at);
                return SpillStep::Go(Goal::Place {
                    at,
                    within: AT_POINT_M,
                });
            }
        }
        let stay = SpillStep::Go(Goal::Place {
            at: position,
            within: AT_POINT_M,
        });
        if !self.views.are_sufficient() {
            if memory.begin_sweep(self.spill, view.now) {
                return stay;
            }
            // A way may exist by now, because other robots have moved.
            self.views.restart();
            self.views.unblock();
            return stay;
        }
        if !self.unreachable.is_empty() {
            return stay;
        }
        let at = self.deposit;
        let within = briefing.deposit_radius_m - INSIDE_DEPOSIT_M;
        if !self.from_deposit && length(at - position) > within {
            self.target = Target::Deposit;
            return SpillStep::Go(Goal::Place { at, within });
        }
        if memory.begin_sweep(self.spill, view.now) {
            return stay;
        }
        SpillStep::Empty
    }

    /// Continues the search of the spill's area. Returns `None` if none is in progress.
    fn search(
        &mut self,
        briefing: &Briefing,
        view: &SpillView,
        memory: &mut Memory,
    ) -> Option<SpillStep> {
        let sweep = memory.sweep(self.spill)?;
        let Some(at) = sweep.next(self.spill, view.sight, briefing.sight_m, view.places) else {
            memory.end_sweep(self.spill);
            return Some(if memory.was_empty(self.spill) {
                SpillStep::Empty
            } else {
                SpillStep::OutOfReach
            });
        };
        self.target = Target::Cell(at);
        Some(SpillStep::Go(Goal::Place {
            at,
            within: AT_POINT_M,
        }))
    }

    fn look(&mut self, briefing: &Briefing, view: &SpillView) {
        let sight = view.sight;
        if !self.entered && view.in_spill == Some(false) {
            let offset = sight.position - view.places.spill(self.spill);
            self.entered = is_within(offset, briefing.spill_radius_m.max(AT_POINT_M));
        }
        self.views.update(sight);
        let is_missing = |item: &Vec2| sight.shows_nothing_at(*item, SAME_ITEM_M);
        // Mostly no item is missing, and `retain` is skipped.
        if self.seen.iter().any(is_missing) {
            self.seen.retain(|item| !is_missing(item));
        }
        for &item in &sight.waste {
            let known = self
                .seen
                .iter()
                .any(|&seen| is_shorter(seen - item, SAME_ITEM_M));
            if !known && view.places.nearest_spill(item) == self.spill {
                self.seen.push(item);
            }
        }
    }

    /// Handles a blocked way to the target.
    fn pass_over(&mut self, view: &SpillView, memory: &mut Memory) {
        if matches!(self.target, Target::Item(_) | Target::View(_)) {
            memory.count_failure(self.spill);
        }
        match self.target {
            Target::Item(at) => self.leave_alone(at, view),
            Target::View(at) => self.views.block(at),
            // A blocked cell mostly lies under an obstacle.
            Target::Cell(_) => {
                if let Some(sweep) = memory.sweep(self.spill) {
                    sweep.skip_cell();
                }
            }
            Target::Deposit => self.from_deposit |= !view.holding,
        }
    }

    /// Removes an item from the seen items and ignores its place for a while.
    fn leave_alone(&mut self, place: Vec2, view: &SpillView) {
        self.seen
            .retain(|item| length(*item - place) >= SAME_ITEM_M);
        self.unreachable.push((place, view.now + UNREACHABLE));
    }

    /// Checks whether an item at this place belongs to this spill and is not ignored.
    fn belongs_to_spill(&self, view: &SpillView, item: Vec2) -> bool {
        let mut unreachable = self.unreachable.iter();
        view.places.nearest_spill(item) == self.spill
            && !unreachable.any(|&(place, _)| is_shorter(place - item, SAME_PLACE_M / 2.0))
    }
}

//! move-spill(LOC): carry the waste of one spill, and what lies loose nearer to it than to another, to the deposit (thesis
//! §4.1.2.2).

use alliance_proto::mission::items::Gripper;
use alliance_proto::time::SimTime;
use glam::Vec2;
use smallvec::SmallVec;

use super::briefing::Briefing;
use super::map::Places;
use super::memory::{Memory, SAME_PLACE_M};
use super::sight::Sight;
use super::views::{AT_POINT_M, Views};
use robot_agent::body::goal::{is_shorter, is_within, length};
use robot_agent::body::{Goal, Status};

/// How far inside the deposit's edge the robot lets go when it faces inward, m.
const INSIDE_DEPOSIT_M: f32 = 0.1;
/// Items are gripped this much nearer than the gripper's reach, m.
const REACH_MARGIN_M: f32 = 0.02;
/// An item seen this near to where one was seen before is the same, m.
const SAME_ITEM_M: f32 = 0.05;
/// So many items and views to which it finds no way, and items that it cannot take up, without having held anything in between,
/// and the robot leaves the spill alone.
const CLOSED_MOST: u32 = 10;
/// How long an item that could not be reached or gripped is left alone.
const UNREACHABLE: SimTime = SimTime(10_000);

/// What the work on a spill wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Work {
    /// Go there.
    Go(Goal),
    /// Use the gripper here.
    Grip(Gripper),
    /// Nothing is left: not at the spill and not on the way.
    Empty,
    /// There is no way to most of it, or to what lies there: obstacles are in the way, or the robot is shut in.
    OutOfReach,
    /// The locations are wrong.
    Wrong,
}

/// What the robot senses and knows in this step.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpillView<'a> {
    pub now: SimTime,
    pub sight: &'a Sight,
    pub holding: bool,
    pub in_deposit: Option<bool>,
    pub in_spill: Option<bool>,
    /// How the body got on in the step before.
    pub status: Status,
    pub places: &'a Places<'a>,
}

/// Work on one spill, from activation to hibernation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpillWork {
    spill: u16,
    /// Center of the deposit that its waste goes to.
    deposit: Vec2,
    views: Views,
    /// Whether the robot has stood where the spill should be, and sensed none.
    entered: bool,
    /// Whether the robot has been at the deposit since it last knew of something to carry: with the views done, the way
    /// between has been swept.
    from_deposit: bool,
    /// Items of this spill that the robot has seen.
    seen: SmallVec<[Vec2; 12]>,
    /// What could not be reached or gripped, and until when it is left alone.
    unreachable: Vec<(Vec2, SimTime)>,
    target: Target,
    /// Where it has just tried to pick something up.
    gripped_at: Option<Vec2>,
}

/// Where the robot goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Item(Vec2),
    View(Vec2),
    /// On the search of the spill's part of the room.
    Cell(Vec2),
    Deposit,
}

impl SpillWork {
    pub fn new(spill: u16, briefing: &Briefing, places: &Places) -> Self {
        let center = places.spill(spill);
        Self {
            spill,
            deposit: places.nearest_deposit(center),
            views: Views::new(center, briefing.spill_radius_m),
            entered: false,
            from_deposit: false,
            seen: SmallVec::new(),
            unreachable: Vec::new(),
            target: Target::Deposit,
            gripped_at: None,
        }
    }

    /// The spill worked on.
    pub fn spill(&self) -> u16 {
        self.spill
    }

    /// What to do in this step.
    pub fn step(&mut self, briefing: &Briefing, view: &SpillView, memory: &mut Memory) -> Work {
        self.unreachable.retain(|&(_, until)| view.now < until);
        self.look(briefing, view);
        if let Some(place) = self.gripped_at.take()
            && !view.holding
        {
            memory.close(self.spill);
            self.leave_alone(place, view);
            memory.see_loose(place, false, view.now);
        }
        if view.status == Status::Blocked {
            self.pass_over(view, memory);
        }
        if view.holding {
            memory.reopen(self.spill);
            return self.deliver(briefing, view);
        }
        if memory.closed(self.spill) >= CLOSED_MOST {
            return Work::OutOfReach;
        }
        self.collect(briefing, view, memory)
    }

    fn deliver(&mut self, briefing: &Briefing, view: &SpillView) -> Work {
        self.target = Target::Deposit;
        let at = self.deposit;
        let within = briefing.deposit_radius_m - INSIDE_DEPOSIT_M;
        let offset = at - view.sight.position;
        if length(offset) > within {
            return Work::Go(Goal::Place { at, within });
        }
        if view.in_deposit == Some(false) {
            return Work::Wrong;
        }
        // What falls ahead of it must fall inside.
        if offset.dot(view.sight.ahead) < 0.0 && length(offset) > within / 2.0 {
            return Work::Go(Goal::Place {
                at,
                within: within / 2.0,
            });
        }
        self.from_deposit = true;
        Work::Grip(Gripper::Drop)
    }

    fn collect(&mut self, briefing: &Briefing, view: &SpillView, memory: &mut Memory) -> Work {
        let within = briefing.reach_m - REACH_MARGIN_M;
        let Some(at) = self.choose(view, memory) else {
            return self.look_around(briefing, view, memory);
        };
        self.target = Target::Item(at);
        self.views.restart();
        self.from_deposit = false;
        // Whatever is in reach will do.
        let nearest = self.seen.iter().chain([&at]).copied();
        let is_near = |item: Vec2| is_within(item - view.sight.position, within);
        let mut in_reach = nearest.filter(|&item| is_near(item));
        if let Some(item) = in_reach.find(|&item| self.is_mine(view, item)) {
            self.gripped_at = Some(item);
            return Work::Grip(Gripper::Pick);
        }
        Work::Go(Goal::Place { at, within })
    }

    /// What to fetch: what was chosen before, until it is seen to be gone, lest the robot change its mind on its way round an
    /// obstacle; else the nearest that it has seen, or that it knows to lie somewhere.
    fn choose(&self, view: &SpillView, memory: &Memory) -> Option<Vec2> {
        if let Target::Item(before) = self.target
            && self.is_mine(view, before)
            && !view.sight.shows_nothing_at(before, SAME_ITEM_M)
        {
            return Some(before);
        }
        let distance = |place: &Vec2| length(*place - view.sight.position);
        let known = self.seen.iter().copied().chain(memory.loose());
        known
            .filter(|&place| self.is_mine(view, place))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// All over the spill, and once along the way to the deposit; then all over its part of the room, if nothing else is known to
    /// be left: once begun, that comes first.
    fn look_around(&mut self, briefing: &Briefing, view: &SpillView, memory: &mut Memory) -> Work {
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
            return Work::Go(Goal::Place {
                at,
                within: AT_POINT_M,
            });
        }
        // All round, and no spill was sensed: it is somewhere else. To have seen it only from outside, or to find the ways into
        // it closed, proves nothing: a true one may lie under an obstacle.
        if view.in_spill.is_some() && !memory.is_confirmed() {
            if self.entered {
                return Work::Wrong;
            }
            if let Some(at) = self.views.center() {
                self.target = Target::View(at);
                return Work::Go(Goal::Place {
                    at,
                    within: AT_POINT_M,
                });
            }
        }
        let stay = Work::Go(Goal::Place {
            at: position,
            within: AT_POINT_M,
        });
        if !self.views.show_enough() {
            if memory.begin_sweep(self.spill, view.now) {
                return stay;
            }
            // There may be a way by now: others have moved.
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
            return Work::Go(Goal::Place { at, within });
        }
        if memory.begin_sweep(self.spill, view.now) {
            return stay;
        }
        Work::Empty
    }

    /// Goes on with the search of the spill's part of the room; `None` where none has begun.
    fn search(
        &mut self,
        briefing: &Briefing,
        view: &SpillView,
        memory: &mut Memory,
    ) -> Option<Work> {
        let sweep = memory.sweep(self.spill)?;
        let Some(at) = sweep.next(self.spill, view.sight, briefing.sight_m, view.places) else {
            memory.end_sweep(self.spill);
            return Some(if memory.was_empty(self.spill) {
                Work::Empty
            } else {
                Work::OutOfReach
            });
        };
        self.target = Target::Cell(at);
        Some(Work::Go(Goal::Place {
            at,
            within: AT_POINT_M,
        }))
    }

    /// Joins what is in sight to what was seen before.
    fn look(&mut self, briefing: &Briefing, view: &SpillView) {
        let sight = view.sight;
        if !self.entered && view.in_spill == Some(false) {
            let offset = sight.position - view.places.spill(self.spill);
            self.entered = is_within(offset, briefing.spill_radius_m.max(AT_POINT_M));
        }
        self.views.look(sight);
        let is_gone = |item: &Vec2| sight.shows_nothing_at(*item, SAME_ITEM_M);
        // Mostly none is: then none has to be moved.
        if self.seen.iter().any(is_gone) {
            self.seen.retain(|item| !is_gone(item));
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

    /// There was no way to the target.
    fn pass_over(&mut self, view: &SpillView, memory: &mut Memory) {
        if matches!(self.target, Target::Item(_) | Target::View(_)) {
            memory.close(self.spill);
        }
        match self.target {
            Target::Item(at) => self.leave_alone(at, view),
            Target::View(at) => self.views.block(at),
            // As mostly when an obstacle stands there.
            Target::Cell(_) => {
                if let Some(sweep) = memory.sweep(self.spill) {
                    sweep.pass();
                }
            }
            Target::Deposit => self.from_deposit |= !view.holding,
        }
    }

    /// Forgets that something lies there; where it is seen again, it is left alone for a while.
    fn leave_alone(&mut self, place: Vec2, view: &SpillView) {
        self.seen
            .retain(|item| length(*item - place) >= SAME_ITEM_M);
        self.unreachable.push((place, view.now + UNREACHABLE));
    }

    /// Whether what lies there is this spill's work, and can be reached.
    fn is_mine(&self, view: &SpillView, item: Vec2) -> bool {
        let mut unreachable = self.unreachable.iter();
        view.places.nearest_spill(item) == self.spill
            && !unreachable.any(|&(place, _)| is_shorter(place - item, SAME_PLACE_M / 2.0))
    }
}

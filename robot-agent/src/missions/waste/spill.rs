//! move-spill(LOC): carry the waste of one spill, and what lies loose nearer to it than to another, to the deposit (thesis
//! §4.1.2.2).

use std::f32::consts::TAU;

use alliance_proto::readings::Gripper;
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::briefing::{Briefing, Places};
use super::memory::{Memory, SAME_PLACE_M};
use super::sight::Sight;
use crate::body::goal::length;
use crate::body::{Goal, Status};

/// How far inside the deposit's edge the robot lets go, m.
const INSIDE_DEPOSIT_M: f32 = 0.1;
/// How exactly it goes to where it looks around, m.
const VIEW_WITHIN_M: f32 = 0.15;
/// Items are gripped this much nearer than the gripper's reach, m.
const REACH_MARGIN_M: f32 = 0.02;
/// An item seen this near to where one was seen before is the same, m.
const SAME_ITEM_M: f32 = 0.05;
/// How long an item that could not be reached is left alone.
const UNREACHABLE: SimTime = SimTime(30_000);
/// Places to look around from when the spill's center cannot be reached or does not overlook it.
const RING: usize = 6;

/// What the work on a spill wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Work {
    /// Go there.
    Go(Goal),
    /// Use the gripper here.
    Grip(Gripper),
    /// Nothing is left: not at the spill and not on the way.
    Empty,
    /// The locations are wrong.
    Wrong,
}

/// What the robot senses and remembers while it works.
pub(super) struct Scene<'a> {
    pub now: SimTime,
    pub sight: &'a Sight,
    pub holding: bool,
    pub in_deposit: Option<bool>,
    pub in_spill: Option<bool>,
    /// How the body got on in the step before.
    pub status: Status,
    pub memory: &'a Memory,
    pub places: &'a Places,
}

/// Work on one spill, from activation to hibernation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpillWork {
    spill: usize,
    /// Places to look around from, in order, and how many of them are done.
    views: Vec<Vec2>,
    viewed: usize,
    /// Whether the robot has been at the deposit since it last sensed something to carry: with the views done, the way
    /// between has been swept.
    from_deposit: bool,
    /// What could not be reached, and until when it is left alone.
    unreachable: Vec<(Vec2, SimTime)>,
    /// Where it goes now.
    target: Target,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Item(Vec2),
    View,
    Deposit,
}

impl SpillWork {
    pub fn new(spill: usize) -> Self {
        Self {
            spill,
            views: Vec::new(),
            viewed: 0,
            from_deposit: false,
            unreachable: Vec::new(),
            target: Target::View,
        }
    }

    /// The spill worked on.
    pub fn spill(&self) -> usize {
        self.spill
    }

    /// What to do in this step.
    pub fn step(&mut self, briefing: &Briefing, scene: &Scene) -> Work {
        if self.views.is_empty() {
            self.views = views(briefing, scene.places.spills[self.spill]);
        }
        self.unreachable.retain(|&(_, until)| scene.now < until);
        if scene.status == Status::Blocked {
            self.pass_over(briefing, scene);
        }
        if scene.holding {
            self.deliver(briefing, scene)
        } else {
            self.collect(briefing, scene)
        }
    }

    fn deliver(&mut self, briefing: &Briefing, scene: &Scene) -> Work {
        self.target = Target::Deposit;
        let deposit = scene.places.deposit;
        let within = briefing.deposit_radius_m - INSIDE_DEPOSIT_M;
        if length(deposit - scene.sight.position) > within {
            return Work::Go(Goal::Place {
                at: deposit,
                within,
            });
        }
        if scene.in_deposit == Some(false) {
            return Work::Wrong;
        }
        self.from_deposit = true;
        Work::Grip(Gripper::Drop)
    }

    fn collect(&mut self, briefing: &Briefing, scene: &Scene) -> Work {
        let within = briefing.reach_m - REACH_MARGIN_M;
        let mut mine = scene.sight.waste.iter().copied();
        if let Some(item) = mine.find(|&item| self.is_mine(scene, item)) {
            self.viewed = 0;
            self.from_deposit = false;
            if length(item - scene.sight.position) <= within {
                return Work::Grip(Gripper::Pick);
            }
        }
        if let Some(at) = self.choose(scene) {
            self.target = Target::Item(at);
            return Work::Go(Goal::Place { at, within });
        }
        self.look_around(briefing, scene)
    }

    /// What to fetch: what was chosen before, until it is seen to be gone, lest the robot change its mind on its way round an
    /// obstacle; else the nearest that it sees, or that it knows to lie somewhere.
    fn choose(&self, scene: &Scene) -> Option<Vec2> {
        let is_mine = |item: &Vec2| self.is_mine(scene, *item);
        if let Target::Item(before) = self.target
            && is_mine(&before)
            && !scene.sight.shows_nothing_at(before, SAME_ITEM_M)
        {
            return scene.sight.item_at(before, SAME_ITEM_M).or(Some(before));
        }
        let distance = |place: &Vec2| length(*place - scene.sight.position);
        let seen = scene.sight.waste.iter().copied().find(is_mine);
        let known = scene.memory.loose().filter(is_mine);
        seen.or_else(|| known.min_by(|a, b| distance(a).total_cmp(&distance(b))))
    }

    /// From the spill's center, or all around, and once along the way to the deposit.
    fn look_around(&mut self, briefing: &Briefing, scene: &Scene) -> Work {
        if let Some(&view) = self.views.get(self.viewed) {
            if length(view - scene.sight.position) > VIEW_WITHIN_M {
                self.target = Target::View;
                return Work::Go(Goal::Place {
                    at: view,
                    within: VIEW_WITHIN_M,
                });
            }
            if self.viewed == 0 && scene.in_spill == Some(false) {
                return Work::Wrong;
            }
            self.viewed += 1;
            return self.look_around(briefing, scene);
        }
        if !self.unreachable.is_empty() {
            // What is left could not be reached before; others may have moved since.
            self.unreachable.clear();
            self.viewed = 0;
            return self.collect(briefing, scene);
        }
        if scene.in_spill.is_some() && !scene.memory.is_confirmed() {
            return Work::Wrong;
        }
        let within = briefing.deposit_radius_m - INSIDE_DEPOSIT_M;
        if !self.from_deposit && length(scene.places.deposit - scene.sight.position) > within {
            self.target = Target::Deposit;
            return Work::Go(Goal::Place {
                at: scene.places.deposit,
                within,
            });
        }
        Work::Empty
    }

    /// There was no way to the target: leave it alone for a while.
    fn pass_over(&mut self, briefing: &Briefing, scene: &Scene) {
        match self.target {
            Target::Item(at) => {
                if !self.is_unreachable(at) {
                    self.unreachable.push((at, scene.now + UNREACHABLE));
                }
            }
            Target::View => {
                if self.views.len() == 1 {
                    let center = scene.places.spills[self.spill];
                    self.views.extend(ring(center, briefing.spill_radius_m));
                }
                self.viewed += 1;
            }
            Target::Deposit => self.from_deposit |= !scene.holding,
        }
    }

    /// Whether what lies there is this spill's work, and can be reached.
    fn is_mine(&self, scene: &Scene, item: Vec2) -> bool {
        nearest_spill(scene.places, item) == Some(self.spill) && !self.is_unreachable(item)
    }

    fn is_unreachable(&self, item: Vec2) -> bool {
        let mut places = self.unreachable.iter();
        places.any(|&(place, _)| length(place - item) < SAME_PLACE_M / 2.0)
    }
}

/// The spill whose work it is to carry what lies there.
pub(super) fn nearest_spill(places: &Places, at: Vec2) -> Option<usize> {
    let distances = places
        .spills
        .iter()
        .map(|&spill| length(spill - at))
        .enumerate();
    distances
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(spill, _)| spill)
}

/// Where to look around from: the center where it overlooks the whole spill.
fn views(briefing: &Briefing, center: Vec2) -> Vec<Vec2> {
    let mut views = vec![center];
    if briefing.sight_m < briefing.spill_radius_m + VIEW_WITHIN_M {
        views.extend(ring(center, briefing.spill_radius_m));
    }
    views
}

fn ring(center: Vec2, radius_m: f32) -> impl Iterator<Item = Vec2> {
    (0..RING).map(move |index| {
        let angle = TAU * index as f32 / RING as f32;
        center + Vec2::new(libm::cosf(angle), libm::sinf(angle)) * radius_m
    })
}

//! The last heartbeat of each teammate.

use glam::Vec2;
use proto::team::{Broadcast, Heartbeat, TaskState};
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

use robot_agent::body::Teammate;
use robot_agent::body::goal::{is_shorter, length};
use robot_agent::by_rank::ByRank;

const POSITION_EXPIRES: SimTime = SimTime(3_000);

/// The content of a teammate's last heartbeat.
#[derive(Clone, Debug, PartialEq)]
struct LastHeartbeat {
    /// Incarnation and sequence number, which order the heartbeats.
    stamp: (Incarnation, u64),
    sent: SimTime,
    received: SimTime,
    position: Option<Vec2>,
    /// True if it carries something that this robot would search for if it were lost.
    carrying: bool,
    works: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HeartbeatRelevance {
    /// The heartbeat is older than a known one.
    None,
    /// The heartbeat is the latest of its sender.
    Latest {
        /// The last position of the sender, if it is a new incarnation of one that was carrying an item.
        lost: Option<Vec2>,
    },
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Teammates {
    last: ByRank<LastHeartbeat>,
    /// A place and a range without a working teammate. Saves a search per step for an idle robot that stands still.
    clear_area: Option<(Vec2, f32)>,
    /// A lower bound for the last heartbeat of all carriers. `None` if no teammate carries anything.
    carriers_since: Option<SimTime>,
}

impl Teammates {
    /// Records a heartbeat received at `now`, unless a later one of its sender is known: messages may be late. A load
    /// that is not of `concern` to this robot is ignored.
    pub fn receive(
        &mut self,
        now: SimTime,
        broadcast: &Broadcast,
        heartbeat: &Heartbeat,
        concern: impl FnOnce() -> bool,
    ) -> HeartbeatRelevance {
        let stamp = (broadcast.incarnation, broadcast.seq);
        let place = self.last.place(broadcast.sender);
        if place.is_ok_and(|known| self.last.at(known).stamp > stamp) {
            return HeartbeatRelevance::None;
        }
        let works = heartbeat.state == TaskState::Executing && heartbeat.task.is_some();
        if works && let Some(at) = heartbeat.position {
            self.clear_area
                .take_if(|&mut (from, range_m)| is_shorter(at - from, range_m));
        }
        let carrying = heartbeat.carrying && concern();
        if carrying {
            self.carriers_since.get_or_insert(now);
        }
        let last = LastHeartbeat {
            stamp,
            sent: broadcast.sent,
            received: now,
            position: heartbeat.position,
            carrying,
            works,
        };
        let before = match place {
            Ok(known) => Some(std::mem::replace(self.last.at_mut(known), last)),
            Err(place) => {
                self.last.insert(place, broadcast.sender, last);
                None
            }
        };
        let lost = before.filter(|last| last.carrying && last.stamp.0 != broadcast.incarnation);
        HeartbeatRelevance::Latest {
            lost: lost.and_then(|last| last.position),
        }
    }

    /// Returns the last positions of carriers that have been silent for longer than `silence`, each position once.
    pub fn take_silent_carriers(&mut self, now: SimTime, silence: SimTime) -> Vec<Vec2> {
        if self
            .carriers_since
            .is_none_or(|since| now.since(since) <= silence)
        {
            return Vec::new();
        }
        let silent = |last: &LastHeartbeat| last.carrying && now.since(last.received) > silence;
        let fallen = self.last.values_mut().filter(|last| silent(last));
        let places = fallen.filter_map(|last| {
            last.carrying = false;
            last.position
        });
        let places = places.collect();
        let carriers = self.last.iter().filter(|(_, last)| last.carrying);
        self.carriers_since = carriers.map(|(_, last)| last.received).min();
        places
    }

    /// Returns the teammates to which `robot` gives way: working robots of lower rank.
    pub fn right_of_way(&self, robot: RobotId, now: SimTime) -> impl Iterator<Item = Teammate> {
        let lower = self.last.iter().take_while(move |(rank, _)| *rank < robot);
        lower
            .filter_map(|(_, last)| last.at_work())
            .filter(move |teammate| is_fresh(teammate, now))
    }

    /// Returns the last position of the nearest working teammate within a range.
    pub fn nearest_at_work(&mut self, position: Vec2, range_m: f32, now: SimTime) -> Option<Vec2> {
        if self.clear_area == Some((position, range_m)) {
            return None;
        }
        let at_work = self.last.iter().filter_map(|(_, last)| last.at_work());
        let mut near = at_work
            .filter(|teammate| is_shorter(teammate.position - position, range_m))
            .peekable();
        if near.peek().is_none() {
            self.clear_area = Some((position, range_m));
            return None;
        }
        let distance = |place: &Vec2| length(*place - position);
        near.filter(|teammate| is_fresh(teammate, now))
            .map(|teammate| teammate.position)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

impl LastHeartbeat {
    fn at_work(&self) -> Option<Teammate> {
        let position = self.position.filter(|_| self.works)?;
        Some(Teammate {
            position,
            received_at: self.sent,
        })
    }
}

/// Checks whether a position is recent enough to be used.
fn is_fresh(teammate: &Teammate, now: SimTime) -> bool {
    now.since(teammate.received_at) < POSITION_EXPIRES
}

#[cfg(test)]
mod tests {
    use proto::mission::SharedKnowledge;
    use proto::team::BroadcastContent;
    use scenario::ids::TaskId;

    use super::*;

    const HERE: Vec2 = Vec2::new(2.0, 3.0);

    fn idle() -> Heartbeat {
        Heartbeat {
            state: TaskState::Idle,
            since: SimTime::ZERO,
            set: None,
            task: None,
            progress: 0,
            position: Some(HERE),
            carrying: false,
            shared_knowledge: SharedKnowledge::default(),
        }
    }

    fn working(carrying: bool) -> Heartbeat {
        Heartbeat {
            state: TaskState::Executing,
            task: Some(TaskId(1)),
            carrying,
            ..idle()
        }
    }

    /// Delivers a heartbeat of an incarnation, sent and received after these times, ms. The sequence number is the time
    /// of sending.
    fn deliver(
        teammates: &mut Teammates,
        (sender, incarnation): (u32, Incarnation),
        (sent_ms, received_ms): (u64, u64),
        heartbeat: Heartbeat,
    ) -> HeartbeatRelevance {
        let broadcast = Broadcast {
            sender: RobotId(sender),
            incarnation,
            tick: 0,
            index: 0,
            seq: sent_ms,
            sent: SimTime(sent_ms),
            body: BroadcastContent::Heartbeat(heartbeat.clone()),
        };
        teammates.receive(SimTime(received_ms), &broadcast, &heartbeat, || true)
    }

    /// Silence starts at reception, and a position ages from its sending.
    #[test]
    fn the_place_of_a_silent_carrier_is_given_once() {
        let mut teammates = Teammates::default();
        deliver(&mut teammates, (1, 1), (10_000, 12_000), working(true));
        deliver(&mut teammates, (2, 1), (9_000, 10_000), working(false));
        let nearest = teammates.nearest_at_work(HERE, 1.0, SimTime(13_000));
        assert_eq!(nearest, None);
        for (now_ms, places) in [(17_000, &[][..]), (17_001, &[HERE]), (17_002, &[])] {
            let taken = teammates.take_silent_carriers(SimTime(now_ms), SimTime(5_000));
            assert_eq!(taken, places, "at {now_ms} ms");
        }
    }

    #[test]
    fn a_new_incarnation_of_a_carrier_has_lost_its_load() {
        let mut teammates = Teammates::default();
        for (incarnation, sent_ms, heartbeat, lost) in [
            (1, 10, working(true), None),
            (1, 11, working(true), None),
            (2, 12, idle(), Some(HERE)),
            (3, 13, idle(), None),
        ] {
            let times = (sent_ms, sent_ms);
            let news = deliver(&mut teammates, (1, incarnation), times, heartbeat);
            assert_eq!(news, HeartbeatRelevance::Latest { lost });
        }
    }

    #[test]
    fn messages_older_than_the_latest_are_ignored() {
        let mut known = Teammates::default();
        deliver(&mut known, (1, 2), (10, 10), working(true));
        for (sender, incarnation, sent_ms, is_news) in [
            (1, 2, 9, false),
            (1, 1, 11, false),
            (1, 2, 11, true),
            (1, 3, 0, true),
            (2, 1, 0, true),
        ] {
            let mut teammates = known.clone();
            let from = (sender, incarnation);
            let news = deliver(&mut teammates, from, (sent_ms, 20), idle());
            assert_eq!(news != HeartbeatRelevance::None, is_news);
            assert_eq!(teammates != known, is_news);
        }
    }

    #[test]
    fn lower_ranks_at_work_have_the_right_of_way_while_their_position_is_fresh() {
        let mut teammates = Teammates::default();
        for (sender, heartbeat) in [(0, working(false)), (1, idle()), (2, working(false))] {
            deliver(&mut teammates, (sender, 1), (10_000, 10_000), heartbeat);
        }
        for (robot, now_ms, expected) in [
            (0, 10_000, 0),
            (1, 10_000, 1),
            (2, 10_000, 1),
            (3, 10_000, 2),
            (3, 13_000, 0),
        ] {
            let first = teammates.right_of_way(RobotId(robot), SimTime(now_ms));
            assert_eq!(first.count(), expected, "robot {robot} at {now_ms} ms");
        }
        let mut nearest = |ms| teammates.nearest_at_work(HERE, 1.0, SimTime(ms));
        assert_eq!([nearest(10_000), nearest(13_000)], [Some(HERE), None]);
    }

    #[test]
    fn an_approaching_teammate_is_detected_after_a_long_absence() {
        let mut teammates = Teammates::default();
        let (now, far) = (SimTime(10_000), HERE + Vec2::splat(2.0));
        let near = HERE + Vec2::new(0.5, 0.0);
        for (seq, at) in [(9_997, far), (9_998, near), (9_999, far)] {
            let position = Some(at);
            let heartbeat = Heartbeat {
                position,
                ..working(false)
            };
            deliver(&mut teammates, (1, 1), (seq, now.0), heartbeat);
            let nearest = teammates.nearest_at_work(HERE, 1.0, now);
            assert_eq!(nearest, position.filter(|at| *at == near));
        }
        // Seen from elsewhere, the other place is near.
        assert_eq!(teammates.nearest_at_work(far, 1.0, now), Some(far));
    }
}

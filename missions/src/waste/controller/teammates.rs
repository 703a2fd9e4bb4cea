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

    /// Delivers a heartbeat of a robot's `incarnation`, sent after the given number of seconds.
    fn deliver(
        teammates: &mut Teammates,
        sender: u16,
        incarnation: Incarnation,
        seconds: u64,
        carrying: bool,
        executes: bool,
    ) -> Option<Vec2> {
        let heartbeat = Heartbeat {
            state: if executes {
                TaskState::Executing
            } else {
                TaskState::Idle
            },
            task: executes.then_some(TaskId(1)),
            carrying,
            ..idle()
        };
        let broadcast = Broadcast {
            sender: RobotId(sender),
            incarnation,
            tick: 0,
            index: 0,
            seq: seconds,
            sent: SimTime(seconds * 1000),
            body: BroadcastContent::Heartbeat(heartbeat.clone()),
        };
        match teammates.receive(broadcast.sent, &broadcast, &heartbeat, || true) {
            HeartbeatRelevance::Latest { lost } => lost,
            HeartbeatRelevance::None => panic!("the heartbeat is new"),
        }
    }

    #[test]
    fn the_place_of_a_silent_carrier_is_given_once() {
        let mut teammates = Teammates::default();
        deliver(&mut teammates, 1, 1, 10, true, true);
        deliver(&mut teammates, 2, 1, 10, false, true);
        let silence = SimTime(5_000);
        assert!(
            teammates
                .take_silent_carriers(SimTime(15_000), silence)
                .is_empty()
        );
        assert_eq!(
            teammates.take_silent_carriers(SimTime(15_001), silence),
            [HERE]
        );
        assert!(
            teammates
                .take_silent_carriers(SimTime(15_002), silence)
                .is_empty()
        );
    }

    #[test]
    fn a_new_incarnation_of_a_carrier_has_lost_its_load() {
        let mut teammates = Teammates::default();
        assert_eq!(deliver(&mut teammates, 1, 1, 10, true, true), None);
        assert_eq!(deliver(&mut teammates, 1, 1, 11, true, true), None);
        assert_eq!(deliver(&mut teammates, 1, 2, 12, false, false), Some(HERE));
        assert_eq!(deliver(&mut teammates, 1, 3, 13, false, false), None);
    }

    #[test]
    fn messages_older_than_the_latest_are_ignored() {
        let mut teammates = Teammates::default();
        let message = |sender, incarnation, seq| Broadcast {
            sender: RobotId(sender),
            incarnation,
            tick: 0,
            index: 0,
            seq,
            sent: SimTime::ZERO,
            body: BroadcastContent::Heartbeat(idle()),
        };
        let is_news = |teammates: &Teammates, broadcast: Broadcast| {
            let news = teammates
                .clone()
                .receive(SimTime::ZERO, &broadcast, &idle(), || true);
            news != HeartbeatRelevance::None
        };
        assert!(is_news(&teammates, message(1, 2, 9)));
        deliver(&mut teammates, 1, 2, 10, true, true);
        let known = teammates.clone();
        for (incarnation, seq) in [(2, 9), (1, 11)] {
            let late = message(1, incarnation, seq);
            let news = teammates.receive(SimTime::ZERO, &late, &idle(), || true);
            assert_eq!((news, &teammates), (HeartbeatRelevance::None, &known));
        }
        assert!(is_news(&teammates, message(1, 2, 11)));
        assert!(is_news(&teammates, message(1, 3, 0)));
        assert!(is_news(&teammates, message(2, 1, 0)));
    }

    #[test]
    fn silence_starts_at_reception_and_a_position_ages_from_its_sending() {
        let mut teammates = Teammates::default();
        let heartbeat = Heartbeat {
            state: TaskState::Executing,
            task: Some(TaskId(1)),
            carrying: true,
            ..idle()
        };
        let late = Broadcast {
            sender: RobotId(0),
            incarnation: 1,
            tick: 0,
            index: 0,
            seq: 0,
            sent: SimTime(10_000),
            body: BroadcastContent::Heartbeat(heartbeat.clone()),
        };
        teammates.receive(SimTime(12_000), &late, &heartbeat, || true);
        assert!(
            teammates
                .nearest_at_work(HERE, 1.0, SimTime(13_000))
                .is_none()
        );
        let silence = SimTime(5_000);
        assert!(
            teammates
                .take_silent_carriers(SimTime(17_000), silence)
                .is_empty()
        );
        assert_eq!(
            teammates.take_silent_carriers(SimTime(17_001), silence),
            [HERE]
        );
    }

    #[test]
    fn lower_ranks_at_work_have_the_right_of_way_while_their_position_is_fresh() {
        let mut teammates = Teammates::default();
        for sender in [0, 2] {
            deliver(&mut teammates, sender, 1, 10, false, true);
        }
        deliver(&mut teammates, 1, 1, 10, false, false);
        let count = |robot, ms| teammates.right_of_way(RobotId(robot), SimTime(ms)).count();
        assert_eq!(count(0, 10_000), 0);
        assert_eq!(count(1, 10_000), 1);
        assert_eq!(count(2, 10_000), 1);
        assert_eq!(count(3, 10_000), 2);
        assert_eq!(count(3, 13_000), 0);
        assert_eq!(
            teammates.nearest_at_work(HERE, 1.0, SimTime(10_000)),
            Some(HERE)
        );
        assert_eq!(teammates.nearest_at_work(HERE, 1.0, SimTime(13_000)), None);
    }

    #[test]
    fn an_approaching_teammate_is_detected_after_a_long_absence() {
        let mut teammates = Teammates::default();
        let work_at = |teammates: &mut Teammates, seq, position| {
            let heartbeat = Heartbeat {
                state: TaskState::Executing,
                task: Some(TaskId(1)),
                position: Some(position),
                ..idle()
            };
            let broadcast = Broadcast {
                sender: RobotId(1),
                incarnation: 1,
                tick: 0,
                index: 0,
                seq,
                sent: SimTime(10_000),
                body: BroadcastContent::Heartbeat(heartbeat.clone()),
            };
            teammates.receive(SimTime(10_000), &broadcast, &heartbeat, || true);
        };
        let (now, far) = (SimTime(10_000), HERE + Vec2::splat(2.0));
        let near = HERE + Vec2::new(0.5, 0.0);
        let nearest = |teammates: &mut Teammates| teammates.nearest_at_work(HERE, 1.0, now);
        work_at(&mut teammates, 0, far);
        assert_eq!(nearest(&mut teammates), None);
        work_at(&mut teammates, 1, near);
        assert_eq!(nearest(&mut teammates), Some(near));
        work_at(&mut teammates, 2, far);
        assert_eq!(nearest(&mut teammates), None);
        // Seen from elsewhere, the other place is near.
        assert_eq!(teammates.nearest_at_work(far, 1.0, now), Some(far));
    }
}

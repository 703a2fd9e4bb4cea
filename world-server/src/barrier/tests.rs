//! Random event sequences against a second, naive model of the barrier, and named special cases.

mod process_faults;

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use proto::join::Refusal;
use proto::readings::Actuation;
use proto::tick::{ManifestEntry, TickMessage};

use super::*;

use Verdict::{Counted, SilenceEnded, Stale};

use StepOrder::{InOrder, Simultaneous};

/// A team of this size in which all robots receive each other.
struct All(u32);

impl RadioReach for All {
    fn for_each_receiver(&self, _: RobotId, receive: impl FnMut(RobotId)) {
        (0..self.0).map(RobotId).for_each(receive);
    }
}

/// An event of the barrier. Robots are given by rank.
#[derive(Clone, Debug)]
enum Action {
    Invite(u32),
    /// The token of an incarnation appears; the number counts back from the latest incarnation.
    Arrive(u32, u32),
    /// The token of an incarnation disappears; the number counts back from the latest incarnation.
    Gone(u32, u32),
    Stall(u32),
    Ask,
    /// A correct answer with this number of broadcasts.
    Answer(u32, u16),
    /// A report with a wrong incarnation and tick, each as distance from the correct value plus one.
    Stray(u32, u32, u64, u16),
    /// The end of the tick, if the tick is complete.
    Finish,
}

fn action() -> impl Strategy<Value = Action> {
    let robot = || 0..4_u32;
    prop_oneof![
        2 => robot().prop_map(Action::Invite),
        2 => (robot(), 0..2_u32).prop_map(|(robot, ago)| Action::Arrive(robot, ago)),
        1 => (robot(), 0..2_u32).prop_map(|(robot, ago)| Action::Gone(robot, ago)),
        1 => robot().prop_map(Action::Stall),
        6 => Just(Action::Ask),
        9 => (robot(), 0..3_u16).prop_map(|(robot, count)| Action::Answer(robot, count)),
        2 => (robot(), 0..3_u32, 0..3_u64, prop_oneof![0..3_u16, Just(u16::MAX)])
            .prop_map(|(robot, incarnation, tick, count)| Action::Stray(robot, incarnation, tick, count)),
        6 => Just(Action::Finish),
    ]
}

fn order() -> impl Strategy<Value = StepOrder> {
    prop_oneof![Just(Simultaneous), Just(InOrder)]
}

fn report(robot: RobotId, incarnation: Incarnation, tick: Tick, broadcasts: u16) -> Report {
    Report {
        robot,
        incarnation,
        tick,
        actuation: Actuation::default(),
        broadcasts,
        broadcast_bytes: 100 * u32::from(broadcasts),
        active: None,
        allocation: Vec::new(),
        motivations: Vec::new(),
        changes: Vec::new(),
        notes: Vec::new(),
        receptions: Vec::new(),
    }
}

/// A barrier and a record of its observed behavior.
struct Watched {
    barrier: Barrier,
    order: StepOrder,
    robots: u32,
    /// All counted reports, by tick and rank.
    counted: BTreeMap<(Tick, u32), Report>,
    /// Robots whose answer to the current tick is due.
    awaited: BTreeSet<u32>,
    /// Robots that were sent the current tick, in that order.
    asked: Vec<u32>,
    /// The first tick that each incarnation was promised.
    promised: BTreeMap<(u32, Incarnation), Tick>,
}

impl Watched {
    fn new(robots: u32, order: StepOrder) -> Self {
        let team: Vec<Robot> = (0..robots)
            .map(|rank| Robot {
                name: format!("robot-{rank}"),
                ..Robot::default()
            })
            .collect();
        Self {
            barrier: Barrier::new(&team, order),
            order,
            robots,
            counted: BTreeMap::new(),
            awaited: BTreeSet::new(),
            asked: Vec::new(),
            promised: BTreeMap::new(),
        }
    }

    /// Creates a barrier whose robots have all arrived.
    fn running(robots: u32, order: StepOrder) -> Self {
        let mut watched = Self::new(robots, order);
        for robot in 0..robots {
            watched.invite(robot);
            watched.arrive(robot, 0);
        }
        assert!(watched.barrier.started());
        watched
    }

    fn incarnation(&self, robot: u32) -> Incarnation {
        self.barrier.places[robot as usize].incarnation
    }

    /// Returns the latest tick in which that incarnation counted.
    fn last_counted(&self, robot: u32, incarnation: Incarnation) -> Option<Tick> {
        let of_robot = self
            .counted
            .iter()
            .rev()
            .filter(|((_, rank), _)| *rank == robot);
        of_robot
            .map(|((tick, _), report)| (*tick, report.incarnation))
            .find(|(_, counted)| *counted == incarnation)
            .map(|(tick, _)| tick)
    }

    fn perform(&mut self, action: &Action) {
        let within = |robot: u32| robot % self.robots;
        match *action {
            Action::Invite(robot) => self.invite(within(robot)),
            Action::Arrive(robot, ago) => self.arrive(within(robot), ago),
            Action::Gone(robot, ago) => self.gone(within(robot), ago),
            Action::Stall(robot) => self.stall(within(robot)),
            Action::Ask => drop(self.ask()),
            Action::Answer(robot, broadcasts) => {
                let (robot, tick) = (within(robot), self.barrier.tick());
                self.report(robot, self.incarnation(robot), tick, broadcasts);
            }
            Action::Stray(robot, offset, tick, broadcasts) => {
                let robot = within(robot);
                let incarnation = (self.incarnation(robot) + offset).saturating_sub(1);
                let tick = (self.barrier.tick() + tick).saturating_sub(1);
                self.report(robot, incarnation, tick, broadcasts);
            }
            Action::Finish => {
                if self.barrier.is_complete() {
                    self.finish();
                }
            }
        }
        for robot in self.barrier.robots() {
            let awaited = self.awaited.contains(&robot.0);
            assert_eq!(
                self.barrier.is_awaited(robot),
                awaited,
                "{robot} after {action:?}"
            );
        }
    }

    fn invite(&mut self, robot: u32) {
        let before = self.incarnation(robot);
        if let Ok((id, incarnation, first)) = self.barrier.invite(&format!("robot-{robot}")) {
            assert_eq!((id, incarnation), (RobotId(robot), before + 1));
            assert!(
                !self.awaited.contains(&robot),
                "the robot of a live agent was offered again"
            );
            self.promised.insert((robot, incarnation), first);
        }
    }

    fn arrive(&mut self, robot: u32, ago: u32) {
        let incarnation = self.incarnation(robot).saturating_sub(ago);
        self.barrier.arrive(RobotId(robot), incarnation);
        self.barrier.start_if_all_arrived();
    }

    fn gone(&mut self, robot: u32, ago: u32) {
        let incarnation = self.incarnation(robot).saturating_sub(ago);
        self.barrier.agent_lost(RobotId(robot), incarnation, true);
        if incarnation == self.incarnation(robot) {
            self.awaited.remove(&robot);
        }
    }

    fn stall(&mut self, robot: u32) {
        self.barrier.stall(RobotId(robot));
        self.awaited.remove(&robot);
    }

    /// Checks that a report counts if and only if it is the first answer of an agent that was sent the tick.
    fn report(
        &mut self,
        robot: u32,
        incarnation: Incarnation,
        tick: Tick,
        broadcasts: u16,
    ) -> Verdict {
        let correct = incarnation == self.incarnation(robot) && tick == self.barrier.tick();
        let counts = self.awaited.contains(&robot) && correct && broadcasts <= MAX_BROADCASTS;
        let report = report(RobotId(robot), incarnation, tick, broadcasts);
        let verdict = self.barrier.report(&report);
        assert_eq!(verdict == Counted, counts, "{report:?} is {verdict:?}");
        if counts {
            let earlier = self.counted.insert((tick, robot), report);
            assert_eq!(earlier, None, "counted twice");
            self.awaited.remove(&robot);
        }
        verdict
    }

    /// Returns the robots that the barrier sends the tick to, with the manifest of each.
    fn ask(&mut self) -> Vec<(RobotId, Vec<ManifestEntry>)> {
        let mut questions = Vec::new();
        while let Some(question) = self.barrier.next_recipient(&All(self.robots)) {
            let message = message(&mut self.barrier, question);
            let mut manifest = message.manifest;
            sort_manifest(&mut manifest);
            let robot = question.0;
            assert!(!self.asked.contains(&robot), "asked twice in a tick");
            if self.order == InOrder {
                assert!(
                    self.awaited.is_empty(),
                    "asked while another robot's answer is due"
                );
                assert!(
                    self.asked.last().is_none_or(|last| *last < robot),
                    "out of order"
                );
            }
            self.asked.push(robot);
            self.awaited.insert(robot);
            let incarnation = message.incarnation;
            assert_eq!(incarnation, self.incarnation(robot));
            assert!(
                self.promised[&(robot, incarnation)] <= self.barrier.tick(),
                "before its first tick"
            );
            assert_eq!(message.last_counted, self.last_counted(robot, incarnation));
            assert_eq!(manifest, self.expected_manifest(robot, incarnation));
            questions.push((question, manifest));
        }
        questions
    }

    /// Returns the expected manifest of a robot in the current tick: all counted broadcasts since its last step. It is empty if the
    /// robot did not count in the previous tick.
    fn expected_manifest(&self, robot: u32, incarnation: Incarnation) -> Vec<ManifestEntry> {
        let now = self.barrier.tick();
        let counted_before = now > 0 && self.last_counted(robot, incarnation) == Some(now - 1);
        let receives = |tick: Tick, sender: u32| match self.order {
            Simultaneous => counted_before && tick + 1 == now,
            InOrder => {
                (counted_before && tick + 1 == now && sender > robot)
                    || (tick == now && sender < robot)
            }
        };
        let mut expected: Vec<ManifestEntry> = self
            .counted
            .iter()
            .filter(|((tick, sender), report)| {
                *sender != robot && report.broadcasts > 0 && receives(*tick, *sender)
            })
            .map(|((tick, sender), report)| ManifestEntry {
                sender: RobotId(*sender),
                tick: *tick,
                incarnation: report.incarnation,
                count: report.broadcasts,
                link: None,
            })
            .collect();
        expected.sort_unstable_by_key(|entry| (entry.sender, entry.tick));
        expected
    }

    fn finish(&mut self) -> TickResult {
        let tick = self.barrier.tick();
        assert!(self.awaited.is_empty(), "ended while an answer was due");
        let mut gathered = TickResult::default();
        self.barrier.finish(&All(self.robots), &mut gathered);
        assert_eq!(self.barrier.tick(), tick + 1);
        for (rank, counted) in gathered.counted.iter().enumerate() {
            assert_eq!(*counted, self.counted.contains_key(&(tick, rank as u32)));
        }
        let mut died = Vec::new();
        for input in &gathered.inputs {
            if let Input::Gone {
                robot,
                incarnation,
                last_counted,
                ..
            } = input
            {
                let rank = self
                    .barrier
                    .places
                    .iter()
                    .position(|place| place.name == *robot);
                let rank = rank.unwrap() as u32;
                assert_eq!(*last_counted, self.last_counted(rank, *incarnation));
                died.push(RobotId(rank));
            }
        }
        died.sort_unstable();
        assert_eq!(gathered.dead, died);
        self.asked.clear();
        gathered
    }

    /// Checks that the barrier waits only for robots that were sent the tick: without them the tick ends.
    fn check_progress_without_answers(&mut self) {
        for _ in 0..=self.robots {
            self.ask();
            for robot in std::mem::take(&mut self.awaited) {
                self.barrier.stall(RobotId(robot));
            }
        }
        assert!(
            !self.barrier.started() || self.barrier.is_complete() || self.barrier.is_idle(),
            "no answer is due and the tick does not end"
        );
    }
}

proptest! {
    #[test]
    fn no_report_counts_twice_and_uncounted_broadcasts_are_not_received(
        robots in 1..=4_u32,
        order in order(),
        started in prop::bool::weighted(0.8),
        actions in prop::collection::vec(action(), 0..200),
    ) {
        let mut watched = if started {
            Watched::running(robots, order)
        } else {
            Watched::new(robots, order)
        };
        for action in &actions {
            watched.perform(action);
        }
        watched.check_progress_without_answers();
    }
}

#[test]
fn the_clock_starts_when_the_last_robot_arrives_in_any_order() {
    for arrivals in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
        let mut watched = Watched::new(3, Simultaneous);
        for (already, robot) in arrivals.into_iter().enumerate() {
            assert!(!watched.barrier.started(), "with {already} of 3");
            assert_eq!(watched.ask(), []);
            watched.invite(robot);
            watched.arrive(robot, 0);
        }
        assert_eq!(watched.ask().len(), 3);
        for robot in arrivals {
            assert_eq!(watched.report(robot, 1, 0, 0), Counted);
        }
        // The order of arrival does not change the log.
        let joined = |rank: u32| Input::Join {
            robot: format!("robot-{rank}"),
            incarnation: 1,
            moment: None,
            scripted: false,
        };
        assert_eq!(watched.finish().inputs, [joined(0), joined(1), joined(2)]);
    }
}

#[test]
fn an_unknown_robot_and_a_taken_one_are_refused() {
    let mut watched = Watched::running(2, Simultaneous);
    assert_eq!(
        watched.barrier.invite("robot-7"),
        Err(Refusal::UnknownRobot {
            robot: "robot-7".to_owned(),
            known: vec!["robot-0".to_owned(), "robot-1".to_owned()],
        })
    );
    assert_eq!(
        watched.barrier.invite("robot-1"),
        Err(Refusal::Taken {
            robot: "robot-1".to_owned(),
            incarnation: 1,
        })
    );
}

#[test]
fn a_silent_robot_receives_nothing_until_it_takes_part_again() {
    let mut watched = Watched::running(2, Simultaneous);
    watched.ask();
    watched.report(0, 1, 0, 1);
    watched.stall(1);
    watched.finish();
    watched.ask();
    assert_eq!(
        watched.report(1, 1, 0, 5),
        SilenceEnded,
        "late, and not counted"
    );
    watched.report(0, 1, 1, 1);
    watched.finish();
    let questions = watched.ask();
    assert_eq!(questions[0].1, [], "uncounted broadcasts are not received");
    assert_eq!(questions[1].1, []);
    watched.report(0, 1, 2, 1);
    watched.report(1, 1, 2, 0);
    watched.finish();
    assert_eq!(watched.ask()[1].1.len(), 1);
}

#[test]
fn without_agents_the_clock_stands_and_a_new_agent_enters_the_current_tick() {
    let mut watched = Watched::running(1, Simultaneous);
    watched.ask();
    watched.gone(0, 0);
    watched.finish();
    assert!(watched.barrier.is_idle() && watched.barrier.has_no_agents());
    assert!(!watched.barrier.is_complete());
    watched.invite(0);
    assert_eq!(watched.promised[&(0, 2)], 1);
    watched.arrive(0, 0);
    let (robot, _) = watched.ask()[0];
    assert_eq!(watched.barrier.incarnation(robot), Some(2));
    assert_eq!(watched.barrier.tick(), 1);
}

#[test]
fn a_replayed_report_does_not_end_a_silence() {
    let mut watched = Watched::running(2, Simultaneous);
    watched.ask();
    watched.report(0, 1, 0, 0);
    watched.report(1, 1, 0, 0);
    watched.finish();
    watched.ask();
    watched.stall(1);
    assert_eq!(watched.report(1, 1, 0, 0), Stale);
    assert_eq!(watched.report(1, 1, 1, 0), SilenceEnded);
}

/// Returns the barrier's part of the message to a robot that the tick is sent to.
fn message(barrier: &mut Barrier, robot: RobotId) -> TickMessage {
    let mut message = TickMessage::default();
    barrier.places[robot.index()].address(barrier.tick, &mut message);
    message
}

/// Sends the tick to all robots and answers for them with one broadcast each. Returns the senders in each robot's manifest.
fn step_all(barrier: &mut Barrier) -> Vec<(RobotId, Vec<RobotId>)> {
    let mut received = Vec::new();
    while let Some(question) = barrier.next_recipient(&All(2)) {
        let mut message = message(barrier, question);
        sort_manifest(&mut message.manifest);
        let senders = message.manifest.iter().map(|entry| entry.sender);
        received.push((question, senders.collect()));
        let answer = report(question, message.incarnation, barrier.tick(), 1);
        assert_eq!(barrier.report(&answer), Counted);
    }
    received
}

fn finish(barrier: &mut Barrier) -> TickResult {
    let mut gathered = TickResult::default();
    barrier.finish(&All(2), &mut gathered);
    gathered
}

#[test]
fn an_agent_that_was_given_up_may_arrive_unless_another_has_the_place() {
    for is_taken in [false, true] {
        let mut barrier = Watched::new(2, Simultaneous).barrier;
        for name in ["robot-0", "robot-1"] {
            barrier.invite(name).unwrap();
        }
        barrier.arrive(RobotId(0), 1);
        barrier.give_up(RobotId(1), 1);
        assert_eq!(barrier.presence(RobotId(1)), Presence::Empty);
        if is_taken {
            assert_eq!(barrier.invite("robot-1").unwrap().1, 2);
        }
        barrier.arrive(RobotId(1), 1);
        assert_eq!(barrier.start_if_all_arrived(), !is_taken);
        if is_taken {
            barrier.arrive(RobotId(1), 2);
            assert!(barrier.start_if_all_arrived());
        }
        assert_eq!(step_all(&mut barrier).len(), 2);
        // A dead agent is not expected any more.
        let incarnation = barrier.incarnation(RobotId(1)).unwrap();
        barrier.agent_lost(RobotId(1), incarnation, true);
        finish(&mut barrier);
        barrier.arrive(RobotId(1), incarnation);
        assert_eq!(barrier.presence(RobotId(1)), Presence::Empty);
    }
}

#[test]
fn the_clock_starts_without_robots_that_died_before_they_arrived_if_any_is_present() {
    let mut barrier = Watched::new(2, Simultaneous).barrier;
    barrier.start_without(RobotId(0));
    barrier.start_without(RobotId(1));
    assert!(!barrier.start_if_all_arrived(), "no robot is present");
    barrier.invite("robot-0").unwrap();
    assert!(!barrier.start_if_all_arrived(), "one is joining");
    barrier.arrive(RobotId(0), 1);
    assert!(barrier.start_if_all_arrived());
    assert_eq!(step_all(&mut barrier).len(), 1);
    let inputs = finish(&mut barrier).inputs;
    let gone = |input: &Input| matches!(input, Input::Gone { robot, incarnation: 0, .. } if robot == "robot-1");
    assert!(inputs.len() == 2 && inputs.iter().any(gone), "{inputs:?}");
    // Like any dead robot, it may come back.
    assert_eq!(barrier.invite("robot-1").unwrap(), (RobotId(1), 1, 2));
}

//! Rows with cached parts are equal to rows that are encoded anew.

use proptest::prelude::*;
use proto::telemetry::AllocationRow;

use super::*;

/// Mostly returns the usual value, because a tick often differs from the previous one in a single value.
fn mostly<T: Clone + std::fmt::Debug + 'static>(
    usual: T,
    others: Vec<T>,
) -> impl Strategy<Value = T> {
    prop_oneof![8 => Just(usual), 1 => prop::sample::select(others)]
}

fn any_motivation() -> impl Strategy<Value = Motivation> {
    let real = || mostly(0.0, vec![-0.0, 1.0 / 3.0]);
    let flag = || mostly(true, vec![false]);
    (
        mostly(0, vec![1]),
        [real(), real()],
        [flag(), flag(), flag(), flag()],
        mostly(BehaviorState::Hibernating, vec![BehaviorState::Active]),
    )
        .prop_map(|(set, reals, flags, state)| Motivation {
            set: BehaviorId(set),
            motivation: reals[0],
            impatience: reals[1],
            sensory_feedback: flags[0],
            activity_suppression: flags[1],
            impatience_reset: flags[2],
            acquiescence: flags[3],
            state,
        })
}

fn any_body() -> impl Strategy<Value = BodyRecord> {
    let real = || mostly(0.0_f32, vec![-0.0, 0.1]);
    (
        mostly(true, vec![false]),
        [real(), real(), real(), real()],
        mostly(false, vec![true]),
        mostly(None, vec![Some(0.0), Some(-0.0)]),
        mostly(None, vec![Some(BehaviorId(0)), Some(BehaviorId(1))]),
    )
        .prop_map(
            |(present, [x, y, heading_rad, speed_m_s], carrying, energy_j, active)| BodyRecord {
                present,
                pose: Pose {
                    position: Vec2::new(x, y),
                    heading_rad,
                },
                speed_m_s,
                carrying,
                energy_j,
                active,
            },
        )
}

/// A reception with a final delivery. The team has three robots, so rank 3 is unknown.
fn any_reception() -> impl Strategy<Value = Reception> {
    let summary = (
        mostly(0, vec![1]),
        mostly(BroadcastKind::Heartbeat, vec![BroadcastKind::FirstBulletin]),
        mostly(None, vec![Some(TaskState::Idle)]),
        mostly(None, vec![Some(SimTime(0))]),
        mostly(None, vec![Some(BehaviorId(0))]),
        mostly(None, vec![Some(TaskId(0))]),
        mostly(None, vec![Some(2)]),
    );
    let summary =
        summary.prop_map(
            |(seq, kind, state, since, set, task, progress)| BroadcastSummary {
                seq,
                kind,
                state,
                since,
                set,
                task,
                progress,
            },
        );
    (
        mostly(0, vec![1, 3]),
        mostly(1, vec![2]),
        mostly(SimTime(0), vec![SimTime(50)]),
        mostly(
            Delivery::Received,
            vec![Delivery::Lost, Delivery::Duplicate],
        ),
        prop_oneof![8 => summary.prop_map(Some), 1 => Just(None)],
    )
        .prop_map(|(sender, incarnation, sent, delivery, summary)| Reception {
            at: SimTime::default(),
            sender: RobotId(sender),
            incarnation,
            sent,
            delivery,
            content: summary,
        })
}

fn any_allocation() -> impl Strategy<Value = AllocationRow> {
    (
        mostly(0, vec![1]),
        mostly(0, vec![1]),
        mostly(0.5, vec![-0.0, 1.0 / 3.0]),
        mostly(None, vec![Some(BLUE), Some(GOLD)]),
    )
        .prop_map(|(task, behavior, utility, holder)| AllocationRow {
            task: TaskId(task),
            behavior: BehaviorId(behavior),
            utility,
            holder,
            state: BehaviorState::Hibernating,
        })
}

type ReportParts = (Vec<Motivation>, Vec<AllocationRow>, Vec<Reception>);

prop_compose! {
    /// A robot's body, and its report if it counts.
    fn any_robot()(
        body in any_body(),
        counts in mostly(true, vec![false]),
        motivations in prop::collection::vec(any_motivation(), 0..3),
        allocation in prop::collection::vec(any_allocation(), 0..3),
        receptions in prop::collection::vec(any_reception(), 0..3),
    ) -> (BodyRecord, Option<ReportParts>) {
        (body, counts.then_some((motivations, allocation, receptions)))
    }
}

prop_compose! {
    /// A run of some ticks with any reports of its robots.
    pub fn any_run()(
        run in prop::collection::vec([any_robot(), any_robot(), any_robot()], 1..8),
    ) -> Vec<OwnedTick> {
        (0..).zip(run).map(|(tick, robots)| {
            let mut owned = OwnedTick { tick, now: SimTime(tick * 50), ..sample()[2].clone() };
            owned.robots = (0..).map(RobotId).zip(robots).map(|(robot, (body, parts))| {
                (body, parts.map(|(motivations, allocation, mut receptions)| {
                    receptions.iter_mut().for_each(|reception| reception.at = owned.now);
                    let report = Report { motivations, allocation, receptions, ..report(robot, tick) };
                    (Readings::default(), report)
                }))
            }).collect();
            owned
        }).collect()
    }
}

proptest! {
    #[test]
    fn rows_of_a_tick_do_not_depend_on_earlier_ticks(
        ticks in any_run(),
    ) {
        let (_, together) = log(LogLevel::Full, &ticks);
        let alone = ticks.iter().map(|tick| log(LogLevel::Full, std::slice::from_ref(tick)).1);
        let alone: Vec<_> = alone.collect();
        for table in [Table::Motivations, Table::Allocation, Table::Messages, Table::Poses] {
            let rows = |log: &MemoryLog| {
                let rows = log.tables.get(&table).map(|rows| &rows[header(table).len()..]);
                rows.unwrap_or_default().to_vec()
            };
            let expected: Vec<u8> = alone.iter().flat_map(rows).collect();
            prop_assert_eq!(
                String::from_utf8(rows(&together)).unwrap(),
                String::from_utf8(expected).unwrap()
            );
        }
    }
}

//! Round trips of every message; malformed bytes are rejected without a panic.

use glam::Vec2;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

use super::*;
use crate::allocation::ble::{Eligibility, EligibleTask};
use crate::allocation::murdoch::{AuctionId, ContractStatus, Negotiation, NegotiationKind};
use crate::allocation::{AllocationMessage, OpenMessage};
use crate::control::{AgentState, ClockStatus, FaultStatus, Phase};
use crate::join::{JoinReply, JoinRequest, Refusal, Welcome};
use crate::link::{LinkState, Probability};
use crate::mission::items::{
    Fact, Gripper, ItemsAction, ItemsBulletin, ItemsKnowledge, ItemsReading, Locations, LooseItem,
    Withdrawal, Zone,
};
use crate::mission::{Action, Bytes, Payload, SensorReading, SharedKnowledge};
use crate::process::{ProcessNews, ProcessState};
use crate::readings::{Actuation, Ground, Hit, Pose, Proximity, Readings};
use crate::team::{
    Broadcast, BroadcastContent, BroadcastKind, Bulletin, BulletinKind, BulletinSubject, Heartbeat,
    TaskState,
};
use crate::telemetry::{
    AllocationRow, BehaviorState, BroadcastSummary, Delivery, Motivation, Note, NoteKind, Reason,
    Reception, StateChange,
};
use crate::tick::{ManifestEntry, Outcome, Report, TaskOffer, TickMessage, ToAgent};
use crate::view::{
    BehaviorView, ItemView, LevelUnit, Mark, MarkOutline, MarkRole, MessageView, RobotView, View,
    Work,
};
use scenario::Obstacle;
use scenario::fault::{Fault, Order};
use scenario::ids::{BehaviorId, ItemId, RobotId, TaskId};
use scenario::time::SimTime;

fn robot() -> impl Strategy<Value = RobotId> {
    any::<u16>().prop_map(RobotId)
}

fn set() -> impl Strategy<Value = BehaviorId> {
    any::<u16>().prop_map(BehaviorId)
}

fn task() -> impl Strategy<Value = TaskId> {
    any::<u16>().prop_map(TaskId)
}

fn time() -> impl Strategy<Value = SimTime> {
    any::<u64>().prop_map(SimTime)
}

/// Any number except NaN, which does not equal itself.
fn real() -> impl Strategy<Value = f32> {
    use prop::num::f32::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

fn point() -> impl Strategy<Value = Vec2> {
    (real(), real()).prop_map(|(x, y)| Vec2::new(x, y))
}

fn pose() -> impl Strategy<Value = Pose> {
    (point(), real()).prop_map(|(position, heading_rad)| Pose {
        position,
        heading_rad,
    })
}

fn proximity() -> impl Strategy<Value = Proximity> {
    let hit = || {
        option::of((real(), real()).prop_map(|(distance_m, normal_rad)| Hit {
            distance_m,
            normal_rad,
        }))
    };
    let three = move || [hit(), hit(), hit()];
    (three(), three(), three()).prop_map(|(ahead, left, right)| Proximity { ahead, left, right })
}

fn readings() -> impl Strategy<Value = Readings> {
    let ground = (real(), real()).prop_map(|(here, ahead)| Ground { here, ahead });
    let devices = (
        option::of(pose()),
        option::of(option::of(real())),
        option::of(option::of(real())),
        option::of(proximity()),
        option::of(ground),
        option::of(real()),
        sensed(),
    );
    devices.prop_map(
        |(pose, front_border, side_border, proximity, ground, energy_j, mission)| Readings {
            pose,
            front_border,
            side_border,
            proximity,
            ground,
            energy_j,
            mission,
        },
    )
}

fn sensed() -> impl Strategy<Value = SensorReading> {
    let zone = prop::sample::select(vec![Zone::None, Zone::Source, Zone::Target]);
    let items = (
        option::of(vec(point(), 0..4).prop_map(|items| items.into_iter().collect())),
        option::of(zone),
        any::<(Option<bool>, Option<bool>)>(),
    );
    prop_oneof![
        Just(SensorReading::Nothing),
        items.prop_map(
            |(items, zone, (at_site, holding))| SensorReading::Items(ItemsReading {
                items,
                zone,
                at_site,
                holding,
            })
        ),
        vec(any::<u8>(), 0..100)
            .prop_map(|bytes| SensorReading::from_bytes(Bytes::encode(&bytes).unwrap())),
    ]
}

fn to_agent() -> impl Strategy<Value = ToAgent> {
    let link = (any::<(bool, bool, f64, f64, f64)>(), time(), time()).prop_map(
        |((cut, hold, drop, duplicate, reorder), delay, jitter)| LinkState {
            cut,
            hold,
            drop: Probability::from_share(drop),
            delay,
            jitter,
            duplicate: Probability::from_share(duplicate),
            reorder: Probability::from_share(reorder),
        },
    );
    let entry = (robot(), any::<(u64, u32, u16)>(), option::of(link)).prop_map(
        |(sender, (tick, incarnation, count), link)| ManifestEntry {
            sender,
            tick,
            incarnation,
            count,
            link: link.map(Box::new),
        },
    );
    let tick = (
        any::<(u32, u64, Option<u64>)>(),
        time(),
        vec(entry, 0..4),
        vec(robot(), 0..4),
        readings(),
    )
        .prop_map(
            |((incarnation, tick, last_counted), now, manifest, held, readings)| {
                Box::new(TickMessage {
                    incarnation,
                    tick,
                    now,
                    last_counted,
                    manifest,
                    held,
                    readings,
                    ground_truth: Vec::new(),
                })
            },
        )
        .boxed();
    let outcome = prop::sample::select(vec![
        Outcome::Complete,
        Outcome::TimeLimit,
        Outcome::Interrupted,
        Outcome::NoRobotLeft,
        Outcome::Expired,
    ]);
    prop_oneof![
        8 => tick.clone().prop_map(ToAgent::Tick),
        1 => (tick, vec(offer(), 0..3)).prop_map(|(tick, ground_truth)| ToAgent::Informed(tick, ground_truth)),
        1 => outcome.prop_map(ToAgent::End),
        1 => any::<u32>().prop_map(ToAgent::Dismissed),
    ]
}

fn offer() -> impl Strategy<Value = TaskOffer> {
    (robot(), any::<(u16, u16, f64)>()).prop_map(|(robot, (behavior, task, utility))| TaskOffer {
        robot,
        behavior: BehaviorId(behavior),
        task: TaskId(task),
        utility,
    })
}

fn fact<T: std::fmt::Debug>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Fact<T>> {
    (value, robot(), time()).prop_map(|(value, seen_by, seen)| Fact {
        value,
        seen_by,
        seen,
    })
}

fn locations() -> impl Strategy<Value = Fact<Locations>> {
    fact((point(), point()).prop_map(|(min, max)| Locations { min, max }))
}

fn withdrawal() -> impl Strategy<Value = Withdrawal> {
    (robot(), time()).prop_map(|(finder, seen)| Withdrawal { finder, seen })
}

fn knowledge() -> impl Strategy<Value = ItemsKnowledge> {
    let loose = (point(), any::<bool>()).prop_map(|(at, present)| LooseItem { at, present });
    (
        option::of(locations()),
        vec(withdrawal(), 0..3),
        vec((any::<u16>(), fact(any::<bool>())), 0..3),
        vec(fact(loose), 0..3),
        option::of(fact(Just(()))),
    )
        .prop_map(
            |(locations, withdrawn, empty, loose, last_report)| ItemsKnowledge {
                locations,
                withdrawn,
                empty,
                loose,
                last_report,
            },
        )
}

fn shared_knowledge() -> impl Strategy<Value = SharedKnowledge> {
    prop_oneof![
        Just(SharedKnowledge::Nothing),
        knowledge().prop_map(SharedKnowledge::Items),
        vec(any::<u8>(), 0..9).prop_map(SharedKnowledge::Open),
    ]
}

fn bulletin() -> impl Strategy<Value = Bulletin> {
    let kind = prop::sample::select(vec![BulletinKind::First, BulletinKind::Second]);
    let about = (task(), set(), any::<u32>()).prop_map(|(task, set, progress)| BulletinSubject {
        task,
        set,
        progress,
    });
    let payload = prop_oneof![
        locations().prop_map(|value| Payload::Items(ItemsBulletin::PositionUpdate(value))),
        withdrawal().prop_map(|value| Payload::Items(ItemsBulletin::Withdrawal(value))),
        vec(any::<u8>(), 0..9).prop_map(Payload::Open),
    ];
    (kind, option::of(about), payload).prop_map(|(kind, about, payload)| Bulletin {
        kind,
        about,
        payload,
    })
}

fn task_state() -> impl Strategy<Value = TaskState> {
    use TaskState::{Executing, Idle, Released, Waiting};
    prop::sample::select(vec![Executing, Waiting, Idle, Released])
}

fn allocation() -> impl Strategy<Value = AllocationMessage> {
    let open = (any::<String>(), vec(any::<u8>(), 0..40))
        .prop_map(|(schema, bytes)| AllocationMessage::Open(OpenMessage { schema, bytes }));
    let eligible =
        (task(), time(), -1e30..1e30_f32).prop_map(|(task, round, utility)| EligibleTask {
            task,
            round,
            utility,
        });
    let eligibility = vec(eligible, 0..20).prop_map(|entries| {
        AllocationMessage::Ble(Eligibility {
            entries: entries.into(),
        })
    });
    let word = prop_oneof![
        time().prop_map(|closes| NegotiationKind::Announce { closes }),
        (-1e30..1e30_f32).prop_map(|utility| NegotiationKind::Bid { utility }),
        robot().prop_map(|winner| NegotiationKind::Renew { winner }),
        (any::<u32>(), 0..3_usize).prop_map(|(progress, status)| NegotiationKind::Ack {
            status: [
                ContractStatus::Ongoing,
                ContractStatus::Done,
                ContractStatus::Abort
            ][status],
            progress,
        }),
    ];
    let auction = (robot(), any::<(u32, u32)>());
    let negotiation = (task(), time(), auction, word).prop_map(
        |(task, round, (auctioneer, (incarnation, number)), word)| {
            AllocationMessage::Murdoch(Negotiation {
                task,
                round,
                auction: AuctionId {
                    auctioneer,
                    incarnation,
                    number,
                },
                word,
            })
        },
    );
    prop_oneof![open, eligibility, negotiation]
}

fn broadcast() -> impl Strategy<Value = Broadcast> {
    let subject = (option::of(set()), option::of(task()), option::of(point()));
    let heartbeat = (
        task_state(),
        time(),
        subject,
        any::<(u32, bool)>(),
        shared_knowledge(),
    )
        .prop_map(
            |(state, since, (set, task, position), (progress, carrying), shared_knowledge)| {
                BroadcastContent::Heartbeat(Heartbeat {
                    state,
                    since,
                    set,
                    task,
                    progress,
                    position,
                    carrying,
                    shared_knowledge,
                })
            },
        );
    let body = prop_oneof![
        heartbeat,
        bulletin().prop_map(BroadcastContent::Bulletin),
        allocation().prop_map(BroadcastContent::Allocation)
    ];
    (robot(), any::<(u32, u64, u16, u64)>(), time(), body).prop_map(
        |(sender, (incarnation, tick, index, seq), sent, body)| Broadcast {
            sender,
            incarnation,
            tick,
            index,
            seq,
            sent,
            body,
        },
    )
}

fn set_state() -> impl Strategy<Value = BehaviorState> {
    prop::sample::select(vec![
        BehaviorState::Hibernating,
        BehaviorState::Waiting,
        BehaviorState::Active,
    ])
}

fn motivation() -> impl Strategy<Value = Motivation> {
    let numbers = (-1e300..1e300, -1e300..1e300);
    (set(), numbers, any::<[bool; 4]>(), set_state()).prop_map(
        |(set, (motivation, impatience), factors, state)| Motivation {
            set,
            motivation,
            impatience,
            sensory_feedback: factors[0],
            activity_suppression: factors[1],
            impatience_reset: factors[2],
            acquiescence: factors[3],
            state,
        },
    )
}

fn change() -> impl Strategy<Value = StateChange> {
    let plain = prop::sample::select(vec![
        Reason::Threshold,
        Reason::NotApplicable,
        Reason::Suppressed,
        Reason::AcquiescedPsi,
        Reason::GaveUpLambda,
        Reason::Arbitration,
        Reason::WaitOver,
        Reason::WaitBound,
    ]);
    let reason = prop_oneof![plain, robot().prop_map(Reason::ResetBy)];
    (set(), set_state(), set_state(), reason).prop_map(|(set, from, to, reason)| StateChange {
        set,
        from,
        to,
        reason,
    })
}

fn note() -> impl Strategy<Value = Note> {
    let mission = any::<u8>().prop_map(NoteKind::Mission);
    let kind = prop_oneof![Just(NoteKind::Progress), Just(NoteKind::Detour), mission];
    (kind, any::<String>()).prop_map(|(kind, detail)| Note { kind, detail })
}

fn reception() -> impl Strategy<Value = Reception> {
    let kind = prop::sample::select(BroadcastKind::ALL.to_vec());
    let about = (option::of(set()), option::of(task()));
    let numbers = any::<(u64, Option<u32>)>();
    let summary = (
        kind,
        option::of(task_state()),
        option::of(time()),
        about,
        numbers,
    )
        .prop_map(
            |(kind, state, since, (set, task), (seq, progress))| BroadcastSummary {
                seq,
                kind,
                state,
                since,
                set,
                task,
                progress,
            },
        );
    let delivery = prop::sample::select(vec![
        Delivery::Heard,
        Delivery::Lost,
        Delivery::Delayed,
        Delivery::Duplicate,
        Delivery::Dropped,
        Delivery::Cut,
        Delivery::Pending,
    ]);
    (
        time(),
        robot(),
        any::<u32>(),
        time(),
        delivery,
        option::of(summary),
    )
        .prop_map(
            |(at, sender, incarnation, sent, delivery, summary)| Reception {
                at,
                sender,
                incarnation,
                sent,
                delivery,
                said: summary,
            },
        )
}

fn allocation_row() -> impl Strategy<Value = AllocationRow> {
    (task(), set(), real(), option::of(robot()), set_state()).prop_map(
        |(task, behavior, utility, holder, state)| AllocationRow {
            task,
            behavior,
            utility: f64::from(utility),
            holder,
            state,
        },
    )
}

fn report() -> impl Strategy<Value = Report> {
    let gripper = prop::sample::select(vec![Gripper::Keep, Gripper::Pick, Gripper::Drop]);
    let action =
        (gripper, any::<bool>()).prop_map(|(gripper, report)| ItemsAction { gripper, report });
    let action = prop_oneof![
        Just(Action::Nothing),
        action.prop_map(Action::Items),
        any::<[u8; 5]>().prop_map(|bytes| Action::Open(Bytes::encode(&bytes).unwrap())),
    ];
    let actuation =
        (real(), real(), action).prop_map(|(speed_m_s, turn_rad_s, action)| Actuation {
            speed_m_s,
            turn_rad_s,
            action,
        });
    let logged = (
        vec(motivation(), 0..4),
        vec(change(), 0..4),
        vec(note(), 0..4),
        vec(reception(), 0..4),
        option::of(set()),
        vec(allocation_row(), 0..4),
    );
    (robot(), any::<(u32, u64, u16, u32)>(), actuation, logged).prop_map(
        |(robot, (incarnation, tick, broadcasts, broadcast_bytes), actuation, logged)| Report {
            robot,
            incarnation,
            tick,
            actuation,
            broadcasts,
            broadcast_bytes,
            motivations: logged.0,
            changes: logged.1,
            notes: logged.2,
            receptions: logged.3,
            active: logged.4,
            allocation: logged.5,
        },
    )
}

fn request() -> impl Strategy<Value = JoinRequest> {
    any::<(u32, String, u32, u128)>().prop_map(|(version, robot, pid, nonce)| JoinRequest {
        version,
        robot,
        pid,
        nonce,
    })
}

fn reply() -> impl Strategy<Value = JoinReply> {
    let welcome = (robot(), any::<(u32, u64, String, Option<Vec<u128>>)>()).prop_map(
        |(robot, (incarnation, first_tick, setup, pairs))| {
            JoinReply::Welcome(Welcome {
                robot,
                incarnation,
                first_tick,
                setup,
                pairs,
            })
        },
    );
    let refusal = prop_oneof![
        any::<(String, Vec<String>)>()
            .prop_map(|(robot, known)| Refusal::UnknownRobot { robot, known }),
        any::<(String, u32)>()
            .prop_map(|(robot, incarnation)| Refusal::Taken { robot, incarnation }),
        any::<(u32, u32)>().prop_map(|(agent, world)| Refusal::Version { agent, world }),
        Just(Refusal::Malformed),
        Just(Refusal::Over),
    ];
    prop_oneof![welcome, refusal.prop_map(JoinReply::Refused)]
}

fn process_news() -> impl Strategy<Value = ProcessNews> {
    let state = prop::sample::select(vec![ProcessState::Stopped, ProcessState::Continued]);
    (any::<(u64, String, u32)>(), state).prop_map(|((number, robot, pid), state)| ProcessNews {
        number,
        robot,
        pid,
        state,
    })
}

fn view() -> impl Strategy<Value = View> {
    let item =
        (point(), option::of(robot()), real()).prop_map(|(position, carrier, radius_m)| ItemView {
            position,
            carrier,
            radius_m,
        });
    let outline = (point(), real());
    let work = (real(), any::<String>()).prop_map(|(left, unit)| Work {
        left,
        all: 2.0,
        unit,
    });
    let mark = (any::<String>(), outline, option::of(work)).prop_map(|(id, at, work)| Mark {
        label: id.clone(),
        id,
        outline: MarkOutline::Disc {
            center: at.0,
            radius_m: at.1,
        },
        role: MarkRole::Zone,
        work,
    });
    let obstacle = any::<[i8; 5]>().prop_map(|numbers| {
        let [x_m, y_m, width_m, height_m, penetrability] = numbers.map(f32::from);
        Obstacle {
            x_m,
            y_m,
            width_m,
            height_m,
            penetrability,
        }
    });
    let message = (robot(), reception()).prop_map(|(receiver, reception)| MessageView {
        receiver,
        reception,
    });
    let clock = (any::<(bool, Option<i32>, u64, u64, Option<String>)>()).prop_map(
        |(paused, speed, steps_left, tick, waits_for)| ClockStatus {
            paused,
            speed: speed.map(f64::from),
            steps_left,
            tick,
            waits_for,
        },
    );
    let world = (
        vec(option::of(any::<i32>().prop_map(f64::from)), 0..4),
        vec(item, 0..4),
        vec(obstacle, 0..3),
        vec(mark, 0..3),
    );
    let team = (
        vec(robot_view(), 0..3),
        vec(fault(), 0..3),
        vec(message, 0..3),
        any::<(u64, bool)>(),
    );
    (any::<u64>(), time(), option::of(clock), world, team).prop_map(
        |(tick, now, clock, world, team)| {
            let (mission, items, obstacles, marks) = world;
            let (robots, faults, messages, (messages_left_out, over)) = team;
            let outcome = over.then_some(Outcome::Complete);
            View {
                tick,
                now,
                clock,
                mission,
                items,
                obstacles,
                marks,
                robots,
                faults,
                messages,
                messages_left_out,
                corners: Vec::new(),
                outcome,
            }
        },
    )
}

fn robot_view() -> impl Strategy<Value = RobotView> {
    let states = vec![AgentState::Absent, AgentState::Present, AgentState::Silent];
    let agent = (
        prop::sample::select(states),
        any::<(Option<u32>, Option<u32>)>(),
    );
    let body = (
        pose(),
        real(),
        option::of(any::<u32>().prop_map(ItemId)),
        option::of(real()),
        (readings(), vec(point(), 0..3)),
    );
    let set_view =
        (motivation(), time()).prop_map(|(motivation, since)| BehaviorView { motivation, since });
    let controller = (option::of(set()), vec(set_view, 0..3));
    (agent, body, controller).prop_map(|((state, (incarnation, pid)), body, (active, sets))| {
        let (pose, speed_m_s, carrying, energy_j, (readings, sensed)) = body;
        RobotView {
            state,
            incarnation,
            pid,
            pose,
            speed_m_s,
            carrying,
            energy_j,
            readings,
            sensed,
            active,
            measure: LevelUnit::Utility,
            sets,
        }
    })
}

fn fault() -> impl Strategy<Value = FaultStatus> {
    let times = (option::of(time()), option::of(time()), any::<u64>());
    let words = (any::<String>(), option::of(any::<String>()));
    (words, times).prop_map(
        |((id, failed), (applied_ms, healed_ms, hits))| FaultStatus {
            order: Order::now(Fault::Kill(id.clone())),
            id,
            phase: Phase::InForce,
            applied_ms,
            healed_ms,
            hits,
            failed,
        },
    )
}

/// Checks that the inline encoding equals bincode's for every initial buffer size.
fn check_inline<T: Serialize>(value: &T) -> Result<(), TestCaseError> {
    let bincode = bincode::serde::encode_to_vec(value, configuration()).unwrap();
    let length = bincode.len();
    for room in [0, length / 2, length, length + 9] {
        let mut room = vec![7; room];
        prop_assert_eq!(encode_into(value, &mut room).unwrap(), length);
        prop_assert_eq!(&room[..length], &bincode[..]);
    }
    prop_assert_eq!(encoded_len(value).unwrap(), length);
    Ok(())
}

/// Checks that the message survives a round trip, and that decoding fails with one byte less or more.
fn check<T>(message: &T) -> Result<(), TestCaseError>
where
    T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug,
{
    check_inline(message)?;
    let mut bytes = encode(message).unwrap();
    prop_assert_eq!(&decode::<T>(&bytes).unwrap(), message);
    for length in 0..bytes.len() {
        let cut = decode::<T>(&bytes[..length]);
        prop_assert!(
            matches!(cut, Err(CodecError::Malformed(_))),
            "{} bytes: {:?}",
            length,
            cut
        );
    }
    bytes.push(0);
    let longer = decode::<T>(&bytes);
    prop_assert!(
        matches!(longer, Err(CodecError::Trailing(1))),
        "{:?}",
        longer
    );
    Ok(())
}

proptest! {
    #[test]
    fn ticks(message in to_agent()) {
        check(&message)?;
    }

    #[test]
    fn reports(message in report()) {
        check(&message)?;
    }

    #[test]
    fn broadcasts(message in broadcast()) {
        check(&message)?;
    }

    #[test]
    fn joins(request in request(), reply in reply()) {
        check(&request)?;
        check(&reply)?;
    }

    #[test]
    fn processes(message in process_news()) {
        check(&message)?;
    }

    #[test]
    fn views(message in view()) {
        check(&message)?;
    }

    /// Numbers of every width, near the limits of each, and all shapes of serde's data model.
    #[test]
    fn the_inline_encoding_of_every_shape_equals_bincode(bits in 0..=127_u32, off in 0..12_u128, text: String, letter: char, real: f64) {
        #[derive(Serialize)]
        enum Shape {
            Unit,
            One(i64),
            Pair(u8, i8),
            Named { map: std::collections::BTreeMap<u32, String>, bytes: [i16; 2] },
        }
        #[derive(Serialize)]
        struct Nothing;
        let big = ((1_u128 << bits) + off).wrapping_sub(6);
        let small = big as u64;
        check_inline(&(big, small, small as u32, small as u16, small as u8))?;
        check_inline(&(small as i64, small as i32, small as i16, small as i8, real, real as f32))?;
        let map = [(small as u32, text.clone())].into();
        let shapes = (Shape::Unit, Shape::One(small as i64), Shape::Pair(1, -1), Shape::Named { map, bytes: [-1, 300] });
        check_inline(&(Nothing, (), letter, Some(text), None::<u8>, shapes, vec![true; bits as usize * 3]))?;
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in any::<Vec<u8>>()) {
        let _ = decode::<ToAgent>(&bytes);
        let _ = decode::<Report>(&bytes);
        let _ = decode::<Broadcast>(&bytes);
        let _ = decode::<JoinRequest>(&bytes);
        let _ = decode::<JoinReply>(&bytes);
        let _ = decode::<ProcessNews>(&bytes);
        let _ = decode::<View>(&bytes);
    }

    /// Replaces one byte of a broadcast, which tests more code than arbitrary bytes.
    #[test]
    fn a_damaged_message_never_panics(message in broadcast(), place: prop::sample::Index, byte: u8) {
        let mut bytes = encode(&message).unwrap();
        *place.get_mut(&mut bytes) = byte;
        let _ = decode::<Broadcast>(&bytes);
    }
}

#[test]
fn too_large_to_send() {
    let text = "x".repeat(LIMIT_BYTES);
    assert!(matches!(encode(&text), Err(CodecError::TooLarge(size)) if size > LIMIT_BYTES));
}

#[test]
fn too_large_to_read() {
    let bytes = vec![0; LIMIT_BYTES + 1];
    assert!(matches!(
        decode::<String>(&bytes),
        Err(CodecError::TooLarge(_))
    ));
}

/// The first bytes announce 2^62 elements, and no element follows. The decoder must fail before it allocates memory for
/// them.
#[test]
fn an_announced_length_without_data_is_rejected() {
    let mut bytes = vec![253];
    bytes.extend((1_u64 << 62).to_le_bytes());
    assert!(matches!(
        decode::<Vec<u64>>(&bytes),
        Err(CodecError::Malformed(_))
    ));
    assert!(matches!(
        decode::<String>(&bytes),
        Err(CodecError::Malformed(_))
    ));
}

//! Test vectors: messages with their bytes, seals, and blocks of random words.

use std::path::Path;

use arrayvec::ArrayVec;
use glam::Vec2;
use proto::codec::{decode, encode};
use proto::join::{JoinReply, JoinRequest};
use proto::keys::KeyExpressions;
use proto::mission::items::{
    Gripper, ItemsAction, ItemsBulletin, ItemsReading, SensedItems, Withdrawal, Zone,
};
use proto::mission::{Action, SensorReading, SharedKnowledge};
use proto::readings::{Actuation, Pose, Readings};
use proto::secret::{Secret, derived};
use proto::team::{Broadcast, BroadcastContent, EncodedBroadcast, Heartbeat, TaskState};
use proto::tick::{ManifestEntry, Report, TickMessage, ToAgent};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::push::bar::BarEnd;
use crate::{observe, push, service};

/// Larger messages of the corpus are left out.
const MAX_BYTES: usize = 300;

/// A secret of the form of a run's token.
const TOKEN: &str = "00112233445566778899aabbccddeeff";

/// Returns the file: JSON with one vector per line.
pub fn file() -> String {
    let sections = [
        ("messages", messages()),
        ("missions", missions()),
        ("seals", seals()),
        ("draws", draws()),
    ];
    let sections = sections.map(|(name, lines)| {
        assert!(!lines.is_empty());
        format!("\"{name}\": [\n{}\n]", lines.join(",\n"))
    });
    format!("{{\n{}\n}}\n", sections.join(",\n"))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns a line with a value and its encoding. The fields of the value have the names of the schema.
fn vector<T: Serialize>(of: &str, name: &str, value: &T) -> String {
    #[derive(Serialize)]
    struct Vector<'v, T> {
        r#type: &'v str,
        name: &'v str,
        hex: String,
        value: &'v T,
    }
    let hex = hexadecimal(&encode(value).unwrap());
    json(&Vector {
        r#type: of,
        name,
        hex,
        value,
    })
}

fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap()
}

/// Returns the messages of the fuzzers' corpus.
fn messages() -> Vec<String> {
    let mut lines = Vec::new();
    for target in ["decode", "received"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../fuzz/corpus")
            .join(target);
        let mut files: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|file| file.unwrap())
            .collect();
        files.sort_by_key(std::fs::DirEntry::file_name);
        for file in files {
            let name = file.file_name().into_string().unwrap();
            let bytes = std::fs::read(file.path()).unwrap();
            if bytes.len() <= MAX_BYTES {
                lines.extend(message(target, &name, &bytes));
            }
        }
    }
    lines
}

fn message(target: &str, name: &str, bytes: &[u8]) -> Option<String> {
    fn line<T: Serialize + DeserializeOwned>(of: &str, name: &str, bytes: &[u8]) -> Option<String> {
        Some(vector(of, name, &decode::<T>(bytes).unwrap()))
    }
    match name.split_once('-')? {
        _ if target == "received" => line::<Broadcast>("Broadcast", name, bytes),
        ("tick", name) => line::<ToAgent>("ToAgent", name, bytes),
        ("report", name) => line::<Report>("Report", name, bytes),
        ("broadcast", name) => line::<Broadcast>("Broadcast", name, bytes),
        ("join_request", name) => line::<JoinRequest>("JoinRequest", name, bytes),
        ("join_reply", name) => line::<JoinReply>("JoinReply", name, bytes),
        // The other files are no messages of an agent.
        _ => None,
    }
}

/// Returns values of the missions' own types.
fn missions() -> Vec<String> {
    let fact = service::bus::PointFact {
        point: 300,
        kind: 1,
        round: 2,
        at: Vec2::new(1.5, -0.25),
        left_s: 12.5,
    };
    let reading = service::bus::SensorReading {
        points: Some(ArrayVec::from_iter([fact])),
        board_line: Some(7),
        effect: None,
    };
    let dead = service::bus::SensorReading {
        points: None,
        board_line: None,
        effect: Some(3),
    };
    let action = |work, read| service::bus::Action { work, read };
    let observed = service::bus::ObservedFact {
        fact,
        sensed: SimTime(70_000),
    };
    let end = BarEnd::Right;
    let seen = push::bus::BarSeen {
        bar: 0,
        end,
        near_end: Vec2::new(0.5, 0.125),
        lead_m: -0.25,
    };
    let bar = |bar, touch| push::bus::SensorReading { bar, touch };
    let report = push::bus::BarReport {
        bar: 1,
        pose: Pose {
            position: Vec2::new(2.0, 3.5),
            heading_rad: 0.5,
        },
        seen: SimTime(1_000),
        last: Some(push::bus::Stroke {
            end: BarEnd::Left,
            at: SimTime(950),
        }),
    };
    let target = observe::bus::SensedTarget {
        target: 4,
        offset: Vec2::new(0.75, -1.0),
    };
    let sighting = observe::bus::Sighting {
        target: 4,
        at: Vec2::new(3.0, 2.0),
        when: SimTime(250),
    };
    let items = ItemsReading {
        items: Some(SensedItems::from_iter([Vec2::new(0.5, 0.25)])),
        zone: Some(Zone::Target),
        at_site: None,
        holding: Some(true),
    };
    let drop = ItemsAction {
        gripper: Gripper::Drop,
        report: true,
    };
    let withdrawal = ItemsBulletin::Withdrawal(Withdrawal {
        finder: RobotId(2),
        seen: SimTime(251),
    });
    let sighted = observe::bus::SensorReading {
        targets: Some(ArrayVec::from_iter([target])),
    };
    vec![
        vector("ItemsReading", "waste reading", &items),
        vector("ItemsAction", "waste action", &drop),
        vector("ItemsBulletin", "waste bulletin", &withdrawal),
        vector("service::SensorReading", "service board", &reading),
        vector("service::SensorReading", "service dead device", &dead),
        vector(
            "service::Action",
            "service work",
            &action(Some(300), Some(7)),
        ),
        vector("service::Action", "service nothing", &action(None, None)),
        vector("service::ObservedFact", "service knowledge", &observed),
        vector(
            "push::SensorReading",
            "push bar",
            &bar(Some(Some(seen)), Some(false)),
        ),
        vector(
            "push::SensorReading",
            "push no bar in sight",
            &bar(Some(None), Some(true)),
        ),
        vector("push::SensorReading", "push dead devices", &bar(None, None)),
        vector("push::BarReport", "push bulletin", &report),
        vector("observe::SensorReading", "observe targets", &sighted),
        vector(
            "observe::ObserveAction",
            "observe action",
            &observe::bus::ObserveAction,
        ),
        vector("observe::Sighting", "observe knowledge", &sighting),
    ]
}

/// Returns one tick of robot `gold` in service: tick, broadcast and report with their keys, seals and tokens.
fn seals() -> Vec<String> {
    #[derive(Serialize)]
    struct Sealed<'s> {
        name: &'s str,
        token: &'s str,
        secret: &'s str,
        key: &'s str,
        message: String,
        sealed: String,
    }
    let keys = KeyExpressions::new("r1");
    let (robot, incarnation) = (RobotId(1), 2);
    let (tick, now) = (300, SimTime(15_000));
    let reading = service::bus::SensorReading {
        points: Some(ArrayVec::new()),
        ..service::bus::SensorReading::default()
    };
    let position = Vec2::new(1.0, 2.0);
    let heartbeat = || {
        BroadcastContent::Heartbeat(Heartbeat {
            state: TaskState::Idle,
            since: SimTime(0),
            set: None,
            task: None,
            progress: 0,
            position: Some(position),
            carrying: false,
            shared_knowledge: SharedKnowledge::Nothing,
        })
    };
    let of_teammate = Broadcast {
        sender: RobotId(0),
        incarnation: 1,
        tick: 299,
        index: 0,
        seq: 14,
        sent: SimTime(14_950),
        body: heartbeat(),
    };
    let message = TickMessage {
        incarnation,
        tick,
        now,
        last_counted: Some(299),
        manifest: vec![ManifestEntry {
            sender: RobotId(0),
            tick: 299,
            incarnation: 1,
            count: 1,
            link: None,
        }],
        readings: Readings {
            pose: Some(Pose {
                position,
                heading_rad: 0.5,
            }),
            front_border: Some(None),
            mission: SensorReading::new(reading),
            ..Readings::default()
        },
        ..TickMessage::default()
    };
    let sent: ToAgent = ToAgent::Tick {
        tick: Box::new(message),
        ground_truth: Vec::new(),
        broadcasts: vec![EncodedBroadcast::of(&of_teammate).ok()],
    };
    let broadcast = Broadcast {
        sender: robot,
        incarnation,
        tick,
        index: 0,
        seq: 12,
        sent: now,
        body: heartbeat(),
    };
    let own = derived(TOKEN, "robot-gold");
    let world = Secret::from_token(&own);
    let beat = world
        .seal(&keys.team("gold", "heartbeat"), &broadcast)
        .unwrap();
    let action = service::bus::Action {
        work: Some(3),
        read: None,
    };
    let report = Report {
        robot,
        incarnation,
        tick,
        broadcasts: 1,
        broadcast_bytes: beat.len() as u32,
        actuation: Actuation {
            speed_m_s: 0.25,
            turn_rad_s: -0.5,
            action: Action::new(&action),
        },
        ..Report::default()
    };
    let sealed = |name: &str, secret: &str, key: &str, message: &[u8], sealed: &[u8]| {
        json(&Sealed {
            name,
            token: TOKEN,
            secret,
            key,
            message: hexadecimal(message),
            sealed: hexadecimal(sealed),
        })
    };
    let (tick_key, report_key) = (keys.tick("gold"), keys.report("gold"));
    let (beat_key, alive) = (
        keys.team("gold", "heartbeat"),
        keys.alive("gold", incarnation),
    );
    let stamped = world.stamp(&alive);
    let mark = world.seal_of(&alive, &[]);
    assert!(stamped.ends_with(&format!("{:016x}", u64::from_le_bytes(mark))));
    let [sent_bytes, beat_bytes, report_bytes] =
        [encode(&sent), encode(&broadcast), encode(&report)].map(Result::unwrap);
    let sealed_tick = world.seal(&tick_key, &sent).unwrap();
    let sealed_report = world.seal(&report_key, &report).unwrap();
    vec![
        sealed("tick", &own, &tick_key, &sent_bytes, &sealed_tick),
        sealed("heartbeat", &own, &beat_key, &beat_bytes, &beat),
        sealed("report", &own, &report_key, &report_bytes, &sealed_report),
        sealed(
            "liveliness token, whose key ends with the seal",
            &own,
            &alive,
            &[],
            &mark,
        ),
    ]
}

/// Returns blocks of 16 random words.
fn draws() -> Vec<String> {
    #[derive(Serialize)]
    struct Block {
        /// As text, because JSON readers may round large numbers.
        seed: String,
        stream: u64,
        block: u64,
        words: [u32; 16],
    }
    let blocks = [
        (1_u64, 3 << 32 | 2 << 16 | 1, 300 << 19 | 1 << 16),
        (u64::MAX, 10 << 32 | 1, (7 << 19) << 17 | 5),
    ];
    let line = |(seed, stream, block): (u64, u64, u64)| {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        generator.set_word_pos(u128::from(block) * 16);
        let words = std::array::from_fn(|_| generator.next_u32());
        json(&Block {
            seed: seed.to_string(),
            stream,
            block,
            words,
        })
    };
    blocks.map(line).to_vec()
}

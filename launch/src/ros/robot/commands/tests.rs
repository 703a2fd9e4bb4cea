//! Tests of the selection of commands.

use proptest::prelude::*;
use ros::messages::Header;
use ros::{Qos, encode, rmw_zenoh::Node};

use super::*;

const STEP: SimTime = SimTime(50);

fn attachment() -> [u8; 33] {
    let node = Node {
        domain: 0,
        session: "1".to_owned(),
        name: "driver",
    };
    let topic = node.publisher(1, "/blue/cmd_vel", Twist::MESSAGE, Qos::Stream);
    topic.attachment(1, 1)
}

fn commands(is_lockstep: bool) -> Commands {
    Commands::new("blue", vec!["search".to_owned()], is_lockstep)
}

fn twist(speed: f64) -> Twist {
    let mut twist = Twist::default();
    twist.linear.x = speed;
    twist
}

fn stamped(at: SimTime, speed: f64, frame: &str) -> Vec<u8> {
    let header = Header {
        stamp: stamp_of(at),
        frame_id: frame.to_owned(),
    };
    let twist = twist(speed);
    encode(&TwistStamped { header, twist })
}

fn send(commands: &mut Commands, topic: CommandTopic, message: &[u8]) -> Option<&'static str> {
    let received = commands.receive(topic, &attachment(), message);
    received.err().map(|dropped| dropped.kind)
}

fn act(commands: &mut Commands, text: &str) -> Option<&'static str> {
    let data = text.to_owned();
    send(
        commands,
        CommandTopic::Action,
        &encode(&StringMessage { data }),
    )
}

fn answer(commands: &mut Commands, at: SimTime, speed: f64) -> Option<&'static str> {
    let message = stamped(at, speed, "blue/base_link");
    send(commands, CommandTopic::TwistStamped, &message)
}

fn speed(command: Option<Command>) -> Option<f32> {
    command.map(|command| command.motion.speed_m_s)
}

#[test]
fn without_lockstep_the_latest_command_counts_for_half_a_second() {
    let mut commands = commands(false);
    let mut now = SimTime::ZERO;
    let mut tick = |commands: &mut Commands| {
        commands.begin(now);
        now = now + STEP;
        assert!(!commands.is_waiting());
        speed(commands.end())
    };
    assert_eq!(tick(&mut commands), Some(0.0));
    for speed in [0.1, 0.2] {
        let message = encode(&twist(speed));
        assert_eq!(send(&mut commands, CommandTopic::Twist, &message), None);
    }
    // The commands arrived in the tick before.
    let speeds: Vec<_> = (0..12).filter_map(|_| tick(&mut commands)).collect();
    assert_eq!(speeds, [[0.2; 9].as_slice(), &[0.0; 3]].concat());
    let message = stamped(SimTime(1), 0.3, "");
    let topic = CommandTopic::TwistStamped;
    assert_eq!(send(&mut commands, topic, &message), None);
    assert_eq!(tick(&mut commands), Some(0.3));
}

#[test]
fn in_lockstep_the_first_command_with_the_stamp_counts() {
    let mut commands = commands(true);
    commands.begin(SimTime(100));
    assert!(commands.is_waiting());
    assert_eq!(answer(&mut commands, SimTime(50), 0.5), Some("late"));
    assert_eq!(answer(&mut commands, SimTime(150), 0.5), Some("early"));
    assert!(commands.is_waiting());
    assert_eq!(act(&mut commands, r#"{ "doing": "search" }"#), None);
    assert_eq!(answer(&mut commands, SimTime(100), 0.1), None);
    assert!(!commands.is_waiting());
    // The activity after the command belongs to the next one.
    assert_eq!(act(&mut commands, "{}"), None);
    assert_eq!(answer(&mut commands, SimTime(100), 0.5), Some("repeated"));
    let command = commands.end().unwrap();
    assert_eq!(command.activity.doing.as_deref(), Some("search"));
    assert_eq!(command.motion.speed_m_s, 0.1);
    assert_eq!(commands.stored(SimTime(100)), Some(&command));
    assert_eq!(commands.stored(SimTime(50)), None);
}

#[test]
fn a_silent_node_is_awaited_once_and_again_after_its_return() {
    let mut commands = commands(true);
    commands.begin(SimTime(0));
    assert!(commands.is_waiting());
    assert_eq!(commands.end(), None);
    assert_eq!(commands.stored(SimTime(0)), Some(&Command::default()));
    commands.begin(SimTime(50));
    assert!(!commands.is_waiting());
    assert_eq!(commands.end(), Some(Command::default()));
    // The tick is over.
    assert_eq!(answer(&mut commands, SimTime(50), 0.1), Some("late"));
    commands.begin(SimTime(100));
    assert!(commands.is_waiting());
    assert_eq!(answer(&mut commands, SimTime(100), 0.1), None);
    assert_eq!(speed(commands.end()), Some(0.1));
}

#[test]
fn invalid_messages_have_no_effect() {
    let mut commands = commands(true);
    commands.begin(SimTime(50));
    let infinite = [f64::NAN, f64::INFINITY, 1e300];
    for value in infinite {
        let kind = answer(&mut commands, SimTime(50), value);
        assert_eq!(kind, Some("number"), "{value}");
    }
    let message = stamped(SimTime(50), 0.1, "gold/base_link");
    let topic = CommandTopic::TwistStamped;
    assert_eq!(send(&mut commands, topic, &message), Some("frame"));
    let message = encode(&twist(0.1));
    assert_eq!(send(&mut commands, topic, &message), Some("encoding"));
    let message = stamped(SimTime(50), 0.1, "");
    let without = commands.receive(topic, &[], &message).unwrap_err();
    assert_eq!(without.kind, "attachment");
    let large = vec![0; MAX_BYTES + 1];
    assert_eq!(send(&mut commands, topic, &large), Some("size"));
    for text in [
        "",
        "[]",
        r#"{ "action": ["pick"] }"#,
        r#"{ "doing": "dig" }"#,
        r#"{ "progress": true }"#,
        r#"{ "action": { "gripper": "open" } }"#,
    ] {
        assert_eq!(act(&mut commands, text), Some("action"), "{text}");
    }
    assert!(commands.is_waiting());
    assert_eq!(commands.activity, Activity::default());
}

proptest! {
    #[test]
    fn no_bytes_cause_a_panic_or_an_infinite_speed(
        messages in prop::collection::vec(
            (0..3_usize, prop::collection::vec(any::<u8>(), 0..80)), 0..20,
        ),
        is_lockstep: bool,
    ) {
        let mut commands = commands(is_lockstep);
        commands.begin(SimTime(50));
        for (topic, mut message) in messages {
            let topics = [CommandTopic::Twist, CommandTopic::TwistStamped, CommandTopic::Action];
            message.splice(0..0, [0, 1, 0, 0]);
            let _ = send(&mut commands, topics[topic], &message);
        }
        let Motion { speed_m_s, turn_rad_s } = commands.end().unwrap_or_default().motion;
        prop_assert!(speed_m_s.is_finite() && turn_rad_s.is_finite());
    }
}

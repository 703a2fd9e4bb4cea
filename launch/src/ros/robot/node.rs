//! The node of ROS beside a robot: it publishes readings, and subscribes to commands.

use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use analysis::ros_messages::{CLOCK, RobotMessages, robot_names};
use anyhow::Context;
use proto::readings::Readings;
use proto::team::Broadcast;
use robot_agent::allocator::OwnBehavior;
use ros::messages::{StringMessage, Twist, TwistStamped};
use ros::{Message, MessageType, Qos};
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use tokio::task::block_in_place;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::clock::ClockDuty;
use super::commands::{Command, CommandTopic, Commands};
use crate::ros::OPTION;
use crate::ros::dropped::{Dropped, DroppedCommands};
use crate::ros::topics::{RosTopics, declare_token};

/// The number of the first subscriber in the node. Publishers have smaller numbers.
const FIRST_SUBSCRIBER: usize = 100;

/// The number of the subscription to the time.
const CLOCK_SUBSCRIBER: usize = FIRST_SUBSCRIBER - 1;

/// The connection of a robot to ROS, before the robot joins a run.
pub struct Connection {
    pub session: Session,
    pub domain: u8,
    /// The longest wait for the command of a tick; `None` without lockstep.
    pub lockstep: Option<Duration>,
    pub dropped: Arc<DroppedCommands>,
}

/// The node of a robot.
pub struct RosNode {
    robot: String,
    wait: Duration,
    inbox: Arc<Inbox>,
    output: Mutex<Output>,
    /// The endpoints, which must live as long as the node.
    _subscribers: Vec<(Subscriber<()>, Vec<LivelinessToken>)>,
}

struct Output {
    messages: RobotMessages,
    topics: RosTopics,
    clock: ClockDuty,
}

/// The commands that arrive from ROS.
struct Inbox {
    commands: Mutex<Commands>,
    has_arrived: Condvar,
    dropped: Arc<DroppedCommands>,
}

impl RosNode {
    /// Creates the node of the robot with this rank.
    pub fn new(connection: &Connection, rank: usize, setup: &Setup) -> anyhow::Result<Self> {
        let names = robot_names(setup, OPTION)?;
        let (robot, name) = (RobotId(rank as u32), &names[rank]);
        let session = connection.session.clone();
        // The process has this node until its end.
        let node = format!("alliance_{name}").leak();
        let mut topics = RosTopics::new(session.clone(), connection.domain, node)?;
        let messages = RobotMessages::new(setup, robot, name, &mut topics)?;
        let clock = topics.endpoint(CLOCK).context(CLOCK)?;
        let clock = ClockDuty::new(&session, &topics, clock, CLOCK_SUBSCRIBER)?;
        let own = OwnBehavior::of_robot(robot, setup).into_iter();
        let sets = own.map(|own| setup.catalog.behavior_name(own.id).to_owned());
        let is_lockstep = connection.lockstep.is_some();
        let inbox = Arc::new(Inbox {
            commands: Mutex::new(Commands::new(name, sets.collect(), is_lockstep)),
            has_arrived: Condvar::new(),
            dropped: Arc::clone(&connection.dropped),
        });
        let stamped = (CommandTopic::TwistStamped, TwistStamped::MESSAGE);
        let motions = match is_lockstep {
            true => vec![stamped],
            false => vec![stamped, (CommandTopic::Twist, Twist::MESSAGE)],
        };
        let actions = vec![(CommandTopic::Action, StringMessage::MESSAGE)];
        let mut subscribers = Vec::new();
        for (topic, types) in [("cmd_vel", motions), ("action", actions)] {
            let first = FIRST_SUBSCRIBER + 10 * subscribers.len();
            let topic = format!("/{name}/{topic}");
            let subscribed = subscribe(&connection.session, &topics, first, &topic, types, &inbox);
            subscribers.push(subscribed.with_context(|| topic)?);
        }
        Ok(Self {
            robot: setup.roster.name(robot).to_owned(),
            wait: connection.lockstep.unwrap_or_default(),
            inbox,
            output: Mutex::new(Output {
                messages,
                topics,
                clock,
            }),
            _subscribers: subscribers,
        })
    }

    /// Publishes the readings of a tick, and returns the command that counts in it. A repeated tick gives the same command.
    pub fn exchange(
        &self,
        now: SimTime,
        readings: &Readings,
        received: &[Arc<Broadcast>],
    ) -> Command {
        {
            let mut commands = lock(&self.inbox.commands);
            if let Some(command) = commands.stored(now) {
                return command.clone();
            }
            commands.begin(now);
        }
        let Output {
            messages,
            topics,
            clock,
        } = &mut *lock(&self.output);
        let has_clock = clock.is_ours();
        if let Err(error) = messages.write(topics, now, readings, received, has_clock) {
            let dropped = Dropped::new("reading", format!("{error:#}"));
            self.inbox.dropped.count(&dropped);
        }
        // Zenoh's only worker calls this, and commands need a worker to arrive.
        let command = block_in_place(|| self.inbox.wait(self.wait));
        command.unwrap_or_else(|| {
            let (robot, wait_s) = (&self.robot, self.wait.as_secs_f64());
            tracing::warn!(
                robot,
                wait_s,
                "no command in time: the robot stands until one arrives"
            );
            Command::default()
        })
    }
}

/// Subscribes to a topic with several types. A message of another type is counted.
fn subscribe(
    session: &Session,
    topics: &RosTopics,
    first: usize,
    topic: &str,
    types: Vec<(CommandTopic, &'static MessageType)>,
    inbox: &Arc<Inbox>,
) -> anyhow::Result<(Subscriber<()>, Vec<LivelinessToken>)> {
    let node = topics.node();
    let mut tokens = Vec::new();
    let mut keys = Vec::new();
    for (number, (kind, message)) in (first..).zip(types) {
        let endpoint = node.subscriber(number, topic, message, Qos::Stream);
        tokens.push(declare_token(session, &endpoint.token)?);
        keys.push((endpoint.key, kind, message.short_name()));
    }
    let inbox = Arc::clone(inbox);
    let subscriber = session
        .declare_subscriber(format!("{}{topic}/*/*", node.domain))
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let known = keys.iter().find(|(known, _, _)| known == key);
            let received = match known {
                Some((_, kind, _)) => inbox.receive(*kind, &sample),
                None => {
                    let names = keys.iter().map(|(_, _, name)| &**name);
                    let names: Vec<&str> = names.collect();
                    let why = format!("its key is {key}; use {}", names.join(" or "));
                    Err(Dropped::new("type", why))
                }
            };
            if let Err(dropped) = received {
                inbox.dropped.count(&dropped);
            }
        })
        .wait()
        .map_err(anyhow::Error::from_boxed)?;
    Ok((subscriber, tokens))
}

impl Inbox {
    fn receive(&self, topic: CommandTopic, sample: &Sample) -> Result<(), Dropped> {
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes());
        let received = lock(&self.commands).receive(
            topic,
            &attachment.unwrap_or_default(),
            &sample.payload().to_bytes(),
        );
        self.has_arrived.notify_one();
        received
    }

    /// Waits for the command of a tick, and ends the tick. Returns `None` if there was none in time.
    fn wait(&self, wait: Duration) -> Option<Command> {
        let commands = lock(&self.commands);
        let waited = self
            .has_arrived
            .wait_timeout_while(commands, wait, |commands| commands.is_waiting());
        waited.unwrap_or_else(PoisonError::into_inner).0.end()
    }
}

/// Locks a mutex and ignores poisoning, because a panic ends the process.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl fmt::Debug for RosNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RosNode").field(&self.robot).finish()
    }
}

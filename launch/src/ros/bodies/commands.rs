//! The topics `/NAME/cmd_vel`, and the dead man's switch: bodies without new commands are stopped.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use ros::messages::{Twist, Vector3};
use ros::rmw_zenoh::{Endpoint, Node};
use ros::{Message, Qos, encode};
use tokio::time::Instant;
use world_server::external_bodies::Velocity;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::ros::topics::declare_token;

/// The least time without commands after which the bodies are stopped. A shorter time stops them on a busy machine.
const LEAST_TIMEOUT: Duration = Duration::from_millis(250);

/// The number of steps without commands after which the bodies are stopped.
const STEPS: u32 = 3;

/// The command topics of all robots.
pub struct CommandTopics {
    topics: Vec<CommandTopic>,
    timeout: Duration,
    /// The time of the last commands, until the bodies are stopped.
    since: Option<Instant>,
}

struct CommandTopic {
    endpoint: Endpoint,
    publisher: Publisher<'static>,
    /// The number of messages so far.
    sequence: i64,
    _token: LivelinessToken,
}

impl CommandTopics {
    /// Declares the topics. The numbers of their endpoints begin after `first`.
    pub fn new(
        session: &Session,
        node: &Node,
        robots: &[String],
        first: usize,
        step: Duration,
    ) -> anyhow::Result<Self> {
        let topics = robots.iter().zip(first + 1..).map(|(robot, number)| {
            let topic = format!("/{robot}/cmd_vel");
            let endpoint = node.publisher(number, &topic, Twist::MESSAGE, Qos::Stream);
            let publisher = session.declare_publisher(endpoint.key.clone());
            Ok(CommandTopic {
                publisher: publisher.wait().map_err(anyhow::Error::from_boxed)?,
                _token: declare_token(session, &endpoint.token)?,
                endpoint,
                sequence: 0,
            })
        });
        Ok(Self {
            topics: topics.collect::<anyhow::Result<_>>()?,
            timeout: LEAST_TIMEOUT.max(step * STEPS),
            since: None,
        })
    }

    /// Publishes the command of each robot, by rank. A robot without one stands still.
    pub fn publish(&mut self, velocities: &[Velocity], now: Instant) {
        self.since = Some(now);
        for (rank, topic) in self.topics.iter_mut().enumerate() {
            topic.put(velocities.get(rank).copied().unwrap_or_default());
        }
    }

    /// Commands all bodies to stand.
    pub fn stop(&mut self) {
        self.since = None;
        for topic in &mut self.topics {
            topic.put(Velocity::default());
        }
    }

    /// Stops all bodies once if no commands have arrived in time.
    pub fn stop_if_overdue(&mut self, now: Instant) {
        if self
            .since
            .is_some_and(|since| now.duration_since(since) > self.timeout)
        {
            self.stop();
        }
    }
}

impl CommandTopic {
    fn put(&mut self, velocity: Velocity) {
        let twist = Twist {
            linear: Vector3 {
                x: velocity.speed_m_s.into(),
                ..Vector3::default()
            },
            angular: Vector3 {
                z: velocity.turn_rad_s.into(),
                ..Vector3::default()
            },
        };
        self.sequence += 1;
        let attachment = self.endpoint.attachment(self.sequence, unix_ns());
        let sent = self.publisher.put(encode(&twist));
        if let Err(error) = sent.attachment(attachment.to_vec()).wait() {
            tracing::warn!("{}: not published: {error}", self.endpoint.key);
        }
    }
}

/// Returns the time since 1970, ns. Commands go to a world whose clock is the wall clock.
fn unix_ns() -> i64 {
    // The time stamps a message to another world and has no effect on the run.
    #[allow(clippy::disallowed_methods)]
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    i64::try_from(now.unwrap_or_default().as_nanos()).unwrap_or(i64::MAX)
}

//! The process between the world of a run and the bodies in another world.

use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use analysis::ros_messages::{MAP_FRAME, robot_names as ros_names};
use anyhow::{Context, bail};
use cluster::locator::Locator;
use ros::messages::{LaserScan, Odometry};
use ros::names::TEAM;
use ros::rmw_zenoh::Node;
use ros::{Message, MessageType, Qos};
use scenario::{Problem, Setup};
use terminal::stderr_line;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::runtime::Handle;
use tokio::sync::Notify;
use tokio::task::spawn_blocking;
use tokio::time::{Instant, interval, sleep, timeout};
use world_server::external_bodies::{BodyCommands, BridgeMessage, Velocity, inherited};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use super::commands::CommandTopics;
use super::received::Received;
use super::{BridgeSettings, OPTION};
use crate::follow::{self, EndRequests};
use crate::ros::topics::{connect, declare_token};

/// The interval between checks of the times.
const CLOCK_INTERVAL: Duration = Duration::from_millis(20);

/// The time for the last messages to leave this process.
const DRAIN_TIME: Duration = Duration::from_millis(200);

/// Returns the ROS names of the robots, by rank.
///
/// # Errors
/// Returns an error if ROS forbids the name of a robot.
pub fn robot_names(setup: &Setup) -> Result<Vec<String>, Problem> {
    ros_names(setup, OPTION)
}

/// Runs the bridge until its standard input is closed. The first line of input contains its settings.
pub fn run(name: &str) -> ExitCode {
    follow::run(name, bridge())
}

async fn bridge() -> anyhow::Result<()> {
    let mut ends = EndRequests::new()?;
    let (reader, writer) = inherited().context("the world")?.into_split();
    let mut lines = BufReader::new(reader).lines();
    let settings = lines.next_line().await?.unwrap_or_default();
    let settings: BridgeSettings = serde_json::from_str(&settings).context("settings")?;
    let Some(opened) = ends.during(open(&settings)).await else {
        return Ok(());
    };
    let (session, mut bridge) = match opened {
        Ok(opened) => opened,
        Err(problem) => return refuse(writer, problem).await,
    };
    stderr_line!("connected");
    // Bodies may still move by the commands of an earlier run.
    bridge.commands.stop();
    let passed = ends.during(bridge.pass_on(&mut lines, writer)).await;
    // The bodies stop in any case.
    bridge.commands.stop();
    sleep(DRAIN_TIME).await;
    drop(bridge);
    // The process ends in any case.
    let _ = session.close().await;
    passed.unwrap_or(Ok(()))
}

/// Connects to the router of ROS and declares all topics.
async fn open(settings: &BridgeSettings) -> anyhow::Result<(Session, Bridge)> {
    let router: Locator = settings.router.parse()?;
    let address = router.clone();
    // Opening a session blocks its thread until there is a router.
    let connecting = spawn_blocking(move || Handle::current().block_on(connect(&address)));
    let Ok(connected) = timeout(settings.stall_after(), connecting).await else {
        let what = format!("no zenoh router has answered at {router}");
        let remedy = "start `ros2 run rmw_zenoh_cpp rmw_zenohd`";
        bail!(Problem::with_source(OPTION, what, remedy));
    };
    let session = connected??;
    let bridge = Bridge::new(&session, settings)?;
    Ok((session, bridge))
}

/// Sends the reason why the run cannot start to the launcher, and returns it.
async fn refuse(mut writer: OwnedWriteHalf, problem: anyhow::Error) -> anyhow::Result<()> {
    let line = line(&BridgeMessage::Refused(format!("{problem:#}")));
    // The launcher may have ended.
    let _ = writer.write_all(line.as_bytes()).await;
    Err(problem)
}

fn line(message: &BridgeMessage) -> String {
    // Poses in the room and beams are finite, so the encoding cannot fail.
    serde_json::to_string(message).unwrap_or_default() + "\n"
}

impl BridgeSettings {
    fn stall_after(&self) -> Duration {
        Duration::from_secs_f64(self.stall_after_s)
    }
}

/// The topics of the bodies.
struct Bridge {
    commands: CommandTopics,
    received: Arc<Incoming>,
    stall_after: Duration,
    started: Instant,
    _subscribers: Vec<(Subscriber<()>, LivelinessToken)>,
    _token: LivelinessToken,
}

/// The poses and scans that wait to be forwarded.
struct Incoming {
    received: Mutex<Received>,
    has_new: Notify,
}

/// Handles a message of the robot with a rank. Returns the reason if it is refused.
type Receive = fn(&mut Received, usize, &[u8], Instant) -> Option<String>;

impl Incoming {
    fn lock(&self) -> MutexGuard<'_, Received> {
        self.received.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bridge {
    fn new(session: &Session, settings: &BridgeSettings) -> anyhow::Result<Self> {
        let node = Node {
            domain: settings.domain,
            session: session.zid().to_string(),
            name: TEAM,
        };
        let (robots, started) = (&settings.robots, Instant::now());
        let received = Received::new(robots, settings.bodies, settings.stall_after(), started);
        let received = Arc::new(Incoming {
            received: Mutex::new(received),
            has_new: Notify::new(),
        });
        let inputs: [(&str, &MessageType, Receive); 2] = [
            ("odom", Odometry::MESSAGE, Received::receive_pose),
            ("scan", LaserScan::MESSAGE, Received::receive_scan),
        ];
        let mut subscribers = Vec::new();
        for (rank, robot) in robots.iter().enumerate() {
            for (name, message, receive) in inputs {
                let topic = format!("/{robot}/{name}");
                let number = subscribers.len() + 1;
                let endpoint = node.subscriber(number, &topic, message, Qos::Stream);
                let incoming = Arc::clone(&received);
                let subscriber = session
                    .declare_subscriber(endpoint.key)
                    .callback(move |sample| {
                        let message = sample.payload().to_bytes();
                        let refused = receive(&mut incoming.lock(), rank, &message, Instant::now());
                        if let Some(why) = refused {
                            tracing::warn!("{why}");
                        }
                        incoming.has_new.notify_one();
                    })
                    .wait()
                    .map_err(anyhow::Error::from_boxed)?;
                subscribers.push((subscriber, declare_token(session, &endpoint.token)?));
            }
        }
        let step = Duration::from_millis(settings.step_ms);
        Ok(Self {
            commands: CommandTopics::new(session, &node, robots, subscribers.len(), step)?,
            received,
            stall_after: settings.stall_after(),
            started,
            _subscribers: subscribers,
            _token: declare_token(session, &node.token())?,
        })
    }

    /// Passes poses and scans to the world and commands to the bodies until the world closes the connection.
    async fn pass_on(
        &mut self,
        lines: &mut Lines<BufReader<OwnedReadHalf>>,
        writer: OwnedWriteHalf,
    ) -> anyhow::Result<()> {
        let mut writer = Some(writer);
        let mut clock = interval(CLOCK_INTERVAL);
        loop {
            tokio::select! {
                line = lines.next_line() => {
                    let Ok(Some(line)) = line else { return Ok(()) };
                    let commands: BodyCommands = serde_json::from_str(&line).context("commands")?;
                    self.publish(commands);
                }
                _ = clock.tick() => {
                    let now = Instant::now();
                    self.commands.stop_if_overdue(now);
                    let missing = self.received.lock().missing();
                    if missing.is_empty() {
                        if let Some(writer) = writer.take() {
                            tokio::spawn(forward(Arc::clone(&self.received), writer));
                        }
                    } else if now.duration_since(self.started) > self.stall_after
                        && let Some(writer) = writer.take()
                    {
                        return refuse(writer, self.missing(&missing)).await;
                    }
                    let lost = self.received.lock().lost(now);
                    if let Some(topics) = lost {
                        bail!("the other world has stopped sending: {topics}");
                    }
                }
            }
        }
    }

    /// Publishes commands. A body that has sent no pose for a long time, or no more scans, stands still.
    fn publish(&mut self, mut commands: BodyCommands) {
        let now = Instant::now();
        let received = self.received.lock();
        for (rank, velocity) in commands.velocities.iter_mut().enumerate() {
            if received.is_silent(rank, now) {
                *velocity = Velocity::default();
            }
        }
        drop(received);
        self.commands.publish(&commands.velocities, now);
    }

    fn missing(&self, topics: &str) -> anyhow::Error {
        let seconds = self.stall_after.as_secs_f64();
        let what = format!("no pose has arrived within {seconds} s on {topics}");
        let remedy = format!(
            "publish nav_msgs/Odometry in the frame '{MAP_FRAME}', or wait longer with --stall-after"
        );
        Problem::with_source(OPTION, what, remedy).into()
    }
}

/// Forwards the newest poses and scans. A world that does not read delays only this task.
async fn forward(incoming: Arc<Incoming>, mut writer: OwnedWriteHalf) {
    let mut text = line(&BridgeMessage::Ready);
    loop {
        if writer.write_all(text.as_bytes()).await.is_err() {
            return;
        }
        text.clear();
        while text.is_empty() {
            let new = incoming.lock().take_new();
            for message in new {
                text += &line(&message);
            }
            if text.is_empty() {
                incoming.has_new.notified().await;
            }
        }
    }
}

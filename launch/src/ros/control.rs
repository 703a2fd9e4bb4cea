//! Services and a topic with which nodes of ROS control the run. They use its control topic, as `alliance fault` does.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use proto::control::{ClockCommand, ControlCommand};
use ros::messages::{StringMessage, TriggerRequest, TriggerResponse};
use ros::names::TEAM;
use ros::rmw_zenoh::{Endpoint, response_attachment};
use ros::services::TRIGGER;
use ros::{Message, Qos, decode, encode};
use scenario::Setup;
use serde_json::json;
use tokio::runtime::Handle;
use tokio::sync::Mutex;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::dropped::{Dropped, DroppedCommands};
use super::topics::{RosTopics, declare_token};
use crate::relay::relay_command;

/// The number of the first endpoint in the node. The topics of a run have smaller numbers.
const FIRST_ENDPOINT: usize = 1_000_000;

/// The services and topics, which exist as long as this value.
pub struct RosControl {
    sender: Arc<Sender>,
    _services: Vec<Queryable<()>>,
    _orders: Subscriber<()>,
    _tokens: Vec<LivelinessToken>,
}

/// The way from ROS to the run.
struct Sender {
    run: String,
    runtime: Handle,
    dropped: DroppedCommands,
    /// The topic of the replies to orders, and the number of replies so far.
    replies: Mutex<(Publisher<'static>, i64)>,
    reply_topic: Endpoint,
}

impl RosControl {
    /// Offers the services of a run: `/alliance/pause`, `resume` and `step`, `/NAME/kill` and `/NAME/restart`, and the topic
    /// `/alliance/control`, whose replies are published as `/alliance/replies`. `names` are the ROS names of the robots.
    pub fn new(
        topics: &RosTopics,
        run: &str,
        setup: &Setup,
        names: &[String],
    ) -> anyhow::Result<Self> {
        let (session, node) = (topics.session(), topics.node());
        let mut number = FIRST_ENDPOINT..;
        let mut next = || number.next().unwrap_or_default();
        let text = StringMessage::MESSAGE;
        let reply_topic = node.publisher(next(), &team_name("replies"), text, Qos::Stream);
        let order_topic = node.subscriber(next(), &team_name("control"), text, Qos::Stream);
        let mut tokens = vec![
            declare_token(session, &reply_topic.token)?,
            declare_token(session, &order_topic.token)?,
        ];
        let publisher = session.declare_publisher(reply_topic.key.clone()).wait();
        let sender = Arc::new(Sender {
            run: run.to_owned(),
            runtime: Handle::current(),
            dropped: DroppedCommands::default(),
            replies: Mutex::new((publisher.map_err(anyhow::Error::from_boxed)?, 0)),
            reply_topic,
        });
        let mut services = Vec::new();
        for (name, command) in commands(setup, names)? {
            let endpoint = node.service(next(), &name, TRIGGER);
            tokens.push(declare_token(session, &endpoint.token)?);
            services.push(serve(session, endpoint.key, command, &sender)?);
        }
        Ok(Self {
            _services: services,
            _orders: take_orders(session, order_topic.key, &sender)?,
            _tokens: tokens,
            sender,
        })
    }

    /// Reports the messages without an effect.
    pub fn report(&self) {
        self.sender.dropped.report();
    }
}

fn team_name(name: &str) -> String {
    format!("/{TEAM}/{name}")
}

/// Returns the names of the services and their commands.
fn commands(setup: &Setup, names: &[String]) -> anyhow::Result<Vec<(String, ControlCommand)>> {
    let clock = [
        ("pause", ClockCommand::Pause),
        ("resume", ClockCommand::Resume),
        ("step", ClockCommand::Step(1)),
    ];
    let mut commands = clock
        .map(|(name, command)| (team_name(name), ControlCommand::Clock(command)))
        .to_vec();
    for (robot, name) in setup.scenario.robots.iter().zip(names) {
        for kind in ["kill", "restart"] {
            let order = json!({ "fault": { "fault": { kind: robot.name } } });
            commands.push((format!("/{name}/{kind}"), serde_json::from_value(order)?));
        }
    }
    Ok(commands)
}

/// Answers the requests of a service.
fn serve(
    session: &Session,
    key: String,
    command: ControlCommand,
    sender: &Arc<Sender>,
) -> anyhow::Result<Queryable<()>> {
    let sender = Arc::clone(sender);
    // Nodes of ROS query only servers that are complete.
    let queryable = session
        .declare_queryable(key)
        .complete(true)
        .callback(move |query| match attachment_of(&query) {
            Ok(attachment) => {
                let (sender, command) = (Arc::clone(&sender), command.clone());
                let runtime = sender.runtime.clone();
                runtime.spawn(async move { sender.answer(&query, attachment, command).await });
            }
            Err(dropped) => sender.dropped.count(&dropped),
        });
    queryable.wait().map_err(anyhow::Error::from_boxed)
}

/// Returns the attachment of the response to a request.
fn attachment_of(query: &Query) -> Result<Vec<u8>, Dropped> {
    let request = query.payload().map(|bytes| bytes.to_bytes());
    decode::<TriggerRequest>(&request.unwrap_or_default())
        .map_err(|error| Dropped::new("request", error))?;
    let attachment = query.attachment().map(|bytes| bytes.to_bytes());
    #[expect(
        clippy::disallowed_methods,
        reason = "nodes of ROS measure the age of a response by the wall clock"
    )]
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let now_ns = i64::try_from(now.unwrap_or_default().as_nanos()).unwrap_or(i64::MAX);
    response_attachment(&attachment.unwrap_or_default(), now_ns)
        .ok_or_else(|| Dropped::new("attachment", "its attachment is not that of ROS"))
}

/// Executes the orders of a topic.
fn take_orders(
    session: &Session,
    key: String,
    sender: &Arc<Sender>,
) -> anyhow::Result<Subscriber<()>> {
    let sender = Arc::clone(sender);
    let subscriber =
        session
            .declare_subscriber(key)
            .callback(move |sample| match read_order(&sample) {
                Ok(command) => {
                    let (sender, runtime) = (Arc::clone(&sender), sender.runtime.clone());
                    runtime.spawn(async move { sender.execute(command).await });
                }
                Err(dropped) => sender.dropped.count(&dropped),
            });
    subscriber.wait().map_err(anyhow::Error::from_boxed)
}

fn read_order(sample: &Sample) -> Result<ControlCommand, Dropped> {
    let text = decode::<StringMessage>(&sample.payload().to_bytes())
        .map_err(|error| Dropped::new("order", error))?;
    serde_json::from_str(&text.data).map_err(|error| Dropped::new("order", error))
}

impl Sender {
    /// Answers a request with the effect of its command.
    async fn answer(&self, query: &Query, attachment: Vec<u8>, command: ControlCommand) {
        let sent = relay_command(&self.run, command).await;
        let response = TriggerResponse {
            success: sent.is_ok(),
            message: sent.unwrap_or_else(|error| format!("{error:#}")),
        };
        let key = query.key_expr().clone();
        let replied = query.reply(key, encode(&response)).attachment(attachment);
        if let Err(error) = replied.await {
            self.dropped.count(&Dropped::new("response", error));
        }
    }

    /// Executes an order, and publishes the reply.
    async fn execute(&self, command: ControlCommand) {
        let sent = relay_command(&self.run, command).await;
        let data =
            sent.unwrap_or_else(|error| json!({ "refused": format!("{error:#}") }).to_string());
        let (publisher, sequence) = &mut *self.replies.lock().await;
        *sequence += 1;
        let attachment = self.reply_topic.attachment(*sequence, 0).to_vec();
        let published = publisher
            .put(encode(&StringMessage { data }))
            .attachment(attachment);
        if let Err(error) = published.await {
            self.dropped.count(&Dropped::new("reply", error));
        }
    }
}

//! Topics of ROS 2 on zenoh, as `rmw_zenoh` has them.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use analysis::ros_messages::{Destination, TopicSpec};
use anyhow::Context;
use cluster::locator::Locator;
use ros::Qos;
use ros::rmw_zenoh::{Endpoint, Node};
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::time::Timestamp;
use zenoh::{Session, Wait};

/// Opens a session to the router of ROS, and waits until there is one.
///
/// - The session is a client. The router of ROS passes the messages of clients on, but not those between its peers.
/// - Timestamps are on. By them, a late subscriber recognizes a message that arrives twice.
/// - The sender waits for a second before it drops messages for a full queue, because only this process waits.
pub async fn connect(router: &Locator) -> anyhow::Result<Session> {
    connect_with_patience(router, Duration::from_secs(1)).await
}

/// Opens a session as [`connect`] does. The sender waits for `patience` before it drops messages.
pub async fn connect_with_patience(
    router: &Locator,
    patience: Duration,
) -> anyhow::Result<Session> {
    let wait_us = patience.as_micros();
    let config = format!(
        r#"{{
  mode: "client", listen: {{ endpoints: [] }},
  connect: {{
    endpoints: ["{router}"], timeout_ms: -1, exit_on_failure: false,
    retry: {{ period_init_ms: 100, period_max_ms: 1000, period_increase_factor: 2 }},
  }},
  scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
  timestamping: {{ enabled: true }},
  transport: {{
    link: {{ tx: {{ queue: {{ size: {{ data: 16 }}, congestion_control: {{ drop: {{ wait_before_drop: {wait_us} }} }} }} }} }},
    shared_memory: {{ enabled: false }},
  }},
}}"#
    );
    cluster::open(&config)
        .await
        .map_err(anyhow::Error::from_boxed)
        .with_context(|| format!("the zenoh router at {router}"))
}

/// The topics of a node.
pub struct RosTopics {
    session: Session,
    node: Node,
    topics: Vec<RosTopic>,
    /// `true` if messages are only stored for late subscribers.
    is_silent: bool,
    /// The token of the node, which must live as long as the node.
    _token: LivelinessToken,
}

struct RosTopic {
    name: String,
    endpoint: Endpoint,
    publisher: Publisher<'static>,
    /// The number of messages so far.
    sequence: i64,
    /// `None` for a topic without messages for late subscribers.
    cache: Option<Cache>,
    _token: LivelinessToken,
}

/// The latest message of a topic, and the answer to late subscribers.
struct Cache {
    latest: Arc<Mutex<Option<Sent>>>,
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

/// A message with everything that a subscriber receives.
#[derive(Clone)]
struct Sent {
    payload: ZBytes,
    attachment: ZBytes,
    time: Timestamp,
}

impl RosTopics {
    /// Creates the node `name` in a domain.
    pub fn new(session: Session, domain: u8, name: &'static str) -> anyhow::Result<Self> {
        let node = Node {
            domain,
            session: session.zid().to_string(),
            name,
        };
        Ok(Self {
            _token: declare_token(&session, &node.token())?,
            session,
            node,
            topics: Vec::new(),
            is_silent: false,
        })
    }

    /// Returns the session of the node.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the node, for the names of its subscriptions.
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Returns the publisher of a topic.
    pub fn endpoint(&self, name: &str) -> Option<&Endpoint> {
        let topic = self.topics.iter().find(|topic| topic.name == name)?;
        Some(&topic.endpoint)
    }

    /// Sets whether messages are only stored for late subscribers.
    pub fn set_silent(&mut self, is_silent: bool) {
        self.is_silent = is_silent;
    }

    /// Closes the session. ROS nodes then see that the publishers are gone.
    pub async fn close(self) {
        // The process ends in any case.
        let _ = self.session.close().await;
    }
}

impl Destination for RosTopics {
    fn add(&mut self, topic: TopicSpec) -> anyhow::Result<usize> {
        let number = self.topics.len() + 1;
        let endpoint = self
            .node
            .publisher(number, &topic.name, topic.message, topic.qos);
        let publisher = self
            .session
            .declare_publisher(endpoint.key.clone())
            .congestion_control(CongestionControl::Drop)
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        let cache = match topic.qos {
            Qos::Latched => Some(Cache::new(&self.session, &endpoint.key)?),
            Qos::Stream => None,
        };
        self.topics.push(RosTopic {
            _token: declare_token(&self.session, &endpoint.token)?,
            name: topic.name,
            endpoint,
            publisher,
            sequence: 0,
            cache,
        });
        Ok(self.topics.len() - 1)
    }

    fn put(&mut self, topic: usize, time_ns: u64, message: Vec<u8>) -> anyhow::Result<()> {
        let topic = &mut self.topics[topic];
        if self.is_silent && topic.cache.is_none() {
            return Ok(());
        }
        topic.sequence += 1;
        let time_ns = i64::try_from(time_ns).unwrap_or(i64::MAX);
        let attachment = topic.endpoint.attachment(topic.sequence, time_ns);
        let sent = Sent {
            payload: message.into(),
            attachment: attachment.to_vec().into(),
            time: self.session.new_timestamp(),
        };
        if let Some(cache) = &topic.cache {
            *cache.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(sent.clone());
        }
        if self.is_silent {
            return Ok(());
        }
        topic
            .publisher
            .put(sent.payload)
            .attachment(sent.attachment)
            .timestamp(sent.time)
            .wait()
            .map_err(anyhow::Error::from_boxed)
    }
}

impl Cache {
    /// Creates the cache of a key, in the form of the advanced publishers of zenoh-ext. A late subscriber of ROS queries
    /// the keys below `@adv`, and finds publishers that are later than itself by their tokens.
    fn new(session: &Session, key: &str) -> anyhow::Result<Self> {
        let latest = Arc::new(Mutex::new(None));
        let place = format!("{key}/@adv/pub/{}/uhlc/_", session.zid());
        let (answered, key) = (Arc::clone(&latest), key.to_owned());
        let queryable = session
            .declare_queryable(&place)
            .callback(move |query| {
                let sent = answered.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(sent) = sent.clone()
                    && let Err(error) = reply(&query, &key, sent)
                {
                    tracing::warn!("a late subscriber of {key} was not answered: {error}");
                }
            })
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        Ok(Self {
            latest,
            _queryable: queryable,
            _token: declare_token(session, &place)?,
        })
    }
}

fn reply(query: &Query, key: &str, sent: Sent) -> zenoh::Result<()> {
    query
        .reply(key.to_owned(), sent.payload)
        .attachment(sent.attachment)
        .timestamp(sent.time)
        .wait()
}

/// Declares a token of the ROS graph, which ends with the returned value.
pub fn declare_token(session: &Session, key: &str) -> anyhow::Result<LivelinessToken> {
    session
        .liveliness()
        .declare_token(key.to_owned())
        .wait()
        .map_err(anyhow::Error::from_boxed)
}

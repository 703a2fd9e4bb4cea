//! The topic `/clock` of a team in which several robots have nodes as controllers: one of their agents publishes the time.
//!
//! Each agent also receives the topic, and leaves it to the agent with the smallest id. If that agent is silent, the next
//! one continues. All agents are in the same tick, so the time does not go back.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use analysis::ros_messages::CLOCK;
use ros::messages::Clock;
use ros::rmw_zenoh::{Endpoint, EndpointId, publisher_of};
use ros::{Message, Qos};
use tokio::time::Instant;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use crate::ros::topics::{RosTopics, declare_token};

/// The wall-clock time without a message after which another agent publishes the time.
const SILENCE: Duration = Duration::from_millis(500);

/// The decision whether this agent publishes the time.
pub struct ClockDuty {
    precedence: Arc<Mutex<Precedence>>,
    /// The subscription, which must live as long as the value.
    _subscriber: (Subscriber<()>, LivelinessToken),
}

/// The agents that precede this one.
#[derive(Debug)]
struct Precedence {
    own: EndpointId,
    /// The arrival of the latest message of an agent with a smaller id.
    latest: Option<Instant>,
}

impl Precedence {
    fn new(own: EndpointId) -> Self {
        Self { own, latest: None }
    }

    /// Handles a message with this attachment.
    fn receive(&mut self, attachment: &[u8], now: Instant) {
        if publisher_of(attachment).is_some_and(|id| id < self.own) {
            self.latest = Some(now);
        }
    }

    /// Returns whether no other agent precedes.
    fn is_first(&self, now: Instant) -> bool {
        self.latest
            .is_none_or(|at| now.duration_since(at) > SILENCE)
    }
}

impl ClockDuty {
    /// Subscribes to the topic. The agent's own publisher is `clock`, and `number` is that of the subscription.
    pub fn new(
        session: &Session,
        topics: &RosTopics,
        clock: &Endpoint,
        number: usize,
    ) -> anyhow::Result<Self> {
        let node = topics.node();
        let endpoint = node.subscriber(number, CLOCK, Clock::MESSAGE, Qos::Stream);
        let precedence = Arc::new(Mutex::new(Precedence::new(clock.id)));
        let receiving = Arc::clone(&precedence);
        let subscriber = session
            .declare_subscriber(endpoint.key)
            .callback(move |sample| {
                if let Some(attachment) = sample.attachment() {
                    let mut precedence = receiving.lock().unwrap_or_else(PoisonError::into_inner);
                    precedence.receive(&attachment.to_bytes(), Instant::now());
                }
            })
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        let token = declare_token(session, &endpoint.token)?;
        Ok(Self {
            precedence,
            _subscriber: (subscriber, token),
        })
    }

    /// Returns whether this agent publishes the time.
    pub fn is_ours(&self) -> bool {
        let precedence = self
            .precedence
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        precedence.is_first(Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use ros::rmw_zenoh::Node;

    use super::*;

    fn clock(name: &'static str) -> Endpoint {
        let session = "1".to_owned();
        let node = Node {
            domain: 0,
            session,
            name,
        };
        node.publisher(1, CLOCK, Clock::MESSAGE, Qos::Stream)
    }

    #[test]
    fn the_agent_with_the_smallest_id_publishes_and_the_next_one_replaces_it() {
        let mut clocks = [clock("alliance_blue"), clock("alliance_gold")];
        clocks.sort_by_key(|clock| clock.id);
        let mut agents = clocks.clone().map(|clock| Precedence::new(clock.id));
        let start = Instant::now();
        assert!(agents.iter().all(|agent| agent.is_first(start)));
        for clock in &clocks {
            for agent in &mut agents {
                agent.receive(&clock.attachment(1, 1), start);
                // Bytes of any other program.
                agent.receive(&[0; 20], start);
            }
        }
        let is_first = |at| [agents[0].is_first(at), agents[1].is_first(at)];
        assert_eq!(is_first(start + SILENCE / 2), [true, false]);
        assert_eq!(is_first(start + SILENCE * 2), [true, true]);
    }
}

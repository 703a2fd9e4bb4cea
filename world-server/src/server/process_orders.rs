//! Orders to the launcher, which applies process faults to the agents' processes.

use std::sync::{Arc, Weak};
use std::time::Duration;

use proto::process::{ProcessAction, ProcessOrder, ProcessReply};
use proto::secret::OpenError;
use scenario::ids::RobotId;
use tokio::time::Instant;
use zenoh::Wait;
use zenoh::query::{ConsolidationMode, QueryTarget};

use super::{Server, lock};

/// The maximum time for a process to join or end after the launcher has carried out an order. It is far longer than needed on a
/// busy machine, so that exceeding it means a defect. There is no limit for the launcher itself, because a stopped launcher may
/// be resumed at any time.
const ACT_DEADLINE: Duration = Duration::from_secs(30);

pub(super) struct CurrentOrder {
    order: ProcessOrder,
    robot: RobotId,
    /// Invalid after the query has ended, with or without an answer.
    query: Weak<()>,
    answered: Option<Instant>,
    /// The id of the process that the launcher has started.
    started: Option<u32>,
}

impl Server {
    /// Sends pending process orders to the launcher, one after the other.
    pub(super) fn send_pending_orders(&mut self) {
        while let Some((robot, act)) = self.simulation.next_act() {
            self.orders += 1;
            let order = ProcessOrder {
                number: self.orders,
                robot: self.peers[robot.index()].name.clone(),
                pid: self.peers[robot.index()].pid,
                act,
            };
            tracing::info!(
                robot = order.robot,
                ?act,
                "sending an order to the launcher"
            );
            self.under_way = Some(CurrentOrder {
                order,
                robot,
                query: Weak::new(),
                answered: None,
                started: None,
            });
            self.send_order();
        }
    }

    fn send_order(&mut self) {
        let Some(current) = &self.under_way else {
            return;
        };
        let number = current.order.number;
        match self.query_launcher(&current.order) {
            Ok(query) => {
                if let Some(current) = &mut self.under_way {
                    current.query = query;
                }
            }
            Err(why) => self.act_done(number, Err(why)),
        }
    }

    fn query_launcher(&self, order: &ProcessOrder) -> Result<Weak<()>, String> {
        let robot = self.robot_named(&order.robot).ok_or("no such robot")?;
        let host = self.seals.host_of(robot);
        let secret = self.seals.host(host).ok_or("no such host")?.clone();
        let key = self.keys.process_order(host);
        let payload = secret
            .seal(&key, order)
            .map_err(|error| error.to_string())?;
        let server = Weak::clone(&self.this);
        // `open` is dropped together with the callback when the query ends.
        let open = Arc::new(());
        let query = Arc::downgrade(&open);
        self.session
            .get(self.keys.process(host))
            .payload(payload)
            // Other members may answer as well. Only an answer with the launcher's seal is valid.
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(ACT_DEADLINE)
            .callback(move |reply| {
                let _ = &open;
                let Ok(sample) = reply.into_result() else {
                    // The query has timed out. The regular clock check detects that as well.
                    return;
                };
                let answer = secret.open::<ProcessReply>(&key, &sample.payload().to_bytes());
                if let Some(server) = server.upgrade() {
                    lock(&server).launcher_answered(answer);
                }
            })
            .wait()
            .map_err(|error| error.to_string())?;
        Ok(query)
    }

    fn launcher_answered(&mut self, answer: Result<ProcessReply, OpenError>) {
        match answer {
            Ok(reply) => {
                // The answer to an earlier order may arrive after its effect, when the next order has already been sent.
                if let Some(current) = &mut self.under_way
                    && current.order.number == reply.number
                {
                    current.answered.get_or_insert_with(Instant::now);
                    current.started = reply.result.as_ref().ok().copied();
                }
                self.act_done(reply.number, reply.result.map(drop));
                self.advance();
            }
            Err(error) => self.refuse("process", &error),
        }
    }

    fn act_done(&mut self, number: u64, result: Result<(), String>) {
        match &self.under_way {
            Some(current) if current.order.number == number => {
                let (robot, act) = (current.robot, current.order.act);
                if act == ProcessAction::Continue {
                    // The launcher's own report of the new state may arrive later.
                    self.peers[robot.index()].stopped = false;
                }
                self.simulation.act_done(robot, act, result);
            }
            _ => self.refuse("process", &"stale"),
        }
    }

    /// Fails the current start order if its process has ended before it joined.
    pub(super) fn fail_start(&mut self, pid: u32) {
        if let Some(current) = &self.under_way
            && current.order.act == ProcessAction::Start
            && current.started == Some(pid)
            && self.simulation.awaits_act()
        {
            let why = "its process ended before it joined".to_owned();
            self.simulation
                .act_done(current.robot, current.order.act, Err(why));
        }
    }

    /// Returns the robot, the act and the started process of the current order, if it is not done yet.
    pub(super) fn act_under_way(&self) -> Option<(RobotId, ProcessAction, Option<u32>)> {
        let current = self.under_way.as_ref();
        let current = current.filter(|_| self.simulation.awaits_act())?;
        Some((current.robot, current.order.act, current.started))
    }

    /// Sends the current order again if its query ended without an answer, because a launcher that is still connecting may have
    /// missed it. The launcher carries out each order once. Fails the order after its deadline.
    pub(super) fn check_current_order(&mut self, now: Instant) {
        let Some(current) = &self.under_way else {
            return;
        };
        if !self.simulation.awaits_act() {
            return;
        }
        let is_late = |answered: Instant| now.duration_since(answered) > ACT_DEADLINE;
        if current.answered.is_some_and(is_late) {
            let late = format!("not done within {} s", ACT_DEADLINE.as_secs());
            self.simulation
                .act_done(current.robot, current.order.act, Err(late));
        } else if current.answered.is_none() && current.query.strong_count() == 0 {
            self.send_order();
        }
    }

    /// Puts the server behind its lock, with a weak reference to itself for callbacks.
    pub fn shared(server: Self) -> Arc<std::sync::Mutex<Self>> {
        Arc::new_cyclic(|this| {
            std::sync::Mutex::new(Self {
                this: Weak::clone(this),
                ..server
            })
        })
    }
}

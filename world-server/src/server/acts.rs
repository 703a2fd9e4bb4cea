//! What faults ask of processes goes to the launcher, which owns them.

use std::sync::{Arc, Weak};
use std::time::Duration;

use alliance_proto::ids::RobotId;
use alliance_proto::process::{ProcessAct, ProcessOrder, ProcessReply};
use alliance_proto::secret::OpenError;
use tokio::time::Instant;
use zenoh::Wait;
use zenoh::query::{ConsolidationMode, QueryTarget};

use super::{Server, lock};

/// How long a process may take to join, or to end, once the launcher has done its part. Far more than it needs on the busiest
/// machine: it decides only that something is broken. For the launcher itself the run waits as long as that lives, for a stopped one
/// may go on at any time.
const ACT_DEADLINE: Duration = Duration::from_secs(30);

/// What the launcher is doing.
pub(super) struct UnderWay {
    order: ProcessOrder,
    robot: RobotId,
    /// Dead once the query is over, be it answered or not.
    query: Weak<()>,
    answered: Option<Instant>,
    /// The process that was started.
    started: Option<u32>,
}

impl Server {
    /// Passes on what is to be done to processes, one act after the other.
    pub(super) fn carry_out(&mut self) {
        while let Some((robot, act)) = self.simulation.next_act() {
            self.orders += 1;
            let order = ProcessOrder {
                number: self.orders,
                robot: self.peers[robot.index()].name.clone(),
                pid: self.peers[robot.index()].pid,
                act,
            };
            tracing::info!(robot = order.robot, ?act, "asks the launcher");
            self.under_way = Some(UnderWay {
                order,
                robot,
                query: Weak::new(),
                answered: None,
                started: None,
            });
            self.ask_launcher();
        }
    }

    /// Sends the order that is under way.
    fn ask_launcher(&mut self) {
        let Some(asked) = &self.under_way else { return };
        let number = asked.order.number;
        match self.query_launcher(&asked.order) {
            Ok(query) => {
                if let Some(asked) = &mut self.under_way {
                    asked.query = query;
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
        let me = Weak::clone(&self.me);
        // The callback, and this with it, is dropped when the query is over.
        let open = Arc::new(());
        let query = Arc::downgrade(&open);
        self.session
            .get(self.keys.process(host))
            .payload(payload)
            // Anybody may answer; only what the launcher sealed is an answer.
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(ACT_DEADLINE)
            .callback(move |reply| {
                let _ = &open;
                let Ok(sample) = reply.into_result() else {
                    // Time has run out, which the clock sees as well.
                    return;
                };
                let answer = secret.open::<ProcessReply>(&key, &sample.payload().to_bytes());
                if let Some(server) = me.upgrade() {
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
                // The answer to the order before may come when its effect has been seen already, and the next one given.
                if let Some(asked) = &mut self.under_way
                    && asked.order.number == reply.number
                {
                    asked.answered.get_or_insert_with(Instant::now);
                    asked.started = reply.result.as_ref().ok().copied();
                }
                self.act_done(reply.number, reply.result.map(drop));
                self.pump();
            }
            Err(error) => self.refuse("process", &error),
        }
    }

    fn act_done(&mut self, number: u64, result: Result<(), String>) {
        match &self.under_way {
            Some(asked) if asked.order.number == number => {
                let (robot, act) = (asked.robot, asked.order.act);
                if act == ProcessAct::Continue {
                    // The launcher's news of it may come later.
                    self.peers[robot.index()].stopped = false;
                }
                self.simulation.act_done(robot, act, result);
            }
            _ => self.refuse("process", &"stale"),
        }
    }

    /// A process that was started and has ended before it joined will not join.
    pub(super) fn stillborn(&mut self, pid: u32) {
        if let Some(asked) = &self.under_way
            && asked.order.act == ProcessAct::Start
            && asked.started == Some(pid)
            && self.simulation.awaits_act()
        {
            let why = "its process ended before it joined".to_owned();
            self.simulation
                .act_done(asked.robot, asked.order.act, Err(why));
        }
    }

    /// What is under way with a process: to which robot, what, and the process that the launcher has started for it.
    pub(super) fn act_under_way(&self) -> Option<(RobotId, ProcessAct, Option<u32>)> {
        let asked = self.under_way.as_ref();
        let asked = asked.filter(|_| self.simulation.awaits_act())?;
        Some((asked.robot, asked.order.act, asked.started))
    }

    /// Asks again where nobody has answered, for a launcher that is still on its way to the bus has not heard it; one that has does
    /// it once.
    pub(super) fn look_after_act(&mut self, now: Instant) {
        let Some(asked) = &self.under_way else { return };
        if !self.simulation.awaits_act() {
            return;
        }
        let is_late = |answered: Instant| now.duration_since(answered) > ACT_DEADLINE;
        if asked.answered.is_some_and(is_late) {
            let late = format!("not done within {} s", ACT_DEADLINE.as_secs());
            self.simulation
                .act_done(asked.robot, asked.order.act, Err(late));
        } else if asked.answered.is_none() && asked.query.strong_count() == 0 {
            self.ask_launcher();
        }
    }

    /// The server behind its lock, which it has to know to be called back.
    pub fn shared(server: Self) -> Arc<std::sync::Mutex<Self>> {
        Arc::new_cyclic(|me| {
            std::sync::Mutex::new(Self {
                me: Weak::clone(me),
                ..server
            })
        })
    }
}

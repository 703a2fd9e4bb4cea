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

/// How long the launcher and the process may take. Far more than they need on the busiest machine: it decides only that
/// something is broken.
const ACT_DEADLINE: Duration = Duration::from_secs(30);

/// What the launcher is doing.
pub(super) struct UnderWay {
    number: u64,
    robot: RobotId,
    act: ProcessAct,
    since: Instant,
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
                number: order.number,
                robot,
                act,
                since: Instant::now(),
                started: None,
            });
            if let Err(why) = self.ask_launcher(&order) {
                self.act_done(order.number, Err(why));
            }
        }
    }

    fn ask_launcher(&self, order: &ProcessOrder) -> Result<(), String> {
        let key = self.keys.process_order();
        let payload = self
            .secret
            .seal(&key, order)
            .map_err(|error| error.to_string())?;
        let (me, secret) = (Weak::clone(&self.me), self.secret.clone());
        self.session
            .get(self.keys.process())
            .payload(payload)
            // Anybody may answer; only what the launcher sealed is an answer.
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(ACT_DEADLINE)
            .callback(move |reply| {
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
            .map_err(|error| error.to_string())
    }

    fn launcher_answered(&mut self, answer: Result<ProcessReply, OpenError>) {
        match answer {
            Ok(reply) => {
                // The answer to the order before may come when its effect has been seen already, and the next one given.
                if let (Some(asked), Ok(pid)) = (&mut self.under_way, &reply.result)
                    && asked.number == reply.number
                {
                    asked.started = Some(*pid);
                }
                self.act_done(reply.number, reply.result.map(drop));
                self.pump();
            }
            Err(error) => self.refuse("process", &error),
        }
    }

    fn act_done(&mut self, number: u64, result: Result<(), String>) {
        match &self.under_way {
            Some(asked) if asked.number == number => {
                let (robot, act) = (asked.robot, asked.act);
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
            && asked.act == ProcessAct::Start
            && asked.started == Some(pid)
            && self.simulation.awaits_act()
        {
            let why = "its process ended before it joined".to_owned();
            self.simulation.act_done(asked.robot, asked.act, Err(why));
        }
    }

    /// Nothing is waited for forever.
    pub(super) fn give_up_late_act(&mut self, now: Instant) {
        if self.simulation.awaits_act()
            && let Some(asked) = &self.under_way
            && now.duration_since(asked.since) > ACT_DEADLINE
        {
            let late = format!("not done within {} s", ACT_DEADLINE.as_secs());
            self.simulation.act_done(asked.robot, asked.act, Err(late));
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

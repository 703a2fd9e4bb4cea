//! The launcher's connection to the bus: it receives views, news and process orders, and reports process states to the world.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cluster::rendezvous::{ConnectionRole, Rendezvous};
use proto::keys::{KeyExpressions, LAUNCHER_HOST};
use proto::process::{ProcessNews, ProcessOrder, ProcessReply, ProcessState};
use proto::secret::Secret;
use proto::view::View;
use tokio::sync::{mpsc, watch};
use zenoh::Session;
use zenoh::query::Query;

use super::news::RunNews;
use crate::observer::Observer;

/// The capacity of the queues for orders and lines. The world sends one order at a time.
const QUEUE_CAPACITY: usize = 256;

pub struct LauncherBus {
    session: Session,
    keys: KeyExpressions,
    secret: Secret,
    /// The name of this host; [`LAUNCHER_HOST`] for the launcher of a run.
    host: String,
    report_count: u64,
    latest_order: u64,
    latest_reply: Option<ProcessReply>,
    orders: mpsc::Receiver<(ProcessOrder, Query)>,
    lines: mpsc::Receiver<String>,
}

/// A received message that the launcher must handle.
pub enum BusMessage {
    /// An order of the world for one process.
    Order(ProcessOrder, Query),
    /// A line about the run, for the user.
    Line(String),
}

impl LauncherBus {
    /// Joins a run. `news` receives all events and views.
    pub async fn join(
        run: &str,
        views: watch::Sender<Option<View>>,
        news: Arc<Mutex<RunNews>>,
    ) -> anyhow::Result<Self> {
        let observer = Observer::join(Rendezvous::find(Some(run))?, ConnectionRole::Team).await?;
        let (line_sender, lines) = mpsc::channel(QUEUE_CAPACITY);
        let send = move |found: Vec<String>| {
            for line in found {
                // A full queue drops lines: they are only displayed.
                let _ = line_sender.try_send(line);
            }
        };
        let (of_views, send_views) = (Arc::clone(&news), send.clone());
        observer
            .on_view(move |view| {
                send_views(lock(&of_views).see(&view));
                // A repeated view is not newer.
                views.send_if_modified(|shown| {
                    let newer = shown.as_ref().is_none_or(|shown| shown.tick <= view.tick);
                    if newer {
                        *shown = Some(view);
                    }
                    newer
                });
            })
            .await?;
        observer
            .on_events(move |events| send(lock(&news).add(&events)))
            .await?;

        let Observer {
            keys,
            secret,
            session,
            ..
        } = observer;
        Self::open(session, keys, secret, LAUNCHER_HOST, lines).await
    }

    /// Creates the connection of a host daemon, which receives no views and no news.
    pub async fn join_as_host(
        session: Session,
        keys: KeyExpressions,
        secret: Secret,
        host: &str,
    ) -> anyhow::Result<Self> {
        let (_, lines) = mpsc::channel(1);
        Self::open(session, keys, secret, host, lines).await
    }

    async fn open(
        session: Session,
        keys: KeyExpressions,
        secret: Secret,
        host: &str,
        lines: mpsc::Receiver<String>,
    ) -> anyhow::Result<Self> {
        let (order_sender, orders) = mpsc::channel(QUEUE_CAPACITY);
        let (opener, key) = (secret.clone(), keys.process_order(host));
        session
            .declare_queryable(keys.process(host))
            .callback(move |query| {
                let payload = query.payload().map(|payload| payload.to_bytes());
                let order = opener.open::<ProcessOrder>(&key, &payload.unwrap_or_default());
                if let Ok(order) = order {
                    // An order that does not fit is not answered; the world detects this.
                    let _ = order_sender.try_send((order, query));
                }
            })
            .background()
            .await
            .map_err(anyhow::Error::from_boxed)?;

        Ok(Self {
            session,
            keys,
            secret,
            host: host.to_owned(),
            report_count: 0,
            latest_order: 0,
            latest_reply: None,
            orders,
            lines,
        })
    }

    /// Waits for the next order or line.
    pub async fn call(&mut self) -> BusMessage {
        loop {
            tokio::select! {
                Some((order, query)) = self.orders.recv() => {
                    if order.number > self.latest_order {
                        self.latest_order = order.number;
                        return BusMessage::Order(order, query);
                    }
                    // A repeated order is executed once and answered again, because the first answer may have been lost.
                    self.reply(&query).await;
                }
                Some(line) = self.lines.recv() => return BusMessage::Line(line),
                // The session is closed. Callers wait for the end of processes, too.
                else => return std::future::pending().await,
            }
        }
    }

    /// Sends the result of an order, and stores it for repetitions of that order.
    pub async fn answer(&mut self, query: &Query, number: u64, result: anyhow::Result<u32>) {
        self.latest_reply = Some(ProcessReply {
            number,
            result: result.map_err(|error| format!("{error:#}")),
        });
        self.reply(query).await;
    }

    async fn reply(&self, query: &Query) {
        let Some(reply) = &self.latest_reply else {
            return;
        };
        if let Ok(bytes) = self
            .secret
            .seal(&self.keys.process_order(&self.host), reply)
        {
            // If the answer is lost, the world repeats its order.
            let _ = query.reply(self.keys.process(&self.host), bytes).await;
        }
    }

    /// Reports the state of an agent's process to the world.
    pub async fn report_state(&mut self, robot: &str, pid: u32, state: ProcessState) {
        self.report_count += 1;
        let news = ProcessNews {
            number: self.report_count,
            robot: robot.to_owned(),
            pid,
            state,
        };
        if let Ok(bytes) = self.secret.seal(&self.keys.process(&self.host), &news) {
            // If the report is lost, the world detects the change by its stall deadline.
            let _ = self.session.put(self.keys.process(&self.host), bytes).await;
        }
    }

    /// Returns the lines that have been received and not yet handled.
    pub fn take_lines(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.lines.try_recv().ok()).collect()
    }

    pub async fn close(self) {
        // The world has ended, so closing may hang or fail. The process ends in any case.
        let _ = self.session.close().await;
    }
}

/// Locks the news. A panic ends the process, so the lock is never poisoned.
pub(super) fn lock(news: &Mutex<RunNews>) -> MutexGuard<'_, RunNews> {
    news.lock().unwrap_or_else(PoisonError::into_inner)
}

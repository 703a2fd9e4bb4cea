//! The launcher's place on the bus: it sees how the run goes, tells the world what has become of processes, and takes its
//! orders.

use alliance_proto::event::EventLine;
use alliance_proto::keys::{Keys, LAUNCHER_HOST};
use alliance_proto::process::{ProcessNews, ProcessOrder, ProcessReply, ProcessState};
use alliance_proto::rendezvous::{Rendezvous, User};
use alliance_proto::secret::Secret;
use alliance_proto::view::View;
use tokio::sync::{mpsc, watch};
use zenoh::Session;
use zenoh::query::Query;

use crate::observer::Observer;

/// Orders and events that may wait to be looked at. The world gives one order at a time.
const WAITING: usize = 256;

/// A session, and what comes over it.
pub struct Bus {
    session: Session,
    keys: Keys,
    secret: Secret,
    /// Name of this host.
    host: String,
    /// Number of the latest news.
    news: u64,
    /// Number of the latest order.
    obeyed: u64,
    /// What came of it.
    latest: Option<ProcessReply>,
    orders: mpsc::Receiver<(ProcessOrder, Query)>,
    events: mpsc::Receiver<EventLine>,
}

/// What wakes the launcher.
pub enum Call {
    /// The world wants something done to a process.
    Order(ProcessOrder, Query),
    /// Something happened in the run.
    Event(EventLine),
}

impl Bus {
    /// Joins a run that is announced.
    ///
    /// # Errors
    /// When the run cannot be found or the bus fails.
    pub async fn join(run: &str, views: watch::Sender<Option<View>>) -> anyhow::Result<Self> {
        let observer = Observer::join(Rendezvous::find(Some(run))?, User::Team).await?;
        let (tell_event, events) = mpsc::channel(WAITING);
        observer
            .on_view(move |view| {
                // One that is put again is no newer.
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
            .on_events(move |news| {
                for line in news.events {
                    // The log has them all; this is for eyes.
                    let _ = tell_event.try_send(line);
                }
            })
            .await?;

        let Observer {
            keys,
            secret,
            session,
            ..
        } = observer;
        Self::open(session, keys, secret, LAUNCHER_HOST, events).await
    }

    /// The place of a host's launcher, which sees nothing of the run.
    ///
    /// # Errors
    /// When the bus fails.
    pub async fn of_host(
        session: Session,
        keys: Keys,
        secret: Secret,
        host: &str,
    ) -> anyhow::Result<Self> {
        let (_, events) = mpsc::channel(1);
        Self::open(session, keys, secret, host, events).await
    }

    async fn open(
        session: Session,
        keys: Keys,
        secret: Secret,
        host: &str,
        events: mpsc::Receiver<EventLine>,
    ) -> anyhow::Result<Self> {
        let (give_order, orders) = mpsc::channel(WAITING);
        let (opener, key) = (secret.clone(), keys.process_order(host));
        session
            .declare_queryable(keys.process(host))
            .callback(move |query| {
                let payload = query.payload().map(|payload| payload.to_bytes());
                let order = opener.open::<ProcessOrder>(&key, &payload.unwrap_or_default());
                if let Ok(order) = order {
                    // An order that finds no place is one that is not answered, which the world sees.
                    let _ = give_order.try_send((order, query));
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
            news: 0,
            obeyed: 0,
            latest: None,
            orders,
            events,
        })
    }

    /// The next thing that comes over the bus.
    pub async fn call(&mut self) -> Call {
        loop {
            tokio::select! {
                Some((order, query)) = self.orders.recv() => {
                    if order.number > self.obeyed {
                        self.obeyed = order.number;
                        return Call::Order(order, query);
                    }
                    // One that is put again is done once, and answered again: the answer may have come too late.
                    self.reply(&query).await;
                }
                Some(line) = self.events.recv() => return Call::Event(line),
            }
        }
    }

    /// Answers an order.
    pub async fn answer(&mut self, query: &Query, number: u64, result: anyhow::Result<u32>) {
        self.latest = Some(ProcessReply {
            number,
            result: result.map_err(|error| format!("{error:#}")),
        });
        self.reply(query).await;
    }

    async fn reply(&self, query: &Query) {
        let Some(reply) = &self.latest else { return };
        if let Ok(bytes) = self
            .secret
            .seal(&self.keys.process_order(&self.host), reply)
        {
            // For an answer that is lost the world asks again.
            let _ = query.reply(self.keys.process(&self.host), bytes).await;
        }
    }

    /// Tells the world what has become of an agent's process.
    pub async fn tell(&mut self, robot: &str, pid: u32, state: ProcessState) {
        self.news += 1;
        let news = ProcessNews {
            number: self.news,
            robot: robot.to_owned(),
            pid,
            state,
        };
        if let Ok(bytes) = self.secret.seal(&self.keys.process(&self.host), &news) {
            // Lost news only means that the stall deadline has to find out.
            let _ = self.session.put(self.keys.process(&self.host), bytes).await;
        }
    }

    /// Leaves.
    pub async fn close(self) {
        // The world is gone already, and a session may hang over it: the process ends whether or not it closes.
        let _ = self.session.close().await;
    }
}

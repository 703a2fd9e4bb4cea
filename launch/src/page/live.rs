//! A live run as received over the bus. Pages receive the newest state, and slow pages do not delay the run.

use missions::Registry;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, bail};
use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use cluster::rendezvous::{ConnectionRole, Rendezvous};
use observation::about::about;
use observation::feed::Feed;
use proto::control::{ControlCommand, Reply};
use proto::event::TickEvents;
use proto::tick::Outcome;
use proto::view::View;
use scenario::Setup;
use serde_json::{Value, json};
use tokio::sync::{broadcast, watch};
use zenoh::sample::SampleKind;

use crate::control;
use crate::observer::Observer;

/// The number of frames in the queue of a slow page. The page receives the number of dropped frames.
const FRAME_QUEUE: usize = 1024;

/// The state behind `GET /api/run`, the WebSocket and `POST /api/control`.
pub struct Live {
    observer: Observer,
    about: Value,
    folder: String,
    received: Arc<Received>,
}

/// The data received over the bus, and the channels to open pages.
struct Received {
    feed: Mutex<Feed>,
    /// The newest view, as a frame.
    view: watch::Sender<Utf8Bytes>,
    /// Events, message receptions and curve corners, as frames.
    news: broadcast::Sender<Utf8Bytes>,
    /// `Some` if the run is over, with its outcome if known.
    over: watch::Sender<Option<Option<Outcome>>>,
    /// `true` if this process ends, although the run may continue.
    leaving: watch::Sender<bool>,
}

impl Live {
    /// Joins a run and subscribes to it. With `stays`, the same link shows the log afterwards.
    ///
    /// # Errors
    /// If the run cannot be reached or returns no description.
    pub async fn join(run: Rendezvous, stays: bool) -> anyhow::Result<Arc<Self>> {
        let observer = Observer::join(run, ConnectionRole::Operator).await?;
        let described = control::query(&observer, ControlCommand::Describe).await?;
        let Reply::Description(description) = described else {
            bail!("run '{}' returned no description", observer.run.run);
        };
        let described = "the world's description of the run";
        let vocabulary = Registry::current().vocabulary();
        let setup = Setup::from_json(&description.setup, &vocabulary)
            .map_err(anyhow::Error::msg)
            .context(described)?;
        let received = Arc::new(Received::new(&setup));

        let receiver = Arc::clone(&received);
        observer
            .on_events(move |news| receiver.events(&news))
            .await?;
        let receiver = Arc::clone(&received);
        observer.on_view(move |view| receiver.view(view)).await?;
        let receiver = Arc::clone(&received);
        observer
            .session
            .liveliness()
            .declare_subscriber(observer.keys.alive_world())
            .history(true)
            .callback(move |sample| {
                if sample.kind() == SampleKind::Delete {
                    receiver.end(None);
                }
            })
            .background()
            .await
            .map_err(anyhow::Error::from_boxed)?;

        let folder = description.folder;
        let mut about = about("live", &observer.run.run, &folder, &setup, Value::Null);
        about["stays"] = stays.into();
        Ok(Arc::new(Self {
            observer,
            about,
            folder,
            received,
        }))
    }

    /// Returns the constant description of the run.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// Waits until the run is over. Returns its outcome if known.
    pub async fn over(&self) -> Option<Outcome> {
        let mut over = self.received.over.subscribe();
        // The sender is never dropped before `self`.
        over.wait_for(Option::is_some)
            .await
            .ok()
            .and_then(|outcome| outcome.flatten())
    }

    pub fn close_pages(&self) {
        self.received.leaving.send_replace(true);
    }

    /// Waits for [`Self::leave`].
    async fn left(&self) {
        let mut leaving = self.received.leaving.subscribe();
        // The sender is never dropped before `self`.
        let _ = leaving.wait_for(|leaving| *leaving).await;
    }

    pub async fn wait_for_no_pages(&self) {
        self.received.view.closed().await;
    }

    /// Sends a command of a page to the world and returns the reply.
    pub async fn send_command(&self, command: ControlCommand) -> anyhow::Result<Reply> {
        control::query(&self.observer, command).await
    }

    /// Sends all frames to a page until it disconnects or the run ends.
    pub async fn serve_page(&self, mut page: WebSocket) {
        let mut view = self.received.view.subscribe();
        view.mark_changed();
        let (past, mut news) = self.received.catch_up();
        if page.send(Message::Text(past)).await.is_err() {
            return;
        }
        loop {
            let frame = tokio::select! {
                // In this order, so that all received frames are sent before the end of the run.
                biased;
                message = page.recv() => match message {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                    // Messages of a page are ignored.
                    Some(Ok(_)) => continue,
                },
                frame = news.recv() => match frame {
                    Ok(frame) => frame,
                    Err(broadcast::error::RecvError::Lagged(count)) => {
                        json!({"missed": count}).to_string().into()
                    }
                    Err(broadcast::error::RecvError::Closed) => return,
                },
                Ok(()) = view.changed() => {
                    let view = view.borrow_and_update().clone();
                    if view.is_empty() {
                        // No view has arrived yet.
                        continue;
                    }
                    view
                }
                () = self.left() => {
                    let _ = page.send(Message::Close(None)).await;
                    return;
                }
                outcome = self.over() => {
                    let ended = json!({"ended": {"outcome": outcome, "folder": self.folder}});
                    // The page may already be closed.
                    let _ = page.send(Message::Text(ended.to_string().into())).await;
                    if page.send(Message::Close(None)).await.is_ok() {
                        // The answer to the close frame confirms that all earlier frames have arrived.
                        while let Some(Ok(_)) = page.recv().await {}
                    }
                    return;
                }
            };
            if page.send(Message::Text(frame)).await.is_err() {
                return;
            }
        }
    }
}

impl Received {
    /// Creates the state of a run without data.
    fn new(setup: &Setup) -> Self {
        Self {
            feed: Mutex::new(Feed::new(setup)),
            view: watch::Sender::default(),
            news: broadcast::Sender::new(FRAME_QUEUE),
            over: watch::Sender::default(),
            leaving: watch::Sender::default(),
        }
    }

    /// Stores a view unless it is outdated. Its news go to the frame queue, because pages may skip views.
    fn view(&self, view: View) {
        let outcome = view.outcome;
        let mut feed = self.feed();
        let Some(frames) = feed.add_view(view) else {
            return;
        };
        for frame in frames.news {
            // Under the lock, as with events. An error means that no page is connected.
            let _ = self.news.send(frame.into());
        }
        self.view.send_replace(frames.view.into());
        drop(feed);
        if outcome.is_some() {
            self.end(outcome);
        }
    }

    /// Sends events to the pages, under the lock, so that a page that catches up receives each event exactly once.
    fn events(&self, news: &TickEvents) {
        let mut feed = self.feed();
        if let Some(frame) = feed.add_events(news) {
            // An error means that no page is connected.
            let _ = self.news.send(frame.into());
        }
    }

    fn end(&self, outcome: Option<Outcome>) {
        self.over.send_if_modified(|over| {
            let first = over.is_none();
            over.get_or_insert(outcome);
            first
        });
    }

    /// Returns the history as a frame, and the receiver of all later frames.
    fn catch_up(&self) -> (Utf8Bytes, broadcast::Receiver<Utf8Bytes>) {
        let feed = self.feed();
        (feed.past().into(), self.news.subscribe())
    }

    /// Locks the feed. A panic ends the process, so the lock is never poisoned.
    fn feed(&self) -> MutexGuard<'_, Feed> {
        self.feed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use proto::event::EventLine;
    use proto::telemetry::BehaviorState;
    use proto::view::Corner;
    use scenario::ids::{BehaviorId, RobotId};
    use scenario::testkit::default_setup;
    use scenario::time::SimTime;
    use tokio::sync::broadcast::error::TryRecvError;

    use super::*;

    fn view(tick: u64, outcome: Option<Outcome>) -> View {
        View {
            tick,
            now: SimTime(50 * tick),
            outcome,
            ..View::default()
        }
    }

    fn news(tick: u64) -> TickEvents {
        TickEvents {
            tick,
            events: vec![EventLine {
                t_ms: SimTime(50 * tick),
                kind: "picked".to_owned(),
                robot: "gold".to_owned(),
                subject: format!("item-{tick}"),
                reason: String::new(),
                detail: String::new(),
            }],
        }
    }

    fn tick_of(frame: &str) -> u64 {
        let frame: Value = serde_json::from_str(frame).unwrap();
        frame["view"]["tick"].as_u64().unwrap()
    }

    #[test]
    fn a_slow_page_gets_the_newest_view_and_the_number_of_missed_frames() {
        let received = Received::new(&default_setup(1));
        let slow = received.view.subscribe();
        let (_, mut events) = received.catch_up();
        let ticks = FRAME_QUEUE as u64 + 10;
        for tick in 0..ticks {
            received.view(view(tick, None));
            received.events(&news(tick));
        }
        assert_eq!(tick_of(&slow.borrow()), ticks - 1);
        assert_eq!(events.try_recv(), Err(TryRecvError::Lagged(10)));
        let next: Value = serde_json::from_str(&events.try_recv().unwrap()).unwrap();
        assert_eq!(next["events"][0]["subject"], "item-10");
    }

    #[test]
    fn a_takeover_is_sent_as_an_event_when_its_robot_has_worked() {
        let setup = default_setup(1);
        let received = Received::new(&setup);
        let (_, mut frames) = received.catch_up();
        let tasks = &setup.catalog.tasks;
        let mut sets = setup.catalog.sets.iter();
        let set = sets.find(|set| tasks[set.task.index()].max_robots == 1);
        let robot = |rank: usize| setup.scenario.robots[rank].name.as_str();
        for (tick, kind, robot) in [
            (10, "activated", robot(0)),
            (20, "gone", robot(0)),
            (90, "activated", robot(1)),
            (100, "done", robot(1)),
        ] {
            received.view(view(tick, None));
            assert_eq!(frames.try_recv(), Err(TryRecvError::Empty));
            let mut news = news(tick);
            news.events[0].kind = kind.to_owned();
            news.events[0].robot = robot.to_owned();
            news.events[0].subject = set.unwrap().name.clone();
            received.events(&news);
            assert!(frames.try_recv().is_ok());
        }
        received.view(view(101, None));
        let frame: Value = serde_json::from_str(&frames.try_recv().unwrap()).unwrap();
        let task = &tasks[set.unwrap().task.index()].name;
        let takeover = json!({"t_ms": 4500, "kind": "took-over", "robot": robot(1), "subject": task, "reason": robot(0), "detail": "3.50 s after its death"});
        assert_eq!(frame["events"], json!([takeover]));
        // A page that opens later receives it, too.
        let (past, _) = received.catch_up();
        let past: Value = serde_json::from_str(&past).unwrap();
        assert_eq!(past["past"]["events"][4], takeover);
    }

    #[test]
    fn repeated_views_and_events_are_ignored() {
        let received = Received::new(&default_setup(1));
        let (_, mut events) = received.catch_up();
        received.view(view(7, None));
        received.view(view(3, None));
        assert_eq!(tick_of(&received.view.subscribe().borrow()), 7);
        for tick in [7, 7, 3] {
            received.events(&news(tick));
        }
        assert!(events.try_recv().is_ok());
        assert_eq!(events.try_recv(), Err(TryRecvError::Empty));
    }

    #[test]
    fn curve_corners_are_not_lost_with_skipped_views() {
        let received = Received::new(&default_setup(1));
        let (_, mut news) = received.catch_up();
        for tick in 0..3 {
            let corner = Corner {
                robot: RobotId(0),
                set: BehaviorId(1),
                at: SimTime(50 * tick),
                level: 7.5,
                state: BehaviorState::Waiting,
                last: false,
            };
            received.view(View {
                corners: vec![corner],
                ..view(tick, None)
            });
        }
        let shown: Value = serde_json::from_str(&received.view.subscribe().borrow()).unwrap();
        assert_eq!(shown["view"]["corners"], json!([]));
        for tick in 0..3 {
            let frame: Value = serde_json::from_str(&news.try_recv().unwrap()).unwrap();
            assert_eq!(
                frame["corners"],
                json!([{"robot": 0, "set": 1, "at": 50 * tick, "level": 7.5, "state": "Waiting", "last": false}])
            );
        }
        let (past, _) = received.catch_up();
        let past: Value = serde_json::from_str(&past).unwrap();
        assert_eq!(past["past"]["corners"].as_array().unwrap().len(), 3);
    }

    #[test]
    fn a_page_that_opens_later_gets_each_event_once() {
        let received = Received::new(&default_setup(1));
        received.events(&news(1));
        let (past, mut events) = received.catch_up();
        received.events(&news(2));
        let past: Value = serde_json::from_str(&past).unwrap();
        let subjects: Vec<&Value> = past["past"]["events"]
            .as_array()
            .unwrap()
            .iter()
            .map(|event| &event["subject"])
            .collect();
        assert_eq!(subjects, ["item-1"]);
        assert!(events.try_recv().unwrap().contains("item-2"));
        assert_eq!(events.try_recv(), Err(TryRecvError::Empty));
    }

    #[test]
    fn a_run_ends_once_and_keeps_its_outcome() {
        let received = Received::new(&default_setup(1));
        let over = received.over.subscribe();
        assert_eq!(*over.borrow(), None);
        received.view(view(9, Some(Outcome::Complete)));
        // The world's liveliness token disappears a little later.
        received.end(None);
        assert_eq!(*over.borrow(), Some(Some(Outcome::Complete)));
    }
}

//! The server of the channels, in the protocol `foxglove.sdk.v1`.

use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use analysis::foxglove_messages::{Channels, Message, Topics, nanoseconds};
use foxglove::websocket::{
    Capability, ChannelView, Client, PlaybackControlRequest, PlaybackState, ServerListener, Status,
};
use foxglove::{
    ChannelId, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServerHandle,
};
use scenario::time::SimTime;
use tokio::time::{Instant, sleep, timeout};

use super::playback::SharedPlayback;
use super::{control, refused};

/// The number of messages that wait for a slow client before it loses the oldest: about 12 s of three robots at 20x.
const BACKLOG: usize = 1 << 17;

/// The interval at which the end of a run checks for clients.
const INTERVAL: Duration = Duration::from_millis(20);

/// The time for the connections to close.
const CLOSE_TIME: Duration = Duration::from_millis(200);

/// The channels of a run, and the server once it has started.
pub struct FoxgloveChannels {
    context: Arc<Context>,
    channels: Vec<Arc<RawChannel>>,
    late: Arc<LateClients>,
    server: Option<WebSocketServerHandle>,
    now_ns: u64,
    /// `true` if messages are only kept for late clients.
    is_silent: bool,
}

/// The latest message of each channel, for clients that subscribe later.
#[derive(Default)]
struct LateClients {
    latest: Mutex<HashMap<ChannelId, Latest>>,
    /// `true` if a client needs the time, although the run may stand.
    needs_time: AtomicBool,
}

struct Latest {
    channel: Arc<RawChannel>,
    time: PartialMetadata,
    bytes: Vec<u8>,
}

impl FoxgloveChannels {
    /// Creates the destination of a run, without channels and server.
    pub fn new(is_silent: bool) -> Self {
        Self {
            context: Context::new(),
            channels: Vec::new(),
            late: Arc::default(),
            server: None,
            now_ns: 0,
            is_silent,
        }
    }

    /// Starts the server. `control` is the id of a live run that clients may control, and `playback` that of a finished one.
    ///
    /// # Errors
    /// Returns a problem if nothing can listen at the address.
    pub async fn serve(
        &mut self,
        name: String,
        address: SocketAddr,
        control: Option<&str>,
        playback: Option<&SharedPlayback>,
    ) -> anyhow::Result<()> {
        let host = match address.ip() {
            IpAddr::V4(ip) => ip.to_string(),
            IpAddr::V6(ip) => format!("[{ip}]"),
        };
        let mut server = self.context.websocket_server();
        if let Some(playback) = playback {
            server = server.playback_time_range(0, playback.lock().end_ns());
        }
        let listener = Listener {
            late: Arc::clone(&self.late),
            playback: playback.cloned(),
        };
        let server = server
            .name(name)
            .bind(host, address.port())
            .capabilities([Capability::Time])
            .services(control.map(control::service))
            .message_backlog_size(BACKLOG)
            .listener(Arc::new(listener));
        let server = server.start().await.map_err(|error| match error {
            FoxgloveError::Bind(error) => refused(address.to_string(), &error).into(),
            error => anyhow::Error::from(error),
        });
        self.server = Some(server?);
        Ok(())
    }

    /// Begins to send messages, and sends the time to new clients of a run that stands.
    pub fn catch_up(&mut self) {
        self.is_silent = false;
        if self.has_new_client() {
            self.broadcast_time();
        }
    }

    /// Returns whether a client has connected or subscribed since the last call.
    pub fn has_new_client(&self) -> bool {
        self.late.needs_time.swap(false, Ordering::Relaxed)
    }

    /// Forgets the latest messages, because the time has changed.
    pub fn forget(&mut self) {
        self.late.lock().clear();
    }

    /// Sends the state of a playback to all clients.
    pub fn broadcast_playback(&self, state: PlaybackState) {
        if let Some(server) = &self.server {
            server.broadcast_playback_state(state);
        }
    }

    fn broadcast_time(&self) {
        if let Some(server) = &self.server {
            server.broadcast_time(self.now_ns);
        }
    }

    /// Announces the end of the run after its last message, waits until all clients have left, at most for `patience`, and
    /// stops the server.
    pub async fn close(&mut self, patience: Duration) {
        let Some(server) = self.server.take() else {
            return;
        };
        server.publish_status(Status::info("The run is over."));
        let end = Instant::now() + patience;
        while server.client_count() > 0 && Instant::now() < end {
            sleep(INTERVAL).await;
        }
        // A client that does not read receives no end of the connection.
        let _ = timeout(CLOSE_TIME, server.stop().wait()).await;
    }
}

impl Topics for FoxgloveChannels {
    fn add(&mut self, topic: &str, schema: &Schema, encoding: &str) -> anyhow::Result<u16> {
        let number = u16::try_from(self.channels.len())?;
        let channel = self.context.channel_builder(topic).schema(schema.clone());
        self.channels
            .push(channel.message_encoding(encoding).build_raw()?);
        Ok(number)
    }
}

impl Channels for FoxgloveChannels {
    fn send(&mut self, message: Message) {
        let channel = &self.channels[usize::from(message.channel)];
        let latest = Latest {
            channel: Arc::clone(channel),
            time: PartialMetadata {
                log_time: Some(message.time_ns()),
            },
            bytes: message.bytes,
        };
        // The lock orders this message and the one for a client that subscribes now.
        let mut all = self.late.lock();
        if !self.is_silent {
            channel.log_with_meta(&latest.bytes, latest.time);
        }
        all.insert(channel.id(), latest);
    }

    fn set_time(&mut self, now: SimTime) {
        self.now_ns = nanoseconds(now);
        if !self.is_silent {
            self.broadcast_time();
        }
    }
}

impl LateClients {
    fn lock(&self) -> MutexGuard<'_, HashMap<ChannelId, Latest>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The receiver of events and requests of clients.
struct Listener {
    late: Arc<LateClients>,
    playback: Option<SharedPlayback>,
}

impl ServerListener for Listener {
    fn on_client_connect(&self) {
        self.late.needs_time.store(true, Ordering::Relaxed);
    }

    fn on_playback_control_request(
        &self,
        request: PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        Some(self.playback.as_ref()?.lock().control(&request))
    }

    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        self.late.needs_time.store(true, Ordering::Relaxed);
        if let Some(latest) = self.late.lock().get(&channel.id()) {
            let sink = client.sink_id();
            let Latest {
                channel,
                time,
                bytes,
            } = latest;
            channel.log_with_meta_to_sink(bytes, *time, sink);
        }
    }
}

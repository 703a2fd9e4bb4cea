//! Opens a session with a single attempt. Zenoh writes the reason of a failure only to its log, so the log is captured.

use std::fmt::{Debug, Write};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::oneshot;
use tracing::field::{Field, Visit};
use tracing::{Dispatch, Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::{Context, SubscriberExt};
use zenoh::{Config, Session, Wait};

use crate::handshake::{ConnectError, failure};

/// Opens a session with a configuration in JSON5, in a single attempt. This overrides the configuration's retries.
/// During the attempt, zenoh's warnings go into the error instead of the log.
///
/// # Errors
/// Returns the reason in one line for people.
pub fn open_once(config: &str, endpoint: &str) -> Result<Session, ConnectError> {
    let wrong = |error: zenoh::Error| failure(endpoint, &error.to_string());
    let mut config = Config::from_json5(config).map_err(wrong)?;
    // These values mean "try once". Zenoh expects both keys.
    for (key, value) in [
        ("connect/timeout_ms", "0"),
        ("connect/exit_on_failure", "true"),
    ] {
        config.insert_json5(key, value).map_err(wrong)?;
    }
    let warnings = Arc::default();
    let collector = WarningCollector {
        warnings: Arc::clone(&warnings),
        other_events: tracing::dispatcher::get_default(Dispatch::clone),
    };
    // Zenoh opens a session on the calling thread, so only its own events arrive here.
    let subscriber = tracing_subscriber::registry().with(collector);
    let opened = tracing::subscriber::with_default(subscriber, || zenoh::open(config).wait());
    opened.map_err(|error| {
        let mut text =
            std::mem::take(&mut *warnings.lock().unwrap_or_else(PoisonError::into_inner));
        // For some errors, such as unreadable files, zenoh logs no warning, and the error contains the reason.
        let _ = write!(text, "{error}");
        failure(endpoint, &text)
    })
}

/// Opens a session like [`open_once`] on a thread of its own. A machine that does not answer takes seconds, in which the
/// caller can handle signals.
pub async fn try_open(config: &str, endpoint: &str) -> Result<Session, ConnectError> {
    let (sender, opened) = oneshot::channel();
    let (config, at) = (config.to_owned(), endpoint.to_owned());
    let open = move || {
        // The receiver is dropped if the caller no longer waits.
        let _ = sender.send(open_once(&config, &at));
    };
    let failed = |error: &dyn std::error::Error| failure(endpoint, &error.to_string());
    let started = std::thread::Builder::new()
        .name("connect".to_owned())
        .spawn(open);
    started.map_err(|error| failed(&error))?;
    opened.await.unwrap_or_else(|error| Err(failed(&error)))
}

/// A layer that collects zenoh's warnings and forwards all other events.
struct WarningCollector {
    warnings: Arc<Mutex<String>>,
    other_events: Dispatch,
}

impl<S: Subscriber> Layer<S> for WarningCollector {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        if metadata.target().starts_with("zenoh") && *metadata.level() <= Level::WARN {
            let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
            event.record(&mut MessageText(&mut warnings));
        } else if self.other_events.enabled(metadata) {
            self.other_events.event(event);
        }
    }
}

struct MessageText<'a>(&'a mut String);

impl Visit for MessageText<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // Writes to a string cannot fail.
            let _ = writeln!(self.0, "{value:?}");
        }
    }
}

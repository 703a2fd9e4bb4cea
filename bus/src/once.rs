//! Opens a session at once or says why not: zenoh tells the reason to its log alone, and the error that it returns names none.

use std::fmt::{Debug, Write};
use std::sync::{Arc, Mutex, PoisonError};

use tracing::field::{Field, Visit};
use tracing::{Dispatch, Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::{Context, SubscriberExt};
use zenoh::{Config, Session, Wait};

use crate::handshake::{ConnectError, failure};

/// A session by that configuration, in JSON5, opened by one try, whatever the configuration says of retries. During the try, what zenoh
/// warns of goes into the error instead of the log.
///
/// # Errors
/// Why there is none, in one line for people.
pub fn open_once(config: &str, endpoint: &str) -> Result<Session, ConnectError> {
    let wrong = |error: zenoh::Error| failure(endpoint, &error.to_string());
    let mut config = Config::from_json5(config).map_err(wrong)?;
    // Zenoh's own words for "try once"; a configuration takes both.
    for (key, value) in [
        ("connect/timeout_ms", "0"),
        ("connect/exit_on_failure", "true"),
    ] {
        config.insert_json5(key, value).map_err(wrong)?;
    }
    let said = Arc::default();
    let listener = Listener {
        said: Arc::clone(&said),
        others: tracing::dispatcher::get_default(Dispatch::clone),
    };
    // Zenoh opens a session on the thread that asks for it: nobody else's words are heard here.
    let subscriber = tracing_subscriber::registry().with(listener);
    let opened = tracing::subscriber::with_default(subscriber, || zenoh::open(config).wait());
    opened.map_err(|error| {
        let mut said = std::mem::take(&mut *said.lock().unwrap_or_else(PoisonError::into_inner));
        // Where zenoh has warned of nothing, as of files that it cannot read, the error says why.
        let _ = write!(said, "{error}");
        failure(endpoint, &said)
    })
}

/// Keeps what zenoh warns of, and passes everything else on.
struct Listener {
    said: Arc<Mutex<String>>,
    others: Dispatch,
}

impl<S: Subscriber> Layer<S> for Listener {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let about = event.metadata();
        if about.target().starts_with("zenoh") && *about.level() <= Level::WARN {
            let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
            event.record(&mut Words(&mut said));
        } else if self.others.enabled(about) {
            self.others.event(event);
        }
    }
}

struct Words<'a>(&'a mut String);

impl Visit for Words<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // Writing to a string cannot fail.
            let _ = writeln!(self.0, "{value:?}");
        }
    }
}

//! Subscription to the views and events of a live run.

use anyhow::Context;
use cluster::rendezvous::{ConnectionRole, Rendezvous};
use cluster::session;
use proto::event::TickEvents;
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::view::View;
use serde::de::DeserializeOwned;
use zenoh::Session;

/// An observer's session on the bus of a live run.
pub struct Observer {
    pub run: Rendezvous,
    pub keys: KeyExpressions,
    /// The secret that seals the messages of the run.
    pub secret: Secret,
    pub session: Session,
}

impl Observer {
    /// Joins the bus of a run as `user`.
    pub async fn join(run: Rendezvous, user: ConnectionRole) -> anyhow::Result<Self> {
        let config = session::client(&run.login(user)?, false);
        let session = cluster::open(&config)
            .await
            .map_err(anyhow::Error::from_boxed)
            .with_context(|| {
                format!(
                    "run '{}' cannot be reached at {}",
                    run.run,
                    user.endpoint(&run)
                )
            })?;
        Ok(Self {
            keys: KeyExpressions::new(&run.run),
            secret: Secret::from_token(&run.token),
            run,
            session,
        })
    }

    /// Calls `look` with every view. Unreadable views are skipped.
    pub async fn on_view(&self, look: impl Fn(View) + Send + Sync + 'static) -> anyhow::Result<()> {
        self.subscribe(self.keys.view(), look).await
    }

    /// Calls `listen` with the events of every tick that has any.
    pub async fn on_events(
        &self,
        listen: impl Fn(TickEvents) + Send + Sync + 'static,
    ) -> anyhow::Result<()> {
        self.subscribe(self.keys.event(), listen).await
    }

    /// Subscribes to a key. Messages without a valid seal of the run are ignored.
    async fn subscribe<T: DeserializeOwned>(
        &self,
        key: String,
        take: impl Fn(T) + Send + Sync + 'static,
    ) -> anyhow::Result<()> {
        let secret = self.secret.clone();
        self.session
            .declare_subscriber(key.clone())
            .callback(move |sample| {
                if let Ok(message) = secret.open(&key, &sample.payload().to_bytes()) {
                    take(message);
                }
            })
            .background()
            .await
            .map_err(anyhow::Error::from_boxed)
    }
}

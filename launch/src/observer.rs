//! What everybody who only looks at a run needs: its views and its events, as they come over the bus.

use alliance_proto::event::EventNews;
use alliance_proto::keys::Keys;
use alliance_proto::rendezvous::{Rendezvous, User};
use alliance_proto::secret::Secret;
use alliance_proto::session;
use alliance_proto::view::View;
use anyhow::Context;
use serde::de::DeserializeOwned;
use zenoh::Session;

/// A session on the bus of a live run.
pub struct Observer {
    /// The run.
    pub run: Rendezvous,
    /// Its keys.
    pub keys: Keys,
    /// What its messages are sealed with.
    pub secret: Secret,
    /// The session.
    pub session: Session,
}

impl Observer {
    /// Joins the bus of a run as that user.
    ///
    /// # Errors
    /// When its world cannot be reached.
    pub async fn join(run: Rendezvous, user: User) -> anyhow::Result<Self> {
        let config = session::client(&run.login(user)?, false);
        let session = bus::open(&config)
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
            keys: Keys::new(&run.run),
            secret: Secret::of(&run.token),
            run,
            session,
        })
    }

    /// Shows every view to `look`. One that cannot be read is one view less.
    ///
    /// # Errors
    /// When the bus fails.
    pub async fn on_view(&self, look: impl Fn(View) + Send + Sync + 'static) -> anyhow::Result<()> {
        self.subscribe(self.keys.view(), look).await
    }

    /// Tells `listen` the events of every tick that has any.
    ///
    /// # Errors
    /// When the bus fails.
    pub async fn on_events(
        &self,
        listen: impl Fn(EventNews) + Send + Sync + 'static,
    ) -> anyhow::Result<()> {
        self.subscribe(self.keys.event(), listen).await
    }

    /// What bears no seal of the run is nobody's message.
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

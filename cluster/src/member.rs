//! The members of a run (world, robots and hosts) with their credentials.

use crate::keyring::Keyring;
use proto::identity;
use proto::secret::derived;

/// The data for a connection to a router.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Login {
    pub endpoint: String,
    /// The user name, which the router must have in its list.
    pub user: String,
    pub password: String,
    /// The certificates, for TLS locators.
    pub keyring: Option<Keyring>,
}

/// The data that a robot's agent needs to take part in a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub run: String,
    pub login: Login,
    /// The secret that seals the messages between the agent and the world.
    pub secret: String,
    /// `true` if the connection to the world can be interrupted, so that the agent must reconnect.
    pub is_remote: bool,
}

impl Member {
    /// Creates the data of a robot on another host, which connects with its own identity.
    #[must_use]
    pub fn remote(run: String, login: Login) -> Self {
        Self {
            run,
            secret: login.password.clone(),
            login,
            is_remote: true,
        }
    }

    /// Creates the data of a robot on the world's machine. The run's token is enough.
    #[must_use]
    pub fn local(run: String, robot: &str, login: Login, token: &str) -> Self {
        Self {
            run,
            login,
            secret: derived(token, &identity::robot(robot)),
            is_remote: false,
        }
    }
}

//! Who takes part in a run, and with what it proves it: the world, the robots, the hosts of a run over a network.

use crate::keyring::Keyring;
use crate::secret::derived;

/// Identity of the world: first name in its certificate, and the stem of its files.
pub const WORLD: &str = "world";

/// Identity of a robot.
#[must_use]
pub fn robot(name: &str) -> String {
    format!("robot-{name}")
}

/// Identity of a host.
#[must_use]
pub fn host(name: &str) -> String {
    format!("host-{name}")
}

/// How somebody connects to a router.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Login {
    /// Zenoh locator of the router.
    pub endpoint: String,
    /// The name that the router knows.
    pub user: String,
    /// Password.
    pub password: String,
    /// Certificates, where the locator is one of TLS.
    pub keyring: Option<Keyring>,
}

/// What a robot's agent needs to take part in a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Id of the run.
    pub run: String,
    /// How it connects.
    pub login: Login,
    /// What it and the world seal with what they tell each other.
    pub secret: String,
    /// The run's secret, where this machine has it.
    pub token: Option<String>,
    /// Whether the way to the world may break and be mended: it is tried again.
    pub is_far: bool,
}

impl Member {
    /// A robot that connects from another host, as itself.
    #[must_use]
    pub fn far(run: String, login: Login) -> Self {
        Self {
            run,
            secret: login.password.clone(),
            login,
            token: None,
            is_far: true,
        }
    }

    /// A robot on the world's own machine, by the run's token.
    #[must_use]
    pub fn near(run: String, robot: &str, login: Login, token: String) -> Self {
        Self {
            run,
            login,
            secret: derived(&token, &self::robot(robot)),
            token: Some(token),
            is_far: false,
        }
    }
}

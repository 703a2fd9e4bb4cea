//! The central routers of a run: the team's, the operators' and a host's.

use std::io;
use std::net::{Ipv4Addr, TcpListener};

use crate::access;
use crate::keyring::Keyring;
use crate::locator::Locator;
use crate::member::Login;
use crate::rendezvous::{ConnectionRole, Rendezvous, RendezvousError, socket};
use crate::session::{self, Members, Router};
use crate::silence;
use proto::keys::KeyExpressions;
use proto::secret::derived;
use scenario::Scenario;
use zenoh::Session;

use crate::network::Network;

/// The error of a router that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum RouterError {
    #[error("bus")]
    Bus(#[from] zenoh::Error),
    /// A network address that the router cannot listen on, with the cause.
    #[error("cannot listen at {0}: {1}")]
    Listen(String, std::io::Error),
    #[error(transparent)]
    Rendezvous(#[from] RendezvousError),
    #[error("system")]
    System(#[from] std::io::Error),
}

/// The number of attempts to find a port that is still free when zenoh opens it.
const PORT_ATTEMPTS: u32 = 20;

/// Opens the world's router for the team and writes its address to the rendezvous. With a network, the router listens there
/// as well, and each member may send only its own messages.
pub async fn open_for_team(
    run: &mut Rendezvous,
    network: Option<(&Network, &Scenario)>,
) -> Result<Session, RouterError> {
    let mut users = vec![(
        ConnectionRole::Team.name().to_owned(),
        run.team.password.clone(),
    )];
    let mut router = RouterConfig::default();
    if let Some((network, scenario)) = network {
        let speakers = network.members(scenario);
        let keys = KeyExpressions::new(&run.run);
        router.access = access::team_rules(&keys, &speakers, ConnectionRole::Team.name(), None);
        router.listen.clone_from(&network.listen);
        router.keyring = Some(network.keyring.clone());
        users.extend(speakers.into_iter().map(|speaker| {
            let secret = derived(&run.token, &speaker.identity);
            (speaker.identity, secret)
        }));
    }
    router.users = users;
    let (session, at) = router.open(&run.run, run.pid, ConnectionRole::Team).await?;
    run.team.endpoint = at;
    Ok(session)
}

/// Opens the gateway's router for operators and observers and writes its address to the rendezvous.
pub async fn open_for_operators(run: &mut Rendezvous) -> Result<Session, RouterError> {
    let router = RouterConfig {
        users: vec![(
            ConnectionRole::Operator.name().to_owned(),
            run.token.clone(),
        )],
        access: access::gateway_rules(&KeyExpressions::new(&run.run)),
        ..RouterConfig::default()
    };
    let (session, at) = router
        .open(&run.run, run.pid, ConnectionRole::Operator)
        .await?;
    run.endpoint = at;
    Ok(session)
}

#[derive(Default)]
pub struct RouterConfig {
    /// Locators to listen on, in addition to the address for this machine.
    pub listen: Vec<String>,
    /// The router to connect to; `None` for a central router.
    pub uplink: Option<Login>,
    pub users: Vec<(String, String)>,
    pub keyring: Option<Keyring>,
    /// Access rules for connected users as Zenoh configuration; empty for no restriction.
    pub access: String,
}

impl RouterConfig {
    /// Opens the router and returns its address: a socket in the runtime folder, or else a free loopback port.
    pub async fn open(
        &self,
        run: &str,
        pid: u32,
        user: ConnectionRole,
    ) -> Result<(Session, String), RouterError> {
        let users = self.users.iter();
        let members =
            Members::new(users.map(|(name, password)| (name.as_str(), password.as_str())))?;
        for at in &self.listen {
            check_address(at)?;
        }
        if !self.listen.is_empty() || self.uplink.is_some() {
            silence::watch();
        }
        let at = socket(run, pid, user)?;
        let mut attempt = 0;
        loop {
            attempt += 1;
            let endpoint = at.clone().map_or_else(free_port, Ok)?;
            let mut listen = vec![endpoint.clone()];
            listen.extend(self.listen.iter().cloned());
            let config = session::router(&Router {
                listen: &listen,
                uplink: self.uplink.as_ref(),
                members: &members,
                keyring: self.keyring.as_ref(),
                access: self.access.clone(),
            });
            match crate::open(&config).await {
                Ok(session) => return Ok((session, endpoint)),
                Err(error) if attempt < PORT_ATTEMPTS && at.is_none() => {
                    tracing::debug!(%error, "port taken");
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Checks that it is possible to listen at this address, because Zenoh's own error does not contain the cause.
fn check_address(at: &str) -> Result<(), RouterError> {
    let locator = at.parse::<Locator>().map_err(io::Error::other);
    locator
        .and_then(|locator| TcpListener::bind((locator.host, locator.port)))
        .map(drop)
        .map_err(|error| RouterError::Listen(at.to_owned(), error))
}

/// Returns a free port. Zenoh does not return the port that it opens, so the port is chosen first; if it is taken in between,
/// the caller tries another one.
fn free_port() -> std::io::Result<String> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    Ok(format!("tcp/{}", listener.local_addr()?))
}

//! The routers in the middle of a star: the team's, the operators', a host's.

use std::io;
use std::net::{Ipv4Addr, TcpListener};

use alliance_proto::access;
use alliance_proto::keyring::Keyring;
use alliance_proto::keys::Keys;
use alliance_proto::locator::Locator;
use alliance_proto::member::Login;
use alliance_proto::rendezvous::{Rendezvous, User, socket};
use alliance_proto::scenario::Scenario;
use alliance_proto::secret::derived;
use alliance_proto::session::{self, Members, Router};
use zenoh::Session;

use crate::error::WorldError;
use crate::network::Network;

/// Attempts to find a port that is still free when zenoh opens it.
const PORT_ATTEMPTS: u32 = 20;

/// Opens the world's router for the team; the rendezvous says where it is. With a network it is there as well, where everybody may say
/// what is his own and nothing else.
///
/// # Errors
/// When the bus fails, or there is no place for it.
pub async fn open_for_team(
    run: &mut Rendezvous,
    network: Option<(&Network, &Scenario)>,
) -> Result<Session, WorldError> {
    let mut users = vec![(User::Team.name().to_owned(), run.team.password.clone())];
    let mut router = Plan::default();
    if let Some((network, scenario)) = network {
        let speakers = network.speakers(scenario);
        let keys = Keys::new(&run.run);
        router.access = access::of_team(&keys, &speakers, User::Team.name(), None);
        router.listen.clone_from(&network.listen);
        router.keyring = Some(network.keyring.clone());
        users.extend(speakers.into_iter().map(|speaker| {
            let secret = derived(&run.token, &speaker.identity);
            (speaker.identity, secret)
        }));
    }
    router.users = users;
    let (session, at) = router.open(&run.run, run.pid, User::Team).await?;
    run.team.endpoint = at;
    Ok(session)
}

/// Opens the gateway's router for those who order and watch; the rendezvous says where it is.
///
/// # Errors
/// As of [`open_for_team`].
pub async fn open_for_operators(run: &mut Rendezvous) -> Result<Session, WorldError> {
    let router = Plan {
        users: vec![(User::Operator.name().to_owned(), run.token.clone())],
        access: access::of_operators(&Keys::new(&run.run)),
        ..Plan::default()
    };
    let (session, at) = router.open(&run.run, run.pid, User::Operator).await?;
    run.endpoint = at;
    Ok(session)
}

/// A router to be.
#[derive(Default)]
pub struct Plan {
    /// Locators where it listens, besides the place for this machine.
    pub listen: Vec<String>,
    /// The router that it is connected to.
    pub uplink: Option<Login>,
    /// Who may connect: names and passwords.
    pub users: Vec<(String, String)>,
    /// Certificates.
    pub keyring: Option<Keyring>,
    /// What those who connect may do; empty: everything.
    pub access: String,
}

impl Plan {
    /// Opens it: at a socket in the runtime folder, and where there cannot be one, on a free port of loopback. Says where that is.
    ///
    /// # Errors
    /// When the bus fails, or there is no such folder.
    pub async fn open(
        &self,
        run: &str,
        pid: u32,
        user: User,
    ) -> Result<(Session, String), WorldError> {
        let users = self.users.iter();
        let members = Members::of(users.map(|(name, word)| (name.as_str(), word.as_str())))?;
        for at in &self.listen {
            look_at_place(at)?;
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
            match bus::open(&config).await {
                Ok(session) => return Ok((session, endpoint)),
                Err(error) if attempt < PORT_ATTEMPTS && at.is_none() => {
                    tracing::debug!(%error, "port taken");
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Whether one can listen there: zenoh says why not in words of its own.
fn look_at_place(at: &str) -> Result<(), WorldError> {
    let place = at.parse::<Locator>().map_err(io::Error::other);
    place
        .and_then(|place| TcpListener::bind((place.host, place.port)))
        .map(drop)
        .map_err(|error| WorldError::Listen(at.to_owned(), error))
}

/// Zenoh does not tell which port it took, so the port is chosen first; should somebody else take it in between, another one is tried.
fn free_port() -> std::io::Result<String> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    Ok(format!("tcp/{}", listener.local_addr()?))
}

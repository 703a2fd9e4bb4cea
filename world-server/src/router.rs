//! The router in the middle of a star: the team's, or the operators'.

use std::net::{Ipv4Addr, TcpListener};

use alliance_proto::rendezvous::{Rendezvous, User, socket};
use alliance_proto::session::{self, Members};
use zenoh::Session;

use crate::error::WorldError;

/// Attempts to find a port that is still free when zenoh opens it.
const PORT_ATTEMPTS: u32 = 20;

/// Opens the router for these users: at a socket in the runtime folder, and where there cannot be one, on a free port of loopback.
/// The rendezvous says where it is.
///
/// # Errors
/// When the bus fails, or there is no such folder.
pub async fn open(run: &mut Rendezvous, user: User) -> Result<Session, WorldError> {
    let members = Members::of(run, user)?;
    let at = socket(&run.run, run.pid, user)?;
    let mut attempt = 0;
    loop {
        attempt += 1;
        let endpoint = at.clone().map_or_else(free_port, Ok)?;
        match user {
            User::Team => run.team.endpoint = endpoint,
            User::Operator => run.endpoint = endpoint,
        }
        let config = zenoh::Config::from_json5(&session::router(run, user, &members))?;
        match zenoh::open(config).await {
            Ok(session) => return Ok(session),
            Err(error) if attempt < PORT_ATTEMPTS && at.is_none() => {
                tracing::debug!(%error, "port taken");
            }
            Err(error) => return Err(error.into()),
        }
    }
}

/// Zenoh does not tell which port it took, so the port is chosen first; should somebody else take it in between, another one is tried.
fn free_port() -> std::io::Result<String> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    Ok(format!("tcp/{}", listener.local_addr()?))
}

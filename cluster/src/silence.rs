//! Detection of machines that vanish from the network without closing their connections.
//!
//! The operating system of a reachable machine acknowledges keep-alive probes even while its processes are stopped. So a
//! connection without any acknowledgment leads to a machine that is switched off or cut off. Zenoh has no option for this:
//! its own lease would also end the connections of stopped processes.

use std::fs;
use std::io;
use std::net::SocketAddr;
use std::os::fd::{AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::sync::Once;
use std::thread;
use std::time::Duration;

use nix::libc;
use nix::sys::socket::sockopt::{KeepAlive, TcpKeepCount, TcpKeepIdle, TcpKeepInterval};
use nix::sys::socket::{self, Shutdown, SockaddrStorage, getpeername, getsockopt, setsockopt};
use nix::unistd::dup;
use terminal::stderr_line;

/// The time without an acknowledgment after which a connection is closed.
pub const SILENCE: Duration = Duration::from_secs(30);

/// The time without traffic after which the operating system sends a probe, and the interval of further probes, s.
const PROBE_S: u32 = 5;

/// The time for a probe and its acknowledgment.
const ANSWER: Duration = Duration::from_secs(1);

/// The interval between two checks of all connections.
const INTERVAL: Duration = Duration::from_secs(5);

/// Starts the watch over all TCP connections of this process. Later calls do nothing.
pub fn watch() {
    static STARTED: Once = Once::new();
    STARTED.call_once(|| {
        let watch = || loop {
            check_all();
            thread::sleep(INTERVAL);
        };
        // Without this thread, only a vanished machine remains undetected.
        let _ = thread::Builder::new()
            .name("silence".to_owned())
            .spawn(watch);
    });
}

fn check_all() {
    // The list is complete before the first check, because a check opens descriptors.
    let Ok(entries) = fs::read_dir("/proc/self/fd") else {
        return;
    };
    let descriptors: Vec<RawFd> = entries
        .flatten()
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .collect();
    for descriptor in descriptors {
        if let Some((socket, peer)) = connection(descriptor) {
            // A connection that has just been closed cannot be checked.
            let _ = check(&socket, peer);
        }
    }
}

/// Returns a duplicate of a TCP connection and its other end; `None` for other descriptors.
fn connection(descriptor: RawFd) -> Option<(OwnedFd, SocketAddr)> {
    let link = fs::read_link(format!("/proc/self/fd/{descriptor}")).ok()?;
    if !link.to_str()?.starts_with("socket:") {
        return None;
    }
    // SAFETY: the descriptor is only duplicated. If another thread has closed it meanwhile, this fails or duplicates
    // another open descriptor. The duplicate keeps the socket open for all further calls.
    #[allow(unsafe_code)]
    let socket = dup(unsafe { BorrowedFd::borrow_raw(descriptor) }).ok()?;
    let peer: SockaddrStorage = getpeername(socket.as_raw_fd()).ok()?;
    let peer = match (peer.as_sockaddr_in(), peer.as_sockaddr_in6()) {
        (Some(four), _) => SocketAddr::V4((*four).into()),
        (_, Some(six)) => SocketAddr::V6((*six).into()),
        _ => return None,
    };
    Some((socket, peer))
}

/// Turns probes on at the first check of a connection. Closes the connection at a later check if it is silent.
fn check(socket: &OwnedFd, peer: SocketAddr) -> io::Result<()> {
    if !getsockopt(socket, KeepAlive)? {
        setsockopt(socket, TcpKeepIdle, &PROBE_S)?;
        setsockopt(socket, TcpKeepInterval, &PROBE_S)?;
        // The check below closes the connection, because probes are not sent while data is unacknowledged.
        setsockopt(socket, TcpKeepCount, &100)?;
        setsockopt(socket, KeepAlive, &true)?;
        return Ok(());
    }
    // A probe may be under way, so only a second look counts.
    if is_silent(socket)? {
        thread::sleep(ANSWER);
        if is_silent(socket)? {
            let seconds = SILENCE.as_secs();
            stderr_line!("{peer} has not answered for {seconds} s; the connection is closed");
            socket::shutdown(socket.as_raw_fd(), Shutdown::Both)?;
        }
    }
    Ok(())
}

/// Returns whether something has not been acknowledged, and nothing else was for [`SILENCE`]. A stopped process can have a
/// full buffer. Probes of its connection are then up to two minutes apart, but each is acknowledged.
fn is_silent(socket: &OwnedFd) -> io::Result<bool> {
    let info = tcp_info(socket)?;
    let since_acknowledged = Duration::from_millis(info.tcpi_last_ack_recv.into());
    let is_unanswered = info.tcpi_probes > 0 || info.tcpi_retransmits > 0;
    Ok(is_unanswered && since_acknowledged > SILENCE)
}

fn tcp_info(socket: &OwnedFd) -> io::Result<libc::tcp_info> {
    // SAFETY: `tcp_info` consists of integers, for which zero is valid. The kernel writes at most `length` bytes.
    #[allow(unsafe_code)]
    let (result, info) = unsafe {
        let mut info: libc::tcp_info = std::mem::zeroed();
        let mut length = size_of::<libc::tcp_info>() as libc::socklen_t;
        let result = libc::getsockopt(
            socket.as_raw_fd(),
            libc::IPPROTO_TCP,
            libc::TCP_INFO,
            (&raw mut info).cast(),
            &raw mut length,
        );
        (result, info)
    };
    if result != 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(info)
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};
    use std::os::unix::net::UnixStream;

    use super::*;

    #[test]
    fn connections_are_probed_from_their_first_check() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let stream = TcpStream::connect(address).unwrap();
        let (local, _other) = UnixStream::pair().unwrap();
        for descriptor in [listener.as_raw_fd(), local.as_raw_fd(), -1] {
            assert!(connection(descriptor).is_none());
        }
        let (socket, peer) = connection(stream.as_raw_fd()).unwrap();
        assert_eq!(peer, address);
        check(&socket, peer).unwrap();
        assert!(getsockopt(&stream, KeepAlive).unwrap());
        assert_eq!(getsockopt(&stream, TcpKeepIdle).unwrap(), PROBE_S);
        // The acknowledgment of the handshake has just arrived, so the connection stays.
        check(&socket, peer).unwrap();
        assert!(!is_silent(&socket).unwrap());
        assert!(stream.peer_addr().is_ok());
    }
}

//! Tests of the hosts with plain sockets.

#![allow(clippy::disallowed_methods)] // A delay has its minimum length on any machine.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use super::{Hosts, isolation};
use crate::needs::cannot_run;

const PORT: u16 = 7000;

/// The timeout of one read. A frame that passes the switch arrives earlier, unless its address is not resolved yet.
const SOON: Duration = Duration::from_millis(200);

/// The maximum number of reads for one datagram, far more than the repetition of an ARP request needs.
const READS: u32 = 100;

fn udp(hosts: &Hosts, host: &str) -> UdpSocket {
    let at = SocketAddrV4::new(hosts.address(host), PORT);
    let socket = hosts.within(host, || UdpSocket::bind(at).unwrap());
    socket.set_read_timeout(Some(SOON)).unwrap();
    socket
}

/// Sends a datagram and returns whether it arrives. Waits until it arrives or the switch has stopped a frame. The kernel
/// may lose the ARP request of a host whose cable was just plugged in, and repeats it after a second.
fn arrives(hosts: &Hosts, from: &UdpSocket, to: &UdpSocket) -> bool {
    let address = to.local_addr().unwrap();
    let before = hosts.frames();
    from.send_to(b"word", address).unwrap();
    let mut word = [0; 8];
    for _ in 0..READS {
        match to.recv_from(&mut word) {
            Ok((4, sender)) => return sender == from.local_addr().unwrap(),
            Ok(other) => panic!("{other:?}"),
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        if hosts.frames().stopped > before.stopped {
            return false;
        }
    }
    panic!(
        "neither arrived nor stopped: {before:?} {:?}",
        hosts.frames()
    );
}

fn tcp(hosts: &Hosts, from: &str, to: &str) -> (TcpStream, TcpStream) {
    let at = SocketAddrV4::new(hosts.address(to), PORT);
    let listener = hosts.within(to, || TcpListener::bind(at).unwrap());
    let here = hosts.within(from, || TcpStream::connect(at).unwrap());
    (here, listener.accept().unwrap().0)
}

#[test]
fn an_unplugged_cable_delays_a_connection_and_a_cut_is_directed() {
    let Some(hosts) = Hosts::enter(3) else { return };
    let (mut left, mut right) = tcp(&hosts, "h1", "h2");
    right.set_read_timeout(Some(SOON)).unwrap();
    let [one, two, three] = ["h1", "h2", "h3"].map(|host| udp(&hosts, host));
    let carrier = || {
        let mut command = hosts.command("h2", "cat");
        let output = command.arg("/sys/class/net/eth0/carrier").output();
        String::from_utf8(output.unwrap().stdout).unwrap()
    };
    // All hosts also resolve each other's addresses here.
    let assert_connected = || {
        for (from, to) in [(&one, &two), (&two, &three), (&three, &one)] {
            assert!(arrives(&hosts, from, to) && arrives(&hosts, to, from));
        }
        assert_eq!(carrier(), "1\n");
    };
    assert_connected();
    assert_eq!(hosts.frames().stopped, 0);
    hosts.unplug("h2");
    assert_eq!(carrier(), "0\n");
    let mut word = [0; 6];
    left.write_all(b"during").unwrap();
    let nothing = right.read(&mut word).unwrap_err();
    assert_eq!(nothing.kind(), ErrorKind::WouldBlock);
    // The other hosts still communicate.
    assert!(arrives(&hosts, &one, &three));
    hosts.plug("h2");
    right.set_read_timeout(None).unwrap();
    right.read_exact(&mut word).unwrap();
    assert_eq!(&word, b"during");
    // The unplugged host has forgotten the addresses of the others.
    assert_connected();

    hosts.cut("h1", "h2");
    assert!(!arrives(&hosts, &one, &two));
    assert!(arrives(&hosts, &two, &one), "the opposite direction");
    hosts.cut("h2", "h1");
    assert!(!arrives(&hosts, &one, &two) && !arrives(&hosts, &two, &one));
    assert!(arrives(&hosts, &one, &three) && arrives(&hosts, &three, &two));
    hosts.heal();
    assert_connected();

    let delay = Duration::from_millis(20);
    hosts.delay(delay);
    let start = Instant::now();
    left.write_all(b"delays").unwrap();
    right.read_exact(&mut word).unwrap();
    assert!(start.elapsed() >= delay);
    for number in 0..100 {
        one.send_to(&[number], two.local_addr().unwrap()).unwrap();
    }
    two.set_read_timeout(None).unwrap();
    for number in 0..100 {
        let mut byte = [0];
        two.recv(&mut byte).unwrap();
        assert_eq!(byte, [number], "delayed frames arrive in order");
    }
}

#[test]
#[ignore = "fails on purpose, used by the next test"]
fn fails_inside() {
    assert!(!isolation::is_inside(), "a failure inside the namespaces");
}

#[test]
fn a_failure_inside_the_namespaces_fails_the_outer_test() {
    let options = match isolation::unshare_options() {
        Ok(options) => options,
        Err(reason) => return cannot_run(reason),
    };
    let error = isolation::run(options, "hosts::tests::fails_inside").unwrap_err();
    assert!(error.contains("a failure inside the namespaces"), "{error}");
    let error = isolation::run(options, "hosts::tests::not_there").unwrap_err();
    assert!(error.contains("0 passed"), "{error}");
}

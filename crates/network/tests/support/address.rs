//! Addresses for tests of runs in several processes.

use std::{
    mem,
    net::{TcpListener, UdpSocket},
    sync::atomic::{AtomicU16, Ordering},
};

/// An address whose port is free: one below those of outgoing connections, which another test
/// may take at any time. Other programs with tests pass it over until this one ends: a socket
/// for datagrams, which nothing else here uses, keeps its number.
pub fn address() -> String {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let process = (std::process::id() % u32::from(PORTS)) as u16;
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed) % PORTS;
        let port = FIRST_PORT + (process + number) % PORTS;
        let host = ("127.0.0.1", port);
        if let Ok(mark) = UdpSocket::bind(host)
            && TcpListener::bind(host).is_ok()
        {
            mem::forget(mark);
            return format!("tcp/127.0.0.1:{port}");
        }
    }
}

/// The ports to look at.
const FIRST_PORT: u16 = 20_000;
const PORTS: u16 = 12_000;

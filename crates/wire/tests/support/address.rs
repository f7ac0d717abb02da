//! Addresses for tests of runs in several processes.

use std::{
    net::TcpListener,
    sync::atomic::{AtomicU16, Ordering},
};

/// An address whose port is free: one below those of outgoing connections, which another test
/// may take at any time.
pub fn address() -> String {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let process = (std::process::id() % u32::from(PORTS)) as u16;
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed) % PORTS;
        let port = FIRST_PORT + (process + number) % PORTS;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return format!("tcp/127.0.0.1:{port}");
        }
    }
}

/// The ports to look at.
const FIRST_PORT: u16 = 20_000;
const PORTS: u16 = 12_000;

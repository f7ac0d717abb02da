//! The connection: zenoh, with settings for control on a network that is not trusted.

use std::{
    fmt::Display,
    io::ErrorKind,
    path::{Path, PathBuf},
    time::Duration,
};

use ratelab_system::file::{FileError, read, read_text};
use zenoh::{Config, Session, Wait, session::ZenohId};

use crate::{
    error::{Attempted, NetworkError, reason},
    machine,
    net::connect,
};

/// Where the process that has the plant listens unless told otherwise: this machine only,
/// on the port of zenoh's routers.
pub const USUAL: &str = "tcp/127.0.0.1:7447";

/// The end of the connection that a process has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SessionEnd {
    /// Listens on these addresses, and passes on what others send to each other.
    Listen(Vec<String>),
    /// Connects to the first of these addresses that answers, again and again.
    Connect(Vec<String>),
}

/// The settings of a connection.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The end of the connection.
    pub end: SessionEnd,
    /// Whether it may listen on a network without credentials.
    pub insecure: bool,
    /// A zenoh configuration in JSON5, for credentials and access control.
    pub file: Option<PathBuf>,
    /// Longest wait for the other end; `None`: for as long as it takes.
    pub wait: Option<Duration>,
    /// The command line that starts this process again, for the others; empty without one.
    pub command: String,
    /// Called with what the connection waits for, and why an attempt failed.
    pub notice: fn(&str),
}

/// The largest file of settings, users, certificates or keys (bytes).
const MOST: u64 = 1 << 20;

/// Where a configuration has users.
const USERS: &str = "transport/auth/";

/// The files that a configuration may name.
const FILES: [&str; 9] = [
    "transport/auth/usrpwd/dictionary_file",
    "transport/auth/pubkey/public_key_file",
    "transport/auth/pubkey/private_key_file",
    "transport/auth/pubkey/known_keys_file",
    "transport/link/tls/root_ca_certificate",
    "transport/link/tls/listen_private_key",
    "transport/link/tls/listen_certificate",
    "transport/link/tls/connect_private_key",
    "transport/link/tls/connect_certificate",
];

/// Settings that replace zenoh's own, unless a file has others.
const SAFE: &[(&str, &str)] = &[
    ("scouting/multicast/enabled", "false"),
    ("scouting/delay", "0"),
    ("transport/unicast/accept_timeout", "1000"),
    // TCP tries again after each whole second. A handshake that this limit interrupts leaves a
    // connection that sends and never reads, so it is far from all of these moments.
    ("transport/unicast/open_timeout", "2500"),
    ("transport/unicast/max_sessions", "64"),
    // The rest of a longer message is not read (bytes).
    ("transport/link/rx/max_message_size", "65536"),
    ("transport/link/tx/lease", "1000"),
    ("transport/shared_memory/enabled", "false"),
    ("queries_default_timeout", "1000"),
    (
        "connect/retry",
        "{period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2}",
    ),
];

impl Settings {
    /// Creates the settings of one `end`, with all else as usual.
    pub fn new(end: SessionEnd, notice: fn(&str)) -> Self {
        Self {
            end,
            insecure: false,
            file: None,
            wait: None,
            command: String::new(),
            notice,
        }
    }

    /// Returns the configuration for zenoh.
    ///
    /// # Errors
    /// [`NetworkError::Setting`] for an unreadable file, an invalid address, or an address
    /// open to the network without credentials.
    pub fn config(&self) -> Result<Config, NetworkError> {
        let mut config = match &self.file {
            None => Config::default(),
            Some(path) => from_file(path)?,
        };
        let usual = Config::default();
        for (key, value) in SAFE {
            let same = |(a, b): (String, String)| a == b;
            let own = config.get_json(key).ok().zip(usual.get_json(key).ok());
            if own.is_none_or(same) {
                set(&mut config, key, value)?;
            }
        }
        let (mode, listen, connect): (_, &[String], &[String]) = match &self.end {
            SessionEnd::Listen(addresses) => ("router", addresses, &[]),
            SessionEnd::Connect(addresses) => ("client", &[], addresses),
        };
        listen.iter().chain(connect).try_for_each(check_address)?;
        set(&mut config, "mode", &format!("{mode:?}"))?;
        set(&mut config, "listen/endpoints", &format!("{listen:?}"))?;
        set(&mut config, "connect/endpoints", &format!("{connect:?}"))?;
        // One attempt: the next ones are made here.
        set(&mut config, "connect/timeout_ms", "0")?;
        check_files(&config)?;
        self.refuse_open(listen, &config)?;
        Ok(config)
    }

    /// Refuses to listen on a network without credentials.
    fn refuse_open(&self, listen: &[String], config: &Config) -> Result<(), NetworkError> {
        let users = config.get_json("transport/auth/usrpwd/dictionary_file");
        let has_users = users.is_ok_and(|users| users != "null");
        let certificates = config.get_json("transport/link/tls/enable_mtls");
        let has_certificates = certificates.is_ok_and(|asked| asked == "true");
        let is_known =
            |address: &str| has_users || (has_certificates && address.starts_with("tls/"));
        let mut listen = listen.iter();
        let open = listen.find(|address| !is_loopback(address) && !is_known(address));
        match open {
            Some(address) if !self.insecure => Err(NetworkError::Setting(format!(
                "--listen {address}: anybody who reaches this address could move the plant: \
                 give users or certificates by --zenoh-config, or add --insecure on a network \
                 of your own"
            ))),
            _ => Ok(()),
        }
    }

    /// Opens the connection. Waits until an end that connects has found the other.
    ///
    /// # Errors
    /// [`NetworkError`] for invalid settings, or an address in use.
    pub fn open(&self) -> Result<Session, NetworkError> {
        let config = self.config()?;
        match &self.end {
            SessionEnd::Listen(addresses) => {
                let what = format!("cannot listen on {}", addresses.join(", "));
                zenoh::open(config).wait().tried(what)
            }
            SessionEnd::Connect(addresses) => {
                (self.notice)(&format!("connecting to {}", addresses.join(", ")));
                connect(&config, addresses, self.wait, self.notice)
            }
        }
    }

    /// Returns the number of the process behind `session`: another one after each start.
    pub(crate) fn number(&self, session: &Session) -> Result<u64, NetworkError> {
        let chosen = self.config()?.get_json("id");
        // The same one after each start, if a file has it.
        let is_fixed = chosen.is_ok_and(|id| id != "null");
        Ok(if is_fixed {
            machine::random()
        } else {
            number(session.zid())
        })
    }
}

/// Returns the number of a process by the identity of its session, as it is in tokens of ROS.
pub(crate) fn number(session: ZenohId) -> u64 {
    low_word(session.to_le_bytes())
}

/// Returns the first half of an identity.
pub(crate) fn low_word([word @ .., _, _, _, _, _, _, _, _]: [u8; 16]) -> u64 {
    u64::from_le_bytes(word)
}

/// The kinds of connections that this build knows.
const PROTOCOLS: &[&str] = if cfg!(feature = "tls") {
    &["tcp", "tls"]
} else {
    &["tcp"]
};

/// Refuses an address that nobody can listen on or connect to.
fn check_address(address: &String) -> Result<(), NetworkError> {
    let (protocol, rest) = address.split_once('/').unwrap_or(("", address));
    let host = rest.split(['?', '#']).next().unwrap_or_default();
    let port = host.rsplit_once(':').map(|(_, port)| port.parse::<u16>());
    if PROTOCOLS.contains(&protocol) && matches!(port, Some(Ok(_))) {
        return Ok(());
    }
    Err(NetworkError::Setting(
        match (protocol, cfg!(feature = "tls")) {
            ("tls", false) => format!("{address}: this build has no TLS: see docs/network.md"),
            _ => format!("{address} is no address: expected one such as {USUAL}"),
        },
    ))
}

/// Returns the configuration in the file at `path`. Zenoh reads files without a limit, so this one
/// is read before, within one.
fn from_file(path: &Path) -> Result<Config, NetworkError> {
    let refused = |why: &dyn Display| {
        let path = path.display();
        NetworkError::Setting(format!("--zenoh-config {path}: {why}"))
    };
    read_text(path, MOST).map_err(|why| refused(&why))?;
    if path.extension().is_some_and(|of| of.to_str().is_none()) {
        return Err(refused(&"expected a name that ends in .json5"));
    }
    Config::from_file(path).map_err(|why| {
        // Zenoh points at the place below the line.
        let why = reason(&why);
        refused(&why.split_whitespace().collect::<Vec<_>>().join(" "))
    })
}

/// Returns whether the file is missing.
fn is_missing(why: &FileError) -> bool {
    matches!(why, FileError::Unreadable(why) if why.kind() == ErrorKind::NotFound)
}

/// Refuses files of users, certificates and keys that cannot be read, or are too large. Zenoh itself
/// names a file of users that is missing.
fn check_files(config: &Config) -> Result<(), NetworkError> {
    for key in FILES {
        let path = config.get_json(key).ok();
        let path: Option<String> = path.and_then(|path| serde_json::from_str(&path).ok()?);
        if let Some(path) = path
            && let Err(why) = read(Path::new(&path), MOST)
            && !(key.starts_with(USERS) && is_missing(&why))
        {
            let name = key.rsplit('/').next().unwrap_or(key);
            return Err(NetworkError::Setting(format!("{name} {path:?}: {why}")));
        }
    }
    Ok(())
}

fn set(config: &mut Config, key: &str, value: &str) -> Result<(), NetworkError> {
    let set = config.insert_json5(key, value);
    set.map_err(|why| {
        let why = reason(&why);
        NetworkError::Setting(format!("{value} is not a setting of {key}: {why}"))
    })
}

/// Returns whether only this machine reaches an `address` such as `tcp/127.0.0.1:7447`.
fn is_loopback(address: &str) -> bool {
    let host = address
        .split_once('/')
        .map_or(address, |(_, host)| host)
        .split(['?', '#'])
        .next()
        .unwrap_or_default();
    let host = host.rsplit_once(':').map_or(host, |(host, _)| host);
    let ip = host.trim_start_matches('[').trim_end_matches(']').parse();
    host == "localhost" || ip.is_ok_and(|ip: std::net::IpAddr| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings of one end, with the zenoh configuration `file`.
    fn settings(end: SessionEnd, file: Option<PathBuf>) -> Settings {
        Settings {
            file,
            ..Settings::new(end, |_| ())
        }
    }

    fn listen(address: &str, file: Option<PathBuf>) -> Settings {
        settings(SessionEnd::Listen(vec![address.to_owned()]), file)
    }

    /// The settings of the end at `address` with a zenoh configuration of this `text`.
    fn with<T>(address: &str, text: &str, test: impl Fn(&Settings) -> T) -> T {
        let file = tempfile::Builder::new().suffix(".json5").tempfile();
        let file = file.expect("a file");
        std::fs::write(file.path(), text).expect("written");
        test(&listen(address, Some(file.path().to_owned())))
    }

    #[test]
    fn an_address_open_to_the_network_needs_credentials() {
        for address in ["tcp/127.0.0.1:7447", "tcp/[::1]:0", "tcp/localhost:1"] {
            assert!(listen(address, None).config().is_ok(), "{address}");
        }
        for address in "tcp/0.0.0.0:7447 tcp/[::]:0 tcp/10.0.0.1:7447 tcp/robot:7447".split(' ') {
            let mut open = listen(address, None);
            let refused = open.config().map(drop).expect_err(address).to_string();
            assert!(refused.contains("--insecure"), "{refused}");
            open.insecure = true;
            assert!(open.config().is_ok(), "{address}");
        }
        let users = r#"{ transport: { auth: { usrpwd: { user: "a", password: "b",
            dictionary_file: "users" } } } }"#;
        let certificates = "{ transport: { link: { tls: { enable_mtls: true } } } }";
        for (address, text, accepted) in [
            ("tcp/0.0.0.0:7447", users, true),
            ("tls/0.0.0.0:7447", certificates, cfg!(feature = "tls")),
            ("tcp/0.0.0.0:7447", certificates, false),
        ] {
            let found = with(address, text, |settings| settings.config().is_ok());
            assert_eq!(found, accepted, "{address} {text}");
        }
    }

    #[test]
    fn a_file_without_an_end_is_refused() {
        let refused = |settings: &Settings| settings.config().map(drop).expect_err("refused");
        let zero = || Some(PathBuf::from("/dev/zero"));
        let error = refused(&listen(USUAL, zero())).to_string();
        assert!(error.contains("found a device"), "{error}");
        for key in FILES {
            let words = key.split('/').map(|word| format!("{{ {word}: "));
            let closed = " }".repeat(key.split('/').count());
            let text = format!("{}\"/dev/zero\"{closed}", words.collect::<String>());
            let error = with(USUAL, &text, refused).to_string();
            assert!(error.contains("found a device"), "{key}: {error}");
        }
    }

    #[test]
    fn the_configurations_of_the_manual_are_valid_and_have_credentials() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/network/");
        let connect = || SessionEnd::Connect(vec!["tcp/robot:7447".to_owned()]);
        let listen = |address: &str| SessionEnd::Listen(vec![address.to_owned()]);
        for (name, end) in [
            ("robot.json5", listen("tcp/0.0.0.0:7447")),
            ("robot-tls.json5", listen("tls/0.0.0.0:7447")),
            ("policy.json5", connect()),
            ("dashboard.json5", connect()),
            ("policy-tls.json5", connect()),
        ] {
            let file = PathBuf::from(format!("{folder}{name}"));
            let checked = settings(end, Some(file)).config().map(drop);
            // All but the certificates, which are made where they are used.
            let lacks_certificates = |why: NetworkError| {
                let why = why.to_string();
                name.contains("tls") && why.contains(".pem\": No such file")
            };
            let text = format!("{name}: {checked:?}");
            assert!(checked.map_or_else(lacks_certificates, |()| true), "{text}");
        }
    }

    #[test]
    fn limits_are_ours_unless_a_file_has_others() {
        let read = |settings: &Settings| {
            let config = settings.config().expect("settings");
            let read = |key| config.get_json(key).expect("a key of zenoh");
            let size = read("transport/link/rx/max_message_size");
            assert_eq!(size, "65536");
            assert_eq!(read("scouting/multicast/enabled"), "false");
            // No file decides who listens.
            assert_eq!(read("mode"), "\"router\"");
            read("transport/link/tx/lease")
        };
        assert_eq!(read(&listen(USUAL, None)), "1000");
        let own = r#"{ mode: "peer", transport: { link: { tx: { lease: 700 } } } }"#;
        assert_eq!(with(USUAL, own, read), "700");
    }

    #[test]
    fn rubbish_is_an_error_in_a_line() {
        let bad = with(USUAL, "{ nonsense: 1", |settings| {
            let refused = settings.config().map(drop);
            refused.expect_err("rubbish").to_string()
        });
        let is_line = bad.starts_with("--zenoh-config ") && !bad.contains('\n');
        assert!(is_line, "{bad}");
    }
}

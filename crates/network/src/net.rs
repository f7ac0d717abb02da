//! The session of zenoh: opened, and what is published and asked in it.

use std::{
    fmt::Debug,
    sync::{Arc, Mutex, Once, mpsc},
    thread,
    time::{Duration, Instant},
};

use ratelab::sync::lock;
use tracing::{
    Event, Level, Subscriber,
    field::{Field, Visit},
    subscriber::set_global_default,
};
use tracing_subscriber::{Layer, Registry, filter::Targets, layer::Context, prelude::*};
use zenoh::{
    Config, Session, Wait,
    liveliness::LivelinessToken,
    pubsub::Publisher,
    qos::{CongestionControl, Priority},
    query::Query,
    sample::{Sample, SampleKind},
};

use crate::error::{self, Attempted, NetworkError};

/// Returns a publisher on `key` that drops messages where the network is too slow: the next one is
/// newer.
pub(crate) fn publisher(
    session: &Session,
    key: String,
    priority: Priority,
) -> Result<Publisher<'static>, NetworkError> {
    let what = format!("cannot publish to {key}");
    let publisher = session
        .declare_publisher(key)
        .congestion_control(CongestionControl::Drop);
    publisher.priority(priority).wait().tried(what)
}

/// Returns whether somebody subscribes to what is published.
pub(crate) fn is_heard(publisher: &Publisher<'static>) -> bool {
    let status = publisher.matching_status().wait();
    status.is_ok_and(|status| status.matching())
}

/// Calls `take` with each message on `key`.
pub(crate) fn subscribe(
    session: &Session,
    key: &str,
    take: impl Fn(Sample) + Send + Sync + 'static,
) -> Result<(), NetworkError> {
    let subscriber = session.declare_subscriber(key).callback(take).background();
    let subscribed = subscriber.wait();
    subscribed.tried(format_args!("cannot subscribe to {key}"))
}

/// Shows others that `token` is present.
pub(crate) fn be_present(session: &Session, token: &str) -> Result<LivelinessToken, NetworkError> {
    let declared = session.liveliness().declare_token(token).wait();
    declared.tried("cannot be present")
}

/// Calls `note` with each token under `keys`, and whether it is there or gone.
pub(crate) fn watch(
    session: &Session,
    (keys, whom): (&str, &str),
    note: impl Fn(&str, SampleKind) + Send + Sync + 'static,
) -> Result<(), NetworkError> {
    let watched = session
        .liveliness()
        .declare_subscriber(keys)
        .history(true)
        .callback(move |sample| note(sample.key_expr().as_str(), sample.kind()))
        .background()
        .wait();
    watched.tried(format_args!("cannot watch for {whom}"))
}

/// A query for a key of ours.
pub(crate) struct Question {
    query: Query,
    key: Arc<str>,
}

impl Question {
    /// Returns what is asked.
    pub(crate) fn payload(&self) -> Vec<u8> {
        let payload = self.query.payload();
        payload.map_or_else(Vec::new, |payload| payload.to_bytes().into_owned())
    }

    /// Sends an answer; nobody may wait for it any more.
    pub(crate) fn answer(&self, answer: Vec<u8>) {
        let _ = self.query.reply(&*self.key, answer).wait();
    }
}

/// Calls `reply` with each query for `key`.
pub(crate) fn answers(
    session: &Session,
    key: String,
    reply: impl Fn(Question) + Send + Sync + 'static,
) -> Result<(), NetworkError> {
    let what = format!("cannot answer on {key}");
    let key: Arc<str> = key.into();
    let declared = session
        .declare_queryable(key.to_string())
        .callback(move |query| {
            let key = key.clone();
            reply(Question { query, key });
        });
    declared.background().wait().tried(what)
}

/// Shortest time between two lines with the same reason.
const AGAIN: Duration = Duration::from_secs(10);

/// Shortest and longest pause between two attempts.
const PAUSES: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(200)];

/// Time after which an attempt that goes on is a failure, too.
const ANSWER: Duration = Duration::from_secs(3);

/// The reason where there is no other.
const NO_ANSWER: &str = "no answer";

/// The reason of the last failure.
static REASON: Mutex<Option<String>> = Mutex::new(None);

/// Connects as `config` has it, again and again, for at most `wait`. Calls `notice` with the
/// reason of a failure, with the same one at most every ten seconds.
///
/// # Errors
/// [`NetworkError::Network`] after `wait`, with the last reason, and if no thread can be started.
pub(crate) fn connect(
    config: &Config,
    addresses: &[String],
    wait: Option<Duration>,
    notice: fn(&str),
) -> Result<Session, NetworkError> {
    listen_to_reasons();
    let what = format!("cannot connect to {}", addresses.join(", "));
    let (began, mut noted) = (Instant::now(), None::<(String, Instant)>);
    let [mut pause, longest] = PAUSES;
    loop {
        let attempt = attempt(config.clone())?;
        let why = loop {
            match attempt.recv_timeout(ANSWER.min(left(began, wait))) {
                Ok(Some(session)) => return Ok(session),
                Ok(None) => break take_reason(),
                Err(_) if left(began, wait).is_zero() => break NO_ANSWER.to_owned(),
                Err(_) => note(&what, NO_ANSWER, &mut noted, notice),
            }
        };
        if left(began, wait).is_zero() {
            let why = noted
                .map(|(reason, _)| reason)
                .filter(|_| why == NO_ANSWER)
                .unwrap_or(why);
            return Err(NetworkError::network(&what, &why));
        }
        note(&what, &why, &mut noted, notice);
        thread::sleep(pause);
        pause = (pause * 2).min(longest);
    }
}

/// Returns what is left of the time to wait.
fn left(began: Instant, wait: Option<Duration>) -> Duration {
    wait.map_or(Duration::MAX, |wait| wait.saturating_sub(began.elapsed()))
}

/// Begins one attempt on a thread of its own: it may take longer than there is time.
fn attempt(config: Config) -> Result<mpsc::Receiver<Option<Session>>, NetworkError> {
    let (done, attempted) = mpsc::channel();
    error::spawn("connect", move || {
        let _ = done.send(zenoh::open(config).wait().ok());
    })?;
    Ok(attempted)
}

/// Prints a failure, unless that was done a moment ago.
fn note(what: &str, why: &str, noted: &mut Option<(String, Instant)>, notice: fn(&str)) {
    let is_new = |(text, at): &(String, Instant)| text != why || at.elapsed() >= AGAIN;
    if noted.as_ref().is_none_or(is_new) {
        notice(&format!("{what}: {why}"));
        *noted = Some((why.to_owned(), Instant::now()));
    }
}

fn take_reason() -> String {
    lock(&REASON).take().unwrap_or_else(|| NO_ANSWER.to_owned())
}

fn listen_to_reasons() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let of_connector = Targets::new().with_target("zenoh::net::runtime", Level::WARN);
        let reasons = Registry::default().with(Connector.with_filter(of_connector));
        // A program with a log of its own keeps it: the reasons are there then.
        drop(set_global_default(reasons));
    });
}

/// Reads the warnings of zenoh's connector.
struct Connector;

impl<S: Subscriber> Layer<S> for Connector {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        event.record(&mut Reason);
    }
}

/// Keeps the reason in a message such as `Unable to connect to ADDRESS! REASON at FILE`.
struct Reason;

impl Visit for Reason {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let text = format!("{value:?}");
        if field.name() != "message" || !text.starts_with("Unable to connect to ") {
            return;
        }
        if let Some(why) = text.split_once("! ").map(|(_, why)| shortened(why))
            && !why.is_empty()
        {
            *lock(&REASON) = Some(why);
        }
    }
}

/// Returns a reason without the places in zenoh's source and without the addresses, of which one
/// end is another one at each attempt.
fn shortened(why: &str) -> String {
    let why = why.split(" at /").next().unwrap_or_default();
    let innermost = why.rsplit(": ").next().unwrap_or_default();
    innermost.trim_matches(['[', ']', '.', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_that_of_the_system_or_of_the_certificate() {
        for (text, reason) in [
            (
                "Can not create a new TCP link bound to tcp/127.0.0.1:1: [127.0.0.1:1: \
             Connection refused (os error 111) at /src/tcp.rs:3.] at /src/x.rs:1.",
                "Connection refused (os error 111)",
            ),
            (
                "failed to lookup it: Name or service not known",
                "Name or service not known",
            ),
            (
                "Read error on TCP link 10.0.0.2:60434 => 10.0.0.1:7447: early eof at /x.rs:2.",
                "early eof",
            ),
        ] {
            assert_eq!(shortened(text), reason);
            assert_eq!(shortened(reason), reason);
        }
    }
}

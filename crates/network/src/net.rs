//! What is asked of zenoh, each with an error that says what was tried.

use std::sync::Arc;

use zenoh::{
    Session, Wait,
    liveliness::LivelinessToken,
    pubsub::Publisher,
    qos::{CongestionControl, Priority},
    query::Query,
    sample::{Sample, SampleKind},
};

use crate::error::{Attempted, NetworkError};

/// A publisher on `key` that drops messages where the network is too slow: the next one is
/// newer.
pub(crate) fn publisher(
    session: &Session,
    key: String,
    priority: Priority,
) -> Result<Publisher<'static>, NetworkError> {
    let what = format!("cannot publish to {key}");
    let publisher = session.declare_publisher(key);
    let publisher = publisher.congestion_control(CongestionControl::Drop);
    publisher.priority(priority).wait().tried(what)
}

/// Whether somebody subscribes to what is published.
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
    let watched = session.liveliness().declare_subscriber(keys).history(true);
    let watched = watched.callback(move |sample| note(sample.key_expr().as_str(), sample.kind()));
    let watched = watched.background().wait();
    watched.tried(format_args!("cannot watch for {whom}"))
}

/// A query for a key of ours.
pub(crate) struct Question {
    query: Query,
    key: Arc<str>,
}

impl Question {
    /// What is asked.
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
    let declared = session.declare_queryable(key.to_string());
    let declared = declared.callback(move |query| {
        let key = key.clone();
        reply(Question { query, key });
    });
    declared.background().wait().tried(what)
}

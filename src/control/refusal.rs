//! Why a graph refuses a setting.

use thiserror::Error;

/// Why a graph refuses a setting, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobRefusal {
    /// A name that the graph does not know.
    #[error("there is no {kind} {name:?}: {}", known_names(known))]
    Unknown {
        /// `node` or `topic`.
        kind: &'static str,
        /// The name.
        name: String,
        /// The known names.
        known: Vec<String>,
    },
    /// A node of another process.
    #[error("{0} runs in another process")]
    OtherProcess(String),
    /// A topic without readers, where others have some.
    #[error("{topic} has no reader: {}", topics_with_readers(read))]
    Unread {
        /// The topic.
        topic: String,
        /// The topics with readers.
        read: Vec<String>,
    },
    /// A setting of due times, of a node that messages trigger.
    #[error("messages trigger {0}: choose a node that ticks at a rate")]
    Triggered(String),
    /// A setting of a thread, of a node in an executor.
    #[error("{0} has no thread of its own: its executor decides when it starts")]
    NoThread(String),
    /// Durations of a file that is not loaded.
    #[error("the durations in {0} were not loaded: name a file that the command can read")]
    NotLoaded(String),
    /// A message that is published already.
    #[error("message {seq} is already published: choose {next} or a later one")]
    UnderWay {
        /// Its sequence number.
        seq: u64,
        /// The next sequence number.
        next: u64,
    },
    /// A setting that the node does without.
    #[error("{0}")]
    Fixed(&'static str),
    /// A setting of something else.
    #[error("{0} is not for a {1}")]
    NotFor(String, &'static str),
    /// The node refuses, in its own words.
    #[error("{0}")]
    ByNode(String),
}

fn known_names(known: &[String]) -> String {
    if known.is_empty() {
        "the graph has none".to_owned()
    } else {
        format!("expected one of {}", known.join(", "))
    }
}

fn topics_with_readers(read: &[String]) -> String {
    if read.is_empty() {
        "let a node read a topic first".to_owned()
    } else {
        format!("expected one of {}", read.join(", "))
    }
}

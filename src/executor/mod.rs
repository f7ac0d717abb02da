//! Executors: which nodes share threads, and by which rules.

mod callback;
mod kind;

pub use callback::Callback;
pub(crate) use callback::CallbackGroup;
pub use kind::Executor;

//! Which of the nodes that are due ticks next, and where, by the rules of the executors.

mod agenda;
mod dispatcher;
mod events;
mod groups;
mod preemptive;
mod queue;
mod windows;

pub(crate) use agenda::{AgendaItem, Phase, Place};
pub(crate) use dispatcher::Dispatcher;
pub(crate) use events::EventOrder;
pub(crate) use queue::{Call, CallbackQueue, Nodes};
pub(crate) use windows::WindowOrder;

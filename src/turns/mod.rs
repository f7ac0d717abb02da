//! State that nodes share, in turns: noted while a real clock runs, kept to when the run is
//! executed again.
//!
//! Nodes are functions of what they read. Two runs of the same graph on threads differ in only
//! two things: *when* each tick began, and *in which order* the threads took what they share. A
//! [`Shared`] value is a lock that counts its *turns*. A thread that notes its turns remembers for
//! each of its operations which lock it took, and which turn that was: enough to order all
//! operations again (Instant Replay, LeBlanc and Mellor-Crummey 1987; DejaVu, Choi and Srinivasan
//! 1998; LEAP, Huang, Liu and Zhang 2010).

mod lock_name;
mod modes;
mod shared;

pub use lock_name::LockName;
pub(crate) use modes::Noter;
pub use modes::{Following, Operation, TurnFollower};
pub use shared::{Shared, Turn};

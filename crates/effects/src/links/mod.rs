//! What lies between the publishers of a topic and its readers.

pub mod channel;
pub mod link;

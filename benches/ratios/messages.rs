//! The transfer of one message, in one thread.

use std::{
    collections::VecDeque,
    hint::black_box,
    sync::{Mutex, PoisonError},
};

use ratelab::{Depth, Derived, Head, Message, Publisher, Subscription, Tick, Time, Topic};
use ratelab_cart_pole::Observation;

use super::{
    paired::{Nanos, paired, time},
    table::Table,
};

const ROUNDS: usize = 200;

/// Messages per round.
const MESSAGES: u64 = 10_000;

/// Run time between two messages, and between sending and reading one.
const PERIOD_NANOS: u64 = 1_000_000;

/// Fills in the rows about single messages.
pub fn measure(table: &mut Table) {
    table.heading("Publish and read one message, depth 1, one thread");
    let mut ours = Ours::new();
    let deque = paired(ROUNDS, || ours.round(), deque_round());
    table.row("beside a mutexed deque", &deque, Some(2.0));
    let channel = paired(ROUNDS, || ours.round(), channel_round());
    table.row("beside a crossbeam channel", &channel, None);
}

fn observation(number: u64) -> Observation {
    Observation {
        cart_position: number as f32,
        cart_velocity: 0.1,
        cos_theta: 1.0,
        sin_theta: 0.0,
        pole_velocity: 0.2,
    }
}

fn stamp(number: u64) -> Time {
    Time::from_nanos(number * PERIOD_NANOS)
}

/// A message for the alternatives, with the same content as a topic's message.
fn message(number: u64) -> Message<Observation> {
    let at = stamp(number);
    let head = Head {
        at,
        by: None,
        stamp: at,
        seq: number,
        origin: None,
        from: Derived::Reads,
        arrives: Some(at),
        dropped: 0,
    };
    Message::from_head(&head, observation(number))
}

/// Time per call of `step` over one round.
fn per_message(mut step: impl FnMut(u64)) -> Nanos {
    time(|| (0..MESSAGES).for_each(&mut step)) / MESSAGES as f64
}

/// A topic with its statistics.
struct Ours {
    publisher: Publisher<Observation>,
    subscription: Subscription<Observation>,
}

impl Ours {
    fn new() -> Self {
        let topic = Topic::new("/obs", Depth::ONE);
        Self {
            publisher: topic.publisher(),
            subscription: topic.subscribe(),
        }
    }

    fn round(&mut self) -> Nanos {
        // A node keeps its tick from one to the next.
        let mut tick = Tick::at(stamp(0));
        per_message(|number| {
            tick.publish(&self.publisher, observation(black_box(number)));
            black_box(tick.read(&mut self.subscription));
        })
    }
}

/// A ring buffer without names, marks, counters and histograms.
fn deque_round() -> impl FnMut() -> Nanos {
    let ring = Mutex::new(VecDeque::new());
    move || {
        per_message(|number| {
            {
                let mut ring = ring.lock().unwrap_or_else(PoisonError::into_inner);
                if ring.len() >= Depth::ONE.get() {
                    ring.pop_front();
                }
                ring.push_back(message(black_box(number)));
            }
            let newest = {
                ring.lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .back()
                    .copied()
            };
            black_box(newest);
        })
    }
}

/// A bounded channel, which delivers each message once and keeps none.
fn channel_round() -> impl FnMut() -> Nanos {
    let (sender, receiver) = crossbeam_channel::bounded(Depth::ONE.get());
    move || {
        per_message(|number| {
            let sent = sender.try_send(message(black_box(number)));
            debug_assert!(sent.is_ok());
            black_box(receiver.try_recv().ok());
        })
    }
}

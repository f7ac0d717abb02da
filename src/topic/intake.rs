//! The end of a topic that triggers a node.

use std::collections::VecDeque;

use super::{
    Subscription, Topic,
    message::Payload,
    queue::{Bus, Queue},
    readers::TriggerEnd,
};
use crate::{
    arrival::Arrivals,
    sync::Arc,
    time::Time,
    trigger::{Intake, TakenMessage},
};

impl<T: Payload> Topic<T> {
    /// Creates a subscription, the topic's reader at this `place`, whose messages trigger the node
    /// with index `node` as its input number `input`.
    pub(crate) fn trigger(
        &self,
        place: usize,
        (node, input): (usize, usize),
        arrivals: &Arc<Arrivals>,
    ) -> (Subscription<T>, Box<dyn Intake>) {
        let mut bus = self.0.lock();
        let reader = bus.add_reader(Some(place));
        bus.note_deliveries();
        bus.readers[reader].trigger = Some(Box::new(TriggerEnd {
            node,
            input,
            arrivals: arrivals.clone(),
            taken: VecDeque::new(),
            chosen: None,
        }));
        drop(bus);
        let intake = TopicIntake {
            bus: self.0.clone(),
            reader,
        };
        let bus = self.0.clone();
        (Subscription { bus, reader }, Box::new(intake))
    }
}

/// The end of a topic by which its messages are taken.
struct TopicIntake<T> {
    bus: Arc<Bus<T>>,
    reader: usize,
}

impl<T> Queue<T> {
    /// Index of the oldest message that a reader has not seen, and its delivery.
    fn unread(&self, reader: usize) -> Option<(usize, Time)> {
        let index = self.first_unread(reader);
        let at = self.delivered.as_ref()?.get(index)?;
        Some((index, *at))
    }
}

impl<T: Payload> Intake for TopicIntake<T> {
    fn oldest(&self, now: Time) -> Option<Time> {
        let mut bus = self.bus.lock();
        bus.deliver(now);
        bus.unread(self.reader).map(|(_, at)| at)
    }

    fn waiting(&self, now: Time) -> usize {
        let mut bus = self.bus.lock();
        bus.deliver(now);
        let first = bus.unread(self.reader).map(|(index, _)| index);
        first.map_or(0, |first| bus.messages.len() - first)
    }

    fn take(&mut self, now: Time) -> Option<TakenMessage> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        queue.deliver(now);
        let (index, arrived) = queue.unread(self.reader)?;
        let message = queue.messages.get(index)?.clone();
        let taken = TakenMessage {
            seq: message.seq,
            sensed: message.sensed(),
            arrived,
        };
        let reader = &mut queue.readers[self.reader];
        reader.next_unread = message.seq + 1;
        reader.trigger.as_mut()?.taken.push_back(message);
        Some(taken)
    }

    fn choose(&mut self, seq: u64) {
        if let Some(end) = &mut self.bus.lock().readers[self.reader].trigger {
            let mut taken = end.taken.iter();
            end.chosen = taken.find(|message| message.seq == seq).cloned();
        }
    }

    fn forget_before(&mut self, seq: Option<u64>) {
        if let Some(end) = &mut self.bus.lock().readers[self.reader].trigger {
            let kept = seq.unwrap_or(u64::MAX);
            end.taken.retain(|message| message.seq >= kept);
        }
    }
}

impl<T> Drop for TopicIntake<T> {
    fn drop(&mut self) {
        self.bus.lock().readers[self.reader].trigger = None;
    }
}

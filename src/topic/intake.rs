//! The end of a topic that triggers a node.

use std::collections::VecDeque;

use super::{
    Subscription, Topic,
    message::Payload,
    queue::{Bus, Queue},
    readers::{ReadMark, TriggerReader, Triggers},
};
use crate::{
    arrival::Arrivals,
    sync::{Arc, atomic::Ordering},
    time::Time,
    trigger::{Intake, TakenMessage},
};

impl<T: Payload> Topic<T> {
    /// Creates a subscription whose messages trigger the node with index `node`, as its
    /// input number `input` and the topic's reader number `reader`.
    pub(crate) fn trigger(
        &self,
        node: usize,
        input: usize,
        reader: usize,
        arrivals: &Arc<Arrivals>,
    ) -> (Subscription<T>, Box<dyn Intake>) {
        let mut bus = self.0.peek();
        let queue = &mut *bus;
        let mark = Arc::new(ReadMark::new(queue.next_delivered(), Some(reader)));
        let delivered = queue.messages.iter().map(|message| message.stamp);
        let triggers = queue.triggers.get_or_insert_with(|| {
            Box::new(Triggers {
                delivered: delivered.collect(),
                readers: Vec::new(),
            })
        });
        triggers.readers.push(TriggerReader {
            mark: mark.clone(),
            node,
            input,
            arrivals: arrivals.clone(),
            taken: VecDeque::new(),
            chosen: None,
        });
        drop(bus);
        let (bus, subscription) = (self.0.clone(), self.subscribe_again(mark.clone()));
        (subscription, Box::new(TopicIntake { bus, mark }))
    }
}

/// The end of a topic by which its messages are taken.
struct TopicIntake<T> {
    bus: Arc<Bus<T>>,
    mark: Arc<ReadMark>,
}

impl<T> Queue<T> {
    /// Index of the oldest message after the read position, and its delivery.
    fn unread(&self, mark: &ReadMark) -> Option<(usize, Time)> {
        let next = mark.next_unread.load(Ordering::Relaxed);
        let index = self.messages.partition_point(|message| message.seq < next);
        let at = self.triggers.as_ref()?.delivered.get(index)?;
        Some((index, *at))
    }

    fn reader(&mut self, mark: &Arc<ReadMark>) -> Option<&mut TriggerReader<T>> {
        let mut readers = self.triggers.as_mut()?.readers.iter_mut();
        readers.find(|reader| Arc::ptr_eq(&reader.mark, mark))
    }
}

impl<T: Payload> Intake for TopicIntake<T> {
    fn oldest(&self, now: Time) -> Option<Time> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        queue.deliver(now);
        queue.unread(&self.mark).map(|(_, at)| at)
    }

    fn waiting(&self, now: Time) -> usize {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        queue.deliver(now);
        let first = queue.unread(&self.mark).map(|(index, _)| index);
        first.map_or(0, |first| queue.messages.len() - first)
    }

    fn take(&mut self, now: Time) -> Option<TakenMessage> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        queue.deliver(now);
        let (index, arrived) = queue.unread(&self.mark)?;
        let message = queue.messages.get(index)?.clone();
        let taken = TakenMessage {
            seq: message.seq,
            sensed: message.sensed(),
            arrived,
        };
        self.mark
            .next_unread
            .store(message.seq + 1, Ordering::Relaxed);
        queue.reader(&self.mark)?.taken.push_back(message);
        Some(taken)
    }

    fn choose(&mut self, seq: u64) {
        let mut bus = self.bus.lock();
        if let Some(reader) = bus.reader(&self.mark) {
            let mut taken = reader.taken.iter();
            reader.chosen = taken.find(|message| message.seq == seq).cloned();
        }
    }

    fn forget_before(&mut self, seq: Option<u64>) {
        let mut bus = self.bus.lock();
        if let Some(reader) = bus.reader(&self.mark) {
            let kept = seq.unwrap_or(u64::MAX);
            reader.taken.retain(|message| message.seq >= kept);
        }
    }
}

impl<T> Drop for TopicIntake<T> {
    fn drop(&mut self) {
        if let Some(triggers) = &mut self.bus.lock().triggers {
            triggers
                .readers
                .retain(|end| !Arc::ptr_eq(&end.mark, &self.mark));
        }
    }
}

//! A topic, regardless of its payload.

use super::{Topic, link_channel::LinkChannel, message::Payload, transit::Transit};
use crate::{
    arrival::Arrival,
    control::{knob::Knob, refusal::KnobRefusal},
    qos::Depth,
    record::RecordSender,
    time::Time,
};

/// A topic, regardless of its payload.
pub(crate) trait AnyTopic: Send {
    /// Sets a knob of the topic, or of its link in a run with this `seed`, for messages published
    /// from run time `now` on; returns the knob that was in force.
    ///
    /// # Errors
    /// [`KnobRefusal`] for a message that is published already, and for a knob of a node.
    fn set(&self, knob: &Knob, seed: u64, now: Time) -> Result<Knob, KnobRefusal>;

    /// Queue depth.
    fn depth(&self) -> Depth;

    /// Sends its records on this way.
    fn set_records(&self, records: RecordSender);

    /// Delivers the messages that arrive by `now`. Publishing and reading do the same.
    fn deliver(&self, now: Time);

    /// Returns the messages in flight that arrive after `now`, for the nodes that they trigger.
    fn arrivals_after(&self, now: Time) -> Vec<Arrival>;
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn set(&self, knob: &Knob, seed: u64, now: Time) -> Result<Knob, KnobRefusal> {
        match knob {
            Knob::Depth { topic, depth } => {
                return Ok(Knob::Depth {
                    topic: topic.clone(),
                    depth: self.set_depth(*depth, now),
                });
            }
            Knob::Read { topic, order } => {
                return Ok(Knob::Read {
                    topic: topic.clone(),
                    order: std::mem::replace(&mut self.0.lock().order, *order),
                });
            }
            _ => {}
        }
        let mut bus = self.0.lock();
        let queue = &mut *bus;
        match knob.message() {
            Some(seq) => queue.ensure_unpublished(seq)?,
            None => queue.deliver_before(now),
        }
        let transit = match &mut queue.transit {
            Some(transit) => transit,
            none => {
                let channel = LinkChannel::new(seed, self.name());
                let newest = queue.messages.back().cloned();
                none.insert(Box::new(Transit::new(channel, queue.next_seq, newest)))
            }
        };
        let before = transit.channel.set(knob);
        // Without a link, and with nothing in flight, it is as fast as a topic that never had one.
        queue.transit.take_if(|transit| transit.is_done());
        before
    }

    fn depth(&self) -> Depth {
        Topic::depth(self)
    }

    fn set_records(&self, records: RecordSender) {
        self.0.peek().records = Some(records);
    }

    fn deliver(&self, now: Time) {
        self.0.peek().deliver(now);
    }

    fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        let queue = self.0.peek();
        let Some(transit) = &queue.transit else {
            return Vec::new();
        };
        let times = transit.arrivals_after(now);
        times.flat_map(|at| queue.arrivals(at)).collect()
    }
}

//! The latest message wins and losses count: random sequences of operations agree with a model
//! without marks or counters.

use std::collections::VecDeque;

use proptest::prelude::*;

use crate::{Depth, Publisher, Subscription, Tick, Time, Topic};

/// An operation on a topic; subscriptions are given by number.
#[derive(Clone, Copy, Debug)]
enum Step {
    Publish,
    Read(usize),
    Next(usize),
    SetDepth(usize),
    Subscribe,
    Leave(usize),
}

/// A topic whose messages are their own numbers, with those who read it.
struct Bench {
    topic: Topic<u64>,
    publisher: Publisher<u64>,
    readers: Vec<Subscription<u64>>,
}

impl Bench {
    fn new(messages: usize) -> Self {
        let topic = Topic::new("/test", Depth::new(messages).expect("a depth"));
        Self {
            publisher: topic.publisher(),
            readers: vec![topic.subscribe()],
            topic,
        }
    }

    /// Takes a step; what was read, and the depth before.
    fn take(&mut self, step: Step) -> (Option<u64>, Option<usize>) {
        match step {
            Step::Publish => {
                let number = self.topic.published();
                Tick::at(Time::from_nanos(number)).publish(&self.publisher, number);
            }
            Step::Read(reader) => {
                let count = self.readers.len();
                let message = Tick::at(Time::MAX).read(&mut self.readers[reader % count]);
                let number = message.map(|message| {
                    let numbers = (message.seq, message.stamp.as_nanos());
                    assert_eq!(numbers, (message.data, message.data));
                    message.data
                });
                return (number, None);
            }
            Step::Next(reader) => {
                let count = self.readers.len();
                let message = Tick::at(Time::MAX).read_next(&mut self.readers[reader % count]);
                return (message.map(|message| message.data), None);
            }
            Step::SetDepth(messages) => {
                let before = self
                    .topic
                    .set_depth(Depth::new(messages).expect("a depth"), Time::ZERO);
                return (None, Some(before.get()));
            }
            Step::Subscribe => self.readers.push(self.topic.subscribe()),
            Step::Leave(reader) if self.readers.len() > 1 => {
                drop(self.readers.remove(reader % self.readers.len()));
            }
            Step::Leave(_) => {}
        }
        (None, None)
    }

    fn dropped(&self) -> Vec<u64> {
        self.readers.iter().map(Subscription::dropped).collect()
    }
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => Just(Step::Publish),
        3 => (0..6usize).prop_map(Step::Read),
        3 => (0..6usize).prop_map(Step::Next),
        1 => (1..8usize).prop_map(Step::SetDepth),
        1 => Just(Step::Subscribe),
        1 => (0..6usize).prop_map(Step::Leave),
    ];
    proptest::collection::vec(step, 0..200)
}

/// A topic without marks or counters: the remaining messages, and for each subscription
/// the messages it has not seen and the number of those that it lost.
struct ReferenceTopic {
    depth: usize,
    published: u64,
    buffer: VecDeque<u64>,
    readers: Vec<(Vec<u64>, u64)>,
}

impl ReferenceTopic {
    fn take(&mut self, step: Step) -> (Option<u64>, Option<usize>) {
        let before = self.depth;
        match step {
            Step::Publish => {
                self.buffer.push_back(self.published);
                let readers = self.readers.iter_mut();
                readers.for_each(|reader| reader.0.push(self.published));
                self.published += 1;
            }
            Step::Read(reader) => {
                let count = self.readers.len();
                self.readers[reader % count].0.clear();
                return (self.buffer.back().copied(), None);
            }
            Step::Next(reader) => {
                let count = self.readers.len();
                let unread = &mut self.readers[reader % count].0;
                let next = (!unread.is_empty()).then(|| unread.remove(0));
                return (next, None);
            }
            Step::SetDepth(messages) => self.depth = messages,
            Step::Subscribe => self.readers.push((Vec::new(), 0)),
            Step::Leave(reader) if self.readers.len() > 1 => {
                self.readers.remove(reader % self.readers.len());
            }
            Step::Leave(_) => {}
        }
        while self.buffer.len() > self.depth {
            let gone = self.buffer.pop_front();
            for (unread, dropped) in &mut self.readers {
                let before = unread.len();
                unread.retain(|message| Some(*message) != gone);
                *dropped += (before - unread.len()) as u64;
            }
        }
        (None, matches!(step, Step::SetDepth(_)).then_some(before))
    }
}

proptest! {
    #[test]
    fn any_sequence_of_operations_agrees_with_the_model(depth in 1..8usize, steps in steps()) {
        let mut bench = Bench::new(depth);
        let (buffer, readers) = (VecDeque::new(), vec![(Vec::new(), 0)]);
        let mut model = ReferenceTopic { depth, published: 0, buffer, readers };
        for step in steps {
            prop_assert_eq!(bench.take(step), model.take(step), "{:?}", step);
            let expected: Vec<_> = model.readers.iter().map(|reader| reader.1).collect();
            prop_assert_eq!(bench.dropped(), expected, "after {:?}", step);
            prop_assert_eq!(bench.topic.published(), model.published);
            prop_assert_eq!(bench.topic.depth().get(), model.depth);
        }
    }
}

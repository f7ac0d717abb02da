//! A topic whose publisher runs in another process.

use std::{
    sync::{Arc, Mutex, MutexGuard},
    time::{Duration, Instant},
};

use crossbeam_channel::Sender as Channel;
use ratelab::{ForwardedTimes, Time, sync::lock};
use ratelab_metrics::RowInlet;
use ratelab_system::TopicChains;
use zenoh::{Session, sample::Sample};

use crate::{
    error::NetworkError,
    net,
    packet::{self, RunTimes},
    sender::{MessageSource, Refusal, Refused, Sender},
    telemetry::SentMessage,
    times::{Recent, Times},
};

/// Receives the messages of one node on one topic. The callback of the connection decodes,
/// checks, publishes and returns: a reader that is too slow leaves its messages to the
/// local topic, where the newest wins, and never to the buffers of the network.
pub struct Inlet {
    /// Index of the topic in the graph.
    pub topic: usize,
    /// Name of the topic.
    pub name: String,
    /// Name of the publishing node.
    pub node: String,
    /// Silence after which the node counts as silent, and another process may send.
    pub patience: Duration,
    /// The messages that were refused.
    pub refused: Refused,
    pub(crate) width: usize,
    pub(crate) run_times: RunTimes,
    pub(crate) publish: RowInlet,
    pub(crate) chains: TopicChains,
    pub(crate) sender: Mutex<Sender>,
    pub(crate) times: Arc<Times>,
    /// For dashboards; what does not fit is left out.
    pub(crate) arrivals: Channel<(SentMessage, Time)>,
    /// The numbers of messages here, and what they are at their senders.
    pub(crate) numbers: Recent<u64, SentMessage>,
}

impl Inlet {
    /// Passes each message on `key` to `take` for as long as `session` is open, and counts
    /// what it refuses.
    pub(crate) fn begin(
        self: &Arc<Self>,
        session: &Session,
        key: &str,
        take: impl Fn(&Self, &Sample) -> Result<(), Refusal> + Send + Sync + 'static,
    ) -> Result<(), NetworkError> {
        let inlet = self.clone();
        net::subscribe(session, key, move |sample| {
            if let Err(why) = take(&inlet, &sample) {
                inlet.refused.count(why);
            }
        })
    }

    /// Returns the sender, and what was lost.
    pub fn sender(&self) -> MutexGuard<'_, Sender> {
        lock(&self.sender)
    }

    /// Takes in a message in our own format, from anybody.
    pub(crate) fn take(&self, bytes: &[u8]) -> Result<(), Refusal> {
        let width = self.width + self.chains.count();
        let (head, mut row) = packet::decode(bytes, width)?;
        let stamp = self.times.time(head.stamp)?;
        let origin = head
            .origin
            .map(|origin| self.times.time(origin))
            .transpose()?;
        let at = self.check_sender(MessageSource::direct(head.incarnation), head.seq)?;
        let sensed = origin.unwrap_or(stamp);
        self.times
            .remember(sensed, head.origin.unwrap_or(head.stamp));
        self.run_times
            .receive(&mut row, self.times.passed(head.stamp)?);
        let here = self.publish(&row, ForwardedTimes { at, stamp, origin })?;
        let message = SentMessage {
            topic: self.topic,
            incarnation: head.incarnation,
            seq: head.seq,
        };
        self.numbers.keep(here, message);
        let _ = self.arrivals.try_send((message, at));
        Ok(())
    }

    /// Checks that message number `seq` is of the topic's sender; returns the run time.
    pub(crate) fn check_sender(&self, from: MessageSource, seq: u64) -> Result<Time, Refusal> {
        let at = self.times.now().ok_or(Refusal::Early)?;
        let (mut sender, now) = (self.sender(), Instant::now());
        sender.accept(from, seq, now, self.patience)?;
        Ok(at)
    }

    /// Returns what message number `seq` of the local topic is at its sender.
    pub(crate) fn sent_message(&self, seq: u64) -> Option<SentMessage> {
        let known = self.numbers.find(|here, _| *here == seq);
        known.map(|(_, sent)| sent)
    }

    /// Publishes into the local topic; returns the number of the message there. Behind its numbers may
    /// be when the data of its chains began.
    pub(crate) fn publish(&self, row: &[f64], times: ForwardedTimes) -> Result<u64, Refusal> {
        let (row, begun) = row.split_at(self.width.min(row.len()));
        let publish = || (self.publish)(row, times);
        self.chains.forward(begun, publish).ok_or(Refusal::Content)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        machine::{ClockId, ClockMoment},
        packet::{PacketHead, encode},
    };
    use crossbeam_channel::{Receiver, bounded, unbounded};
    use ratelab::{Clock, Flow, Graph, Hz, Inbox, Tick, Wiring};
    use ratelab_metrics::Observer;
    use ratelab_real_clock::RealClock;

    /// What was published: rows with stamp and origin.
    type Published = Receiver<(Vec<f64>, Time, Option<Time>)>;

    /// An inlet for messages of one number, while the clock of its graph runs, some of whose nodes
    /// have `wrong_clocks`.
    fn with_inlet(wrong_clocks: bool, test: impl Fn(&Inlet, &Published) + Send + Sync + 'static) {
        let (sent, published) = unbounded();
        let mut graph = Graph::new();
        let inlet = Inlet {
            topic: 0,
            name: "/action".to_owned(),
            node: "policy".to_owned(),
            patience: Duration::from_secs(3600),
            refused: Refused::default(),
            width: 1,
            publish: Box::new(move |row, times| {
                let message = (row.to_vec(), times.stamp, times.origin);
                (sent.send(message).is_ok() && row != [7.0]).then_some(0)
            }),
            sender: Mutex::default(),
            times: Arc::new(Times::new(
                Observer::new(&graph),
                graph.run_writer(),
                Arc::default(),
                wrong_clocks,
            )),
            arrivals: bounded(1).0,
            run_times: RunTimes::default(),
            chains: TopicChains::default(),
            numbers: Recent::default(),
        };
        let hz = Hz::new(100.0).expect("a rate");
        let once = move |_: &mut Wiring<'_>| {
            move |_: &mut Tick| {
                test(&inlet, &published);
                Flow::End
            }
        };
        graph.node("test", hz, 0, once).expect("a node");
        let run = RealClock::default().run(&mut graph, &mut Inbox::default(), Time::MAX);
        run.expect("no panic");
    }

    fn head(seq: u64, stamp: ClockMoment) -> PacketHead {
        PacketHead {
            incarnation: 1,
            seq,
            stamp,
            origin: Some(stamp),
        }
    }

    #[test]
    fn hostile_messages_are_counted_and_never_obeyed() {
        with_inlet(false, |inlet, published| {
            let good = encode(&head(5, ClockMoment::now()), &[0.5]);
            assert_eq!(inlet.take(&good), Ok(()));
            let of = |row: &[f64]| encode(&head(6, ClockMoment::now()), row);
            let (now, clock) = (ClockMoment::now(), ClockId(1));
            let of_time = |stamp| encode(&head(6, stamp), &[1.0]);
            let at = |at| of_time(ClockMoment { at, ..now });
            let second = PacketHead {
                incarnation: 2,
                ..head(0, now)
            };
            for (bytes, why) in [
                (good.clone(), Refusal::Repeated),
                (good[1..].to_vec(), Refusal::Format),
                (good[..60].to_vec(), Refusal::Length),
                (of(&[0.5, 0.5]), Refusal::Length),
                (of(&[f64::NAN]), Refusal::NotFinite),
                (of(&[f64::INFINITY]), Refusal::NotFinite),
                (encode(&second, &[1.0]), Refusal::Sender),
                (at(now.at + 1_000_000_000), Refusal::Future),
                (of_time(ClockMoment { clock, ..now }), Refusal::Clock),
                (at(i64::MIN + 1), Refusal::Early),
            ] {
                let before = inlet.refused.hostile();
                assert_eq!(inlet.take(&bytes), Err(why));
                inlet.refused.count(why);
                let more = inlet.refused.hostile() - before;
                assert_eq!(more, u64::from(!why.is_harmless()), "{why}");
                assert!(inlet.refused.read().contains_key(&why), "{why}");
            }
            assert_eq!(published.try_iter().count(), 1);
            assert_eq!(inlet.take(&of(&[0.25])), Ok(()));
            assert_eq!(published.try_iter().count(), 1);
            assert_eq!(inlet.sender().lost, 0);
        });
    }

    #[test]
    fn a_time_that_came_from_here_comes_back_as_it_left() {
        with_inlet(false, |inlet, published| {
            let sensed = ClockMoment::now();
            assert_eq!(inlet.take(&encode(&head(0, sensed), &[0.5])), Ok(()));
            let (_, stamp, origin) = published.try_recv().expect("published");
            assert_eq!(Some(stamp), origin);
            assert_eq!(inlet.times.moment(stamp), Some(sensed));
            assert_eq!(inlet.times.origin(stamp), Some(sensed));
        });
    }

    #[test]
    fn the_stamps_of_a_wrong_clock_arrive_as_they_are_where_the_graph_has_one() {
        with_inlet(true, |inlet, published| {
            let now = ClockMoment::now();
            for (seq, ahead) in [8_000_000_i64, 37_000_000_000, -175_000_000]
                .into_iter()
                .enumerate()
            {
                let stamp = ClockMoment {
                    at: now.at + ahead,
                    ..now
                };
                let bytes = encode(&head(seq as u64, stamp), &[0.5]);
                assert_eq!(inlet.take(&bytes), Ok(()), "{ahead}");
                let (_, shown, header) = published.try_recv().expect("published");
                let expected = stamp.at - inlet.times.zero().expect("a run");
                assert_eq!(shown.as_nanos(), expected.max(0).unsigned_abs(), "{ahead}");
                assert_eq!(header, Some(shown));
                // And a node that copies it sends it as it came.
                assert_eq!(inlet.times.origin(shown), Some(stamp));
            }
            let unknown = ClockMoment {
                clock: ClockId(1),
                ..now
            };
            let refused = inlet.take(&encode(&head(9, unknown), &[0.5]));
            assert_eq!(refused, Err(Refusal::Clock));
        });
    }
}

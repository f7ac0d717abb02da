//! A topic whose publisher runs in another process.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crossbeam_channel::Sender as Channel;
use ratelab::Time;
use ratelab_account::RowInlet;
use zenoh::{Session, Wait, sample::Sample};

use crate::{
    error::WireError,
    origins::Origins,
    packet,
    refusal::{Refusal, Refused},
    sender::{MessageSource, Sender},
    telemetry::ReceivedMessage,
    times::Times,
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
    pub(crate) publish: RowInlet,
    pub(crate) sender: Mutex<Sender>,
    pub(crate) times: Arc<Times>,
    pub(crate) origins: Arc<Origins>,
    /// For dashboards; what does not fit is left out.
    pub(crate) arrivals: Channel<ReceivedMessage>,
}

impl Inlet {
    /// Subscribes to `key` for as long as `session` is open.
    pub(crate) fn begin(self: &Arc<Self>, session: &Session, key: &str) -> Result<(), WireError> {
        let inlet = self.clone();
        let receive = move |sample: Sample| inlet.receive(&sample.payload().to_bytes());
        let subscribed = session.declare_subscriber(key).callback(receive);
        let subscribed = subscribed.background().wait();
        subscribed.map_err(|why| WireError::network(&format!("cannot subscribe to {key}"), &why))
    }

    /// The sender, and what was lost.
    pub fn sender(&self) -> MutexGuard<'_, Sender> {
        self.sender.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a message from anybody.
    pub(crate) fn receive(&self, bytes: &[u8]) {
        if let Err(why) = self.take(bytes) {
            self.refused.count(why);
        }
    }

    fn take(&self, bytes: &[u8]) -> Result<(), Refusal> {
        let (head, row) = packet::decode(bytes, self.width)?;
        let stamp = self.times.time(head.stamp)?;
        let origin = head.origin.map(|origin| self.times.time(origin));
        let origin = origin.transpose()?;
        let at = self.check_sender(MessageSource::direct(head.incarnation), head.seq)?;
        let sensed = origin.unwrap_or(stamp);
        self.origins
            .remember(sensed, head.origin.unwrap_or(head.stamp));
        self.publish(&row, at, stamp, origin)?;
        self.note_arrival(head.incarnation, head.seq, at);
        Ok(())
    }

    /// Checks that message number `seq` is of the topic's sender; returns the run time.
    pub(crate) fn check_sender(&self, from: MessageSource, seq: u64) -> Result<Time, Refusal> {
        let at = self.times.now().ok_or(Refusal::Early)?;
        let (mut sender, now) = (self.sender(), Instant::now());
        sender.accept(from, seq, now, self.patience)?;
        Ok(at)
    }

    /// Notes for dashboards that message number `seq` arrived.
    pub(crate) fn note_arrival(&self, incarnation: u64, seq: u64, at: Time) {
        let topic = self.topic;
        let _ = self.arrivals.try_send(ReceivedMessage {
            topic,
            incarnation,
            seq,
            at,
        });
    }

    /// Publishes into the local topic.
    pub(crate) fn publish(
        &self,
        row: &[f64],
        at: Time,
        stamp: Time,
        origin: Option<Time>,
    ) -> Result<(), Refusal> {
        match (self.publish)(row, at, stamp, origin) {
            true => Ok(()),
            false => Err(Refusal::Content),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        clock::{self, ClockId},
        offset::Offsets,
        packet::{ClockMoment, PacketHead, encode},
    };
    use crossbeam_channel::{Receiver, bounded, unbounded};
    use ratelab::{Clock, END, Graph, Hz, Inbox, RealClock, Wiring};
    use ratelab_account::Observer;

    /// What was published: rows with stamp and origin.
    type Published = Receiver<(Vec<f64>, Time, Option<Time>)>;

    /// An inlet for messages of one number, while the clock of its graph runs.
    fn with_inlet(test: impl Fn(&Inlet, &Published) + Send + Sync + 'static) {
        let (sent, published) = unbounded();
        let mut graph = Graph::new();
        let inlet = Inlet {
            topic: 0,
            name: "/action".to_owned(),
            node: "policy".to_owned(),
            patience: Duration::from_secs(3600),
            refused: Refused::default(),
            width: 1,
            publish: Box::new(move |row, _, stamp, origin| {
                sent.send((row.to_vec(), stamp, origin)).is_ok() && row != [7.0]
            }),
            sender: Mutex::default(),
            times: Arc::new(Times::new(Observer::of(&graph), Arc::<Offsets>::default())),
            origins: Arc::default(),
            arrivals: bounded(1).0,
        };
        let hz = Hz::new(100.0).expect("a rate");
        let once = move |_: &mut Wiring<'_>| {
            move |_| {
                test(&inlet, &published);
                END
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

    fn now() -> ClockMoment {
        ClockMoment {
            clock: ClockId::here(),
            at: clock::now(),
        }
    }

    #[test]
    fn hostile_messages_are_counted_and_never_obeyed() {
        with_inlet(|inlet, published| {
            let good = encode(&head(5, now()), &[0.5]);
            inlet.receive(&good);
            assert_eq!(published.try_iter().count(), 1);
            let mut expected = 0;
            let mut refuse = |bytes: &[u8], why: Refusal| {
                inlet.receive(bytes);
                expected += u64::from(!why.is_harmless());
                let counted = inlet.refused.read();
                assert!(
                    counted.iter().any(|(known, _)| *known == why),
                    "{why}: {counted:?}"
                );
                assert_eq!(inlet.refused.hostile(), expected, "{why}");
            };
            refuse(&good, Refusal::Repeated);
            refuse(&good[1..], Refusal::Format);
            refuse(&good[..60], Refusal::Length);
            refuse(&encode(&head(6, now()), &[0.5, 0.5]), Refusal::Length);
            refuse(&encode(&head(6, now()), &[f64::NAN]), Refusal::NotFinite);
            refuse(
                &encode(&head(6, now()), &[f64::INFINITY]),
                Refusal::NotFinite,
            );
            let second = PacketHead {
                incarnation: 2,
                ..head(0, now())
            };
            refuse(&encode(&second, &[1.0]), Refusal::Sender);
            let later = ClockMoment {
                at: now().at + 1_000_000_000,
                ..now()
            };
            refuse(&encode(&head(6, later), &[1.0]), Refusal::Future);
            let foreign = ClockMoment {
                clock: ClockId(1),
                ..now()
            };
            refuse(&encode(&head(6, foreign), &[1.0]), Refusal::Clock);
            let before = ClockMoment {
                at: i64::MIN + 1,
                ..now()
            };
            refuse(&encode(&head(6, before), &[1.0]), Refusal::Early);
            assert_eq!(published.try_iter().count(), 0);
            inlet.receive(&encode(&head(6, now()), &[0.25]));
            assert_eq!(published.try_iter().count(), 1);
            assert_eq!(inlet.sender().lost, 0);
        });
    }

    #[test]
    fn a_time_that_came_from_here_comes_back_as_it_left() {
        with_inlet(|inlet, published| {
            let sensed = now();
            inlet.receive(&encode(&head(0, sensed), &[0.5]));
            let (_, stamp, origin) = published.try_recv().expect("published");
            assert_eq!(Some(stamp), origin);
            assert_eq!(inlet.times.moment(stamp), Some(sensed));
            assert_eq!(inlet.origins.original(stamp), Some(sensed));
        });
    }
}

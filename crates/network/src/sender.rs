//! The sender of a topic, and why messages of it are refused.

use std::{
    collections::BTreeMap,
    sync::Mutex,
    time::{Duration, Instant},
};

use ratelab::sync::lock;
use thiserror::Error;

/// The most messages that a node sends in a second: the highest rate that there is.
const MOST_PER_SECOND: f64 = 10_000.0;

/// Messages by which a sender may be ahead of that, after a moment in which it was held up.
const AHEAD: u64 = 100;

/// The sender of a topic, as its receiver knows it.
#[derive(Debug, Default)]
pub struct Sender {
    current: Option<Current>,
    /// When the receiver stood still last.
    excused: Option<Instant>,
    /// Messages that were sent and did not arrive.
    pub lost: u64,
    /// Senders so far.
    pub starts: u64,
}

/// Who sent a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageSource {
    /// Number of the sender: of a process, or of a publisher of ROS.
    pub number: u64,
    /// Number of its process, where that is known.
    pub process: Option<u64>,
}

impl MessageSource {
    /// Returns the process with this number, by a message of our own format.
    pub fn direct(number: u64) -> Self {
        let process = Some(number);
        Self { number, process }
    }

    /// Returns whether it is a publisher of ROS in the process that is `direct`.
    fn is_twin_of(self, direct: Self) -> bool {
        direct == Self::direct(direct.number) && self.process == direct.process
    }
}

#[derive(Debug)]
struct Current {
    from: MessageSource,
    next_seq: u64,
    heard: Instant,
    gone: bool,
}

impl Sender {
    /// Accepts message number `seq` of `from`, which arrived at `now`. A sender that
    /// was silent for `patience` may be replaced by another.
    ///
    /// # Errors
    /// The reason to refuse it.
    pub fn accept(
        &mut self,
        from: MessageSource,
        seq: u64,
        now: Instant,
        patience: Duration,
    ) -> Result<(), Refusal> {
        match &self.current {
            Some(current) if current.from.number == from.number => {
                let silence = now.saturating_duration_since(current.heard);
                match seq.checked_sub(current.next_seq) {
                    Some(gap) if gap <= possible(silence) => {
                        self.lost = self.lost.saturating_add(gap);
                    }
                    _ if silence >= patience => {}
                    Some(_) => return Err(Refusal::Jump),
                    None => return Err(Refusal::Repeated),
                }
            }
            Some(current) if !current.gone && now - current.heard < patience => {
                if from.is_twin_of(current.from) {
                    return Err(Refusal::Twin);
                }
                if !current.from.is_twin_of(from) {
                    return Err(Refusal::Sender);
                }
            }
            _ => self.starts += 1,
        }
        self.current = Some(Current {
            from,
            next_seq: seq.saturating_add(1),
            heard: now,
            gone: false,
        });
        Ok(())
    }

    /// Notes that the presence of sender `number` ended.
    pub fn gone(&mut self, number: u64) {
        if let Some(current) = &mut self.current {
            current.gone |= current.from.number == number;
        }
    }

    /// Counts silence from `now` on: the receiver stood still, and not the sender.
    pub fn excuse(&mut self, now: Instant) {
        self.excused = Some(now);
    }

    /// Returns how long nothing has been heard at `now`; `None` before the first message.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        let heard = self.current.as_ref()?.heard;
        let since = self.excused.map_or(heard, |excused| excused.max(heard));
        Some(now.saturating_duration_since(since))
    }
}

/// Returns the number of messages that can be lost in a `silence`.
fn possible(silence: Duration) -> u64 {
    AHEAD + (silence.as_secs_f64() * MOST_PER_SECOND) as u64
}

/// The reason to refuse a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Error)]
pub enum Refusal {
    /// It does not begin as messages do.
    #[error("unknown format")]
    Format,
    /// It has another length than messages of its topic.
    #[error("wrong length")]
    Length,
    /// A number in it is infinite, not a number, or beyond single precision.
    #[error("not finite")]
    NotFinite,
    /// Another process sends to this topic already.
    #[error("second sender")]
    Sender,
    /// Its process sends it directly as well, and not by ROS alone.
    #[error("by ROS as well")]
    Twin,
    /// It was there already, or is older than one that was.
    #[error("repeated")]
    Repeated,
    /// Its number is too far from the last one.
    #[error("impossible number")]
    Jump,
    /// The clock of its sender is not known yet.
    #[error("unknown clock")]
    Clock,
    /// By the clocks it was published later than now.
    #[error("from the future")]
    Future,
    /// It was published before the run began here.
    #[error("from before the run")]
    Early,
    /// Its numbers are no message of the topic.
    #[error("invalid content")]
    Content,
}

impl Refusal {
    /// Returns whether an honest sender causes it as well: at the start of a run, or by ROS beside
    /// ratelab's own way.
    pub fn is_harmless(self) -> bool {
        matches!(self, Self::Early | Self::Twin)
    }
}

/// The number of refused messages, by reason.
#[derive(Debug, Default)]
pub struct Refused(Mutex<BTreeMap<Refusal, u64>>);

impl Refused {
    /// Counts a refused message.
    pub fn count(&self, why: Refusal) {
        *lock(&self.0).entry(why).or_default() += 1;
    }

    /// Returns the counts by reason.
    pub fn read(&self) -> BTreeMap<Refusal, u64> {
        lock(&self.0).clone()
    }

    /// Returns the number of messages that no honest sender causes.
    pub fn hostile(&self) -> u64 {
        let counts = self.read().into_iter();
        counts
            .filter(|(why, _)| !why.is_harmless())
            .map(|(_, count)| count)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(100);
    const SECOND: Result<(), Refusal> = Err(Refusal::Sender);

    /// A name, messages (sender, number, time since the one before in ms, what follows), how many
    /// count as lost, and how many senders there were.
    const CASES: &str = "
    in order              | 1 0 0 ok, 1 1 20 ok                                       | 0 1
    begins late           | 1 40 0 ok, 1 41 20 ok                                     | 0 1
    some lost             | 1 1 0 ok, 1 51 1000 ok                                    | 49 1
    late and repeated     | 1 0 0 ok, 1 2 20 ok, 1 1 0 repeated, 1 2 0 repeated       | 1 1
    a forged jump         | 1 1 0 ok, 1 1000000 20 jump, 1 2 20 ok                    | 0 1
    the greatest          | 1 1 0 ok, 1 18446744073709551615 20 jump, 1 2 20 ok       | 0 1
    half of it            | 1 1 0 ok, 1 9223372036854775808 20 jump, 1 2 20 ok        | 0 1
    jump after jump       | 1 1 0 ok, 1 1000000 20 jump, 1 2000000 20 jump, 1 2 10 ok | 0 1
    within reach and back | 1 0 0 ok, 1 250 20 ok, 1 1 20 repeated, 1 2 100 ok        | 249 1
    after a silence       | 1 1 0 ok, 1 1099511627776 100 ok, 1 1099511627777 20 ok   | 0 1
    the last of all       | 1 1 0 ok, 1 18446744073709551615 200 ok, 1 2 200 ok       | 0 1
    a restart             | 1 40 0 ok, 1 43 20 ok, 2 0 100 ok                         | 2 2
    a second sender waits | 1 0 0 ok, 2 0 99 second, 2 1 1 ok, 1 1 20 second          | 0 2
    and the first is next | 1 0 0 ok, 2 1 100 ok, 1 1 20 second, 1 2 80 ok            | 0 3
";

    #[test]
    fn no_single_number_silences_the_sender_or_counts_as_a_loss() {
        for case in CASES.trim().lines() {
            let parts: Vec<&str> = case.split('|').collect();
            let (mut now, mut sender) = (Instant::now(), Sender::default());
            for message in parts[1].split(',') {
                let words: Vec<&str> = message.split_whitespace().collect();
                let [from, seq, after] = [0, 1, 2].map(|at| words[at].parse().expect("a number"));
                let expected = match words[3] {
                    "ok" => Ok(()),
                    "repeated" => Err(Refusal::Repeated),
                    "jump" => Err(Refusal::Jump),
                    "second" => SECOND,
                    other => panic!("{other}"),
                };
                now += Duration::from_millis(after);
                let accepted = sender.accept(MessageSource::direct(from), seq, now, PATIENCE);
                assert_eq!(accepted, expected, "{case}: {message}");
            }
            let counts = format!("{} {}", sender.lost, sender.starts);
            assert_eq!(counts, parts[2].trim(), "{case}");
        }
    }

    #[test]
    fn a_process_that_speaks_ros_as_well_is_one_sender() {
        let by_ros = |number, process| MessageSource { number, process };
        let (policy, twin) = (MessageSource::direct(1), by_ros(2, Some(1)));
        let (other, unknown) = (by_ros(3, Some(4)), by_ros(5, None));
        for (first, second, accepted) in [
            (policy, twin, Err(Refusal::Twin)),
            (twin, policy, Ok(())),
            (policy, other, SECOND),
            (policy, unknown, SECOND),
            (other, policy, SECOND),
            (twin, by_ros(6, Some(1)), SECOND),
            (unknown, by_ros(6, None), SECOND),
        ] {
            let (now, mut sender) = (Instant::now(), Sender::default());
            assert_eq!(sender.accept(first, 7, now, PATIENCE), Ok(()));
            let next = now + Duration::from_millis(99);
            let next = sender.accept(second, 3, next, PATIENCE);
            assert_eq!(next, accepted, "{first:?} {second:?}");
            assert_eq!((sender.starts, sender.lost), (1, 0));
        }
    }

    #[test]
    fn a_second_sender_takes_over_from_one_that_is_gone_and_from_no_other() {
        let (now, mut sender) = (Instant::now(), Sender::default());
        let mut accept = |gone: u64, from| {
            sender.gone(gone);
            sender.accept(MessageSource::direct(from), 0, now, PATIENCE)
        };
        let accepted = [accept(0, 1), accept(7, 2), accept(1, 2)];
        assert_eq!(accepted, [Ok(()), SECOND, Ok(())]);
    }
}

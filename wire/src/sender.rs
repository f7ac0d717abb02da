//! Who sends to a topic, and what was lost on the way.
//!
//! One process at a time sends to a topic. Another one takes over when it is gone: when its
//! presence ended, or when it was silent for long. A start is a new incarnation, so that
//! numbers from the beginning are a restart and not a reordering.

use std::time::{Duration, Instant};

use crate::refusal::Refusal;

/// The sender of a topic, as its receiver knows it.
#[derive(Debug, Default)]
pub struct Sender {
    current: Option<Current>,
    /// Messages that were sent and did not arrive.
    pub lost: u64,
    /// Senders so far.
    pub starts: u64,
}

#[derive(Debug)]
struct Current {
    incarnation: u64,
    next_seq: u64,
    heard: Instant,
    gone: bool,
}

impl Sender {
    /// Accepts message number `seq` of `incarnation`, which arrived at `now`. A sender that
    /// was silent for `patience` may be replaced by another.
    ///
    /// # Errors
    /// The reason to refuse it.
    pub fn accept(
        &mut self,
        incarnation: u64,
        seq: u64,
        now: Instant,
        patience: Duration,
    ) -> Result<(), Refusal> {
        match &mut self.current {
            Some(current) if current.incarnation == incarnation => {
                if seq < current.next_seq {
                    return Err(Refusal::Repeated);
                }
                self.lost = self.lost.saturating_add(seq - current.next_seq);
            }
            Some(current) if !current.gone && now - current.heard < patience => {
                return Err(Refusal::Sender);
            }
            _ => self.starts += 1,
        }
        self.current = Some(Current {
            incarnation,
            next_seq: seq.saturating_add(1),
            heard: now,
            gone: false,
        });
        Ok(())
    }

    /// Notes that the presence of `incarnation` ended.
    pub fn gone(&mut self, incarnation: u64) {
        if let Some(current) = &mut self.current {
            current.gone |= current.incarnation == incarnation;
        }
    }

    /// How long nothing has been heard at `now`; `None` before the first message.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        let current = self.current.as_ref()?;
        Some(now.saturating_duration_since(current.heard))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(100);

    fn at(start: Instant, ms: u64) -> Instant {
        start + Duration::from_millis(ms)
    }

    #[test]
    fn gaps_are_lost_and_a_restart_is_none() {
        let (start, mut sender) = (Instant::now(), Sender::default());
        let mut accept = |incarnation, seq, ms| {
            let accepted = sender.accept(incarnation, seq, at(start, ms), PATIENCE);
            (accepted, sender.lost)
        };
        // The first may come late: what was before was for nobody.
        assert_eq!(accept(1, 40, 0), (Ok(()), 0));
        assert_eq!(accept(1, 41, 20), (Ok(()), 0));
        assert_eq!(accept(1, 44, 40), (Ok(()), 2));
        assert_eq!(accept(1, 44, 40), (Err(Refusal::Repeated), 2));
        assert_eq!(accept(1, 43, 40), (Err(Refusal::Repeated), 2));
        assert_eq!(accept(2, 0, 140), (Ok(()), 2));
        assert_eq!(sender.starts, 2);
    }

    #[test]
    fn a_second_sender_waits_until_the_first_is_silent_or_gone() {
        let (start, mut sender) = (Instant::now(), Sender::default());
        assert_eq!(sender.accept(1, 0, start, PATIENCE), Ok(()));
        let too_early = sender.accept(2, 0, at(start, 99), PATIENCE);
        assert_eq!(too_early, Err(Refusal::Sender));
        sender.gone(7);
        let no_more = sender.accept(2, 0, at(start, 99), PATIENCE);
        assert_eq!(no_more, Err(Refusal::Sender));
        sender.gone(1);
        assert_eq!(sender.accept(2, 0, at(start, 99), PATIENCE), Ok(()));
        // Now the first is the second.
        let back = sender.accept(1, 1, at(start, 120), PATIENCE);
        assert_eq!(back, Err(Refusal::Sender));
        assert_eq!(sender.accept(1, 2, at(start, 199), PATIENCE), Ok(()));
        assert_eq!((sender.lost, sender.starts), (0, 3));
    }

    #[test]
    fn the_greatest_numbers_do_no_harm() {
        let (start, mut sender) = (Instant::now(), Sender::default());
        assert_eq!(sender.accept(1, 0, start, PATIENCE), Ok(()));
        assert_eq!(sender.accept(1, u64::MAX, start, PATIENCE), Ok(()));
        assert_eq!(sender.accept(1, u64::MAX, start, PATIENCE), Ok(()));
        assert_eq!(sender.lost, u64::MAX - 1);
    }
}

//! One entry of a thread's log as bytes.

use ratelab::{Arrival, End, Entry, LateLook, LockName, Operation, Time};

use super::bytes::{Reader, put, put_signed, put_text};

/// The first byte of an entry. The highest bit: the same locks as in the entry before that
/// had locks.
mod tag {
    pub const LOCK: u8 = 0;
    pub const BEGIN: u8 = 1;
    pub const OBEY: u8 = 6;
    pub const LEAVE: u8 = 7;
    pub const REST: u8 = 8;
    pub const ABANDONED: u8 = 9;
    pub const END: u8 = 10;
    /// A look without work, and one with some.
    pub const LOOK: u8 = 17;
    pub const WORK: u8 = 18;
    pub const LATE_LOOK: u8 = 19;
    pub const LATE_WORK: u8 = 20;
    pub const FINISH: u8 = 21;
    pub const DONE: u8 = 22;
    /// Work whose missed periods do not follow from its end.
    pub const LAST_DONE: u8 = 23;
    pub const ARRIVE: u8 = 24;
    pub const SAME_LOCKS: u8 = 0x80;

    /// Entries of earlier logs: the ticks of nodes, and arrivals by place in a crew.
    pub const EARLIER: [u8; 7] = [2, 3, 4, 5, 11, 12, 16];
}

/// Position between two entries of a thread, for numbers that count from the last one.
#[derive(Debug, Default)]
pub(super) struct Coder {
    last: Time,
    locks: Vec<LockName>,
    /// The next turn of each lock, if no other thread took one.
    turns: Vec<u64>,
    /// Indices of the locks of the last entry that had some.
    pattern: Vec<usize>,
    /// Whether an entry was read that only earlier logs have.
    is_earlier: bool,
}

impl Coder {
    /// The next turn of each known lock, if no other thread took one.
    pub(super) fn turns(&self) -> impl Iterator<Item = (LockName, u64)> {
        self.locks.iter().copied().zip(self.turns.iter().copied())
    }

    /// Whether an entry was read that only earlier logs have.
    pub(super) fn is_earlier(&self) -> bool {
        self.is_earlier
    }

    /// Adds an entry and its operations.
    pub(super) fn put(&mut self, bytes: &mut Vec<u8>, entry: &Entry, operations: &[Operation]) {
        let locks: Vec<usize> = operations
            .iter()
            .map(|operation| self.index(bytes, operation.lock))
            .collect();
        let same = !locks.is_empty() && locks == self.pattern;
        let head = bytes.len();
        self.put_entry(bytes, entry);
        if same {
            bytes[head] |= tag::SAME_LOCKS;
        } else {
            put(bytes, locks.len() as u64);
        }
        for (lock, operation) in locks.iter().zip(operations) {
            if !same {
                put(bytes, *lock as u64);
            }
            let ahead = operation.turn.wrapping_sub(self.turns[*lock]);
            put(bytes, ahead << 1 | u64::from(operation.outside));
            self.turns[*lock] = operation.turn + 1;
        }
        if !locks.is_empty() {
            self.pattern = locks;
        }
    }

    /// The index of a lock; names it before its first use.
    fn index(&mut self, bytes: &mut Vec<u8>, lock: LockName) -> usize {
        let known = self.locks.iter().position(|known| *known == lock);
        known.unwrap_or_else(|| {
            bytes.push(tag::LOCK);
            put_text(bytes, &lock.text());
            self.locks.push(lock);
            self.turns.push(0);
            self.locks.len() - 1
        })
    }

    fn put_entry(&mut self, bytes: &mut Vec<u8>, entry: &Entry) {
        match *entry {
            Entry::Begin => bytes.push(tag::BEGIN),
            Entry::Arrive(Arrival { at, node, input }) => {
                bytes.push(tag::ARRIVE);
                self.put_beside(bytes, at);
                put(bytes, node as u64);
                put(bytes, input as u64);
            }
            Entry::Look { at, late, node } => {
                bytes.push(match (late, node) {
                    (None, None) => tag::LOOK,
                    (None, Some(_)) => tag::WORK,
                    (Some(_), None) => tag::LATE_LOOK,
                    (Some(_), Some(_)) => tag::LATE_WORK,
                });
                self.put_time(bytes, at);
                if let Some(LateLook { until, over }) = late {
                    self.put_beside(bytes, until);
                    bytes.push(over.into());
                }
                if let Some(node) = node {
                    put(bytes, node as u64);
                }
            }
            Entry::Finish { at, node } => {
                bytes.push(tag::FINISH);
                self.put_time(bytes, at);
                put(bytes, node as u64);
            }
            Entry::Done { at, passed } => {
                let usual = passed == at;
                bytes.push(if usual { tag::DONE } else { tag::LAST_DONE });
                self.put_beside(bytes, at);
                if !usual {
                    self.put_beside(bytes, passed);
                }
            }
            Entry::Obey { at, event } => {
                bytes.push(tag::OBEY);
                self.put_time(bytes, at);
                put(bytes, event);
            }
            Entry::Leave { before } => {
                bytes.push(tag::LEAVE);
                self.put_beside(bytes, before);
            }
            Entry::Rest { event } => {
                bytes.push(tag::REST);
                put(bytes, event);
            }
            Entry::Abandoned => bytes.push(tag::ABANDONED),
            Entry::End(end) => {
                bytes.push(tag::END);
                self.put_end(bytes, end);
            }
        }
    }

    fn put_end(&mut self, bytes: &mut Vec<u8>, end: End) {
        let (number, node, at) = match end {
            End::Paused => (0, None, None),
            End::Completed { until } => (1, None, Some(until)),
            End::Ended { node, at } => (2, Some(node), Some(at)),
            End::Stopped => (3, None, None),
            End::HandedOver => (4, None, None),
            End::Failed { node, at } => (5, Some(node), Some(at)),
            End::NoThread { node, at } => (6, Some(node), Some(at)),
            End::Left => (7, None, None),
        };
        bytes.push(number);
        if let Some(node) = node {
            put(bytes, node as u64);
        }
        if let Some(at) = at {
            self.put_beside(bytes, at);
        }
    }

    /// Adds a time that later ones count from.
    fn put_time(&mut self, bytes: &mut Vec<u8>, time: Time) {
        self.put_beside(bytes, time);
        self.last = time;
    }

    fn put_beside(&self, bytes: &mut Vec<u8>, time: Time) {
        let ahead = time.as_nanos().wrapping_sub(self.last.as_nanos());
        put_signed(bytes, ahead as i64);
    }

    /// Reads an entry, and adds its operations to `operations`; `None` where there is none.
    pub(super) fn get(
        &mut self,
        reader: &mut Reader<'_>,
        operations: &mut Vec<Operation>,
    ) -> Option<Entry> {
        let mut head = reader.byte()?;
        while head == tag::LOCK {
            self.locks.push(LockName::of(reader.text()?));
            self.turns.push(0);
            head = reader.byte()?;
        }
        let same = head & tag::SAME_LOCKS != 0;
        self.is_earlier = tag::EARLIER.contains(&(head & !tag::SAME_LOCKS));
        let entry = self.get_entry(head & !tag::SAME_LOCKS, reader)?;
        let count = match same {
            true => self.pattern.len(),
            false => usize::try_from(reader.number()?).ok()?,
        };
        // An operation has at least one byte.
        if count > reader.0.len() {
            return None;
        }
        let mut locks = std::mem::take(&mut self.pattern);
        let before = locks.len();
        for index in 0..count {
            let lock = match same {
                true => locks[index],
                false => usize::try_from(reader.number()?).ok()?,
            };
            let next = self.turns.get_mut(lock)?;
            let ahead = reader.number()?;
            let turn = next.checked_add(ahead >> 1)?;
            *next = turn.checked_add(1)?;
            operations.push(Operation {
                lock: self.locks[lock],
                turn,
                outside: ahead & 1 != 0,
            });
            if !same {
                locks.push(lock);
            }
        }
        if !same && count > 0 {
            locks.drain(..before);
        }
        self.pattern = locks;
        Some(entry)
    }

    fn get_entry(&mut self, head: u8, reader: &mut Reader<'_>) -> Option<Entry> {
        Some(match head {
            tag::BEGIN => Entry::Begin,
            tag::ARRIVE => Entry::Arrive(Arrival {
                at: self.get_beside(reader)?,
                node: usize::try_from(reader.number()?).ok()?,
                input: usize::try_from(reader.number()?).ok()?,
            }),
            tag::LOOK | tag::WORK | tag::LATE_LOOK | tag::LATE_WORK => {
                let at = self.get_time(reader)?;
                let late = match head {
                    tag::LATE_LOOK | tag::LATE_WORK => Some(LateLook {
                        until: self.get_beside(reader)?,
                        over: reader.byte()? != 0,
                    }),
                    _ => None,
                };
                let node = match head {
                    tag::WORK | tag::LATE_WORK => Some(usize::try_from(reader.number()?).ok()?),
                    _ => None,
                };
                Entry::Look { at, late, node }
            }
            tag::FINISH => Entry::Finish {
                at: self.get_time(reader)?,
                node: usize::try_from(reader.number()?).ok()?,
            },
            tag::DONE | tag::LAST_DONE => {
                let at = self.get_beside(reader)?;
                let passed = match head {
                    tag::DONE => at,
                    _ => self.get_beside(reader)?,
                };
                Entry::Done { at, passed }
            }
            tag::OBEY => Entry::Obey {
                at: self.get_time(reader)?,
                event: reader.number()?,
            },
            tag::LEAVE => Entry::Leave {
                before: self.get_beside(reader)?,
            },
            tag::REST => Entry::Rest {
                event: reader.number()?,
            },
            tag::ABANDONED => Entry::Abandoned,
            tag::END => Entry::End(self.get_end(reader)?),
            _ => return None,
        })
    }

    fn get_end(&self, reader: &mut Reader<'_>) -> Option<End> {
        let kind = reader.byte()?;
        let mut node = || usize::try_from(reader.number()?).ok();
        Some(match kind {
            0 => End::Paused,
            1 => End::Completed {
                until: self.get_beside(reader)?,
            },
            2 => End::Ended {
                node: node()?,
                at: self.get_beside(reader)?,
            },
            3 => End::Stopped,
            4 => End::HandedOver,
            5 => End::Failed {
                node: node()?,
                at: self.get_beside(reader)?,
            },
            6 => End::NoThread {
                node: node()?,
                at: self.get_beside(reader)?,
            },
            7 => End::Left,
            _ => return None,
        })
    }

    fn get_time(&mut self, reader: &mut Reader<'_>) -> Option<Time> {
        let time = self.get_beside(reader)?;
        self.last = time;
        Some(time)
    }

    fn get_beside(&self, reader: &mut Reader<'_>) -> Option<Time> {
        let ahead = reader.signed()? as u64;
        Some(Time::from_nanos(self.last.as_nanos().wrapping_add(ahead)))
    }
}

//! A message between processes as bytes: 56 bytes of head, then its numbers.
//!
//! | bytes | content, little endian |
//! |---|---|
//! | 4 | `RLB1` |
//! | 4 | how many numbers follow |
//! | 8 | incarnation of the sender: another one after each start |
//! | 8 | sequence number in the topic |
//! | 8 | the sender's clock |
//! | 8 | when it was published, by that clock (ns) |
//! | 8 | the clock of the sensing behind it |
//! | 8 | when that was, by that clock (ns); the least number for none |
//! | 8 each | the numbers, as doubles; run times among them (ns) count from the publication |
//! | 8 each | for each chain through the topic, when its data began: a run time like those |

use ratelab::Time;
use ratelab_system::is_run_time;

use crate::{
    machine::{ClockId, ClockMoment, Nanos},
    sender::Refusal,
};

/// The first bytes, with the version of this format.
const MAGIC: [u8; 4] = *b"RLB1";

/// The absence of a sensing.
const NONE: ClockMoment = ClockMoment {
    clock: ClockId(0),
    at: Nanos::MIN,
};

/// In place of a run time that is not known.
const UNKNOWN: f64 = -1e30;

/// The numbers of a message that are run times, by their places. On the wire they count from the
/// publication of the message, so that they need no clock of their own.
#[derive(Clone, Debug, Default)]
pub struct RunTimes(Vec<usize>);

impl RunTimes {
    /// Those of a message with numbers of these names, and with the beginnings of the data of so many
    /// `chains` behind them.
    pub fn among(fields: &[String], chains: usize) -> Self {
        let times = fields
            .iter()
            .enumerate()
            .filter(|(_, field)| is_run_time(field));
        let beginnings = fields.len()..fields.len() + chains;
        Self(times.map(|(place, _)| place).chain(beginnings).collect())
    }

    /// Returns the numbers of a message that was published at run time `stamp`, for the wire.
    pub fn sent(&self, mut row: Vec<f64>, stamp: Time) -> Vec<f64> {
        for place in &self.0 {
            row[*place] -= stamp.as_nanos() as f64;
            if row[*place].is_nan() {
                row[*place] = UNKNOWN;
            }
        }
        row
    }

    /// Makes the numbers of a message from the wire those of one that was published at run time
    /// `stamp` here (ns), which may be before the run.
    pub fn receive(&self, row: &mut [f64], stamp: Nanos) {
        for place in &self.0 {
            row[*place] = match row[*place] {
                UNKNOWN => f64::NAN,
                since => since + stamp as f64,
            };
        }
    }
}

/// The head of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketHead {
    /// Incarnation of the sender.
    pub incarnation: u64,
    /// Position in the topic's history at the sender.
    pub seq: u64,
    /// When it was published, by the sender's clock.
    pub stamp: ClockMoment,
    /// When the reading behind it was sensed, by the clock of the machine that sensed it:
    /// where that is the receiver's, the age is exact.
    pub origin: Option<ClockMoment>,
}

/// Returns the bytes of a message.
pub fn encode(head: &PacketHead, row: &[f64]) -> Vec<u8> {
    let moments = [head.stamp, head.origin.unwrap_or(NONE)];
    let moments = moments.map(|moment| [moment.clock.0, moment.at.cast_unsigned()]);
    let words = [head.incarnation, head.seq].into_iter();
    let words = words
        .chain(moments.into_iter().flatten())
        .chain(row.iter().map(|number| number.to_bits()));
    let count = (row.len() as u32).to_le_bytes();
    MAGIC
        .into_iter()
        .chain(count)
        .chain(words.flat_map(u64::to_le_bytes))
        .collect()
}

/// Reads a message of `width` numbers from `bytes` of anybody.
///
/// # Errors
/// The reason to refuse it.
pub fn decode(bytes: &[u8], width: usize) -> Result<(PacketHead, Vec<f64>), Refusal> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or(Refusal::Format)?;
    let (count, rest) = rest.split_first_chunk().ok_or(Refusal::Length)?;
    let (words, more) = rest.as_chunks();
    let words: Vec<u64> = words.iter().copied().map(u64::from_le_bytes).collect();
    let [
        incarnation,
        seq,
        clock,
        at,
        sensed_by,
        sensed_at,
        ref row @ ..,
    ] = words[..]
    else {
        return Err(Refusal::Length);
    };
    if u32::from_le_bytes(*count) as usize != width || row.len() != width || !more.is_empty() {
        return Err(Refusal::Length);
    }
    let row: Vec<f64> = row.iter().copied().map(f64::from_bits).collect();
    if !are_finite(&row) {
        return Err(Refusal::NotFinite);
    }
    let moment = |clock, at: u64| ClockMoment {
        clock: ClockId(clock),
        at: at.cast_signed(),
    };
    let head = PacketHead {
        incarnation,
        seq,
        stamp: moment(clock, at),
        origin: Some(moment(sensed_by, sensed_at)).filter(|origin| origin.at != NONE.at),
    };
    Ok((head, row))
}

/// Returns whether all numbers are finite. Messages are of single precision in part: beyond it they
/// would become infinite.
pub(crate) fn are_finite(row: &[f64]) -> bool {
    row.iter().all(|number| (*number as f32).is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(origin: Option<Nanos>) -> PacketHead {
        let clock = ClockId(0x1122_3344_5566_7788);
        PacketHead {
            incarnation: 9,
            seq: 3,
            stamp: ClockMoment { clock, at: -5 },
            origin: origin.map(|at| ClockMoment { clock, at }),
        }
    }

    #[test]
    fn a_message_comes_back_as_it_was_sent() {
        for origin in [None, Some(12), Some(-1)] {
            let row = [0.1, -0.0, 1e-300];
            let bytes = encode(&head(origin), &row);
            let (read, numbers) = decode(&bytes, 3).expect("our own");
            assert_eq!(read, head(origin));
            assert_eq!(numbers.len(), row.len());
            let mut both = numbers.iter().zip(row);
            assert!(both.all(|(read, sent)| read.to_bits() == sent.to_bits()));
        }
    }

    #[test]
    fn the_bytes_are_those_of_the_description() {
        let bytes = encode(&head(None), &[1.0]);
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(
            hex,
            "524c423101000000\
             0900000000000000\
             0300000000000000\
             8877665544332211\
             fbffffffffffffff\
             0000000000000000\
             0000000000000080\
             000000000000f03f"
        );
    }

    #[test]
    fn run_times_and_the_beginnings_of_chains_go_from_clock_to_clock() {
        let times = RunTimes::among(&["x (m)", "origin (ns)"].map(str::to_owned), 2);
        let row = vec![7.0, 400.0, 100.0, f64::NAN];
        let sent = times.sent(row, Time::from_nanos(500));
        assert_eq!(sent, [7.0, -100.0, -400.0, UNKNOWN]);
        let mut received = sent;
        times.receive(&mut received, 30);
        assert_eq!(received[..3], [7.0, -70.0, -370.0]);
        assert!(received[3].is_nan());
    }

    #[test]
    fn rubbish_is_refused_and_never_a_panic() {
        let good = encode(&head(Some(1)), &[1.0, 2.0]);
        for length in 0..good.len() {
            assert!(decode(&good[..length], 2).is_err(), "{length} bytes");
        }
        assert_eq!(decode(&[&good[..], &[0]].concat(), 2), Err(Refusal::Length));
        assert_eq!(decode(&good, 1), Err(Refusal::Length));
        assert_eq!(decode(&good, 8_000), Err(Refusal::Length));
        for number in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e39] {
            let bytes = encode(&head(None), &[number]);
            assert_eq!(decode(&bytes, 1), Err(Refusal::NotFinite), "{number}");
        }
        let mut lies = good.clone();
        lies[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(decode(&lies, 2), Err(Refusal::Length));
        assert_eq!(decode(&vec![0xff; 1 << 20], 2), Err(Refusal::Format));
    }
}

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
//! | 8 each | the numbers, as doubles |

use crate::{
    clock::{ClockId, Nanos},
    refusal::Refusal,
};

/// The first bytes, with the version of this format.
const MAGIC: [u8; 4] = *b"RLB1";

/// Bytes before the numbers.
const HEAD: usize = 56;

/// The most numbers in a message: 64 KiB in all.
pub const MOST: usize = 8_000;

/// The absence of a sensing.
const NONE: Nanos = Nanos::MIN;

/// A moment of a known clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockMoment {
    /// The clock.
    pub clock: ClockId,
    /// Its reading (ns).
    pub at: Nanos,
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

/// The bytes of a message.
pub fn encode(head: &PacketHead, row: &[f64]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + 8 * row.len());
    bytes.extend(MAGIC);
    bytes.extend((row.len() as u32).to_le_bytes());
    bytes.extend(head.incarnation.to_le_bytes());
    bytes.extend(head.seq.to_le_bytes());
    let none = ClockMoment {
        clock: ClockId(0),
        at: NONE,
    };
    for moment in [head.stamp, head.origin.unwrap_or(none)] {
        bytes.extend(moment.clock.0.to_le_bytes());
        bytes.extend(moment.at.to_le_bytes());
    }
    row.iter()
        .for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

/// Reads a message of `width` numbers from `bytes` of anybody.
///
/// # Errors
/// The reason to refuse it.
pub fn decode(bytes: &[u8], width: usize) -> Result<(PacketHead, Vec<f64>), Refusal> {
    if bytes.get(..4) != Some(&MAGIC) {
        return Err(Refusal::Format);
    }
    if bytes.len() != HEAD + 8 * width {
        return Err(Refusal::Length);
    }
    let mut words = bytes[8..].chunks_exact(8).map(|word| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(word);
        u64::from_le_bytes(bytes)
    });
    let count = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]);
    if count as usize != width {
        return Err(Refusal::Length);
    }
    let mut next = || words.next().unwrap_or_default();
    let (incarnation, seq) = (next(), next());
    let [stamp, origin] = [(); 2].map(|()| ClockMoment {
        clock: ClockId(next()),
        at: next().cast_signed(),
    });
    let row: Vec<f64> = words.map(f64::from_bits).collect();
    // Messages are of single precision in part: beyond it they would become infinite.
    if row.iter().any(|number| !(*number as f32).is_finite()) {
        return Err(Refusal::NotFinite);
    }
    let origin = Some(origin).filter(|origin| origin.at != NONE);
    let head = PacketHead {
        incarnation,
        seq,
        stamp,
        origin,
    };
    Ok((head, row))
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
            assert_eq!(numbers.map_bits(), row.to_vec().map_bits());
        }
    }

    trait Bits {
        fn map_bits(&self) -> Vec<u64>;
    }

    impl Bits for Vec<f64> {
        fn map_bits(&self) -> Vec<u64> {
            self.iter().map(|number| number.to_bits()).collect()
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
    fn rubbish_is_refused_and_never_a_panic() {
        let good = encode(&head(Some(1)), &[1.0, 2.0]);
        for length in 0..good.len() {
            assert!(decode(&good[..length], 2).is_err(), "{length} bytes");
        }
        assert_eq!(decode(&[&good[..], &[0]].concat(), 2), Err(Refusal::Length));
        assert_eq!(decode(&good, 1), Err(Refusal::Length));
        assert_eq!(decode(&good, MOST), Err(Refusal::Length));
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

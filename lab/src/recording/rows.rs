//! The rows of a chunk, read cell by cell: a missing value is not zero.

use std::time::Duration;

use ratelab::{Head, Push, Time};
use ratelab_account::TickRecord;
use rerun::{archetypes::Scalars, log::Chunk};
use serde_json::Value;

use super::{
    printable::make_printable,
    schema::{JSON, message, piece, tick},
    timeline::RUN_TIME,
    tracks::NANOS_PER_MICRO,
};

/// Upper bound of a lateness in 64 bits of nanoseconds (µs).
const LATEST: f64 = u64::MAX as f64 / NANOS_PER_MICRO;

/// The messages in `chunk`, each with its numbers; `None` for a damaged row.
pub fn messages(chunk: &Chunk) -> impl Iterator<Item = Option<(Head, &[f64])>> {
    let heads = stamps(chunk)
        .into_iter()
        .zip(numbers(chunk, message::SEQ))
        .zip(numbers(chunk, message::ORIGIN))
        .zip(numbers(chunk, message::DROPPED));
    let other = numbers_if_any(chunk, message::STAMP).into_iter();
    let other = other.zip(numbers_if_any(chunk, message::ARRIVES));
    let rows = heads.zip(other).zip(values(chunk));
    rows.map(
        |(((((at, seq), origin), dropped), (stamp, arrives)), values)| {
            let (at, arrives) = (at?, arrives?);
            let head = Head {
                at,
                stamp: stamp?.map_or(at, Time::from_nanos),
                seq: seq??,
                origin: origin?.map(Time::from_nanos),
                arrives: match arrives {
                    Some(message::LOST) => None,
                    Some(arrives) => Some(Time::from_nanos(arrives)),
                    None => Some(at),
                },
                dropped: dropped??,
            };
            Some((head, values?))
        },
    )
}

/// The ticks in `chunk`; `None` for a damaged row.
pub fn ticks(chunk: &Chunk) -> impl Iterator<Item = Option<TickRecord>> {
    let rows = stamps(chunk)
        .into_iter()
        .zip(numbers(chunk, tick::NUMBER))
        .zip(values(chunk))
        .zip(numbers(chunk, tick::TOOK))
        .zip(numbers(chunk, tick::OVERRUNS))
        .zip(pushes(chunk));
    rows.map(|(((((at, number), lateness), took), overruns), push)| {
        let at = at?;
        Some(TickRecord {
            number: number??,
            at,
            ends: Some(at),
            lateness: lateness_of(lateness?)?,
            took: took?.map(Duration::from_nanos),
            overruns: overruns??,
            push: push?,
        })
    })
}

/// The action of each tick in `chunk` on the world, if it had one.
fn pushes(chunk: &Chunk) -> impl Iterator<Item = Option<Option<Push>>> {
    let ends = numbers_if_any(chunk, tick::PUSHED)
        .into_iter()
        .zip(numbers_if_any(chunk, tick::SENSED));
    ends.map(|ends| match ends {
        (Some(Some(at)), Some(Some(sensed))) => {
            let [at, sensed] = [at, sensed].map(Time::from_nanos);
            Some(Some(Push { at, sensed }))
        }
        (Some(None), Some(None)) => Some(None),
        _ => None,
    })
}

/// The lateness of a tick, from a cell in microseconds: exact to the nanosecond up to 26
/// days. NaN under a clock without lateness.
fn lateness_of(cell: &[f64]) -> Option<Option<Duration>> {
    match *cell {
        [micros] if micros.is_nan() => Some(None),
        [micros] if (0.0..LATEST).contains(&micros) => {
            let nanos = (micros * NANOS_PER_MICRO).round() as u64;
            Some(Some(Duration::from_nanos(nanos)))
        }
        _ => None,
    }
}

/// A piece of a thread's log in a file.
pub struct LogPiece {
    /// Number of the row, counted from zero.
    pub row: u64,
    /// Number of the thread.
    pub thread: u64,
    /// The piece.
    pub bytes: Vec<u8>,
    /// Digest of this row and all before.
    pub digest: u64,
}

/// The pieces of the log of threads in `chunk`; `None` for a damaged row.
pub fn pieces(chunk: &Chunk) -> Vec<Option<LogPiece>> {
    let bytes = chunk.iter_slices::<u8>(piece::BYTES.into());
    let bytes = one_a_row(chunk, bytes.map(|bytes| Some(bytes.to_vec())));
    let rows = numbers(chunk, piece::ROW)
        .into_iter()
        .zip(numbers(chunk, piece::THREAD))
        .zip(numbers(chunk, piece::DIGEST))
        .zip(bytes);
    let rows = rows.map(|(((row, thread), digest), bytes)| {
        Some(LogPiece {
            row: row??,
            thread: thread??,
            bytes: bytes?,
            digest: digest??,
        })
    });
    rows.collect()
}

/// The JSON in `text`, safe for a terminal; `None` for an invalid one.
pub fn json(text: Option<&str>) -> Option<Value> {
    let mut value = serde_json::from_str(text?).ok()?;
    make_printable(&mut value);
    Some(value)
}

/// The texts in the rows of `chunk`, if it has any; `None` for a damaged cell.
pub fn texts(chunk: &Chunk) -> Vec<Option<String>> {
    if chunk.components().get_array(JSON.into()).is_none() {
        return Vec::new();
    }
    let rows = chunk.iter_slices::<String>(JSON.into());
    let texts = rows.map(only).map(|text| Some(text?.as_str().to_owned()));
    one_a_row(chunk, texts)
}

/// The component `name` in the rows of `chunk`: at most one number each, and `None` for a
/// damaged cell.
pub fn numbers(chunk: &Chunk, name: &'static str) -> Vec<Option<Option<u64>>> {
    let rows = chunk.iter_slices::<Option<u64>>(name.into());
    one_a_row(chunk, rows.map(only))
}

/// The component `name` in the rows of `chunk`, as [`numbers`]; without numbers if the
/// chunk lacks the component.
fn numbers_if_any(chunk: &Chunk, name: &'static str) -> Vec<Option<Option<u64>>> {
    match chunk.components().get_array(name.into()) {
        Some(_) => numbers(chunk, name),
        None => vec![Some(None); chunk.num_rows()],
    }
}

/// Run times of the rows of `chunk`; `None` for an invalid one.
fn stamps(chunk: &Chunk) -> Vec<Option<Time>> {
    let column = chunk.timelines().get(&RUN_TIME.into());
    let times = column.map_or(&[][..], |column| column.times_raw());
    let nanos = times.iter().map(|nanos| u64::try_from(*nanos).ok());
    nanos.map(|nanos| nanos.map(Time::from_nanos)).collect()
}

/// The numbers of each row of `chunk`.
fn values(chunk: &Chunk) -> Vec<Option<&[f64]>> {
    let name = Scalars::descriptor_scalars().component;
    let cells = chunk.components().get_array(name);
    // A missing number would shift the others to the wrong place.
    let whole = cells.is_some_and(|cells| cells.values().null_count() == 0);
    let rows = chunk.iter_slices::<f64>(name);
    one_a_row(chunk, rows.map(|row| whole.then_some(row)))
}

/// The single item of `items`.
fn only<T>(items: impl IntoIterator<Item = T>) -> Option<T> {
    let mut items = items.into_iter();
    let item = items.next()?;
    items.next().is_none().then_some(item)
}

/// `cells`, if there is one for each row of `chunk`: with a missing one, the rows of the
/// others are unknown.
fn one_a_row<T: Clone>(chunk: &Chunk, cells: impl Iterator<Item = Option<T>>) -> Vec<Option<T>> {
    let cells: Vec<_> = cells.collect();
    match cells.len() == chunk.num_rows() {
        true => cells,
        false => vec![None; chunk.num_rows()],
    }
}

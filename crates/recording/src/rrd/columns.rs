//! Rows as columns of a file, whose numbers and payloads may be in different chunks.

use std::{collections::BTreeMap, sync::Arc};

use ratelab::Head;
use rerun::{
    ComponentDescriptor, SerializedComponentBatch, SerializedComponentColumn, SeriesLines,
    archetypes::Scalars,
    external::arrow::array::{ArrayRef, Float64Array, StringArray, UInt8Array, UInt64Array},
    log::{Chunk, RowId},
};

use super::{
    schema::JSON,
    timeline::{RUN_TIME, Written},
};
use crate::{
    printable::is_control,
    run::{ColumnForm, RecordColumn, RecordRow},
};

/// Nanoseconds in a microsecond.
const NANOS_PER_MICRO: f64 = 1e3;

/// In place of the delivery of a lost message.
const LOST: u64 = u64::MAX;

/// Upper bound of a time in 64 bits of nanoseconds (µs).
const LATEST: f64 = u64::MAX as f64 / NANOS_PER_MICRO;

/// A cell: `None` if it is damaged.
type Cell<T> = Option<T>;

impl RecordColumn {
    /// Returns the column with these `cells` of rows at these times, if it is there and no
    /// timeline.
    fn written(
        &self,
        cells: Vec<Option<u64>>,
        times: &[u64],
    ) -> Option<Written<SerializedComponentColumn>> {
        let Self { name, form, .. } = *self;
        let cells = match form {
            ColumnForm::RunTime => return None,
            ColumnForm::Count => return Some(numbers(name, cells.into_iter().flatten())),
            ColumnForm::Plot => {
                let micros = |nanos: u64| nanos as f64 / NANOS_PER_MICRO;
                let micros = cells.iter().map(|nanos| nanos.map_or(f64::NAN, micros));
                return Some(series(micros.collect(), 1, cells.len()));
            }
            ColumnForm::Stamp | ColumnForm::Delivery => {
                let other = |(cell, at): (Option<u64>, &u64)| {
                    (cell != Some(*at)).then(|| cell.unwrap_or(LOST))
                };
                cells.into_iter().zip(times).map(other).collect()
            }
            ColumnForm::Nanos | ColumnForm::Wall | ColumnForm::Rare | ColumnForm::RareCount => {
                cells
            }
        };
        let is_there = !self.may_be_missing() || cells.iter().any(Option::is_some);
        is_there.then(|| units(name, Arc::new(UInt64Array::from_iter(cells))))
    }

    /// Returns the numbers of this column in the rows of `chunk`, which have these run times.
    fn read(&self, chunk: &Chunk, times: &[Cell<Option<u64>>]) -> Vec<Cell<Option<u64>>> {
        let Self { name, form, .. } = *self;
        let cells = match form {
            ColumnForm::RunTime => return times.to_vec(),
            ColumnForm::Plot => return plotted(chunk).into_iter().map(|c| nanos_of(c?)).collect(),
            _ if self.may_be_missing() && !has(chunk, name) => vec![Some(None); chunk.num_rows()],
            _ => cells(chunk, name),
        };
        let number = |(cell, at): (Cell<_>, &Cell<_>)| match (form, cell?) {
            (ColumnForm::Stamp | ColumnForm::Delivery, None) => *at,
            (ColumnForm::Delivery, Some(LOST)) => Some(None),
            (_, number) => Some(number),
        };
        cells.into_iter().zip(times).map(number).collect()
    }

    /// Returns whether the column may be missing in a file.
    fn may_be_missing(&self) -> bool {
        use ColumnForm::{Delivery, Rare, RareCount, Stamp};
        matches!(self.form, Rare | RareCount | Stamp | Delivery)
    }
}

/// Returns the columns of `rows`.
pub fn write<R: RecordRow>(rows: &[R]) -> Written<Vec<SerializedComponentColumn>> {
    let cells: Vec<_> = rows.iter().map(RecordRow::cells).collect();
    let times: Vec<u64> = rows.iter().map(|row| row.at().as_nanos()).collect();
    let columns = R::COLUMNS.iter().enumerate().filter_map(|(index, column)| {
        column.written(cells.iter().map(|row| row[index]).collect(), &times)
    });
    let list = R::LIST.map(|list| lists(list.name, rows.iter().map(RecordRow::list)));
    columns.chain(list).collect()
}

/// Returns the rows in `chunk`.
pub fn read<R: RecordRow>(chunk: &Chunk) -> Vec<Cell<R>> {
    let times = run_times(chunk);
    let columns: Vec<_> = R::COLUMNS
        .iter()
        .map(|column| column.read(chunk, &times))
        .collect();
    let lists = R::LIST.map(|list| read_lists(chunk, list.name));
    let rows = (0..chunk.num_rows()).map(|index| {
        let cells = columns.iter().map(|cells| *cells.get(index)?);
        let list = match &lists {
            Some(lists) => lists.get(index)?.as_deref()?,
            None => &[],
        };
        R::from_cells(&cells.collect::<Option<Vec<_>>>()?, list)
    });
    rows.collect()
}

/// Returns one number per row.
pub fn numbers(
    name: &'static str,
    values: impl IntoIterator<Item = u64>,
) -> Written<SerializedComponentColumn> {
    units(name, Arc::new(UInt64Array::from_iter_values(values)))
}

/// Returns one text per row.
pub fn texts(values: impl IntoIterator<Item = String>) -> Written<SerializedComponentColumn> {
    units(JSON, Arc::new(StringArray::from_iter_values(values)))
}

/// Returns a list of numbers per row.
fn lists(
    name: &'static str,
    lists: impl Iterator<Item = Vec<u64>>,
) -> Written<SerializedComponentColumn> {
    let lists: Vec<Vec<u64>> = lists.collect();
    let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
    let array: ArrayRef = Arc::new(UInt64Array::from_iter_values(lists.into_iter().flatten()));
    let batch = SerializedComponentBatch::new(array, descriptor(name));
    Ok(batch.partitioned(lengths)?)
}

/// Returns the lists `name` in the rows of `chunk`.
fn read_lists(chunk: &Chunk, name: &'static str) -> Vec<Cell<Vec<u64>>> {
    let rows = chunk.iter_slices::<u64>(name.into());
    one_a_row(chunk, rows.map(|list| Some(list.to_vec())))
}

/// Returns some bytes per row.
pub fn bytes<'a>(
    name: &'static str,
    values: impl Iterator<Item = &'a [u8]> + Clone,
) -> Written<SerializedComponentColumn> {
    let lengths: Vec<usize> = values.clone().map(<[u8]>::len).collect();
    let array: ArrayRef = Arc::new(UInt8Array::from_iter_values(values.flatten().copied()));
    let batch = SerializedComponentBatch::new(array, descriptor(name));
    Ok(batch.partitioned(lengths)?)
}

/// Returns `width` values in each of `rows`, to be plotted as `width` series.
pub fn series(values: Vec<f64>, width: usize, rows: usize) -> Written<SerializedComponentColumn> {
    let array: ArrayRef = Arc::new(Float64Array::from(values));
    let batch = SerializedComponentBatch::new(array, Scalars::descriptor_scalars());
    Ok(batch.partitioned(std::iter::repeat_n(width, rows))?)
}

/// Returns the component `name` of a record. Tools that divide wide columns from narrow ones keep
/// the columns of one archetype together.
fn descriptor(name: &'static str) -> ComponentDescriptor {
    ComponentDescriptor::partial(name).with_archetype("ratelab.Record".into())
}

fn units(name: &'static str, array: ArrayRef) -> Written<SerializedComponentColumn> {
    Ok(SerializedComponentBatch::new(array, descriptor(name)).column_of_unit_batches()?)
}

/// Returns the run times of the rows of `chunk`.
fn run_times(chunk: &Chunk) -> Vec<Cell<Option<u64>>> {
    let column = chunk.timelines().get(&RUN_TIME.into());
    let times = column.map_or(&[][..], |column| column.times_raw());
    let nanos = times.iter().map(|nanos| u64::try_from(*nanos).ok());
    nanos.map(|nanos| nanos.map(Some)).collect()
}

/// Returns the duration in a plotted cell.
fn nanos_of(cell: &[f64]) -> Cell<Option<u64>> {
    match *cell {
        [micros] if micros.is_nan() => Some(None),
        [micros] if (0.0..LATEST).contains(&micros) => {
            Some(Some((micros * NANOS_PER_MICRO).round() as u64))
        }
        _ => None,
    }
}

/// Returns the plotted values of each row of `chunk`.
pub fn plotted(chunk: &Chunk) -> Vec<Cell<&[f64]>> {
    let name = Scalars::descriptor_scalars().component;
    let cells = chunk.components().get_array(name);
    // A missing number would shift the others to the wrong place.
    let whole = cells.is_some_and(|cells| cells.values().null_count() == 0);
    let rows = chunk.iter_slices::<f64>(name);
    one_a_row(chunk, rows.map(|row| whole.then_some(row)))
}

/// Reads the texts in the rows of `chunk`. A row may have none: tools that merge chunks put
/// rows of other columns between rows with a text.
pub fn read_texts(chunk: &Chunk) -> Vec<Cell<String>> {
    if !has(chunk, JSON) {
        return Vec::new();
    }
    let rows = chunk.iter_slices::<String>(JSON.into());
    let texts = rows
        .filter(|texts| !texts.is_empty())
        .map(|texts| Some(only(texts)?.as_str().to_owned()));
    texts.collect()
}

/// Returns the names of the plotted values in the rows of `chunk`, safe for a terminal.
pub fn read_names(chunk: &Chunk) -> Vec<String> {
    let names = chunk
        .iter_slices::<String>(SeriesLines::descriptor_names().component)
        .flatten();
    names
        .map(|name| name.as_str().replace(is_control, "?"))
        .collect()
}

/// Returns the bytes `name` in the rows of `chunk`.
pub fn read_bytes(chunk: &Chunk, name: &'static str) -> Vec<Cell<Vec<u8>>> {
    let rows = chunk.iter_slices::<u8>(name.into());
    one_a_row(chunk, rows.map(|bytes| Some(bytes.to_vec())))
}

/// Returns the numbers `name` in the rows of `chunk`, at most one in each.
pub fn cells(chunk: &Chunk, name: &'static str) -> Vec<Cell<Option<u64>>> {
    let rows = chunk.iter_slices::<Option<u64>>(name.into());
    one_a_row(chunk, rows.map(only))
}

/// Returns whether `chunk` has the columns that rows of this kind never lack.
pub fn has_numbers<R: RecordRow>(chunk: &Chunk) -> bool {
    R::COLUMNS
        .iter()
        .all(|column| column.form != ColumnForm::Count || has(chunk, column.name))
}

/// Returns whether `chunk` has values to be plotted.
pub fn is_plotted(chunk: &Chunk) -> bool {
    let name = Scalars::descriptor_scalars().component;
    chunk.components().get_array(name).is_some()
}

fn has(chunk: &Chunk, name: &'static str) -> bool {
    chunk.components().get_array(name.into()).is_some()
}

/// Returns the single item of `items`.
fn only<T>(items: impl IntoIterator<Item = T>) -> Option<T> {
    let mut items = items.into_iter();
    let item = items.next()?;
    items.next().is_none().then_some(item)
}

/// Returns `cells` if each row of `chunk` has one; if one is missing, the rows of the
/// others are unknown.
fn one_a_row<T: Clone>(chunk: &Chunk, cells: impl Iterator<Item = Cell<T>>) -> Vec<Cell<T>> {
    let cells: Vec<_> = cells.collect();
    if cells.len() == chunk.num_rows() {
        cells
    } else {
        vec![None; chunk.num_rows()]
    }
}

/// The halves of the messages of a topic, by row.
#[derive(Default)]
pub struct MessageHalves(BTreeMap<RowId, (Option<Head>, Option<Vec<f64>>)>);

impl MessageHalves {
    /// Returns whether `chunk` has one half of its messages.
    pub fn are_in(chunk: &Chunk) -> bool {
        has_numbers::<Head>(chunk) != is_plotted(chunk)
    }

    /// Adds the rows of `chunk`.
    pub fn add(&mut self, chunk: &Chunk) {
        let heads = read::<Head>(chunk).into_iter();
        let payloads = plotted(chunk).into_iter();
        for (id, (head, payload)) in chunk.row_ids().zip(heads.zip(payloads)) {
            let (known, numbers) = self.0.entry(id).or_default();
            *known = known.or(head);
            if let Some(payload) = payload {
                *numbers = Some(payload.to_vec());
            }
        }
    }

    /// Returns the messages in the order of their numbers; `None` if a half is missing.
    pub fn joined(self) -> Option<Vec<(Head, Vec<f64>)>> {
        let mut rows = self
            .0
            .into_values()
            .map(|(head, payload)| head.zip(payload))
            .collect::<Option<Vec<_>>>()?;
        rows.sort_by_key(|(head, _)| head.seq);
        Some(rows)
    }
}

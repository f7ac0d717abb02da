//! Columns of values for rerun.

use std::sync::Arc;

use rerun::{
    ComponentDescriptor, RecordingStreamResult, SerializedComponentBatch,
    SerializedComponentColumn,
    archetypes::Scalars,
    external::arrow::array::{ArrayRef, Float64Array, StringArray, UInt8Array, UInt64Array},
};

/// One number per row.
pub fn numbers(
    name: &'static str,
    values: impl IntoIterator<Item = u64>,
) -> RecordingStreamResult<SerializedComponentColumn> {
    units(name, Arc::new(UInt64Array::from_iter_values(values)))
}

/// At most one number per row.
pub fn numbers_or_none(
    name: &'static str,
    values: impl IntoIterator<Item = Option<u64>>,
) -> RecordingStreamResult<SerializedComponentColumn> {
    units(name, Arc::new(UInt64Array::from_iter(values)))
}

/// Some bytes per row.
pub fn bytes<'a>(
    name: &'static str,
    values: impl Iterator<Item = &'a [u8]> + Clone,
) -> RecordingStreamResult<SerializedComponentColumn> {
    let lengths: Vec<usize> = values.clone().map(<[u8]>::len).collect();
    let array: ArrayRef = Arc::new(UInt8Array::from_iter_values(values.flatten().copied()));
    let batch = SerializedComponentBatch::new(array, ComponentDescriptor::partial(name));
    Ok(batch.partitioned(lengths)?)
}

/// One text per row.
pub fn texts(
    name: &'static str,
    values: impl IntoIterator<Item = String>,
) -> RecordingStreamResult<SerializedComponentColumn> {
    units(name, Arc::new(StringArray::from_iter_values(values)))
}

/// `width` values in each of `rows`, to be plotted as `width` series.
pub fn series(
    values: Vec<f64>,
    width: usize,
    rows: usize,
) -> RecordingStreamResult<SerializedComponentColumn> {
    let array: ArrayRef = Arc::new(Float64Array::from(values));
    let batch = SerializedComponentBatch::new(array, Scalars::descriptor_scalars());
    Ok(batch.partitioned(std::iter::repeat_n(width, rows))?)
}

fn units(name: &'static str, array: ArrayRef) -> RecordingStreamResult<SerializedComponentColumn> {
    let descriptor = ComponentDescriptor::partial(name);
    Ok(SerializedComponentBatch::new(array, descriptor).column_of_unit_batches()?)
}

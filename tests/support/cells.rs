//! Cells of the tables in a recording, replaced.

use std::sync::Arc;

use rerun::external::arrow::{
    array::{Array, ArrayRef, ListArray},
    buffer::OffsetBuffer,
    compute::concat,
    datatypes::DataType,
};

/// A cell with these values, for a column of lists such as `like`.
pub fn list(values: ArrayRef, like: &ListArray) -> ArrayRef {
    let DataType::List(field) = like.data_type() else {
        panic!("{} is no list", like.data_type());
    };
    let whole = OffsetBuffer::from_lengths([values.len()]);
    Arc::new(ListArray::new(field.clone(), whole, values, None))
}

/// `column` with another cell in row `row`.
pub fn with_cell(column: &ArrayRef, row: usize, cell: &dyn Array) -> ArrayRef {
    let (before, after) = (row, column.len() - row - 1);
    let [before, after] = [column.slice(0, before), column.slice(row + 1, after)];
    concat(&[&before, cell, &after]).expect("cells of one type")
}

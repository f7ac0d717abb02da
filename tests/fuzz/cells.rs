//! Single cells, rows and columns of a table in a recording, changed.

use std::sync::Arc;

use rand::{Rng, seq::IndexedRandom};
use rerun::external::arrow::{
    array::{
        Array, ArrayRef, AsArray, DurationNanosecondArray, Float64Array, ListArray, RecordBatch,
        StringArray, UInt8Array, UInt64Array, new_null_array,
    },
    compute::concat_batches,
    datatypes::{DurationNanosecondType, Float64Type, UInt8Type, UInt64Type},
};

use crate::{
    cases::{RandomSource, chance},
    columns::{list, with_cell},
};

/// Changes one cell of `column`; describes the change.
pub fn change_cell(table: &mut RecordBatch, column: usize, random: &mut RandomSource) -> String {
    let row = random.random_range(0..table.num_rows());
    let cells = table.column(column).clone();
    let (cell, how) = match cells.as_list_opt::<i32>() {
        Some(list) => change_list(list, row, random),
        None => change_time(&cells, row, random),
    };
    set_cell(table, column, row, &cell);
    format!("row {row}: {how}")
}

/// Changes one bit in a row of a column of bytes; describes the change.
pub fn flip_bit(table: &mut RecordBatch, column: usize, random: &mut RandomSource) -> String {
    let row = random.random_range(0..table.num_rows());
    let cells = table.column(column).as_list::<i32>().clone();
    let bytes = cells.value(row);
    let mut bytes = bytes.as_primitive::<UInt8Type>().values().to_vec();
    let place = random.random_range(0..bytes.len());
    let bit = random.random_range(0..8);
    bytes[place] ^= 1 << bit;
    let cell = list(Arc::new(UInt8Array::from(bytes)), &cells);
    set_cell(table, column, row, &cell);
    format!("row {row}: bit {bit} of byte {place}")
}

/// Replaces one cell of `table`.
fn set_cell(table: &mut RecordBatch, column: usize, row: usize, cell: &ArrayRef) {
    let mut columns = table.columns().to_vec();
    columns[column] = with_cell(&columns[column], row, cell);
    *table = RecordBatch::try_new(table.schema(), columns).expect("a table");
}

/// Sets the text in a row of `column`.
pub fn set_text(table: &mut RecordBatch, column: &str, row: usize, text: String) {
    let column = table.schema().index_of(column).expect("a column");
    let values = Arc::new(StringArray::from(vec![text]));
    let cell = list(values, table.column(column).as_list());
    set_cell(table, column, row, &cell);
}

/// Sets the number in the first row of `column`, if there is one.
pub fn set_number(table: &mut RecordBatch, column: &str, number: i64) {
    let Ok(column) = table.schema().index_of(column) else {
        return;
    };
    let cell: ArrayRef = match table.column(column).as_list_opt::<i32>() {
        Some(cells) => {
            let values = UInt64Array::from(vec![number.unsigned_abs()]);
            list(Arc::new(values), cells)
        }
        None => Arc::new(DurationNanosecondArray::from(vec![number])),
    };
    set_cell(table, column, 0, &cell);
}

/// Another run time in place of that in `row`.
fn change_time(cells: &ArrayRef, row: usize, random: &mut RandomSource) -> (ArrayRef, String) {
    let old = cells.as_primitive::<DurationNanosecondType>().value(row);
    let apart = *[1, -1, 20_000_000, -20_000_000]
        .choose(random)
        .expect("one");
    let others = [
        -1,
        -old,
        i64::MIN,
        i64::MAX,
        0,
        random.random(),
        old + apart,
    ];
    let new = *others.choose(random).expect("one");
    let cell = DurationNanosecondArray::from(vec![new]);
    (Arc::new(cell), format!("{old} ns became {new} ns"))
}

/// Other numbers in place of those in `row`.
fn change_list(cells: &ListArray, row: usize, random: &mut RandomSource) -> (ArrayRef, String) {
    let old = cells.value(row);
    if !old.is_empty() && chance(random, 5) {
        return (new_null_array(cells.data_type(), 1), "null".to_owned());
    }
    let new: ArrayRef = match old.as_primitive_opt::<UInt64Type>() {
        Some(whole) => {
            let others = [0, 1, 2, 1_000_000_000, u64::MAX >> 1, u64::MAX];
            let numbers = whole.values().to_vec();
            Arc::new(UInt64Array::from(changed(numbers, &others, random)))
        }
        None => {
            let floats = old.as_primitive::<Float64Type>().values().iter();
            let others = [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, 1e300].map(f64::to_bits);
            let bits = changed(
                floats.map(|number| number.to_bits()).collect(),
                &others,
                random,
            );
            Arc::new(Float64Array::from_iter_values(
                bits.into_iter().map(f64::from_bits),
            ))
        }
    };
    let how = format!("{old:?} became {new:?}");
    (list(new, cells), how)
}

/// `numbers` with one changed, perhaps to one of `others`, added or left out.
fn changed(mut numbers: Vec<u64>, others: &[u64], random: &mut RandomSource) -> Vec<u64> {
    let other = *others.choose(random).expect("one");
    let place = random.random_range(0..=numbers.len());
    match (random.random_range(0..8), numbers.get_mut(place)) {
        // None are as good as an empty cell.
        (1, _) | (_, None) => numbers.insert(place, other),
        (0, Some(_)) => numbers.clear(),
        (2, Some(number)) => *number = number.wrapping_add(1),
        (3, Some(number)) => *number = number.wrapping_sub(1),
        (4 | 5, Some(number)) => *number ^= 1 << random.random_range(0..64),
        (_, Some(number)) => *number = other,
    }
    numbers
}

/// Removes, doubles or swaps rows; describes the change.
pub fn change_rows(table: &mut RecordBatch, random: &mut RandomSource) -> String {
    let rows = table.num_rows();
    let [one, other] = [(); 2].map(|()| random.random_range(0..rows));
    let (first, last) = (one.min(other), one.max(other));
    let mut order: Vec<usize> = (0..rows).collect();
    let how = match random.random_range(0..4) {
        0 if first != last => {
            order.swap(first, last);
            format!("rows {first} and {last} swapped")
        }
        1 => {
            order.insert(one, one);
            format!("row {one} doubled")
        }
        2 => {
            order.drain(first..=last);
            format!("rows {first} to {last} of {rows} removed")
        }
        _ => {
            order.remove(one);
            format!("row {one} of {rows} removed")
        }
    };
    let parts: Vec<_> = order.iter().map(|row| table.slice(*row, 1)).collect();
    *table = concat_batches(&table.schema(), &parts).expect("a table");
    how
}

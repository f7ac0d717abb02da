//! Single cells, rows and columns of a table in a recording, changed.

use std::sync::Arc;

use rand::{Rng, seq::IndexedRandom};
use rerun::external::arrow::{
    array::{
        Array, ArrayRef, AsArray, DurationNanosecondArray, Float64Array, ListArray, RecordBatch,
        StringArray, UInt8Array, UInt64Array, new_null_array,
    },
    buffer::OffsetBuffer,
    compute::{concat, concat_batches},
    datatypes::{DataType, DurationNanosecondType, Float64Type, UInt8Type, UInt64Type},
};

use crate::cases::{RandomSource, chance};

/// Changes one cell of `column`; describes the change.
pub fn change_cell(table: &mut RecordBatch, column: usize, random: &mut RandomSource) -> String {
    let row = random.random_range(0..table.num_rows());
    let cells = table.column(column).clone();
    let (cell, how) = match cells.as_list_opt::<i32>() {
        Some(list) => change_list(list, row, random),
        None => change_time(&cells, row, random),
    };
    *table = with_cell(table, column, row, &cell);
    format!("row {row}: {how}")
}

/// Changes one bit in a row of a column of bytes; describes the change.
pub fn flip_bit(table: &mut RecordBatch, column: usize, random: &mut RandomSource) -> String {
    let row = random.random_range(0..table.num_rows());
    let cells = table.column(column).as_list::<i32>().clone();
    let mut bytes = cells
        .value(row)
        .as_primitive::<UInt8Type>()
        .values()
        .to_vec();
    let (place, bit) = (
        random.random_range(0..bytes.len()),
        random.random_range(0..8),
    );
    bytes[place] ^= 1 << bit;
    let cell = list(Arc::new(UInt8Array::from(bytes)), &cells);
    *table = with_cell(table, column, row, &cell);
    format!("row {row}: bit {bit} of byte {place}")
}

/// `table` with one cell replaced.
fn with_cell(table: &RecordBatch, column: usize, row: usize, cell: &dyn Array) -> RecordBatch {
    let cells = table.column(column);
    let (before, after) = (
        cells.slice(0, row),
        cells.slice(row + 1, cells.len() - row - 1),
    );
    let mut columns = table.columns().to_vec();
    columns[column] = concat(&[&before, cell, &after]).expect("cells of a kind");
    RecordBatch::try_new(table.schema(), columns).expect("a table")
}

/// Sets the text in a row of `column`.
pub fn set_text(table: &mut RecordBatch, column: &str, row: usize, text: String) {
    let column = table.schema().index_of(column).expect("a column");
    let values = Arc::new(StringArray::from(vec![text]));
    let cell = list(values, table.column(column).as_list());
    *table = with_cell(table, column, row, &cell);
}

/// Sets the number in the first row of `column`, if there is one.
pub fn set_number(table: &mut RecordBatch, column: &str, number: i64) {
    let Ok(column) = table.schema().index_of(column) else {
        return;
    };
    let cell: ArrayRef = match table.column(column).as_list_opt::<i32>() {
        Some(cells) => {
            let values = UInt64Array::from(vec![number.unsigned_abs()]);
            Arc::new(list(Arc::new(values), cells))
        }
        None => Arc::new(DurationNanosecondArray::from(vec![number])),
    };
    *table = with_cell(table, column, 0, &cell);
}

fn list(values: ArrayRef, like: &ListArray) -> ListArray {
    let DataType::List(field) = like.data_type() else {
        panic!("{} is no list", like.data_type());
    };
    ListArray::new(
        field.clone(),
        OffsetBuffer::from_lengths([values.len()]),
        values,
        None,
    )
}

/// A run time other than that in `row`.
fn change_time(cells: &ArrayRef, row: usize, random: &mut RandomSource) -> (ArrayRef, String) {
    let old = cells.as_primitive::<DurationNanosecondType>().value(row);
    let others = [
        -1,
        -old,
        i64::MIN,
        i64::MAX,
        0,
        old + 1,
        old - 1,
        old + 20_000_000,
        old - 20_000_000,
        random.random(),
    ];
    let others: Vec<_> = others.into_iter().filter(|other| *other != old).collect();
    let new = *others.choose(random).expect("another");
    let cell = DurationNanosecondArray::from(vec![new]);
    (Arc::new(cell), format!("{old} ns became {new} ns"))
}

/// Numbers different from those in `row`.
fn change_list(cells: &ListArray, row: usize, random: &mut RandomSource) -> (ArrayRef, String) {
    let (old, floats) = numbers(cells, row);
    if !old.is_empty() && chance(random, 5) {
        return (new_null_array(cells.data_type(), 1), "null".to_owned());
    }
    let mut new = old.clone();
    while same(&new, &old, floats) {
        change_numbers(&mut new, floats, random);
    }
    let values: ArrayRef = match floats {
        true => Arc::new(Float64Array::from_iter_values(
            new.iter().copied().map(f64::from_bits),
        )),
        false => Arc::new(UInt64Array::from(new.clone())),
    };
    let shown = |numbers: &[u64]| match floats {
        true => format!(
            "{:?}",
            numbers
                .iter()
                .copied()
                .map(f64::from_bits)
                .collect::<Vec<_>>()
        ),
        false => format!("{numbers:?}"),
    };
    let how = format!("{} became {}", shown(&old), shown(&new));
    (Arc::new(list(values, cells)), how)
}

/// The numbers in a cell, with floats as their bits, and whether they are floats.
fn numbers(cells: &ListArray, row: usize) -> (Vec<u64>, bool) {
    let cell = cells.is_valid(row).then(|| cells.value(row));
    let whole = |cell: &ArrayRef| {
        cell.as_primitive_opt::<UInt64Type>()
            .map(|n| n.iter().flatten().collect())
    };
    let float = |cell: &ArrayRef| {
        let numbers = cell.as_primitive::<Float64Type>().iter().flatten();
        numbers.map(f64::to_bits).collect()
    };
    let floats = cells.value_type() == DataType::Float64;
    let numbers = cell.map(|cell| whole(&cell).unwrap_or_else(|| float(&cell)));
    (numbers.unwrap_or_default(), floats)
}

/// Whether they have the same meaning: all NaNs are equal.
fn same(one: &[u64], other: &[u64], floats: bool) -> bool {
    let nan = |bits: &u64| floats && f64::from_bits(*bits).is_nan();
    one.len() == other.len()
        && one
            .iter()
            .zip(other)
            .all(|(one, other)| one == other || nan(one) && nan(other))
}

fn change_numbers(numbers: &mut Vec<u64>, floats: bool, random: &mut RandomSource) {
    let specials = match floats {
        true => [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, 1e300].map(f64::to_bits),
        false => [0, 1, 2, 1_000_000_000, u64::MAX >> 1, u64::MAX],
    };
    let special = *specials.choose(random).expect("one");
    let place = random.random_range(0..=numbers.len());
    match (random.random_range(0..8), numbers.get_mut(place)) {
        (0, _) => numbers.clear(),
        (1, _) | (_, None) => numbers.insert(place, special),
        (2, Some(number)) => *number = number.wrapping_add(1),
        (3, Some(number)) => *number = number.wrapping_sub(1),
        (4 | 5, Some(number)) => *number ^= 1 << random.random_range(0..64),
        (_, Some(number)) => *number = special,
    }
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

//! Files whose cells were altered, and written again as a recorder writes them.

use std::{fs, path::Path, sync::Arc};

use ratelab_recording::rrd::schema::JSON;
use rerun::{
    external::{
        arrow::array::{Array, ArrayRef, AsArray, RecordBatch, StringArray, UInt64Array},
        re_log_encoding::{DecoderApp, Encoder},
    },
    log::LogMsg,
};
use serde_json::Value;

use super::cells::{list, with_cell};

/// Alters the columns called `column` of the entities whose path ends with
/// `entity`, in the file at `path`.
pub fn alter(path: &Path, entity: &str, column: &str, how: impl Fn(&ArrayRef) -> ArrayRef) {
    let bytes = fs::read(path).expect("read");
    let messages = DecoderApp::decode_eager(&*bytes).expect("whole");
    let mut found = 0;
    let messages: Vec<_> = messages
        .map(|message| {
            let mut message = message.expect("whole");
            if let LogMsg::ArrowMsg(_, data) = &mut message {
                found += usize::from(alter_batch(&mut data.batch, entity, column, &how));
            }
            Ok(message)
        })
        .collect();
    assert!(found > 0, "no {column} of {entity}");
    fs::write(path, Encoder::encode(messages).expect("encoded")).expect("written");
}

/// Whether it has such a column, which is altered then.
fn alter_batch(
    batch: &mut RecordBatch,
    entity: &str,
    column: &str,
    how: impl Fn(&ArrayRef) -> ArrayRef,
) -> bool {
    let schema = batch.schema();
    let mut names = schema.metadata().values();
    let is_it = names.any(|name| name.starts_with('/') && name.ends_with(entity));
    let Some(index) = schema.index_of(column).ok().filter(|_| is_it) else {
        return false;
    };
    let mut columns = batch.columns().to_vec();
    columns[index] = how(&columns[index]);
    *batch = RecordBatch::try_new(schema, columns).expect("columns of the same types");
    true
}

/// Alters the JSON in the rows of `entity`.
pub fn alter_json(path: &Path, entity: &str, how: impl Fn(&mut Value)) {
    alter(path, entity, JSON, |column| {
        (0..column.len()).fold(column.clone(), |column, row| {
            let cell = column.as_list::<i32>().value(row);
            let text = cell.as_string::<i32>().value(0);
            let mut value = serde_json::from_str(text).expect("JSON");
            how(&mut value);
            let text = Arc::new(StringArray::from(vec![value.to_string()]));
            with_cell(&column, row, &list(text, column.as_list()))
        })
    });
}

/// Sets the number in row `row` of a column of numbers to `number`.
pub fn set_number(column: &ArrayRef, row: usize, number: u64) -> ArrayRef {
    let number = Arc::new(UInt64Array::from(vec![number]));
    with_cell(column, row, &list(number, column.as_list()))
}

/// Exchanges the cells in two rows of a column, if it has so many.
pub fn exchange(column: &ArrayRef, [one, other]: [usize; 2]) -> ArrayRef {
    if column.len() <= one.max(other) {
        return column.clone();
    }
    let changed = with_cell(column, one, &column.slice(other, 1));
    with_cell(&changed, other, &column.slice(one, 1))
}

/// Leaves row `row` of a column without a value.
pub fn empty_cell(column: &ArrayRef, row: usize) -> ArrayRef {
    let cells = column.as_list::<i32>();
    let none = cells.values().slice(0, 0);
    with_cell(column, row, &list(none, cells))
}

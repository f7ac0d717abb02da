//! SQLite files as rosbag2 writes them. What is whole before damage is used.

use std::{
    collections::HashMap,
    io,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, OpenFlags, Result, Row, types::ValueRef};

use super::{
    FileReading,
    schema::{PREFIX, StampField, stamp_field},
};
use crate::bag::RawMessage;

/// The topics of a file, by their numbers in it.
type Topics = HashMap<i64, (usize, Option<StampField>)>;

/// Reads the file of SQLite that is called as `reading` says.
///
/// # Errors
/// The error of SQLite for a file without the tables of rosbag2.
pub fn read(reading: &mut FileReading<'_>) -> io::Result<()> {
    let file = open(Path::new(&reading.name)).map_err(io::Error::other)?;
    if !has_tables(&file).map_err(io::Error::other)? {
        let why = "the tables topics and messages of rosbag2 are missing";
        return Err(io::Error::other(why));
    }
    let topics = topics(&file, reading).map_err(io::Error::other)?;
    let mut count = 0;
    if let Err(why) = messages(&file, &topics, reading, &mut count) {
        reading.damaged(format!("damaged behind message {count}: {why}"));
    }
    Ok(())
}

/// Opens a file so that nothing is written beside it.
fn open(path: &Path) -> Result<Connection> {
    let mut beside = path.to_owned().into_os_string();
    beside.push("-wal");
    let is_open = PathBuf::from(beside).exists();
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let file = if is_open {
        Connection::open_with_flags(path, flags)?
    } else {
        let escaped = path.to_string_lossy().replace('%', "%25");
        let escaped = escaped.replace('?', "%3f").replace('#', "%23");
        let uri = format!("file:{escaped}?immutable=1");
        Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_URI)?
    };
    file.execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON")?;
    Ok(file)
}

/// Returns whether a file has the tables of rosbag2.
fn has_tables(file: &Connection) -> Result<bool> {
    Ok(has_table(file, "topics")? && has_table(file, "messages")?)
}

/// Returns whether a file has a table called `name`. A view in its place may compute for ever: it
/// counts as none.
fn has_table(file: &Connection, name: &str) -> Result<bool> {
    let sql = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?";
    file.query_one(sql, [name], |row| Ok(row.get::<_, i64>(0)? > 0))
}

/// Returns the topics of a file.
fn topics(file: &Connection, reading: &mut FileReading<'_>) -> Result<Topics> {
    let schemas = schemas(file, has_table(file, "message_definitions")?);
    let mut topics = Topics::new();
    let mut rows = file.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        let (name, kind, format) = (text(row, 1)?, text(row, 2)?, text(row, 3)?);
        let (encoding, schema) = schemas.get(&kind).cloned().unwrap_or_default();
        let stamp = stamp_field(&kind, &encoding, schema.as_bytes());
        let stamp = stamp.filter(|_| format == "cdr");
        if let Some(topic) = reading.bag.topic(&name) {
            reading.bag.topic_mut(topic).has_stamps |= stamp.is_some();
            topics.insert(row.get(0)?, (topic, stamp));
        }
    }
    Ok(topics)
}

/// Returns the encoding and the text of each schema, by type. Older files have none.
fn schemas(file: &Connection, are_there: bool) -> HashMap<String, (String, String)> {
    let sql = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
    let read = || {
        let mut rows = file.prepare(sql)?;
        let schema = |row: &Row<'_>| Ok((text(row, 0)?, (text(row, 1)?, text(row, 2)?)));
        rows.query_map([], schema)?.collect::<Result<_>>()
    };
    are_there
        .then(read)
        .and_then(Result::ok)
        .unwrap_or_default()
}

/// Adds the messages of a file, and counts them.
fn messages(
    file: &Connection,
    topics: &Topics,
    reading: &mut FileReading<'_>,
    count: &mut u64,
) -> Result<()> {
    let all: i64 = file.query_one("SELECT max(id) FROM messages", [], |row| {
        Ok(row.get(0).unwrap_or(1))
    })?;
    let sql = format!(
        "SELECT topic_id, timestamp, length(data), substr(data, 1, {PREFIX}) FROM messages"
    );
    let mut rows = file.prepare(&sql)?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        *count += 1;
        let part = (*count as f64 / all.max(1) as f64).min(1.0);
        let at = (part * reading.length as f64) as u64;
        if reading.progress(at).is_err() || reading.is_full(at) {
            break;
        }
        let known = row.get(0).ok().and_then(|id: i64| topics.get(&id));
        let log = row.get::<_, i64>(1).map(u64::try_from);
        let (Some((topic, stamp)), Ok(Ok(log))) = (known, log) else {
            continue;
        };
        let data = match row.get_ref(3)? {
            ValueRef::Blob(data) => data,
            _ => &[],
        };
        let raw = RawMessage {
            log,
            // The files have one time of each message.
            publish: log,
            stamp: stamp.map_or(0, |field| field.read(data)),
            sequence: 0,
            length: row.get(2).map_or(0, i64::unsigned_abs),
        };
        reading.add(*topic, raw);
    }
    Ok(())
}

/// Returns the text in a column, however it is encoded.
fn text(row: &Row<'_>, column: usize) -> Result<String> {
    let bytes = row.get_ref(column)?.as_bytes_or_null()?;
    Ok(String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned())
}

#[cfg(test)]
mod tests {
    use std::{fs, ops::ControlFlow};

    use super::*;
    use crate::{Bag, BagError, read};

    /// The tables of rosbag2; older files lack the last one.
    const TABLES: &str = "
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
            timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        INSERT INTO topics VALUES (1, '/image', 'sensor_msgs/msg/Image', 'cdr', ''),
            (2, '/own', 'own/msg/Own', 'cdr', '');";
    const DEFINITIONS: &str = "
        CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL,
            encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL,
            type_description_hash TEXT NOT NULL);
        INSERT INTO message_definitions VALUES
            (1, 'own/msg/Own', 'ros2msg', 'builtin_interfaces/Time stamp', '');";

    /// Returns the bytes of a file with 100 messages of each topic: 10 ms old at 10 Hz.
    fn file(tables: &str) -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("bag_0.db3");
        let file = Connection::open(&path).expect("a file");
        file.execute_batch(tables).expect("tables");
        let sql = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)";
        for message in 0..200_u32 {
            let ms = 1_000 + 50 * message;
            let stamp = u64::from(ms) * 1_000_000 - 10_000_000;
            let mut data = vec![0, 1, 0, 0];
            data.extend(
                u32::try_from(stamp / 1_000_000_000)
                    .expect("32 bits")
                    .to_le_bytes(),
            );
            data.extend(
                u32::try_from(stamp % 1_000_000_000)
                    .expect("32 bits")
                    .to_le_bytes(),
            );
            data.resize(300, 7);
            let log = i64::from(ms) * 1_000_000;
            file.execute(sql, (message % 2 + 1, log, data))
                .expect("a row");
        }
        drop(file);
        fs::read(path).expect("read")
    }

    fn read_bytes(bytes: &[u8]) -> std::result::Result<Bag, BagError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a ?%23.db3");
        fs::write(&path, bytes).expect("written");
        read(folder.path(), &mut |_, _| ControlFlow::Continue(()))
    }

    #[test]
    fn files_of_sqlite_have_stamps_by_their_schemas_or_known_types() {
        let stamped = |tables: &str| {
            let bag = read_bytes(&file(tables)).expect("a bag");
            let ages = bag.topics.iter().map(|topic| {
                assert_eq!((topic.messages.len(), topic.bytes), (100, 30_000));
                let message = topic.messages[50];
                (topic.has_stamps, message.log.checked_sub(message.stamp))
            });
            ages.collect::<Vec<_>>()
        };
        let (with, without) = ((true, Some(10_000_000)), (false, None));
        assert_eq!(stamped(&format!("{TABLES}{DEFINITIONS}")), [with, with]);
        assert_eq!(stamped(TABLES), [with, without]);
    }

    #[test]
    fn damaged_files_of_sqlite_are_read_as_far_as_they_are_whole() {
        let whole = file(TABLES);
        let cut = read_bytes(&whole[..whole.len() / 2]);
        assert!(cut.is_err() || cut.is_ok_and(|bag| !bag.damage.is_empty()));
        let others = read_bytes(&file(
            "CREATE VIEW topics AS SELECT 1; CREATE TABLE messages(id,
            topic_id, timestamp, data);",
        ));
        let why = others.expect_err("refused").to_string();
        assert!(
            why.contains("tables topics and messages of rosbag2"),
            "{why}"
        );
        for place in (0..whole.len()).step_by(whole.len() / 100) {
            let mut altered = whole.clone();
            altered[place] ^= 0x55;
            let _ = read_bytes(&altered); // It may be anything but a panic.
        }
    }
}

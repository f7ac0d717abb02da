//! Tables of events: the door for every other system.

use std::io::{self, BufRead, BufReader, Read};

use super::FileReading;
use crate::bag::RawMessage;

/// The columns; all but the first two may be left out or empty.
pub const COLUMNS: [&str; 5] = ["topic", "log_ns", "publish_ns", "stamp_ns", "seq"];

/// The longest line (bytes).
const LONGEST: u64 = 64 << 10;

/// Bytes that are read at once.
const PORTION: usize = 256 << 10;

/// Returns whether a file that begins with `head` is such a table.
pub fn is_table(head: &[u8]) -> bool {
    let line = head.split(|byte| *byte == b'\n').next().unwrap_or_default();
    columns(&String::from_utf8_lossy(line)).is_some()
}

/// Returns the place of each column in a table with this first line.
fn columns(line: &str) -> Option<[Option<usize>; 5]> {
    let names = cells(line.trim_start_matches('\u{feff}').trim_end());
    let places = COLUMNS.map(|name| names.iter().position(|cell| cell == name));
    let is_known = names.iter().all(|name| COLUMNS.contains(&name.as_str()));
    (places[0].is_some() && places[1].is_some() && is_known).then_some(places)
}

/// Returns the cells of a line; one in quotes may contain commas, and doubled quotes.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut signs = line.chars().peekable();
    while let Some(sign) = signs.next() {
        match sign {
            '"' if quoted && signs.peek() == Some(&'"') => cell.extend(signs.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            sign => cell.push(sign),
        }
    }
    cells.push(cell);
    cells
}

/// Reads such a table from its beginning.
///
/// # Errors
/// The error of the operating system.
pub fn read(source: &mut impl Read, reading: &mut FileReading<'_>) -> io::Result<()> {
    let mut source = BufReader::with_capacity(PORTION, source);
    let (mut at, mut line, mut columns_of) = (0, Vec::new(), None);
    for number in 1_u64.. {
        line.clear();
        let length = source.by_ref().take(LONGEST).read_until(b'\n', &mut line)?;
        if length == 0 || reading.is_full(at) {
            break;
        }
        at += length as u64;
        if number % 4_096 == 1 {
            reading.progress(at)?;
        }
        let text = String::from_utf8_lossy(&line);
        let Some(columns) = columns_of else {
            columns_of = columns(&text);
            continue;
        };
        if text.trim().is_empty() {
            continue;
        }
        match event(&text, columns) {
            Ok((name, raw)) => {
                if let Some(topic) = reading.bag.topic(&name) {
                    reading.bag.topic_mut(topic).has_stamps |= columns[3].is_some();
                    reading.add(topic, raw);
                }
            }
            Err(why) => reading.damaged(format!("line {number}: {why}: left out")),
        }
    }
    Ok(())
}

/// Returns the topic and the message of a line.
fn event(line: &str, columns: [Option<usize>; 5]) -> Result<(String, RawMessage), String> {
    let mut cells = cells(line.trim_end());
    let number = |column: usize| {
        let cell = columns[column]
            .and_then(|at| cells.get(at))
            .map_or("", |cell| cell.trim());
        let expected = || {
            let name = COLUMNS[column];
            let shown: String = cell.chars().take(40).collect();
            format!("{name} {shown:?}: expected a whole number of 0 or more")
        };
        match cell {
            "" if column > 1 => Ok(0),
            cell => cell.parse::<u64>().map_err(|_| expected()),
        }
    };
    let (log, publish) = (number(1)?, number(2)?);
    let (stamp, sequence) = (number(3)?, number(4)?);
    let raw = RawMessage {
        log,
        publish,
        stamp: i64::try_from(stamp).unwrap_or(0),
        sequence: u32::try_from(sequence).unwrap_or(0),
        length: 0,
    };
    let topic = columns[0]
        .and_then(|at| cells.get_mut(at))
        .map(std::mem::take)
        .filter(|topic| !topic.is_empty())
        .ok_or("no topic")?;
    Ok((topic, raw))
}

//! Bags in files: each way of writing one gives the same, and damage is told with its place.

use std::{
    collections::BTreeMap,
    fs,
    io::Cursor,
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::Arc,
};

use mcap::{Channel, Compression, Message, Schema, WriteOptions};
use ratelab_bag::{Analysis, Bag, BagError, Kind, read};

const MS: u64 = 1_000_000;

/// The first log time of these bags.
const BEGIN: u64 = 1_764_000_000_000 * MS;

const POINT: &str = "# A point.
std_msgs/Header header
geometry_msgs/Point point
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// A message of a bag: topic, log time, publish time and stamp (ns).
type Event = (&'static str, u64, u64, u64);

/// A camera at 10 Hz, a detector that its images trigger, and a planner that reads at 4 Hz what the
/// detector found; each message takes 1 ms.
fn events() -> Vec<Event> {
    let (mut events, mut objects) = (Vec::new(), Vec::new());
    for image in 0..100 {
        let stamp = BEGIN + 12_345_670 + image * 100 * MS;
        let published = stamp + 5 * MS;
        events.push(("/image", published + MS, published, stamp));
        let found = published + 31 * MS;
        events.push(("/objects", found + MS, found, stamp));
        objects.push((found + MS, stamp));
    }
    for tick in 0..40 {
        let tick = BEGIN + 50 * MS + tick * 250 * MS;
        let newest = objects.iter().rev().find(|(arrived, _)| *arrived <= tick);
        let published = tick + 6 * MS;
        events.extend(newest.map(|(_, stamp)| ("/plan", published + MS, published, *stamp)));
    }
    events.sort_by_key(|event| (event.1, event.0));
    events
}

/// A point with this stamp, in CDR.
fn point(stamp: u64) -> Vec<u8> {
    let mut data = vec![0, 1, 0, 0];
    data.extend(((stamp / 1_000_000_000) as i32).to_le_bytes());
    data.extend(((stamp % 1_000_000_000) as u32).to_le_bytes());
    data.extend([2, 0, 0, 0, b'f', 0, 0, 0]);
    // Nothing that can be compressed.
    let mut number = stamp | 1;
    data.extend((0..2_000).map(|_| {
        number = number
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (number >> 56) as u8
    }));
    data
}

/// An MCAP file of `events`.
fn mcap(options: WriteOptions, events: &[Event], first_number: u32) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = options.create(&mut file).expect("a writer");
    let schema = Arc::new(Schema {
        id: 1,
        name: "geometry_msgs/msg/PointStamped".to_owned(),
        encoding: "ros2msg".to_owned(),
        data: POINT.as_bytes().into(),
    });
    let (mut channels, mut numbers) = (BTreeMap::new(), BTreeMap::new());
    for (topic, log_time, publish_time, stamp) in events {
        let id = channels.len() as u16 + 1;
        let channel = channels.entry(*topic).or_insert_with(|| {
            Arc::new(Channel {
                id,
                topic: (*topic).to_owned(),
                schema: Some(schema.clone()),
                message_encoding: "cdr".to_owned(),
                metadata: BTreeMap::new(),
            })
        });
        let number = numbers.entry(*topic).or_insert(first_number);
        let message = Message {
            channel: channel.clone(),
            sequence: *number,
            log_time: *log_time,
            publish_time: *publish_time,
            data: point(*stamp).into(),
        };
        *number += u32::from(first_number > 0);
        writer.write(&message).expect("written");
    }
    writer.finish().expect("finished");
    drop(writer);
    file.into_inner()
}

/// A folder that is removed at the end.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, content).expect("written");
        path
    }
}

fn bag(path: &Path) -> Result<Bag, BagError> {
    read(path, &mut |_, _| ControlFlow::Continue(()))
}

/// The bag in a file of this content.
fn bag_of(content: &[u8]) -> Result<Bag, BagError> {
    let folder = Folder::new();
    bag(&folder.put("a.mcap", content))
}

/// The times of all messages, by topic.
fn times(bag: &Bag) -> Vec<(String, Vec<ratelab_bag::BagMessage>)> {
    let topics = bag.topics.iter();
    topics
        .map(|topic| (topic.name.clone(), topic.messages.clone()))
        .collect()
}

fn small_chunks(compression: Option<Compression>) -> WriteOptions {
    WriteOptions::new()
        .chunk_size(Some(16 << 10))
        .compression(compression)
}

/// The same events as a table.
fn table(events: &[Event]) -> String {
    let rows = events
        .iter()
        .map(|(topic, log, publish, stamp)| format!("{topic},{log},{publish},{stamp}\n"));
    format!(
        "topic,log_ns,publish_ns,stamp_ns\n{}",
        rows.collect::<String>()
    )
}

#[test]
fn every_way_to_write_a_bag_gives_the_same_messages() {
    let events = events();
    let folder = Folder::new();
    let expected = times(&bag(&folder.put("table.csv", table(&events))).expect("a bag"));
    assert_eq!(expected.len(), 3);
    for (name, options) in [
        ("none", small_chunks(None)),
        ("lz4", small_chunks(Some(Compression::Lz4))),
        ("zstd", small_chunks(Some(Compression::Zstd))),
        ("one chunk", WriteOptions::new()),
        ("no chunks", WriteOptions::new().use_chunks(false)),
        (
            "no summary",
            small_chunks(None)
                .disable_seeking(true)
                .emit_summary_records(false),
        ),
        (
            "no index",
            small_chunks(None)
                .emit_message_indexes(false)
                .emit_chunk_indexes(false),
        ),
    ] {
        let found = bag_of(&mcap(options, &events, 0)).expect(name);
        assert_eq!(times(&found), expected, "{name}");
        assert_eq!(found.damage, [], "{name}");
        assert!(
            found
                .topics
                .iter()
                .all(|topic| topic.bytes == 2_020 * topic.messages.len() as u64)
        );
    }
}

#[test]
fn the_files_of_a_split_bag_are_read_in_the_order_of_its_metadata() {
    let (folder, events) = (Folder::new(), events());
    let whole = times(&bag_of(&mcap(small_chunks(None), &events, 0)).expect("a bag"));
    let (one, two) = events.split_at(events.len() / 2);
    folder.put("b.mcap", mcap(small_chunks(None), one, 0));
    folder.put("a.mcap", mcap(small_chunks(None), two, 0));
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - b.mcap\n    - a.mcap\n  files: []\n";
    for metadata in ["", metadata] {
        folder.put("metadata.yaml", metadata);
        let found = bag(folder.0.path()).expect("a bag");
        assert_eq!(times(&found), whole);
        // The log goes back between two files in the wrong order, but not within one.
        assert_eq!(found.steps_back, 0);
    }
    folder.put("metadata.yaml", metadata.replace("a.mcap", "c.mcap"));
    let found = bag(folder.0.path()).expect("a bag");
    assert_eq!(found.damage.len(), 1);
    assert!(found.messages() < events.len());
}

#[test]
fn a_bag_that_is_cut_off_has_the_messages_before_that() {
    let events = events();
    for compression in [None, Some(Compression::Lz4), Some(Compression::Zstd)] {
        let whole = mcap(small_chunks(compression), &events, 0);
        let half = bag_of(&whole[..whole.len() / 2]).expect("a bag");
        let share = half.messages() as f64 / events.len() as f64;
        assert!((0.3..0.7).contains(&share), "{share}");
        assert!(
            half.damage[0]
                .what
                .starts_with("cut off in the chunk at byte"),
            "{:?}",
            half.damage
        );
    }
}

#[test]
fn a_damaged_chunk_is_left_out_and_the_next_one_is_read() {
    let events = events();
    for compression in [None, Some(Compression::Zstd)] {
        let mut file = mcap(small_chunks(compression), &events, 0);
        let middle = file.len() / 3;
        file[middle] ^= 0x55;
        let found = bag_of(&file).expect("a bag");
        assert_eq!(found.damage.len(), 1, "{:?}", found.damage);
        assert!(
            found.damage[0].what.contains("left out"),
            "{:?}",
            found.damage
        );
        let lost = events.len() - found.messages();
        assert!((1..40).contains(&lost), "{lost}");
    }
}

#[test]
fn no_altered_bag_is_more_than_a_damaged_one() {
    let events = &events()[..60];
    for compression in [None, Some(Compression::Lz4), Some(Compression::Zstd)] {
        for options in [
            small_chunks(compression),
            WriteOptions::new().use_chunks(false),
        ] {
            let whole = mcap(options, events, 1);
            for round in 0..400_usize {
                let mut file = whole.clone();
                let at = round * 7_919 % file.len();
                file[at] = [0, 0xff, 0x7f, file[at] ^ 1][round % 4];
                let lie = (round * 104_729 + 13) % (file.len() - 8);
                if round % 3 == 0 {
                    file[lie..lie + 8].copy_from_slice(&(u64::MAX >> (round % 60)).to_le_bytes());
                }
                if let Ok(bag) = bag_of(&file) {
                    Analysis::new(&bag);
                }
            }
        }
    }
}

#[test]
fn times_that_cannot_be_break_nothing() {
    const STRANGE: [u64; 8] = [
        0,
        1,
        (1 << 61) - 1,
        1 << 61,
        1 << 62,
        u64::MAX >> 1,
        u64::MAX,
        BEGIN,
    ];
    let folder = Folder::new();
    for round in 0..30_usize {
        let mut rows = "topic,log_ns,publish_ns,stamp_ns\n".to_owned();
        for message in 0..300_usize {
            let time = BEGIN + message as u64 * MS;
            // One, two or all three of the times are strange.
            let [log, publish, stamp] = [0, 1, 2].map(|column| {
                let strange = STRANGE[(message * (7 + column) + round) % STRANGE.len()];
                if column <= round % 3 { strange } else { time }
            });
            rows += &format!("/{},{log},{publish},{stamp}\n", message % 3);
        }
        if let Ok(bag) = bag(&folder.put("a.csv", rows)) {
            Analysis::new(&bag);
        }
    }
}

#[test]
fn messages_that_the_recorder_lost_are_counted_by_their_numbers() {
    let mut file_events = events();
    let numbered = bag_of(&mcap(small_chunks(None), &file_events, 1)).expect("a bag");
    assert!(numbered.topics.iter().all(|topic| topic.lost == Some(0)));
    let bare = bag_of(&mcap(small_chunks(None), &file_events, 0)).expect("a bag");
    assert!(bare.topics.iter().all(|topic| topic.lost.is_none()));
    file_events.truncate(3);
    let rows = "topic,log_ns,seq\n/a,10,1\n/a,20,2\n/a,30,5\nno row\n";
    let folder = Folder::new();
    let found = bag(&folder.put("a.csv", rows)).expect("a bag");
    assert_eq!(found.messages(), 3);
    assert!(
        found.damage[0].what.starts_with("line 5"),
        "{:?}",
        found.damage
    );
}

#[test]
fn the_nodes_of_a_bag_are_the_ones_that_made_it() {
    let found = bag_of(&mcap(small_chunks(Some(Compression::Zstd)), &events(), 0)).expect("a bag");
    let analysis = Analysis::new(&found);
    let kinds: Vec<_> = analysis
        .nodes
        .iter()
        .map(|node| (node.kind, node.parent()))
        .collect();
    let expected = [
        (Kind::Sensor, None),
        (Kind::Trigger, Some(0)),
        (Kind::Timer, Some(1)),
    ];
    assert_eq!(kinds, expected);
    let timed = analysis.nodes[2]
        .input
        .as_ref()
        .and_then(|input| input.timed);
    let timed = timed.expect("a timer");
    assert_eq!(timed.period, 250.0 * MS as f64);
    assert_eq!(analysis.nodes[1].costs(), vec![30_000_000; 100]);
    let ages = analysis.chains[2].ages.expect("ages");
    // As a second program has counted them.
    assert_eq!((ages.mean / 1e3).round(), 192_608.0);
    assert_eq!((ages.p99 + 500) / 1_000, 338_448);
}

#[test]
fn what_is_no_bag_is_refused_with_what_it_is() {
    let folder = Folder::new();
    let of_sqlite = if cfg!(feature = "sqlite") {
        "not a database"
    } else {
        "ros2 bag convert"
    };
    for (content, why) in [
        (&b"mine\n"[..], "5 bytes of something else"),
        (b"", "0 bytes"),
        (b"SQLite format 3\0", of_sqlite),
        (b"#ROSBAG V2.0\n", "mcap convert"),
        (b"topic,log_ns\n", "no message"),
    ] {
        let said = bag(&folder.put("a", content)).expect_err(why).to_string();
        assert!(said.contains(why), "{said}");
    }
    let said = bag(Path::new("/dev/zero"))
        .expect_err("a device")
        .to_string();
    assert!(said.contains("a device"), "{said}");
}

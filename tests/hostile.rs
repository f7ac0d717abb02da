//! Files of weights from anywhere: whatever is in them, reading ends, panics
//! never and takes little memory; and deciding takes none.

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    fs,
    io::{Cursor, Read, Write},
};

use rand_pcg::{Pcg64, rand_core::RngCore};
use ratelab::{
    cartpole::{Observation, generator},
    experiment::Config,
    policy::{Brain, LARGEST_FILE, read_weights},
};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// The most that reading a file may take beside the file itself (bytes).
const MOST_MEMORY: isize = (64 << 20) - LARGEST_FILE as isize;

/// Counts what each thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
    static LIVE: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    LIVE.set(LIVE.get() + bytes);
    PEAK.set(PEAK.get().max(LIVE.get()));
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        count(layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Most memory that `work` held at a time (bytes).
fn peak(work: impl FnOnce()) -> isize {
    let before = LIVE.get();
    PEAK.set(before);
    work();
    PEAK.get() - before
}

fn fixture(name: &str) -> String {
    format!("{}/tests/brains/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn content(name: &str) -> Vec<u8> {
    fs::read(fixture(name)).expect("fixture")
}

#[test]
fn deciding_allocates_nothing() {
    let brain: Brain = fixture("actor.pt").parse().expect("a brain");
    let config = Config {
        policy: brain,
        ..Config::default()
    };
    let mut policy = common::brain(&config);
    let seen = Observation {
        cart_position: 0.1,
        cart_velocity: -0.2,
        cos_theta: 0.99,
        sin_theta: 0.1,
        pole_velocity: 0.3,
    };
    let before = ALLOCATIONS.get();
    let sum: f32 = (0..1_000).map(|_| policy.act(&seen).0).sum();
    assert_eq!(ALLOCATIONS.get() - before, 0);
    assert!(sum.is_finite());
}

/// Entries of a zip, to be put together again with sums that are right: a file
/// whose sums are wrong is refused before anybody looks at what is in it.
fn entries(content: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(content)).expect("a zip");
    let count = archive.len();
    let entry = |index| {
        let mut entry = archive.by_index(index).expect("an entry");
        let mut content = Vec::new();
        entry.read_to_end(&mut content).expect("content");
        (entry.name().expect("a name").into_owned(), content)
    };
    (0..count).map(entry).collect()
}

fn zipped(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in entries {
        // Names may be what the mutation made of them.
        if writer.start_file(name.as_str(), options).is_ok() {
            writer.write_all(content).expect("written");
        }
    }
    writer.finish().expect("a zip").into_inner()
}

/// A checkpoint with this pickle.
fn with_pickle(pickle: &[u8]) -> Vec<u8> {
    let mut entries = entries(&content("actor.pt"));
    entries[0].1 = pickle.to_vec();
    zipped(&entries)
}

/// Instructions and numbers that pickles and headers are sensitive to.
const SPICE: &[u8] = b"(.)0NRbcdehijlopqrstu}]QXKMJGPI\x80\x81\x85\x86\x87\x88\x8a\x8c\x93\x94\x95\x00\x01\xff{}\":,9";

/// Makes one to eight small changes.
fn mutate(content: &mut Vec<u8>, random: &mut Pcg64) {
    let mut below = |limit: usize| (random.next_u64() % limit.max(1) as u64) as usize;
    for _ in 0..=below(8) {
        let at = below(content.len());
        match below(6) {
            0 if at < content.len() => content[at] ^= 1 << below(8),
            1 if at < content.len() => content[at] = SPICE[below(SPICE.len())],
            2 => content.insert(at, SPICE[below(SPICE.len())]),
            3 => content.truncate(at),
            4 => {
                let end = (at + below(64)).min(content.len());
                content.drain(at..end);
            }
            _ => {
                let end = (at + below(256)).min(content.len());
                let piece = content[at..end].to_vec();
                let to = below(content.len());
                content.splice(to..to, piece);
            }
        }
    }
}

/// A file that was hurt: as a whole, or one entry of it, or its header.
fn hurt(index: usize, random: &mut Pcg64) -> Vec<u8> {
    let names = [
        "actor.pt",
        "parameters.pt",
        "half.pt",
        "asks.pt",
        "actor.safetensors",
    ];
    let name = names[index % names.len()];
    let mut whole = content(name);
    if name.ends_with(".pt") && !index.is_multiple_of(4) {
        let mut entries = entries(&whole);
        let victim = match random.next_u64() % 4 {
            0 => (random.next_u64() % entries.len() as u64) as usize,
            _ => 0, // The pickle.
        };
        mutate(&mut entries[victim].1, random);
        return zipped(&entries);
    }
    if name.ends_with(".safetensors") && index.is_multiple_of(2) {
        let rest = whole.split_off(600);
        mutate(&mut whole, random);
        whole.extend(rest);
        return whole;
    }
    mutate(&mut whole, random);
    whole
}

#[test]
fn no_mutated_file_makes_reading_panic_or_grow() {
    let count = std::env::var("RATELAB_MUTATIONS").ok();
    let count = count.map_or(2_000, |count| count.parse().expect("a number"));
    let mut random = generator(&[6]);
    let (mut read, mut most) = (0, 0);
    for index in 0..count {
        let content = hurt(index, &mut random);
        let peak = peak(|| match read_weights(&content) {
            Ok(_) => read += 1,
            Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
        });
        most = most.max(peak);
        assert!(peak < MOST_MEMORY, "file {index}: {peak} bytes");
    }
    println!("{count} files, {read} read, {most} bytes at most");
    assert!(
        read > 0 && read < count,
        "{read} of {count} files were read"
    );
}

/// What is said of a checkpoint with this pickle, in little memory.
fn refusal(pickle: &[u8]) -> String {
    let content = with_pickle(pickle);
    let mut said = String::new();
    let peak = peak(|| said = read_weights(&content).expect_err("no brain").to_string());
    assert!(peak < MOST_MEMORY, "{peak} bytes");
    said
}

#[test]
fn pickles_that_are_bombs_are_refused_in_little_memory() {
    let many = |piece: &[u8]| piece.repeat((1 << 18) / piece.len() - 4);
    let program = |parts: &[&[u8]]| parts.concat();
    // A tuple in a tuple in a tuple.
    assert!(refusal(&program(&[b"\x80\x02N", &many(b"\x85"), b"."])).contains("a tuple"));
    // Twice the last one in the next: two to the power of thousands.
    let doubled = program(&[b"\x80\x02)", &many(b"q\x00h\x00\x86"), b"."]);
    assert!(refusal(&doubled).contains("a tuple"));
    // A dictionary that contains itself.
    assert!(refusal(b"\x80\x02}q\x00X\x01\x00\x00\x00ah\x00s.").contains("\"a\""));
    // Marks without end, and a string longer than the file.
    assert!(refusal(&many(b"(")).contains("ends in the middle"));
    assert!(refusal(b"\x80\x02X\xff\xff\xff\xffab").contains("ends in the middle"));
    // A pickle longer than any.
    assert!(refusal(&many(b"N").repeat(5)).contains("longer than"));
}

#[test]
fn a_pickle_that_asks_for_more_than_tensors_is_refused_and_says_for_what() {
    let cases: [(&[u8], &str); 7] = [
        (
            b"\x80\x02cos\nsystem\nX\x02\x00\x00\x00ls\x85R.",
            "\"os.system\"",
        ),
        (
            b"\x80\x04\x8c\x08builtins\x8c\x04eval\x93.",
            "\"builtins.eval\"",
        ),
        (b"(S'ls'\nios\nsystem\n.", "0x53"),
        (b"\x80\x02(ios\nsystem\n.", "INST"),
        (b"\x80\x02)\x81.", "NEWOBJ"),
        (b"\x80\x02ctorch.hub\nload\n.", "\"torch.hub.load\""),
        (b"\x80\x02X\x02\x00\x00\x00ab)R.", "a call of a string"),
    ];
    for (pickle, asked) in cases {
        let said = refusal(pickle);
        assert!(
            said.contains("never code") && said.contains(asked),
            "{said}"
        );
    }
}

/// A pickle of one tensor under the first name, which shows of its storage what
/// these parts say.
fn tensor_pickle(offset: &[u8], shape: &[u8], strides: &[u8]) -> Vec<u8> {
    let name = b"actor_mean.0.weight";
    let storage = b"((X\x07\x00\x00\x00storagectorch\nFloatStorage\nX\x01\x00\x00\x000X\x03\x00\x00\x00cpuK\x04tQ";
    let head = [b"\x80\x02}X\x13\x00\x00\x00".as_slice(), name].concat();
    let call = b"ctorch._utils\n_rebuild_tensor_v2\n".as_slice();
    [&head, call, storage, offset, shape, strides, b"\x89}tRs."].concat()
}

#[test]
fn tensors_larger_than_their_storage_or_than_memory_are_refused() {
    let billion = b"J\x00\x00\x00\x40J\x00\x00\x00\x40\x86";
    let actor = b"K\x40K\x05\x86";
    let cases = [
        // A square of a billion, every number the same one.
        (
            tensor_pickle(b"K\x00", billion, b"K\x00K\x00\x86"),
            "numbers at most",
        ),
        (
            tensor_pickle(b"J\x00\x00\x00\x40", actor, b"K\x05K\x01\x86"),
            "1280 bytes",
        ),
        (
            tensor_pickle(b"K\x00", actor, b"J\x00\x00\x00\x40K\x01\x86"),
            "1280 bytes",
        ),
        (
            tensor_pickle(b"J\xff\xff\xff\xff", actor, b"K\x05K\x01\x86"),
            "-1 for a size",
        ),
        (
            tensor_pickle(b"K\x00", actor, b"K\x01\x85"),
            "does not take",
        ),
    ];
    for (pickle, found) in cases {
        let said = refusal(&pickle);
        assert!(said.contains(found), "{said}");
    }
}

#[test]
fn a_storage_much_larger_than_its_tensor_takes_no_more_than_itself() {
    let mut entries = entries(&content("actor.pt"));
    let storage = entries
        .iter_mut()
        .find(|(name, _)| name.ends_with("data/0"));
    let (_, numbers) = storage.expect("a storage");
    numbers.resize(15 << 20, 0);
    let content = zipped(&entries);
    assert!(content.len() as u64 <= LARGEST_FILE);
    let peak = peak(|| assert!(read_weights(&content).is_ok()));
    assert!(peak < MOST_MEMORY / 2, "{peak} bytes");
}

#[test]
fn a_zip_with_entries_without_end_is_refused_in_little_memory() {
    let mut content = content("actor.pt");
    let entry = content
        .windows(4)
        .position(|bytes| bytes == b"PK\x01\x02")
        .expect("an entry");
    let piece = content[entry..entry + 60].to_vec();
    while content.len() + piece.len() <= LARGEST_FILE as usize {
        content.splice(
            entry..entry,
            piece.repeat(1 + (content.len() / piece.len()) / 2),
        );
        content.truncate(LARGEST_FILE as usize);
    }
    let peak = peak(|| {
        let error = read_weights(&content).expect_err("no brain").to_string();
        assert!(error.contains("entries"), "{error}");
    });
    assert!(peak < MOST_MEMORY, "{peak} bytes");
}

#[test]
fn a_header_without_end_is_refused_in_little_memory() {
    let entry = br#""a":{"dtype":"F32","shape":[],"data_offsets":[0,0]},"#;
    let header = [b"{".as_slice(), &entry.repeat(200_000)].concat();
    let content = [&(header.len() as u64).to_le_bytes(), &header[..]].concat();
    let peak = peak(|| {
        let error = read_weights(&content).expect_err("no brain").to_string();
        assert!(error.contains("header"), "{error}");
    });
    assert!(peak < MOST_MEMORY, "{peak} bytes");
}

//! Files of weights from any source: for any content, reading ends without a panic and
//! takes little memory; a decision takes none.

use crate::{
    checkpoint::{content, entries, fixture, zipped},
    clone::root,
    memory::{MOST_MEMORY, allocations, peak},
    support::*,
};

#[test]
fn deciding_allocates_nothing() {
    let file = fixture(&root(), "actor.pt").display().to_string();
    let mut policy = policy(&config(&format!("policy {file}")));
    let seen = Observation {
        cart_position: 0.1,
        cart_velocity: -0.2,
        cos_theta: 0.99,
        sin_theta: 0.1,
        pole_velocity: 0.3,
    };
    let mut sum = 0.0;
    let decide = || sum = (0..1_000).map(|_| policy.act(&seen).0).sum::<f32>();
    assert_eq!(allocations(decide), 0);
    assert!(sum.is_finite());
}

/// A checkpoint with this pickle.
fn with_pickle(pickle: &[u8]) -> Vec<u8> {
    let mut entries = entries(&content(&root(), "actor.pt"));
    entries[0].1 = pickle.to_vec();
    zipped(&entries)
}

/// The error for a file of weights, read in little memory.
fn refused(content: &[u8]) -> String {
    let mut said = String::new();
    let peak = peak(|| said = read_weights(content).expect_err("no policy").to_string());
    assert!(peak < MOST_MEMORY, "{peak} bytes");
    said
}

/// The error for a checkpoint with this pickle.
fn refusal(pickle: &[u8]) -> String {
    refused(&with_pickle(pickle))
}

#[test]
fn pickles_that_are_bombs_are_refused_in_little_memory() {
    let many = |piece: &[u8]| piece.repeat((1 << 18) / piece.len() - 4);
    let program = |parts: &[&[u8]]| parts.concat();
    // Nested tuples.
    assert!(refusal(&program(&[b"\x80\x02N", &many(b"\x85"), b"."])).contains("a tuple"));
    // Each contains the last one twice: two to the power of thousands.
    let doubled = program(&[b"\x80\x02)", &many(b"q\x00h\x00\x86"), b"."]);
    assert!(refusal(&doubled).contains("a tuple"));
    // A dictionary that contains itself.
    assert!(refusal(b"\x80\x02}q\x00X\x01\x00\x00\x00ah\x00s.").contains("\"a\""));
    // Endless marks, and a string longer than the file.
    assert!(refusal(&many(b"(")).contains("ends in the middle"));
    assert!(refusal(b"\x80\x02X\xff\xff\xff\xffab").contains("ends in the middle"));
    // A pickle longer than the limit.
    assert!(refusal(&many(b"N").repeat(5)).contains("longer than"));
}

#[test]
fn a_pickle_of_other_objects_than_tensors_is_refused_by_name() {
    #[rustfmt::skip]
    let cases: [(&[u8], &str); 7] = [
        (b"\x80\x02cos\nsystem\nX\x02\x00\x00\x00ls\x85R.", "\"os.system\""),
        (b"\x80\x04\x8c\x08builtins\x8c\x04eval\x93.", "\"builtins.eval\""),
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

/// A pickle of one tensor under the first name, with this view of its storage.
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
    let square = tensor_pickle(b"K\x00", billion, b"K\x00K\x00\x86");
    let of_actor = |offset: &[u8], strides: &[u8]| tensor_pickle(offset, actor, strides);
    let cases = [
        // With a side of a billion, where every element is the same number.
        (square, "numbers at most"),
        (
            of_actor(b"J\x00\x00\x00\x40", b"K\x05K\x01\x86"),
            "1280 bytes",
        ),
        (
            of_actor(b"K\x00", b"J\x00\x00\x00\x40K\x01\x86"),
            "1280 bytes",
        ),
        (
            of_actor(b"J\xff\xff\xff\xff", b"K\x05K\x01\x86"),
            "-1 for a size",
        ),
        (of_actor(b"K\x00", b"K\x01\x85"), "does not take"),
    ];
    for (pickle, found) in cases {
        let said = refusal(&pickle);
        assert!(said.contains(found), "{said}");
    }
}

#[test]
fn a_storage_much_larger_than_its_tensor_takes_no_more_than_itself() {
    let mut entries = entries(&content(&root(), "actor.pt"));
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
    let mut content = content(&root(), "actor.pt");
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
    assert!(refused(&content).contains("entries"));
}

#[test]
fn a_header_without_end_is_refused_in_little_memory() {
    let entry = br#""a":{"dtype":"F32","shape":[],"data_offsets":[0,0]},"#;
    let header = [b"{".as_slice(), &entry.repeat(200_000)].concat();
    let content = [&(header.len() as u64).to_le_bytes(), &header[..]].concat();
    assert!(refused(&content).contains("header"));
}

//! Files of weights from any source: for any content, reading ends without a panic and
//! takes little memory; a decision takes none.

use crate::{
    checkpoint::{content, entries, fixture, zipped},
    clone::root,
    memory::{MAX_MEMORY, allocations, peak},
    support::*,
};

#[test]
fn deciding_allocates_nothing() {
    let file = fixture(&root(), "actor.pt").display().to_string();
    let mut policy = policy(&file);
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

/// A checkpoint with a pickle of these parts.
fn pickle(parts: &[&[u8]]) -> Vec<u8> {
    let mut entries = entries(&content(&root(), "actor.pt"));
    entries[0].1 = parts.concat();
    zipped(&entries)
}

/// So many of `piece` that they nearly fill the pickle of a checkpoint.
fn many(piece: &[u8]) -> Vec<u8> {
    piece.repeat((1 << 18) / piece.len() - 4)
}

/// A checkpoint of one tensor under the first name, with this view of its storage.
fn tensor(offset: &[u8], shape: &[u8], strides: &[u8]) -> Vec<u8> {
    let head = b"\x80\x02}X\x13\x00\x00\x00actor_mean.0.weight".as_slice();
    let call = b"ctorch._utils\n_rebuild_tensor_v2\n";
    let storage = b"((X\x07\x00\x00\x00storagectorch\nFloatStorage\nX\x01\x00\x00\x000X\x03\x00\x00\x00cpuK\x04tQ";
    pickle(&[head, call, storage, offset, shape, strides, b"\x89}tRs."])
}

/// A checkpoint with entries without end.
fn endless_entries() -> Vec<u8> {
    let mut content = content(&root(), "actor.pt");
    let mut places = content.windows(4);
    let entry = places.position(|bytes| bytes == b"PK\x01\x02");
    let entry = entry.expect("an entry");
    let piece = content[entry..entry + 60].to_vec();
    while content.len() + piece.len() <= LARGEST_FILE as usize {
        let count = 1 + (content.len() / piece.len()) / 2;
        content.splice(entry..entry, piece.repeat(count));
        content.truncate(LARGEST_FILE as usize);
    }
    content
}

/// A safetensors file with a header without end.
fn endless_header() -> Vec<u8> {
    let entry = br#""a":{"dtype":"F32","shape":[],"data_offsets":[0,0]},"#;
    let header = [b"{".as_slice(), &entry.repeat(200_000)].concat();
    [&(header.len() as u64).to_le_bytes(), &header[..]].concat()
}

/// A dictionary with thousands of names, each of a hundred thousand letters.
fn long_names() -> Vec<u8> {
    let (length, count) = (100_000_u32, 30_000);
    let name = [
        b"X".as_slice(),
        &length.to_le_bytes(),
        &b"n".repeat(length as usize),
        b"q\x00N",
    ];
    let more = b"h\x00N".repeat(count);
    pickle(&[b"\x80\x02}(", &name.concat(), &more, b"u."])
}

/// The error for a file of weights, read in little memory.
fn refused(content: &[u8]) -> String {
    let mut said = String::new();
    let peak = peak(|| said = read_weights(content).expect_err("no policy").to_string());
    assert!(peak < MAX_MEMORY, "{said}: {peak} bytes");
    said
}

#[test]
fn bombs_and_tensors_larger_than_their_storage_are_refused_in_little_memory() {
    let (actor, usual) = (b"K\x40K\x05\x86", b"K\x05K\x01\x86");
    let (zero, billion) = (b"K\x00", b"J\x00\x00\x00\x40");
    let square = [billion.as_slice(), billion, b"\x86"].concat();
    #[rustfmt::skip]
    let cases = [
        ("tuples within each other", pickle(&[b"\x80\x02N", &many(b"\x85"), b"."]), "a tuple"),
        // Two to the power of thousands.
        ("doubled", pickle(&[b"\x80\x02)", &many(b"q\x00h\x00\x86"), b"."]), "a tuple"),
        ("in itself", pickle(&[b"\x80\x02}q\x00X\x01\x00\x00\x00ah\x00s."]), "\"a\""),
        ("long names", long_names(), "expected a tensor"),
        ("endless marks", pickle(&[&many(b"(")]), "ends in the middle"),
        ("a long string", pickle(&[b"\x80\x02X\xff\xff\xff\xffab"]), "ends in the middle"),
        ("a long pickle", pickle(&[&many(b"N").repeat(5)]), "longer than"),
        // With a side of a billion, where every element is the same number.
        ("one number everywhere", tensor(zero, &square, b"K\x00K\x00\x86"), "numbers at most"),
        ("a far offset", tensor(billion, actor, usual), "1280 bytes"),
        ("a far step", tensor(zero, actor, b"J\x00\x00\x00\x40K\x01\x86"), "1280 bytes"),
        ("a negative offset", tensor(b"J\xff\xff\xff\xff", actor, usual), "-1 for a size"),
        ("too few steps", tensor(zero, actor, b"K\x01\x85"), "does not take"),
        ("endless entries", endless_entries(), "entries"),
        ("endless header", endless_header(), "header"),
    ];
    for (case, content, part) in cases {
        let said = refused(&content);
        assert!(said.contains(part), "{case}: {said}");
    }
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
    for (program, asked) in cases {
        let said = refused(&pickle(&[program]));
        assert!(said.contains("never code"), "{asked}: {said}");
        assert!(said.contains(asked), "{asked}: {said}");
    }
}

#[test]
fn a_storage_much_larger_than_its_tensor_takes_no_more_than_itself() {
    let mut entries = entries(&content(&root(), "actor.pt"));
    let mut storages = entries.iter_mut();
    let storage = storages.find(|(name, _)| name.ends_with("data/0"));
    storage.expect("a storage").1.resize(15 << 20, 0);
    let content = zipped(&entries);
    assert!(content.len() as u64 <= LARGEST_FILE);
    let peak = peak(|| assert!(read_weights(&content).is_ok()));
    assert!(peak < MAX_MEMORY / 2, "{peak} bytes");
}

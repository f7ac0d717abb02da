//! Checkpoints as `torch.save` writes them, made without PyTorch.

use crate::checkpoint::zipped;

/// A value in a checkpoint.
#[derive(Clone, Debug)]
pub enum Saved {
    /// A tensor of this shape, all zeros.
    Tensor(Vec<usize>),
    Text(String),
    Number,
    List(Vec<Saved>),
    Dict(Vec<(String, Saved)>),
    /// An object of a class, as `module\nname\n`.
    Object(&'static str),
    /// A state dictionary with the names of its layers.
    Module(Vec<(String, Saved)>, Vec<String>),
}

/// Bytes of the one storage of all tensors.
const STORAGE: usize = 64 << 10;

/// A state dictionary of these tensors, such as `actor_mean.0.weight 8x5; global_step; act = tanh`:
/// each with its shape, or else a number or a text.
pub fn state(items: &str) -> Vec<(String, Saved)> {
    items
        .split(';')
        .map(str::trim)
        .filter(|item| !item.is_empty())
        .map(|item| match item.split_once(' ') {
            None => (item, Saved::Number),
            Some((name, text)) if text.starts_with("= ") => {
                (name, Saved::Text(text[2..].to_owned()))
            }
            Some((name, shape)) => {
                let sides = shape.split('x').map(|side| side.parse().expect(item));
                (name, Saved::Tensor(sides.collect()))
            }
        })
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

/// The zip of a checkpoint called `stem`.
pub fn checkpoint(stem: &str, value: &Saved) -> Vec<u8> {
    let entries = [
        ("data.pkl", pickled(value)),
        ("byteorder", b"little".to_vec()),
        ("data/0", vec![0; STORAGE]),
        ("version", b"3\n".to_vec()),
    ]
    .map(|(name, content)| (format!("{stem}/{name}"), content));
    as_torch_writes(zipped(&entries))
}

/// A pickle of protocol 2.
pub fn pickled(value: &Saved) -> Vec<u8> {
    let mut pickle = b"\x80\x02".to_vec();
    put(&mut pickle, value);
    pickle.push(b'.');
    pickle
}

fn put(pickle: &mut Vec<u8>, value: &Saved) {
    match value {
        Saved::Tensor(shape) => put_tensor(pickle, shape),
        Saved::Text(text) => put_text(pickle, text),
        Saved::Number => put_size(pickle, 7),
        Saved::List(items) => {
            pickle.extend(b"](");
            items.iter().for_each(|item| put(pickle, item));
            pickle.push(b'e');
        }
        Saved::Dict(pairs) => put_dict(pickle, pairs),
        Saved::Object(class) => {
            pickle.push(b'c');
            pickle.extend(class.as_bytes());
            pickle.extend(b")\x81");
        }
        Saved::Module(pairs, layers) => {
            pickle.extend(b"ccollections\nOrderedDict\n)R(");
            put_pairs(pickle, pairs);
            pickle.push(b'u');
            let version = || Saved::Dict(vec![("version".to_owned(), Saved::Number)]);
            let layers = layers.iter().map(|layer| (layer.clone(), version()));
            let layers = Saved::Dict(layers.collect());
            put_dict(pickle, &[("_metadata".to_owned(), layers)]);
            pickle.push(b'b');
        }
    }
}

fn put_dict(pickle: &mut Vec<u8>, pairs: &[(String, Saved)]) {
    pickle.extend(b"}(");
    put_pairs(pickle, pairs);
    pickle.push(b'u');
}

fn put_pairs(pickle: &mut Vec<u8>, pairs: &[(String, Saved)]) {
    for (name, value) in pairs {
        put_text(pickle, name);
        put(pickle, value);
    }
}

fn put_tensor(pickle: &mut Vec<u8>, shape: &[usize]) {
    let count: usize = shape.iter().product();
    assert!(4 * count <= STORAGE, "{shape:?}");
    pickle.extend(b"ctorch._utils\n_rebuild_tensor_v2\n((");
    put_text(pickle, "storage");
    pickle.extend(b"ctorch\nFloatStorage\n");
    put_text(pickle, "0");
    put_text(pickle, "cpu");
    put_size(pickle, STORAGE / 4);
    pickle.extend(b"tQ");
    put_size(pickle, 0);
    let strides = (0..shape.len()).map(|axis| shape[axis + 1..].iter().product());
    for sizes in [shape.to_vec(), strides.collect()] {
        pickle.push(b'(');
        sizes.iter().for_each(|size| put_size(pickle, *size));
        pickle.push(b't');
    }
    pickle.extend(b"\x89ccollections\nOrderedDict\n)RtR");
}

fn put_text(pickle: &mut Vec<u8>, text: &str) {
    pickle.push(b'X');
    pickle.extend((text.len() as u32).to_le_bytes());
    pickle.extend(text.as_bytes());
}

fn put_size(pickle: &mut Vec<u8>, size: usize) {
    pickle.push(b'J');
    pickle.extend((size as i32).to_le_bytes());
}

/// The zip with the records that PyTorch writes between the table of contents and its end, also
/// where the zip is small.
pub fn as_torch_writes(mut zip: Vec<u8>) -> Vec<u8> {
    let end = zip.split_off(zip.len() - 22);
    assert!(end.starts_with(b"PK\x05\x06"), "{end:?}");
    let number = |at: usize| u32::from_le_bytes(end[at..at + 4].try_into().expect("four bytes"));
    let entries = u64::from(u16::from_le_bytes([end[10], end[11]]));
    let (size, offset) = (u64::from(number(12)), u64::from(number(16)));
    let record = zip.len() as u64;
    zip.extend(b"PK\x06\x06");
    zip.extend(44_u64.to_le_bytes());
    zip.extend([0x1e, 0x03, 0x2d, 0x00]); // Versions of the writer and for the reader.
    zip.extend([0; 8]); // Numbers of disks.
    for number in [entries, entries, size, offset] {
        zip.extend(number.to_le_bytes());
    }
    zip.extend(b"PK\x06\x07\0\0\0\0");
    zip.extend(record.to_le_bytes());
    zip.extend(1_u32.to_le_bytes());
    zip.extend(end);
    zip
}

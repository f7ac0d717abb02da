//! Files of weights: loaded, or refused in one line, in little time and memory.

use std::time::{Duration, Instant};

use rand::{
    Rng,
    seq::{IndexedMutRandom, IndexedRandom},
};
use ratelab_cart_pole::policy::read_weights;
use serde_json::{Value, json};

use crate::{
    cases::{RandomSource, chance, mutate, pick, run},
    checkpoint::{content, entries, zipped},
    memory::{MAX_MEMORY, peak},
    root,
};

/// Time limit for reading a file, on a busy machine.
const MAX_TIME: Duration = Duration::from_secs(10);

/// Instructions and numbers with special meanings in pickles and headers.
const SPICE: &[u8] = b"(.)0NRbcdehijlopqrstu}]QXKMJGPI\x80\x81\x85\x86\x87\x88\x8a\x8c\x93\x94\x95\x00\x01\xff{}\":,9";

const CHECKPOINTS: &[&str] = &["actor.pt", "parameters.pt", "half.pt", "asks.pt"];

#[test]
fn weights() {
    run("weights", 2_000, |random, _| {
        let file = hurt(random);
        let begin = Instant::now();
        let peak = peak(|| {
            if let Err(error) = read_weights(&file) {
                let error = error.to_string();
                assert!(!error.contains(char::is_control), "{error:?}");
            }
        });
        assert!(peak < MAX_MEMORY, "{peak} bytes of memory");
        assert!(begin.elapsed() < MAX_TIME, "{:?}", begin.elapsed());
    });
}

/// A file damaged in one of several ways.
fn hurt(random: &mut RandomSource) -> Vec<u8> {
    match random.random_range(0..8) {
        0 => mutated(content(root(), pick(random, CHECKPOINTS)), random),
        1..=4 => checkpoint(random),
        5 => spliced(random),
        _ => safetensors(random),
    }
}

fn mutated(mut bytes: Vec<u8>, random: &mut RandomSource) -> Vec<u8> {
    mutate(&mut bytes, SPICE, random);
    bytes
}

/// A valid zip with an invalid entry: mostly its first, the pickle.
fn checkpoint(random: &mut RandomSource) -> Vec<u8> {
    let mut entries = entries(&content(root(), pick(random, CHECKPOINTS)));
    let victim = if chance(random, 75) {
        0
    } else {
        random.random_range(0..entries.len())
    };
    match random.random_range(0..8) {
        0 => drop(entries.remove(victim)),
        1 => entries.push(entries[victim].clone()),
        2 => {
            let length = random.random_range(0..1 << 16);
            entries[victim].1.resize(length, 0);
        }
        3 => mutate_name(&mut entries[victim].0, random),
        _ => mutate(&mut entries[victim].1, SPICE, random),
    }
    zipped(&entries)
}

fn mutate_name(name: &mut String, random: &mut RandomSource) {
    let bytes = mutated(std::mem::take(name).into_bytes(), random);
    *name = String::from_utf8_lossy(&bytes).into_owned();
}

/// The beginning of one file and the end of another.
fn spliced(random: &mut RandomSource) -> Vec<u8> {
    let [mut one, other] = [(); 2].map(|()| content(root(), pick(random, CHECKPOINTS)));
    one.truncate(random.random_range(0..=one.len()));
    one.extend(&other[random.random_range(0..=other.len())..]);
    one
}

/// A safetensors file with a damaged or false header.
fn safetensors(random: &mut RandomSource) -> Vec<u8> {
    let whole = content(root(), "actor.safetensors");
    let (length, rest) = whole.split_first_chunk().expect("a length");
    let length = u64::from_le_bytes(*length);
    let (header, numbers) = rest.split_at(length as usize);
    let header = match random.random_range(0..3) {
        0 => mutated(header.to_vec(), random),
        _ => lie(header, random),
    };
    let length = match random.random_range(0..10) {
        0 => u64::MAX >> random.random_range(0..64),
        1 => length,
        _ => header.len() as u64,
    };
    let numbers = &numbers[..numbers.len() - if chance(random, 20) { 4 } else { 0 }];
    [&length.to_le_bytes(), &header[..], numbers].concat()
}

/// A header with one property of a tensor changed.
fn lie(header: &[u8], random: &mut RandomSource) -> Vec<u8> {
    let mut header: Value = serde_json::from_slice(header).expect("JSON");
    let tensors = header.as_object_mut().expect("tensors");
    let names: Vec<_> = tensors.keys().cloned().collect();
    let name = names.choose(random).expect("a tensor");
    let number = random.next_u64() >> random.random_range(0..64);
    let dtypes = [
        "F16", "BF16", "F64", "I8", "BOOL", "U64", "F8_E4M3", "", "f32",
    ];
    match random.random_range(0..6) {
        0 => drop(tensors.remove(name)),
        1 => drop(tensors.insert(format!("{name}\u{1b}"), tensors[name].clone())),
        2 => tensors[name]["dtype"] = json!(pick(random, &dtypes)),
        3 => tensors[name] = json!(number),
        field => {
            let field = if field == 4 { "shape" } else { "data_offsets" };
            let numbers = tensors[name][field].as_array_mut();
            if let Some(place) = numbers.and_then(|numbers| numbers.choose_mut(random)) {
                *place = json!(number);
            }
        }
    }
    serde_json::to_vec(&header).expect("JSON")
}

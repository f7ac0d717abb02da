//! An ONNX graph with its weights in a file of their own: they come from the folder of the graph
//! alone, they are pinned with it, and what is pinned is what runs.

use std::{fs, os::unix::fs::symlink, path::Path};

use tempfile::TempDir;

use crate::{support::*, table::rows};

/// The weights of the graph: its action is the sum of products with the observation.
const WEIGHTS: [f32; 5] = [0.5, -1.0, 2.0, 0.25, 4.0];

/// A field of a message in the wire format of protocol buffers.
fn field(number: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len()).expect("a short message");
    let length = [length as u8 | 0x80, (length >> 7) as u8];
    let number = u16::from(number) << 3 | 2;
    let tag = [number as u8 | 0x80, (number >> 7) as u8];
    [&tag, &length, content].concat()
}

fn text(number: u8, text: &str) -> Vec<u8> {
    field(number, text.as_bytes())
}

fn varint(number: u8, value: u8) -> Vec<u8> {
    vec![number << 3, value]
}

fn message(number: u8, fields: &[Vec<u8>]) -> Vec<u8> {
    field(number, &fields.concat())
}

/// An input or output of one row.
fn row(number: u8, name: &str, columns: u8) -> Vec<u8> {
    let sides = [1, columns].map(|side| message(1, &[varint(1, side)]));
    let tensor = message(1, &[varint(1, 1), message(2, &sides)]);
    message(number, &[text(1, name), message(2, &[tensor])])
}

/// Where the weights are in the graph.
#[derive(Clone, Copy)]
enum Place {
    Initializer,
    Constant,
}

/// A graph whose weights are in the file at `location`, with these other texts about their place.
fn graph(location: &str, about: &[(&str, &str)], place: Place) -> Vec<u8> {
    let pairs = [("location", location)]
        .into_iter()
        .chain(about.iter().copied());
    let pairs = pairs.map(|(key, value)| message(13, &[text(1, key), text(2, value)]));
    let mut tensor = vec![varint(1, 5), varint(1, 1), varint(2, 1), text(8, "W")];
    tensor.extend(pairs);
    tensor.push(varint(14, 1));
    let weights = match place {
        Place::Initializer => message(5, &tensor),
        Place::Constant => {
            let value = message(
                5,
                &[text(1, "value"), message(5, &tensor), vec![0xa0, 1, 4]],
            );
            message(1, &[text(2, "W"), text(4, "Constant"), value])
        }
    };
    let product = [
        text(1, "obs"),
        text(1, "W"),
        text(2, "action"),
        text(4, "MatMul"),
    ];
    let graph = [
        weights,
        message(1, &product),
        text(2, "g"),
        row(11, "obs", 5),
        row(12, "action", 1),
    ];
    [
        varint(1, 8),
        message(7, &graph),
        message(8, &[varint(2, 17)]),
    ]
    .concat()
}

fn bytes(weights: &[f32]) -> Vec<u8> {
    weights
        .iter()
        .flat_map(|weight| weight.to_le_bytes())
        .collect()
}

/// The error for the policy in a file with this pin, without the file; none if all that is missing
/// is the runtime.
fn error(path: &Path, pin: Option<Digest>) -> Option<String> {
    let path = path.to_str().expect("UTF-8");
    let pin = pin.map_or(String::new(), |pin| format!("@sha256:{pin}"));
    let spec: PolicySpec = format!("{path}{pin}").parse().expect("a policy");
    let error = spec.load().err()?.to_string();
    assert!(!error.contains(char::is_control), "{error}");
    let error = error.strip_prefix(path).expect("the file").to_owned();
    Some(error).filter(|error| !error.contains("it takes the ONNX Runtime"))
}

#[test]
fn weights_are_read_from_the_folder_of_the_graph_alone() {
    let folder = TempDir::new().expect("a folder");
    let (inside, outside) = (folder.path().join("in"), folder.path().join("out"));
    for made in [&inside, &outside, &inside.join("sub")] {
        fs::create_dir(made).expect("made");
    }
    let whole = bytes(&WEIGHTS);
    for good in [
        &inside.join("w.data"),
        &inside.join("sub/w"),
        &outside.join("w"),
    ] {
        fs::write(good, &whole).expect("written");
    }
    fs::write(inside.join("short"), &whole[..12]).expect("written");
    symlink("w.data", inside.join("link")).expect("linked");
    symlink("../out/w", inside.join("away")).expect("linked");
    symlink("../out", inside.join("folder")).expect("linked");
    let huge = fs::File::create(inside.join("huge")).expect("made");
    huge.set_len(1 << 40).expect("a terabyte of nothing");
    let absolute = outside.join("w").display().to_string();
    let path = inside.join("policy.onnx");
    for place in [Place::Initializer, Place::Constant] {
        for [location, found] in rows(
            "w.data      | right
             ./w.data    | right
             sub/w       | right
             link        | right
             sub/../w.data | read from the folder of the graph alone
             ../out/w    | its weights are in \"../out/w\", and they are read from the folder
             ABSOLUTE    | read from the folder of the graph alone
             away        | read from the folder of the graph alone
             folder/w    | read from the folder of the graph alone
             none        | in \"none\", which is missing: keep it beside the graph
             sub         | in \"sub\", which is a directory
             short       | expected bytes 0 to 20 of \"short\" for \"W\", found 12 bytes
             huge        | 16777216 bytes at most",
        ) {
            let location = location.replace("ABSOLUTE", &absolute);
            let graph = graph(&location, &[("offset", "0"), ("length", "20")], place);
            fs::write(&path, graph).expect("written");
            let error = error(&path, None).unwrap_or("right".to_owned());
            assert!(error.contains(&found), "{location}: {error}");
        }
    }
    for about in [("offset", "-1"), ("length", "x")] {
        fs::write(&path, graph("w.data", &[about], Place::Initializer)).expect("written");
        assert!(error(&path, None).is_some_and(|error| error.contains("damaged")));
    }
    let far = [("offset", "18446744073709551615"), ("length", "2")];
    fs::write(&path, graph("w.data", &far, Place::Initializer)).expect("written");
    assert!(error(&path, None).is_some_and(|error| error.contains("do not belong together")));
}

#[test]
fn a_graph_that_is_a_link_has_its_weights_beside_its_name_or_its_target() {
    let folder = TempDir::new().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    for made in ["blobs", "named", "alone", "far"] {
        fs::create_dir(at(made)).expect("made");
    }
    let graph = graph("p.onnx.data", &[], Place::Initializer);
    // As the cache of Hugging Face has them: each file is a link to one of another name.
    fs::write(at("blobs/aa"), &graph).expect("written");
    fs::write(at("blobs/bb"), bytes(&WEIGHTS)).expect("written");
    symlink("../blobs/aa", at("named/p.onnx")).expect("linked");
    assert!(error(&at("named/p.onnx"), None).is_some_and(|error| error.contains("is missing")));
    symlink("../far/w", at("named/p.onnx.data")).expect("linked");
    fs::write(at("far/w"), bytes(&WEIGHTS)).expect("written");
    let outside = "read from the folder of the graph alone";
    assert!(error(&at("named/p.onnx"), None).is_some_and(|error| error.contains(outside)));
    fs::remove_file(at("named/p.onnx.data")).expect("removed");
    symlink("../blobs/bb", at("named/p.onnx.data")).expect("linked");
    assert_eq!(error(&at("named/p.onnx"), None), None);
    // A link to the graph alone.
    fs::copy(at("blobs/bb"), at("blobs/p.onnx.data")).expect("copied");
    symlink("../blobs/aa", at("alone/p.onnx")).expect("linked");
    assert_eq!(error(&at("alone/p.onnx"), None), None);
}

#[test]
fn a_pin_covers_the_graph_and_its_weights_and_of_a_graph_alone_it_is_that_of_the_file() {
    let folder = TempDir::new().expect("a folder");
    let (path, data) = (
        folder.path().join("p.onnx"),
        folder.path().join("p.onnx.data"),
    );
    let graph = graph("p.onnx.data", &[], Place::Initializer);
    fs::write(&path, &graph).expect("written");
    fs::write(&data, bytes(&WEIGHTS)).expect("written");
    // As the shell computes it: sha256sum p.onnx p.onnx.data | cut -d' ' -f1 | sha256sum
    let parts = [&graph, &bytes(&WEIGHTS)].map(|part| format!("{}\n", Digest::new(part)));
    let pin = Digest::new(parts.concat().as_bytes());
    assert_eq!(error(&path, Some(pin)), None);
    for (changed, content) in [
        (&data, bytes(&[0.0; 5])),
        (&path, [&graph[..], b"\x10\0"].concat()),
    ] {
        let before = fs::read(changed).expect("there");
        fs::write(changed, content).expect("written");
        let error = error(&path, Some(pin)).expect("another policy");
        assert!(
            error.contains("with the SHA-256") && error.contains("another one"),
            "{error}"
        );
        fs::write(changed, before).expect("written");
    }
    assert_eq!(error(&path, Some(pin)), None);
    let alone = [varint(1, 8), message(7, &[row(11, "obs", 5)])].concat();
    fs::write(&path, &alone).expect("written");
    let another = error(&path, Some(Digest::new(b""))).expect("another");
    assert!(
        another.ends_with(&format!("another one: {}", Digest::new(&alone))),
        "{another}"
    );
}

#[test]
fn a_graph_with_any_byte_changed_is_read_to_its_end_or_refused() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("p.onnx");
    fs::write(folder.path().join("p.data"), bytes(&WEIGHTS)).expect("written");
    let about = [("offset", "0"), ("length", "20")];
    // With the pin of nothing no graph reaches the runtime.
    let nothing = Some(Digest::new(b""));
    for place in [Place::Initializer, Place::Constant] {
        let whole = graph("p.data", &about, place);
        for at in 1..whole.len() {
            for byte in [0x00, 0x7f, 0x80, 0xff, whole[at] ^ 1] {
                let mut changed = whole.clone();
                changed[at] = byte;
                fs::write(&path, &changed).expect("written");
                assert!(error(&path, nothing).is_some(), "{changed:?}");
            }
            fs::write(&path, &whole[..at]).expect("written");
            assert!(error(&path, nothing).is_some(), "{at}");
        }
    }
    // Many tensors of the same bytes are more than there are, and messages may be deep.
    let size = 8 << 20;
    fs::write(folder.path().join("p.data"), vec![0; size]).expect("written");
    let tensor = message(13, &[text(1, "location"), text(2, "p.data")]);
    let tensors = message(5, &[tensor, varint(14, 1)]).repeat(3);
    fs::write(&path, [varint(1, 8), field(7, &tensors)].concat()).expect("written");
    let error_of = || error(&path, nothing).expect("refused");
    assert!(error_of().contains("bytes at most"), "{}", error_of());
    let deep = (0..400).fold(Vec::new(), |inner, level| match level % 3 {
        0 => field(1, &inner),
        1 => field(6, &inner),
        _ => field(5, &inner),
    });
    fs::write(&path, [varint(1, 8), field(7, &deep)].concat()).expect("written");
    assert!(error_of().contains("damaged"), "{}", error_of());
}

#[test]
fn the_weights_that_run_are_those_beside_the_graph() {
    if !RUNS_ONNX || std::env::var_os("ORT_DYLIB_PATH").is_none() {
        eprintln!("SKIPPED: set ORT_DYLIB_PATH to an ONNX Runtime library");
        return;
    }
    let folder = TempDir::new().expect("a folder");
    let seen = Observation {
        cart_position: 1.0,
        cart_velocity: 2.0,
        cos_theta: 3.0,
        sin_theta: 4.0,
        pole_velocity: 5.0,
    };
    // 1.0 is in front of the weights.
    let data = bytes(&[&[1.0], &WEIGHTS[..], &[7.0]].concat());
    fs::write(folder.path().join("p.data"), data).expect("written");
    for place in [Place::Initializer, Place::Constant] {
        let path = folder.path().join("p.onnx");
        let about = [("offset", "4"), ("length", "20")];
        fs::write(&path, graph("p.data", &about, place)).expect("written");
        let mut policy = policy(path.to_str().expect("UTF-8"));
        assert_eq!(policy.act(&seen).0, 0.5 - 2.0 + 6.0 + 1.0 + 20.0);
    }
}

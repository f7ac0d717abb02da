//! Values for options: valid ones, the last accepted, the first refused, and random text.

use std::{ffi::OsString, os::unix::ffi::OsStringExt};

use rand::Rng;

use crate::cases::{RandomSource, pick_from};

/// A value for the placeholder `name` in the help: valid, invalid, or not even text.
pub fn value(name: &str, random: &mut RandomSource) -> OsString {
    let known = if ["DIR", "BAG"].contains(&name) {
        "FILE"
    } else {
        name
    };
    let Some([_, good, others]) = values().find(|row| row[0] == known) else {
        panic!("no values are known for what help calls {name}: add some");
    };
    match random.random_range(0..100) {
        0..75 => pick_from(random, &good).into(),
        75..98 => pick_from(random, &others).into(),
        98 => OsString::from_vec(vec![b'a', 0xff, 0x1b]),
        _ => "x".repeat(random.next_u32() as usize % 5_000).into(),
    }
}

/// The values for each placeholder in the help.
fn values() -> impl Iterator<Item = [String; 3]> {
    let blocks = include_str!("values.txt").split("\n\n").skip(1);
    blocks.map(|block| {
        let lines = block.trim_matches('\n').split('\n').map(unescaped);
        let lines: Vec<_> = lines.collect();
        lines.try_into().expect("three lines")
    })
}

/// `text` with its characters of control.
fn unescaped(text: &str) -> String {
    let mut parts = text.split(r"\u{");
    let first = parts.next().unwrap_or_default().replace(r"\n", "\n");
    parts.fold(first, |text, part| {
        let (code, rest) = part.split_once('}').expect("a code");
        let code = u32::from_str_radix(code, 16).ok().and_then(char::from_u32);
        format!(
            "{text}{}{}",
            code.expect("a character"),
            rest.replace(r"\n", "\n")
        )
    })
}

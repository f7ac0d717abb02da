//! Knobs files: accepted, or refused with the line, by the library and the command alike.

use std::{fs, sync::Arc};

use rand::Rng;
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment};
use tempfile::tempdir;

use crate::{
    cases::{RandomSource, chance, mutate, pick, run},
    program::{does, stderr},
};

/// Times, valid and invalid, separated by `|` like the words below.
const TIMES: &str = "0|2.5|0.000000001|1e-9|4503599.627370495|1e3|-0|-1|NaN|inf|1e300|\
    18446744073.709551615|1e11|.5|+1|";

const NAMES: &str = "control-hz|sensor_hz|queue-depth|rate policy|depth /obs|queue_depth|policy|\
    send policy|CONTROL-HZ|policy-hz|rate planner";

const VALUES: &str = "10|7.5|33.333333|0.001|10000|1e3|0.0005|10000.5|0|-1|NaN|1|1000000|1000001|\
    1.5|lqr|scripted|random|none.pt|my policy.pt|a#b.pt";

/// Between words and around lines.
const SPACES: &[&str] = &[" ", "  ", "\t", "\u{a0}", "", " # ", "\u{b}", "\u{3000}"];

const ENDS: &[&str] = &["\n", "\n", "\r\n", "\n\n", "\r", "", "# what follows\n"];

/// Bytes that a mutation inserts.
const SPICE: &[u8] = b"0123456789.-+eE#_ \t\n\r\0\x1b\x7f\xc2\x85\xe2\x80\xae\xef\xbb\xbf\"'\\:";

fn file(random: &mut RandomSource) -> Vec<u8> {
    let mut text = String::new();
    for _ in 0..random.random_range(0..6) {
        for words in [TIMES, NAMES, VALUES] {
            // The first half is valid: most lines should be.
            let words: Vec<_> = words.split('|').collect();
            let good = words.len() / 2;
            let words = if chance(random, 85) {
                &words[..good]
            } else {
                &words[..]
            };
            text += pick(random, words);
            text += if chance(random, 80) {
                " "
            } else {
                pick(random, SPACES)
            };
        }
        text += pick(random, ENDS);
    }
    let mut bytes = text.into_bytes();
    if chance(random, 40) {
        mutate(&mut bytes, SPICE, random);
    }
    bytes
}

/// Whether the library takes the knobs in `text` for a run, or the line that it refuses.
fn accepts(text: &str) -> Result<bool, String> {
    let knobs = CartPole::KNOBS.parse_list(text).map_err(|error| {
        let error = error.to_string();
        let line = error.split(": ").next().unwrap_or_default();
        let number = line.strip_prefix("line ").and_then(|n| n.parse().ok());
        let lines = 1..=text.lines().count();
        assert!(
            number.is_some_and(|n: usize| lines.contains(&n)),
            "no line: {error}"
        );
        line.to_owned()
    })?;
    let config = Config {
        knobs,
        ..Config::default()
    };
    Ok(Experiment::new(Arc::new(CartPole::default()), &config).is_ok())
}

#[test]
fn knobs() {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join("turns.knobs");
    run("knobs", 120, |random, note| {
        let bytes = file(random);
        *note = format!("{:?}", String::from_utf8_lossy(&bytes));
        fs::write(&path, &bytes).expect("written");
        let line = "run --clock virtual --duration-s 0.001 --knobs turns.knobs";
        let output = does(line, folder.path());
        let (accepted, said) = (output.status.success(), stderr(&output));
        match String::from_utf8(bytes).map(|text| accepts(&text)) {
            Ok(Ok(expected)) => assert_eq!(accepted, expected, "{said}"),
            Ok(Err(line)) => assert!(!accepted && said.contains(&line), "{line}: {said}"),
            Err(_) => assert!(!accepted, "it is no text"),
        }
    });
}

//! Knobs files: parsed, or refused with the line, with the same result by the library and
//! the command; printed knobs parse again.

use std::{fs, sync::Arc};

use rand::Rng;
use ratelab::TimedKnob;
use ratelab_cart_pole::CartPole;
use ratelab_study::experiment::{Config, Experiment};
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

#[test]
fn knobs() {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join("turns.knobs");
    run("knobs", 120, |random, note| {
        let bytes = file(random);
        *note = format!("{:?}", String::from_utf8_lossy(&bytes));
        // The library alone is fast.
        for _ in 0..100 {
            let _ = check(&String::from_utf8_lossy(&file(random)));
        }
        fs::write(&path, &bytes).expect("written");
        let line = "run --clock virtual --duration-s 0.001 --knobs turns.knobs";
        let output = does(line, folder.path());
        let text = String::from_utf8(bytes);
        let read = text.as_deref().map(check);
        let (accepted, said) = (output.status.success(), stderr(&output));
        let Ok(Ok(knobs)) = read else {
            assert!(!accepted, "only the command accepts it");
            let line = read.ok().and_then(Result::err);
            assert!(said.contains(&line.unwrap_or_default()), "{said}");
            return;
        };
        let config = Config {
            knobs,
            ..Config::default()
        };
        let experiment = Experiment::new(Arc::new(CartPole::default()), &config);
        assert_eq!(accepted, experiment.is_ok(), "{said}");
    });
}

/// The knobs in `text`, or the refused line, as the error names it.
fn check(text: &str) -> Result<Vec<TimedKnob>, String> {
    let knobs = CartPole::KNOBS.parse_list(text).map_err(|error| {
        let error = error.to_string();
        let line = error.split(": ").next().unwrap_or_default();
        let number = line
            .strip_prefix("line ")
            .and_then(|number| number.parse().ok());
        let lines = 1..=text.lines().count();
        assert!(
            number.is_some_and(|n: usize| lines.contains(&n)),
            "no line: {error}"
        );
        assert!(!error.contains(char::is_control), "{error:?}");
        line.to_owned()
    })?;
    let printed = CartPole::KNOBS.lines(&knobs).join("\n");
    assert_eq!(
        CartPole::KNOBS.parse_list(&printed).as_ref(),
        Ok(&knobs),
        "printed {printed:?}"
    );
    Ok(knobs)
}

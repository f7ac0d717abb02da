//! Numbered cases: each depends on its number alone, so that a failed one can be
//! repeated.

use std::{
    any::Any,
    env,
    panic::{AssertUnwindSafe, catch_unwind},
    time::{Duration, Instant},
};

use rand::{Rng, RngCore, seq::IndexedRandom};
use ratelab_cart_pole::generator;

/// Number of the first case; without [`SECONDS`] the only one.
const SEED: &str = "RATELAB_FUZZ_SEED";

/// Time during which each target runs new cases (s), however many these are.
const SECONDS: &str = "RATELAB_FUZZ_S";

/// Number of failures after which a target ends.
const ENOUGH: usize = 20;

/// The source of random numbers for a case.
pub type RandomSource = dyn RngCore;

/// Runs the cases of `target`: `usual` of them unless the environment sets something
/// else. A case records its input.
///
/// # Panics
/// If a case does, with the numbers of all failed cases.
pub fn run(target: &str, usual: u64, case: impl Fn(&mut RandomSource, &mut String)) {
    let (seed, seconds) = (setting(SEED), setting(SECONDS));
    let first = seed.unwrap_or(0);
    let count = if seed.is_some() { 1 } else { usual };
    let begin = Instant::now();
    let more = |number: u64| match seconds {
        Some(seconds) => begin.elapsed() < Duration::from_secs(seconds),
        None => number - first < count,
    };
    let mut failures = Vec::new();
    let mut number = first;
    while more(number) && failures.len() < ENOUGH {
        let (mut random, mut note) = (generator(&[number]), String::new());
        let ended = catch_unwind(AssertUnwindSafe(|| case(&mut random, &mut note)));
        if let Err(panic) = ended {
            let why = message(&*panic);
            failures.push(format!("{SEED}={number}: {note}: {why}"));
        }
        number += 1;
    }
    println!(
        "{target}: {} cases in {:.1?}",
        number - first,
        begin.elapsed()
    );
    assert!(
        failures.is_empty(),
        "{target}: {} of {} cases failed:\n{}",
        failures.len(),
        number - first,
        failures.join("\n")
    );
}

fn setting(name: &str) -> Option<u64> {
    let value = env::var(name).ok()?;
    let number = value.parse();
    Some(number.unwrap_or_else(|_| panic!("{name}={value}: expected a whole number")))
}

fn message(panic: &dyn Any) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or(panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("a panic without a message")
}

/// One of `values`.
pub fn pick<'a, T: ?Sized>(random: &mut RandomSource, values: &[&'a T]) -> &'a T {
    values.choose(random).expect("a value")
}

/// One of the values in `list`, which `|` separates.
pub fn pick_from<'a>(random: &mut RandomSource, list: &'a str) -> &'a str {
    let values: Vec<_> = list.split('|').collect();
    pick(random, &values)
}

/// Returns true in `percent` of all cases.
pub fn chance(random: &mut RandomSource, percent: u32) -> bool {
    random.random_ratio(percent, 100)
}

/// Makes one to eight small changes to `content`, with pieces of `spice`.
pub fn mutate(content: &mut Vec<u8>, spice: &[u8], random: &mut RandomSource) {
    for _ in 0..random.random_range(1..=8) {
        let at = random.random_range(0..=content.len());
        let end = |random: &mut RandomSource, most: usize| {
            (at + random.random_range(0..most)).min(content.len())
        };
        match random.random_range(0..6) {
            0 if at < content.len() => content[at] ^= 1 << random.random_range(0..8),
            1 if at < content.len() => content[at] = *spice.choose(random).expect("spice"),
            2 => content.insert(at, *spice.choose(random).expect("spice")),
            3 if chance(random, 30) => content.truncate(at),
            4 => {
                let end = end(random, 64);
                content.drain(at..end);
            }
            _ => {
                let end = end(random, 256);
                let piece = content[at..end].to_vec();
                let to = random.random_range(0..=content.len());
                content.splice(to..to, piece);
            }
        }
    }
}

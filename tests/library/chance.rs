//! The course's start of a seed.

use rand_pcg::{Pcg64, rand_core::RngCore};

use crate::support::*;

/// Four numbers of 64 bits, in hexadecimal.
fn words(field: &str) -> [u64; 4] {
    let words = field.split(',');
    let words = words.map(|word| u64::from_str_radix(word, 16).expect("hexadecimal"));
    words.collect::<Vec<_>>().try_into().expect("four")
}

#[test]
fn seeds_and_starts_match_numpy_below_and_above_32_bits() {
    let lines = include_str!("../golden/seeds.txt").lines();
    assert!(lines.clone().count() > 10);
    for line in lines {
        let fields = fields(line);
        let seed = fields["seed"].parse().expect("a seed");
        let [a, b, c, d] = words(fields["words"]).map(u128::from);
        assert_eq!(
            generator(&[seed]),
            Pcg64::new(a << 64 | b, c << 64 | d),
            "{line}"
        );
        let plant = Plant::new(seed).expect("plant");
        let ([x, angle], [x_velocity, angle_velocity]) = (plant.qpos(), plant.qvel());
        let drawn = [x, angle, x_velocity, angle_velocity].map(f64::to_bits);
        assert_eq!(drawn, words(fields["uniforms"]), "{line}");
    }
}

#[test]
fn every_word_of_entropy_changes_the_stream() {
    let draw = |entropy: &[u64]| generator(entropy).next_u64();
    // More than the pool of four words of 32 bits holds.
    let wide = u64::MAX;
    assert_ne!(draw(&[wide, wide, 1]), draw(&[wide, wide, 2]));
    assert_ne!(draw(&[0]), draw(&[0, 1]));
}

//! Random numbers: what a draw depends on, the distribution of draws, and the course's start of a
//! seed.

use rand_pcg::{Pcg64, rand_core::RngCore};

use crate::support::*;

#[test]
fn draws_depend_on_every_part_of_their_purpose() {
    let draws = [
        (0, "takes", "policy", 0),
        (0, "takes", "policy", 1),
        (1, "takes", "policy", 0),
        (0, "wakes", "policy", 0),
        (0, "takes", "sensor", 0),
    ];
    let draws = draws.map(|(seed, what, name, number)| {
        let chance = Chance { seed, what, name };
        chance.uniform(number)
    });
    for (index, draw) in draws.iter().enumerate() {
        assert!((0.0..1.0).contains(draw));
        assert!(!draws[..index].contains(draw));
    }
}

#[test]
fn the_normal_quantile_matches_the_published_checks_of_its_algorithm() {
    // Values from the article; the last one is in the far tail.
    for (p, z) in [
        (0.25, -0.674_489_750_196_081_7),
        (0.001, -3.090_232_306_167_814),
        (1e-20, -9.262_340_089_798_408),
    ] {
        let got = normal_quantile(p);
        assert!((got - z).abs() <= 1e-15 * f64::abs(z), "{p}: {got}");
    }
    assert_eq!(normal_quantile(0.99), 2.326_347_874_040_840_8);
    assert_eq!(normal_quantile(0.5), 0.0);
}

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

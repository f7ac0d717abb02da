//! Random numbers: what a draw depends on, and the distribution of draws.

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

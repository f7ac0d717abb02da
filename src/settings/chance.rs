//! Reproducible chance: every draw depends only on the seed of the run and on its
//! purpose.

use std::fmt::Display;

use sha2::{Digest as _, Sha256};

/// The draws of one kind for one node or topic.
///
/// A draw is a pure function, so changing one knob changes no other draw, and a run can
/// be repeated from any part of its log.
#[derive(Clone, Copy, Debug)]
pub struct Chance<'a> {
    /// Seed of the run.
    pub seed: u64,
    /// Kind of draw, such as `takes`.
    pub what: &'a str,
    /// Name of the node or topic.
    pub name: &'a str,
}

impl Chance<'_> {
    /// Draw number `n`, uniform in 0..1: 53 bits of the SHA-256 of seed, kind, name and
    /// number.
    pub fn uniform(&self, n: impl Display) -> f64 {
        let Self { seed, what, name } = self;
        let digest = Sha256::digest(format!("{seed} {what} {name} {n}"));
        let word = digest
            .iter()
            .take(8)
            .rev()
            .fold(0, |word: u64, byte| word << 8 | u64::from(*byte));
        (word >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Draw number `n` of a standard normal distribution: the quantile of the uniform draw,
    /// zero for the lowest one.
    pub fn normal(&self, n: impl Display) -> f64 {
        match self.uniform(n) {
            0.0 => 0.0,
            u => normal_quantile(u),
        }
    }
}

/// Returns the standard normal quantile of a probability `p` between 0 and 1, by Wichura's
/// algorithm AS 241 (PPND16), accurate to about one part in 10¹⁶.
pub(crate) fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * polynomial(&CENTRE.0, r) / polynomial(&CENTRE.1, r);
    }
    let r = (-(if q < 0.0 { p } else { 1.0 - p }).ln()).sqrt();
    let ((numerator, denominator), r) = if r <= 5.0 {
        (&SIDES, r - 1.6)
    } else {
        (&TAILS, r - 5.0)
    };
    (polynomial(numerator, r) / polynomial(denominator, r)).copysign(q)
}

/// Evaluates a polynomial by Horner's rule; the coefficient of the highest power comes
/// first.
fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    let [first, others @ ..] = coefficients;
    others
        .iter()
        .fold(*first, |sum, coefficient| sum * x + coefficient)
}

/// Numerator and denominator of a rational approximation.
type Ratio = ([f64; 8], [f64; 8]);

#[expect(clippy::excessive_precision, reason = "as published")]
const CENTRE: Ratio = (
    [
        2.509_080_928_730_122_672_7e3,
        3.343_057_558_358_812_810_5e4,
        6.726_577_092_700_870_085_3e4,
        4.592_195_393_154_987_145_7e4,
        1.373_169_376_550_946_112_5e4,
        1.971_590_950_306_551_442_7e3,
        1.331_416_678_917_843_774_5e2,
        3.387_132_872_796_366_608,
    ],
    [
        5.226_495_278_852_854_561e3,
        2.872_908_573_572_194_267_4e4,
        3.930_789_580_009_271_061e4,
        2.121_379_430_158_659_586_7e4,
        5.394_196_021_424_751_107_7e3,
        6.871_870_074_920_579_083e2,
        4.231_333_070_160_091_125_2e1,
        1.0,
    ],
);

#[expect(clippy::excessive_precision, reason = "as published")]
const SIDES: Ratio = (
    [
        7.745_450_142_783_414_076_4e-4,
        2.272_384_498_926_918_458_33e-2,
        2.417_807_251_774_506_117_7e-1,
        1.270_458_252_452_368_382_58,
        3.647_848_324_763_204_605_04,
        5.769_497_221_460_691_405_5,
        4.630_337_846_156_545_295_9,
        1.423_437_110_749_683_577_34,
    ],
    [
        1.050_750_071_644_416_843_24e-9,
        5.475_938_084_995_344_946e-4,
        1.519_866_656_361_645_719_66e-2,
        1.481_039_764_274_800_745_9e-1,
        6.897_673_349_851_000_045_5e-1,
        1.676_384_830_183_803_849_4,
        2.053_191_626_637_758_821_87,
        1.0,
    ],
);

#[expect(clippy::excessive_precision, reason = "as published")]
const TAILS: Ratio = (
    [
        2.010_334_399_292_288_132_65e-7,
        2.711_555_568_743_487_578_15e-5,
        1.242_660_947_388_078_438_6e-3,
        2.653_218_952_657_612_309_3e-2,
        2.965_605_718_285_048_912_3e-1,
        1.784_826_539_917_291_335_8,
        5.463_784_911_164_114_369_9,
        6.657_904_643_501_103_777_2,
    ],
    [
        2.044_263_103_389_939_785_64e-15,
        1.421_511_758_316_445_888_7e-7,
        1.846_318_317_510_054_681_8e-5,
        7.868_691_311_456_132_591e-4,
        1.487_536_129_085_061_485_25e-2,
        1.369_298_809_227_358_053_1e-1,
        5.998_322_065_558_879_376_9e-1,
        1.0,
    ],
);

#[cfg(test)]
mod tests {
    use super::*;

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
}

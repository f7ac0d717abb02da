//! Random numbers as in numpy, so that a seed gives the same start here as in the course.

use rand_pcg::{Pcg64, rand_core::RngCore};

/// Words in the entropy pool.
const POOL: usize = 4;

/// Returns numpy's `default_rng(entropy)`: PCG64, seeded through numpy's `SeedSequence`.
/// Several words of entropy give a separate stream, like a list in numpy.
pub fn generator(entropy: &[u64]) -> Pcg64 {
    let [a, b, c, d] = seed_words(entropy);
    Pcg64::new(join(a, b), join(c, d))
}

/// Returns the next number of `random` within 0 to 1, as numpy's `random()` draws it.
pub(crate) fn unit(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn join(high: u64, low: u64) -> u128 {
    u128::from(high) << 64 | u128::from(low)
}

/// Four words that depend on every bit of the entropy, equal to
/// `SeedSequence(entropy).generate_state(4, uint64)`.
fn seed_words(entropy: &[u64]) -> [u64; 4] {
    let pool = mixed_pool(&words_of(entropy));
    let mut hash = Hash::new(0x8b51_f9dd, 0x58f3_8ded);
    let mut word = |index: usize| u64::from(hash.hash(pool[index % POOL]));
    std::array::from_fn(|i| {
        let low = word(2 * i);
        word(2 * i + 1) << 32 | low
    })
}

/// Splits each number into as many 32-bit words as it needs, lowest first.
fn words_of(entropy: &[u64]) -> Vec<u32> {
    let mut words = Vec::with_capacity(2 * entropy.len());
    for &number in entropy {
        words.push(number as u32);
        if number > u64::from(u32::MAX) {
            words.push((number >> 32) as u32);
        }
    }
    words
}

fn mixed_pool(entropy: &[u32]) -> [u32; POOL] {
    let mut hash = Hash::new(0x43b0_d7e5, 0x931e_8875);
    let mut pool: [u32; POOL] =
        std::array::from_fn(|i| hash.hash(entropy.get(i).copied().unwrap_or(0)));
    for source in 0..POOL {
        for target in (0..POOL).filter(|&target| target != source) {
            pool[target] = mix(pool[target], hash.hash(pool[source]));
        }
    }
    for &word in entropy.iter().skip(POOL) {
        for target in &mut pool {
            *target = mix(*target, hash.hash(word));
        }
    }
    pool
}

/// A multiplicative hash whose multiplier changes with every word.
struct Hash {
    state: u32,
    step: u32,
}

impl Hash {
    fn new(state: u32, step: u32) -> Self {
        Self { state, step }
    }

    fn hash(&mut self, word: u32) -> u32 {
        let masked = word ^ self.state;
        self.state = self.state.wrapping_mul(self.step);
        let hashed = masked.wrapping_mul(self.state);
        hashed ^ hashed >> 16
    }
}

fn mix(x: u32, y: u32) -> u32 {
    let mixed = x
        .wrapping_mul(0xca01_f9dd)
        .wrapping_sub(y.wrapping_mul(0x4973_f715));
    mixed ^ mixed >> 16
}

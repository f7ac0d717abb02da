//! The period of events, by their spectrum.

use std::f64::consts::TAU;

use crate::numbers::{median_f64, nearest};

/// The fewest events that a period is looked for in.
const MIN_COUNT: usize = 16;

/// The most events of the first look.
const MOST: usize = 2_048;

/// How many times the frequency of a period a shorter one has at least.
const ABOVE: f64 = 1.3;

/// How much sharper than a harmonic a shorter period is at least.
const SHARP: f64 = 0.3;

/// A period, and how sharp it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventPeriod {
    /// Its length (ns).
    pub length: f64,
    /// 1 for a clockwork, near 0 for chance.
    pub sharpness: f64,
    /// The number of distinct events.
    pub events: usize,
    /// A shorter one that is sharp as well, with its sharpness.
    shorter: Option<(f64, f64)>,
}

impl EventPeriod {
    /// Returns the shorter period that is sharp as well, if there is one.
    pub fn shorter(self) -> Option<Self> {
        let (length, sharpness) = self.shorter?;
        Some(Self {
            length,
            sharpness,
            shorter: None,
            ..self
        })
    }
}

/// Returns the period of `events` (ns) in order; `None` of too few.
pub fn period(events: &[i64]) -> Option<EventPeriod> {
    let mut distinct = events.to_vec();
    distinct.dedup();
    if distinct.len() < MIN_COUNT {
        return None;
    }
    let times: Vec<f64> = distinct
        .iter()
        .map(|event| (event - distinct[0]) as f64)
        .collect();
    let (frequency, higher) = first_look(&times[..times.len().min(MOST)])?;
    let (length, sharpness) = exact(&times, frequency);
    Some(EventPeriod {
        length,
        sharpness,
        events: times.len(),
        shorter: higher.map(|frequency| exact(&times, frequency)),
    })
}

/// Returns the period near this `frequency` of the first look, and how sharp it is in all `times`.
fn exact(times: &[f64], mut frequency: f64) -> (f64, f64) {
    let mut count = times.len().min(MOST);
    let sharpness = loop {
        let some = &times[..count];
        let width = 1.0 / (4.0 * some[count - 1]);
        frequency = refined(some, frequency, width);
        frequency = refined(some, frequency, width / 8.0);
        if count == times.len() {
            break sharpness(some, frequency);
        }
        count = (2 * count).min(times.len());
    };
    let mut length = 1.0 / frequency;
    if sharpness > 0.6 {
        length = straightened(times, length);
    }
    (length, sharpness)
}

/// Pointers that are turned at once.
const LANES: usize = 8;

/// Some pointers, each with the angle by which it turns. A missing one has no length.
struct Pointers {
    sines: [f64; LANES],
    cosines: [f64; LANES],
    turn_sines: [f64; LANES],
    turn_cosines: [f64; LANES],
}

impl Pointers {
    fn new(begun: &[(f64, f64)], turns: &[(f64, f64)]) -> Self {
        let of = |values: &[(f64, f64)]| {
            let mut lanes = ([0.0; LANES], [0.0; LANES]);
            for (lane, value) in values.iter().enumerate().take(LANES) {
                (lanes.0[lane], lanes.1[lane]) = *value;
            }
            lanes
        };
        let ((sines, cosines), (turn_sines, turn_cosines)) = (of(begun), of(turns));
        Self {
            sines,
            cosines,
            turn_sines,
            turn_cosines,
        }
    }

    /// Adds the pointers to `sum`, and turns them.
    fn turn(&mut self, sum: &mut ([f64; LANES], [f64; LANES])) {
        for lane in 0..LANES {
            let (s, c) = (self.sines[lane], self.cosines[lane]);
            let (ts, tc) = (self.turn_sines[lane], self.turn_cosines[lane]);
            sum.0[lane] += s;
            sum.1[lane] += c;
            self.sines[lane] = s * tc + c * ts;
            self.cosines[lane] = c * tc - s * ts;
        }
    }
}

/// Returns how sharp the `frequency` is in `times`.
fn sharpness(times: &[f64], frequency: f64) -> f64 {
    let (mut sine, mut cosine) = (0.0, 0.0);
    for time in times {
        let (s, c) = (TAU * frequency * time).sin_cos();
        sine += s;
        cosine += c;
    }
    f64::hypot(sine, cosine) / times.len() as f64
}

/// Returns the lowest frequency nearly as sharp as any between 0.9 and 12 of the mean rate, and one
/// well above it that is sharper than its harmonics.
fn first_look(times: &[f64]) -> Option<(f64, Option<f64>)> {
    let steps = times.len() - 1;
    let step = 1.0 / (4.0 * times[steps]);
    let (first, last) = ((3.6 * steps as f64).ceil() as usize, 48 * steps);
    // Each time has a pointer, which turns from one frequency to the next.
    let turned = |frequency: f64| {
        times
            .iter()
            .map(move |time| (TAU * frequency * time).sin_cos())
    };
    let begun: Vec<(f64, f64)> = turned(first as f64 * step).collect();
    let turns: Vec<(f64, f64)> = turned(step).collect();
    let mut pointers: Vec<Pointers> = begun
        .chunks(LANES)
        .zip(turns.chunks(LANES))
        .map(|(begun, turns)| Pointers::new(begun, turns))
        .collect();
    let mut found = Vec::with_capacity(last + 1 - first);
    for _ in first..=last {
        let mut sum = ([0.0; LANES], [0.0; LANES]);
        pointers.iter_mut().for_each(|of| of.turn(&mut sum));
        found.push(f64::hypot(sum.0.iter().sum(), sum.1.iter().sum()));
    }
    let greatest = found.iter().copied().fold(0.0, f64::max);
    let is_peak = |place: usize| {
        let at = found[place];
        let is_below = |other: Option<&f64>| other.is_some_and(|other| at < *other);
        let before = place.checked_sub(1).and_then(|before| found.get(before));
        at >= 0.8 * greatest && !is_below(before) && !is_below(found.get(place + 1))
    };
    let peak = (0..found.len()).find(|place| is_peak(*place))?;
    let frequency = |place: usize| (first + place) as f64 * step;
    let sharp = |place: usize| found[place] / times.len() as f64;
    // By how much it is sharper than a normal distribution around the period makes its harmonics.
    let excess = |place: usize| {
        let times = frequency(place) / frequency(peak);
        sharp(place) - sharp(peak).powf(times * times)
    };
    let above = ((first + peak) as f64 * ABOVE) as usize;
    let higher = (above.saturating_sub(first)..found.len())
        .filter(|place| excess(*place) >= SHARP)
        .max_by(|one, other| found[*one].total_cmp(&found[*other]));
    Some((frequency(peak), higher.map(frequency)))
}

/// Returns the sharpest frequency within `width`.
fn refined(times: &[f64], frequency: f64, width: f64) -> f64 {
    let near = (-10..=10).map(|tenth| frequency + width * f64::from(tenth) / 10.0);
    let (mut best, mut greatest) = (frequency, f64::NEG_INFINITY);
    for frequency in near {
        let sharp = sharpness(times, frequency);
        if sharp > greatest {
            (best, greatest) = (frequency, sharp);
        }
    }
    best
}

/// Returns the slope of the line of least squares through the numbered times, unless it leads
/// elsewhere.
fn straightened(times: &[f64], length: f64) -> f64 {
    let mut straight = length;
    for _ in 0..2 {
        let rests = times
            .iter()
            .map(|time| time - (time / straight).round() * straight);
        let middle = median_f64(rests.collect());
        let numbers = times
            .iter()
            .map(|time| ((time - middle) / straight).round());
        let points: Vec<(f64, f64)> = numbers.zip(times.iter().copied()).collect();
        let count = points.len() as f64;
        let (n, x) = points
            .iter()
            .fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
        let (mean_n, mean_x) = (n / count, x / count);
        let (mut over, mut under) = (0.0, 0.0);
        for (n, x) in &points {
            over += (n - mean_n) * (x - mean_x);
            under += (n - mean_n) * (n - mean_n);
        }
        if under <= 0.0 {
            return length;
        }
        straight = over / under;
    }
    let whole = times.last().map_or(0.0, |last| last / length);
    if (straight - length).abs() * whole > length / 4.0 || !straight.is_finite() {
        return length;
    }
    straight
}

/// Returns the nearest period of whole 0.1 ms, or rate of whole 0.5 Hz, within `tolerance` (ns).
pub fn snapped(length: f64, tolerance: f64) -> f64 {
    const TENTH: f64 = 1e5;
    const HALF_HZ: f64 = 2e9;
    let candidates = [
        nearest(length / TENTH) as f64 * TENTH,
        HALF_HZ / (HALF_HZ / length).round(),
    ];
    let near = candidates.into_iter().filter(|candidate| {
        candidate.is_finite() && *candidate > 0.0 && (candidate - length).abs() <= tolerance
    });
    near.min_by(|one, other| (one - length).abs().total_cmp(&(other - length).abs()))
        .unwrap_or(length)
}

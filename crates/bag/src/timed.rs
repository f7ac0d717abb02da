//! A node as a timer: the phase at which it reads, by which inputs it used.

use crate::{
    numbers::{MS, shortest_half, spread},
    period::{EventPeriod, snapped},
    stamps::TopicEvents,
    triggered::{Triggered, part},
};

/// The phases that are tried.
const PHASES: i32 = 180;

/// Halvings that find the ends of a plateau.
const HALVINGS: usize = 4;

/// What a phase may lose against the best one.
const LOSS: f64 = 0.006;

/// What a multiple of the period may lose against it: messages that were lost on their way to the
/// node spoil a few of its outputs.
const MULTIPLE_LOSS: f64 = 0.03;

/// A shorter period must make the costs this much narrower.
const NARROWER: f64 = 0.7;

/// An output, in time since the first one (ns).
#[derive(Clone, Copy, Debug)]
struct TimedOutput {
    end: f64,
    /// When the node is free.
    free: f64,
    /// When the first input with its stamp arrived.
    arrival: f64,
    /// The last moment at which that was the newest.
    last: f64,
}

/// How well a phase explains the outputs.
#[derive(Clone, Copy, Debug)]
struct Fitness {
    holds: f64,
    spread: i64,
}

/// A node as a timer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed {
    /// Its period (ns).
    pub period: f64,
    /// Its phase, from the first output (ns).
    pub phase: f64,
    /// The part of the outputs that it explains.
    pub holds: f64,
    /// What lies between the 10th and 90th percentile of end less start (ns).
    pub spread: i64,
    /// The width of the shortest interval with half of these (ns).
    pub half: i64,
    /// How far the phase is known (ns).
    pub known_to: f64,
    /// Whether its ticks begin late.
    pub is_late: bool,
}

impl Timed {
    /// Returns the latest phase that explains the outputs as well (ns).
    pub fn latest(&self) -> f64 {
        self.phase + (self.spread as f64).min(self.known_to) / 2.0
    }
}

/// One run of a timer, in time since the first output (ns).
#[derive(Clone, Copy, Debug)]
pub struct TimerRun {
    /// The tick that it is of.
    pub tick: f64,
    /// How late it began, of a timer whose ticks begin late.
    pub late: f64,
    /// When it began.
    pub start: f64,
    /// From when to when what it used was the newest.
    pub reads: (f64, f64),
    /// When it ended.
    pub end: f64,
}

/// The outputs that a timer is fitted to.
#[derive(Debug)]
pub struct TimedOutputs {
    all: Vec<TimedOutput>,
    mean_interval: f64,
}

impl TimedOutputs {
    /// Those of `b` that have inputs among the messages of `a`.
    pub fn new(
        a: &TopicEvents,
        b: &TopicEvents,
        transport: i64,
        busy_until: &[i64],
        triggered: &Triggered,
    ) -> Self {
        let first = b.events.first().copied().unwrap_or(0);
        let since = |time: i64| time.saturating_sub(first) as f64;
        let outputs = triggered.steps.iter().filter_map(|step| {
            let possible = a.with_stamp(b.stamps[step.output]);
            let possible = &a.by_stamp[possible];
            let arrival = a.events[possible.first()?.1] + transport;
            let end = b.events[step.output];
            let next = a.events.get(possible.last()?.1 + 1);
            let last = next
                .map_or(i64::MAX, |next| next + transport - 1)
                .min(end - 1);
            Some(TimedOutput {
                end: since(end),
                free: since(busy_until[step.output]),
                arrival: since(arrival),
                last: since(last),
            })
        });
        let length = b.events.last().map_or(0.0, |last| since(*last));
        Self {
            all: outputs.collect(),
            mean_interval: length / b.events.len().saturating_sub(1).max(1) as f64,
        }
    }

    /// Returns the runs of such a timer, one for each output.
    pub fn runs(&self, timed: Timed) -> impl Iterator<Item = TimerRun> {
        self.all.iter().map(move |output| {
            let mut run = TimerRun {
                tick: output.tick(timed.phase, timed.period),
                late: 0.0,
                start: 0.0,
                reads: (output.arrival, output.last),
                end: output.end,
            };
            if timed.is_late {
                run.tick = before(timed.phase, timed.period, output.end);
                run.start = run.tick.max(output.arrival);
                run.late = run.start - run.tick;
            } else {
                run.start = run.tick.max(output.free);
            }
            run
        })
    }

    /// Returns the mean time between two outputs (ns).
    pub fn mean_interval(&self) -> f64 {
        self.mean_interval
    }

    fn fitness(&self, phase: f64, period: f64, costs: &mut Vec<i64>) -> Fitness {
        costs.clear();
        for output in &self.all {
            let tick = output.tick(phase, period);
            let start = tick.max(output.free);
            if (output.arrival..=output.last + 1.0).contains(&start) {
                costs.push((output.end - start).round() as i64);
            }
        }
        Fitness {
            holds: part(costs.len(), self.all.len()),
            spread: spread(costs),
        }
    }

    /// Returns the best timer with this `period`.
    fn fit(&self, period: f64) -> Timed {
        let mut costs = Vec::with_capacity(self.all.len());
        let step = period / f64::from(PHASES);
        let mut at = |phase: f64| self.fitness(phase, period, &mut costs);
        let phases: Vec<Fitness> = (0..PHASES).map(|i| at(step * f64::from(i))).collect();
        let top = phases
            .iter()
            .map(|fitness| fitness.holds)
            .fold(0.0, f64::max);
        let is_good = |fitness: &Fitness| fitness.holds >= top - LOSS;
        let best = phases
            .iter()
            .zip(0..)
            .filter(|(fitness, _)| is_good(fitness))
            .min_by_key(|(fitness, _)| fitness.spread);
        let (least, best) = best.map_or((0, 0), |(fitness, place)| (fitness.spread, place));
        let widest = 1.1 * least as f64 + 0.1 * MS as f64;
        let is_of_plateau = |fitness: Fitness| is_good(&fitness) && fitness.spread as f64 <= widest;
        let mut end = |direction: i32| {
            let is_good = |i: &i32| {
                let place = (best + direction * i).rem_euclid(PHASES);
                is_of_plateau(phases[place as usize])
            };
            let steps = (1..PHASES).take_while(is_good).count();
            let direction = f64::from(direction);
            let mut end = step * (f64::from(best) + direction * steps as f64);
            let mut half = step;
            for _ in 0..HALVINGS {
                half /= 2.0;
                let farther = end + direction * half;
                if is_of_plateau(at(farther)) {
                    end = farther;
                }
            }
            end
        };
        let (upper, lower) = (end(1), end(-1));
        let known_to = (upper - lower).min(period);
        let phase = upper - (least as f64 / 2.0).min(known_to / 2.0);
        at(phase);
        Timed {
            period,
            phase,
            holds: top,
            spread: least,
            half: shortest_half(&mut costs),
            known_to,
            is_late: false,
        }
    }

    /// Returns the same with ticks that begin late, if these explain nearly all outputs.
    fn late(&self, timed: Timed) -> Option<Timed> {
        let (period, count) = (timed.period, self.all.len());
        let mut best: Option<(f64, f64, f64)> = None;
        for i in 0..PHASES {
            let phase = period / f64::from(PHASES) * f64::from(i);
            let (mut fits, mut sum) = (0, 0.0);
            for output in &self.all {
                let tick = before(phase, period, output.end);
                let late = (output.arrival - tick).max(0.0);
                fits += usize::from(tick <= output.last && late < 0.6 * period);
                sum += late;
            }
            let (part, mean) = (part(fits, count), sum / count.max(1) as f64);
            if part >= 0.97 && best.is_none_or(|(_, least, _)| mean < least) {
                best = Some((phase, mean, part));
            }
        }
        let (phase, _, holds) = best?;
        let costs = self.all.iter().map(|output| {
            let start = before(phase, period, output.end).max(output.free);
            (output.end - start).round() as i64
        });
        let mut costs: Vec<i64> = costs.collect();
        Some(Timed {
            phase,
            holds,
            spread: spread(&mut costs),
            half: shortest_half(&mut costs),
            is_late: true,
            ..timed
        })
    }

    /// Returns the timer that explains the outputs best, and how sharp its period is.
    pub fn timed(&self, period: EventPeriod) -> (Timed, f64) {
        let with_period = |period| (self.with_period(period), period.sharpness);
        let found = with_period(period);
        let shorter = period.shorter().map(with_period).filter(|(shorter, _)| {
            let narrow = NARROWER * found.0.half as f64;
            shorter.holds >= found.0.holds - MULTIPLE_LOSS && (shorter.half as f64) < narrow
        });
        shorter.unwrap_or(found)
    }

    /// Returns the timer with about this `period` that explains the outputs best.
    fn with_period(&self, period: EventPeriod) -> Timed {
        let mut best = self.fit(period.length);
        for multiple in 2..=5 {
            let longer = period.length * f64::from(multiple);
            if self.mean_interval < 0.97 * longer {
                break;
            }
            let fit = self.fit(longer);
            if fit.holds >= best.holds - MULTIPLE_LOSS
                && fit.holds > 0.9
                && (fit.spread as f64) < 0.8 * longer
            {
                best = fit;
            }
        }
        let events = period.events as f64;
        let tolerance = 3.0 * 3.46 * best.spread as f64 / 2.56 / events.powf(1.5);
        let length = snapped(best.period, tolerance.max(0.2e-6 * best.period));
        if length.to_bits() != best.period.to_bits() {
            best = self.fit(length);
        }
        let may_be_late = best.holds < 0.93 && period.sharpness > 0.4;
        may_be_late
            .then(|| self.late(best))
            .flatten()
            .unwrap_or(best)
    }
}

impl TimedOutput {
    /// Returns the tick that this output is of, of a timer of this `phase`.
    fn tick(&self, phase: f64, period: f64) -> f64 {
        let tick = before(phase, period, self.end);
        if tick > self.last {
            before(phase, period, self.last)
        } else {
            tick
        }
    }
}

/// Returns the last `phase + n * period` before `time`.
pub fn before(phase: f64, period: f64, time: f64) -> f64 {
    phase + (((time - phase) / period).ceil() - 1.0) * period
}

//! The delay and the jitter that a loop bears.

use std::{f64::consts::PI, time::Duration};

use nalgebra::{Complex, ComplexField, Matrix4, RowVector4};
use ratelab::{Hz, hyper_period};

use super::{
    control_loop::{Loop, StabilityError, WorldModel, gains},
    frequency::{complex, frequencies},
    monodromy::Stability,
    span::{Noise, Span, Weights},
    timing::{Cadence, Rates, Timing},
};
use crate::policy::PolicySpec;

/// Number of tested frequencies of a sampled loop, up to half of its rate.
const FREQUENCIES: u32 = 20_000;

/// The lowest of them, as a share of half the rate.
const LOWEST: f64 = 1e-5;

/// A disturbance of the action of intensity 1.
const UNIT: Noise = Noise {
    push: 1.0,
    reading: [0.0; 4],
};

/// The largest variation of a delay at which the loop stays stable, for any pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JitterMargin {
    /// The largest delay of any action beyond the constant part; each action may have its
    /// own.
    pub jitter: Duration,
    /// The jitter as an age: deviations shrink if no action is applied earlier than the
    /// constant part after its reading, and none is in force once its reading is this
    /// old, for whatever reason.
    pub oldest: Duration,
}

impl Loop {
    /// Returns the largest age of the action in force at which deviations shrink for any timing:
    /// any rates, delays, losses and patterns of these. `None` if the continuous loop is unstable
    /// without any delay.
    ///
    /// A small-gain condition, and only sufficient: the closed loop `T`, from a
    /// disturbance of the action to the action, has `|ω·T(iω)| < 1 / age` at all
    /// frequencies `ω`. Kao and Lincoln, *Simple stability criteria for systems
    /// with time-varying delays*, Automatica 40 (2004), in continuous time.
    pub fn oldest_push(&self) -> Option<Duration> {
        if !self.shrinks_without_delay() {
            return None;
        }
        let gain = |frequency: f64| {
            let open = self.open_loop(Complex::new(0.0, frequency))?;
            Some(frequency * (open / (open + 1.0)).modulus())
        };
        let loudest = frequencies().filter_map(gain).fold(0.0, f64::max);
        // The limit for infinite frequency.
        let limit = (RowVector4::from(self.gains) * self.dynamics.g)[0].abs();
        Duration::try_from_secs_f64(1.0 / loudest.max(limit)).ok()
    }

    /// Returns the largest variation of the delay of actions, beyond the constant delays of this
    /// loop, at which deviations shrink. `None` if they grow without any jitter.
    ///
    /// The plant is continuous here, and each reading of the sensor has an action: where
    /// the policy answers fewer readings, the actions in between count as late. So the
    /// rates of policy and actuator and all losses count as jitter.
    ///
    /// A small-gain condition, and only sufficient: Kao and Lincoln (2004), for a sampled
    /// loop, with the constant part as in Cervin, Lincoln, Eker, Årzén and Buttazzo, *The
    /// jitter margin and its application in the design of real-time control systems*,
    /// RTCSA 2004.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn jitter_margin(&self) -> Result<Option<JitterMargin>, StabilityError> {
        let sensor = self.timing.sensor.hz;
        let constant = self.timing.constant();
        let mut uniform = Timing::direct(sensor);
        uniform.action_delay = constant;
        let sampled = Self {
            world: WorldModel::Continuous,
            timing: uniform,
            ..*self
        };
        if !sampled.stability()?.is_stable() {
            return Ok(None);
        }
        let period = sensor.period();
        let jitter = periods(1.0 / sampled.loudest(period, constant)) * period.as_secs_f64();
        Ok(Duration::try_from_secs_f64(jitter)
            .ok()
            .map(|jitter| JitterMargin {
                jitter,
                oldest: constant + jitter + period,
            }))
    }

    /// Returns the largest gain of the sampled loop, from the force that jitter adds to the plant
    /// to the change from one action to the next.
    fn loudest(&self, period: Duration, constant: Duration) -> f64 {
        let flow = |seconds| Span::flow(&self.dynamics, seconds, &UNIT, &Weights::default());
        // The previous action is in force for the first part of a period.
        let seconds = period.as_secs_f64();
        let waits = constant.as_secs_f64() / seconds;
        let (early, late) = (waits.fract() * seconds, (1.0 - waits.fract()) * seconds);
        let (first, second, whole) = (flow(early), flow(late), flow(seconds));
        let newer = second.b();
        let older = second.a() * first.b();
        let gain = |angle: f64| {
            let z = Complex::new(angle.cos(), angle.sin());
            let resolvent = Matrix4::identity() * z - whole.a().map(complex);
            let row = RowVector4::from(self.gains).map(complex) * resolvent.try_inverse()?;
            let pushes = (newer.map(complex) + older.map(complex) / z) / z.powf(waits.floor());
            let disturbed = (row * whole.disturbance().map(complex) * row.adjoint())[0].re;
            let closed = (row * pushes)[0] - 1.0;
            Some((disturbed * seconds).sqrt() * (z - 1.0).modulus() / closed.modulus())
        };
        (0..=FREQUENCIES)
            .map(|part| f64::from(part) / f64::from(FREQUENCIES))
            .map(|part| PI * LOWEST.powf(part))
            .filter_map(gain)
            .fold(0.0, f64::max)
    }
}

/// Returns the jitter in periods for the gain `most`: with `n` whole periods and a fraction `g`,
/// the change is one of up to `n + 1` differences of actions for the fraction `g` of a period and
/// of up to `n` for the rest, `most² = n² + 2ng + g`.
fn periods(most: f64) -> f64 {
    let whole = most.floor();
    whole + (most * most - whole * whole) / (2.0 * whole + 1.0)
}

/// Interval between the tested delays. A window of unstable delays that is narrower may
/// be missed.
const STEP: Duration = Duration::from_millis(1);

/// Accuracy of the margin.
const NEAR: Duration = Duration::from_nanos(100);

/// The longest delay tested. A loop that is stable even then has a plant that is stable
/// without its policy.
const LONGEST_DELAY: Duration = Duration::from_secs(2);

/// The margin of delay at which small deviations begin to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayMargin {
    /// The shortest delay of `/action` at which they do not shrink, to a tenth of a
    /// microsecond; zero if they never shrink.
    pub delay: Duration,
    /// Stability of the loop with that delay.
    pub there: Stability,
}

impl Loop {
    /// Returns the shortest delay of `/action`, all else equal, at which small deviations do not
    /// shrink: a search upwards from zero in steps of 1 ms, then bisection over the exact
    /// schedules. `None` if the loop is stable even at 2 s.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn delay_margin(&self) -> Result<Option<DelayMargin>, StabilityError> {
        let mut stable = Duration::ZERO;
        let mut there = self.delayed(stable)?;
        if !there.is_stable() {
            let delay = stable;
            return Ok(Some(DelayMargin { delay, there }));
        }
        while there.is_stable() {
            stable += STEP;
            if stable > LONGEST_DELAY {
                return Ok(None);
            }
            there = self.delayed(stable)?;
        }
        let (mut stable, mut delay) = (stable - STEP, stable);
        while delay - stable > NEAR {
            let middle = stable + (delay - stable) / 2;
            let between = self.delayed(middle)?;
            if between.is_stable() {
                stable = middle;
            } else {
                (delay, there) = (middle, between);
            }
        }
        Ok(Some(DelayMargin { delay, there }))
    }

    fn delayed(&self, action_delay: Duration) -> Result<Stability, StabilityError> {
        let mut delayed = *self;
        delayed.timing.action_delay = action_delay;
        delayed.stability()
    }
}

/// Returns the mean push age above which small deviations grow, for `policy` at these rates: that
/// of the loop with the shortest constant delay at which they grow, in continuous time. An action
/// is applied on delivery.
///
/// Where sensor and policy meet less often than once a second, the limit is that of rounded
/// rates, which from 7 Hz on is within a millisecond of the exact one.
///
/// If deviations grow even without a delay, it is the mean push age of the rates alone:
/// the limit is then exceeded at these rates for any delay.
///
/// # Errors
/// [`StabilityError`], with the reason.
pub fn age_limit(policy: &PolicySpec, rates: Rates) -> Result<Duration, StabilityError> {
    let gains = gains(policy, rates.control)?;
    let nearby = rates.meeting_soon();
    let timing = Timing {
        sensor: Cadence::new(nearby.sensor),
        ..Timing::direct(nearby.control)
    };
    let control = Loop::cart_pole(gains, WorldModel::Continuous, timing)?;
    let margin = control
        .delay_margin()?
        .ok_or_else(|| StabilityError::Boundless(policy.to_string()))?;
    Ok(margin.there.mean_push_age)
}

/// The longest hyper-period of an exact limit: the work grows with it, and a longer one
/// would take seconds.
const SOON: Duration = Duration::from_secs(1);

impl Rates {
    /// Returns the nearest rates that meet often, if these meet too seldom.
    fn meeting_soon(self) -> Self {
        if hyper_period([self.sensor, self.control]) > SOON {
            Self {
                sensor: rounded(self.sensor),
                control: rounded(self.control),
            }
        } else {
            self
        }
    }
}

/// Multiples of 1 Hz meet once a second; lower rates have few ticks in ten.
fn rounded(hz: Hz) -> Hz {
    let step = if hz.get() >= 10.0 { 1.0 } else { 0.1 };
    Hz::new((hz.get() / step).round() * step).unwrap_or(hz)
}

//! The margins of a loop, compared with figures of other programs, closed forms and
//! simulations by other code.

use std::{sync::Arc, time::Duration};

use mujoco_rs::prelude::{MjData, MjModel};
use nalgebra::{Matrix4, SMatrix, Vector4};
use proptest::prelude::*;
use rand_pcg::{Pcg64, rand_core::RngCore};
use ratelab::{Hz, Time};
use ratelab_cart_pole::{
    CartPole, ControlStep, LinearPlant, STATE, generator,
    policy::Scripted,
    stability::{
        Cadence, Dynamics, JitterMargin, Loop, Loss, Lost, Noise, Rates, TimedPush, Timing,
        Weights, WorldModel, age_limit, gains,
    },
};
use ratelab_experiment::{Config, Experiment};
use ratelab_system::WorldKind;

fn hz(hz: f64) -> Hz {
    Hz::new(hz).expect("a rate")
}

fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

fn rates(sensor: f64, control: f64) -> Rates {
    Rates {
        sensor: hz(sensor),
        control: hz(control),
    }
}

/// The scripted balancer's loop.
fn scripted(world: WorldModel, timing: impl Into<Timing>) -> Loop {
    Loop::cart_pole(Scripted::GAINS, world, timing).expect("plant")
}

/// Everything at `rate`, and actions `delay` ms late.
fn delayed(rate: f64, delay: u64) -> Timing {
    Timing {
        action_delay: ms(delay),
        ..Timing::direct(hz(rate))
    }
}

fn growth(control: &Loop) -> f64 {
    control.stability().expect("a short hyper-period").growth()
}

fn shortest_unstable_delay(control: &Loop) -> Duration {
    let margin = control.delay_margin().expect("a short hyper-period");
    margin.expect("a margin").delay
}

/// `u` in a linear plant whose other coordinates shrink.
fn control(gains: [f64; 4], timing: Timing, plant: impl FnOnce(&mut Matrix4<f64>)) -> Loop {
    let mut f = -Matrix4::identity();
    plant(&mut f);
    Loop {
        dynamics: Dynamics { f, g: Vector4::z() },
        gains,
        world: WorldModel::Continuous,
        timing,
    }
}

/// `dx/dt = rate·x + u` for one coordinate, `u = −gain·x`.
fn scalar(rate: f64, gain: f64, timing: Timing) -> Loop {
    control([0.0, 0.0, -gain, 0.0], timing, |f| f[(2, 2)] = rate)
}

/// `d²x/dt² = u`, `u = −stiffness·x − damping·dx/dt`.
fn double_integrator(stiffness: f64, damping: f64, timing: Timing) -> Loop {
    control([-stiffness, 0.0, -damping, 0.0], timing, |f| {
        (f[(0, 0)], f[(0, 2)], f[(2, 2)]) = (0.0, 1.0, 0.0);
    })
}

/// A duration in milliseconds.
fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn jitter(control: &Loop) -> JitterMargin {
    control.jitter_margin().expect("short").expect("stable")
}

/// What noise costs, if it is bounded.
fn cost(control: &Loop, noise: &Noise, weights: &Weights, loss: Loss) -> Option<f64> {
    control.expected_cost(noise, weights, loss).expect("short")
}

/// What [`PUSHED`] costs with the usual weights, if it is bounded.
fn pushed_cost(control: &Loop, loss: Loss) -> Option<f64> {
    cost(control, &PUSHED, &Weights::default(), loss)
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn near(ours: f64, expected: f64, relative: f64) {
    let apart = (ours / expected - 1.0).abs();
    assert!(apart < relative, "{ours}, expected {expected}");
}

/// Velocities (m/s, rad/s) and positions (m, rad) so small that their motion is linear.
const SMALL: f64 = 1e-5;

/// MuJoCo's own step from a small deviation.
fn mujoco(step: Duration, x: Vector4<f64>, u: f64) -> Vector4<f64> {
    let timestep = format!("timestep=\"{}\"", step.as_secs_f64());
    let xml = include_str!("../crates/cart-pole/src/cartpole.xml");
    let xml = xml.replace("timestep=\"0.01\"", &timestep);
    let model = MjModel::from_xml_string(&xml).expect("model");
    let mut data = MjData::try_new(Arc::new(model)).expect("memory");
    data.qpos_mut().copy_from_slice(&[x[0], x[1]]);
    data.qvel_mut().copy_from_slice(&[x[2], x[3]]);
    data.ctrl_mut()[0] = u;
    data.step();
    let (qpos, qvel) = (data.qpos(), data.qvel());
    Vector4::new(qpos[0], qpos[1], qvel[0], qvel[1])
}

#[test]
fn a_step_of_any_length_matches_mujoco() {
    let dynamics = Dynamics::cart_pole().expect("plant");
    for step in [1, 2, 5, 10].map(ms) {
        let LinearPlant { a, b } = dynamics.step(step);
        for axis in 0..4 {
            let x = Vector4::ith(axis, SMALL);
            let apart = (mujoco(step, x, 0.0) - a * x).amax();
            assert!(apart < 1e-8 * SMALL, "{step:?}, {axis}: {apart}");
        }
        let apart = (mujoco(step, Vector4::zeros(), SMALL) - b * SMALL).amax();
        assert!(apart < 1e-8 * SMALL, "{step:?}, action: {apart}");
    }
}

#[test]
fn a_deviation_that_is_gone_within_a_period_has_no_growth() {
    // Each is gone at once, and what the action makes of one is not read.
    let gone = control([1.0, 0.0, 0.0, 0.0], Timing::direct(hz(10.0)), |f| {
        *f *= 1e6
    });
    assert_eq!(growth(&gone), f64::NEG_INFINITY);
}

#[test]
fn both_worlds_are_one_where_a_step_of_10_ms_meets_every_tick() {
    for sensor in [50.0, 25.0, 12.5, 10.0] {
        for control in 5..=50 {
            let rates = rates(sensor, f64::from(control));
            let course = growth(&scripted(WorldModel::Course, rates));
            let own = growth(&scripted(WorldModel::Own(ms(10)), rates));
            assert!((course - own).abs() < 1e-9, "{rates:?}: {course}, {own}");
        }
    }
}

/// The graph as a clock runs it, with all times in whole milliseconds, around the linear
/// plant: releases, deliveries, ticks, then a physics step.
struct Graph {
    plant: LinearPlant,
    sensor: [u64; 2],
    policy: [u64; 2],
    actuator: [u64; 2],
    takes: u64,
    delays: [u64; 2],
}

type States = SMatrix<f64, 4, 4>;
type Answers = SMatrix<f64, 1, 4>;

impl Graph {
    fn timing(&self) -> Timing {
        let cadence = |[period, offset]: [u64; 2]| Cadence {
            hz: hz(1e3 / period as f64),
            offset: ms(offset),
        };
        Timing {
            sensor: cadence(self.sensor),
            policy: cadence(self.policy),
            actuator: Some(cadence(self.actuator)),
            policy_takes: ms(self.takes),
            obs_delay: ms(self.delays[0]),
            action_delay: ms(self.delays[1]),
        }
    }

    /// The growth between two times (ms).
    fn growth(&self, from: u64, to: u64) -> f64 {
        let gains = Answers::from(Scripted::GAINS);
        let mut x = States::identity();
        let (mut force, mut heard, mut seen) = (Answers::zeros(), None, None);
        let (mut readings, mut actions) = (Vec::new(), Vec::new());
        let (mut free_at, mut log_scale, mut begin) = (0, 0.0, 0.0);
        let due = |[period, offset]: [u64; 2], now: u64| {
            now >= offset && (now - offset).is_multiple_of(period)
        };
        for now in 0..to {
            let deliver = |queue: &mut Vec<(u64, States)>| {
                let newest = queue.iter().rfind(|(at, _)| *at <= now).map(|(_, x)| *x);
                queue.retain(|(at, _)| *at > now);
                newest
            };
            if due(self.sensor, now) {
                readings.push((now + self.delays[0], x));
            }
            seen = deliver(&mut readings).or(seen);
            if due(self.policy, now) && now >= free_at {
                free_at = now + self.takes;
                if let Some(seen) = seen {
                    actions.push((free_at + self.delays[1], seen));
                }
            }
            heard = deliver(&mut actions).or(heard);
            if let Some(heard) = heard.filter(|_| due(self.actuator, now)) {
                force = gains * heard;
            }
            x = self.plant.a * x + self.plant.b * force;
            let size = x.amax();
            if !(1e-50..1e50).contains(&size) {
                let scaled = |queue: &mut Vec<(u64, States)>| {
                    queue.iter_mut().for_each(|(_, x)| *x /= size);
                };
                scaled(&mut readings);
                scaled(&mut actions);
                (x, force) = (x / size, force / size);
                (heard, seen) = (heard.map(|x| x / size), seen.map(|x| x / size));
                log_scale += size.ln();
            }
            if now == from {
                begin = log_scale + x.norm().ln();
            }
        }
        (log_scale + x.norm().ln() - begin) / (to - from) as f64 * 1e3
    }
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn theory_and_a_simulated_graph_have_the_same_growth(
        periods in [0_usize..6, 0..6, 0..5],
        offsets in [0_u64..30, 0..30, 0..30],
        takes in 0_u64..60,
        delays in [0_u64..50, 0..50],
    ) {
        const PERIODS: [u64; 6] = [5, 10, 20, 25, 40, 50];
        let plant = Dynamics::cart_pole().expect("plant").step(ms(1));
        let graph = Graph {
            plant,
            sensor: [PERIODS[periods[0]], offsets[0]],
            policy: [PERIODS[periods[1]], offsets[1]],
            actuator: [PERIODS[periods[2]], offsets[2]],
            takes,
            delays,
        };
        let theory = growth(&scripted(WorldModel::Own(ms(1)), graph.timing()));
        let run = graph.growth(60_000, 240_000);
        prop_assert!((theory - run).abs() < 0.03, "{theory}, run {run}");
    }
}

#[test]
fn the_margins_of_the_continuous_loop_match_another_program() {
    let control = scripted(WorldModel::Continuous, Timing::direct(hz(50.0)));
    let margins = control.continuous_margins().expect("margins");
    near(margins.crossover, 21.1, 0.005);
    near(margins.phase_margin.to_degrees(), 72.0, 0.01);
    near(margins.delay.as_secs_f64(), 0.0598, 0.005);
}

#[test]
fn delay_plus_half_a_period_is_the_margin_at_every_rate() {
    // Results of another program: the first delay, in whole milliseconds, at which
    // deviations grow, and half a period.
    let rates = [500.0, 100.0, 50.0, 25.0, 20.0];
    for (rate, expected) in rates.into_iter().zip([60.0, 60.0, 61.0, 60.0, 62.0]) {
        let [continuous, own] = [WorldModel::Continuous, WorldModel::Own(ms(1))]
            .map(|world| scripted(world, Timing::direct(hz(rate))));
        let delay = millis(shortest_unstable_delay(&continuous));
        assert_eq!(delay.ceil() + 500.0 / rate, expected, "{rate} Hz: {delay}");
        // In a world of steps an action waits for the next step.
        let stepped = millis(shortest_unstable_delay(&own)) - delay.floor();
        assert!(stepped.abs() < 1e-3, "{rate} Hz: {stepped}");
        let margin = continuous.delay_margin().expect("short").expect("margin");
        let age = millis(margin.there.mean_push_age) - delay - 500.0 / rate;
        assert!(age.abs() < 1e-5, "{rate} Hz: {age}");
    }
}

/// How far the pole swings (rad) in the last second of a minute in the own world in
/// which everything ticks at `rate`, but for an actuator that applies an action as soon
/// as it is delivered, `delay` ms after it was decided.
fn swing(rate: f64, delay: u64) -> f64 {
    let knobs = format!(
        "rate sensor {rate}; rate policy {rate}; rate actuator 1000; link /action delay:{delay}"
    );
    let knobs = knobs.split("; ").map(|knob| knob.parse().expect("a knob"));
    let config = Config {
        world: WorldKind::OWN,
        end: Time::from_nanos(60_000_000_000),
        setup: knobs.collect(),
        ..Config::default()
    };
    let experiment = Experiment::new(Arc::new(CartPole::default()), &config).expect("a graph");
    let tap = experiment.taps().messages::<ControlStep>(STATE, 4_096);
    let tap = tap.expect(STATE);
    experiment.run().expect("no fault");
    let steps = tap.items().iter();
    let angles: Vec<f64> = steps.map(|step| step.message.data.qpos[1].abs()).collect();
    assert_eq!(angles.len(), 3_000, "{rate} Hz, {delay} ms: it fell");
    angles[2_950..].iter().copied().fold(0.0, f64::max)
}

#[test]
fn in_runs_deviations_grow_from_the_delay_on_that_theory_tells() {
    for rate in [500.0, 200.0, 100.0, 50.0, 25.0, 20.0] {
        let own = scripted(WorldModel::Own(ms(1)), Timing::direct(hz(rate)));
        // The first whole millisecond at which they grow.
        let first = shortest_unstable_delay(&own).as_millis() as u64 + 1;
        // So near the margin they grow slowly, and end in a swing where the motor clips.
        let [shrunk, grown] = [first - 2, first + 1].map(|delay| swing(rate, delay));
        let holds = shrunk < 1e-3 && grown > 1e-2;
        assert!(holds, "{rate} Hz: {shrunk}, {grown} rad");
    }
}

#[test]
fn a_faster_loop_comes_near_the_continuous_one() {
    let control = scripted(WorldModel::Continuous, Timing::direct(hz(2_000.0)));
    let margins = control.continuous_margins().expect("margins");
    let delay = shortest_unstable_delay(&control) + Duration::from_micros(250);
    near(delay.as_secs_f64(), margins.delay.as_secs_f64(), 1e-3);
}

#[test]
fn a_double_integrator_has_the_delay_margin_of_its_closed_form() {
    let (stiffness, damping) = (4.0_f64, 3.0_f64);
    let control = double_integrator(stiffness, damping, Timing::direct(hz(10.0)));
    let margins = control.continuous_margins().expect("margins");
    let squared = (damping.powi(2) + (damping.powi(4) + 4.0 * stiffness.powi(2)).sqrt()) / 2.0;
    let crossover = squared.sqrt();
    near(margins.crossover, crossover, 1e-9);
    let phase = (damping * crossover / stiffness).atan();
    near(margins.phase_margin, phase, 1e-9);
    near(margins.delay.as_secs_f64(), phase / crossover, 1e-7);
}

#[test]
fn a_sampled_integrator_is_stable_up_to_the_gain_of_its_closed_form() {
    // z^(n+1) − z^n + kT has its roots within the circle up to
    // kT = 2·sin(π / (4n + 2)).
    for periods in 0..6_u32 {
        let timing = delayed(10.0, 100 * u64::from(periods));
        let most = 20.0 * (std::f64::consts::PI / f64::from(4 * periods + 2)).sin();
        let growth = [0.999, 1.001].map(|part| growth(&scalar(0.0, most * part, timing)));
        assert!(growth[0] < 0.0 && growth[1] > 0.0, "{periods}: {growth:?}");
    }
}

#[test]
fn an_action_is_as_old_on_average_as_its_delay_and_half_a_period() {
    for (rate, delay) in [(50.0, 0), (50.0, 35), (12.5, 7), (3.0, 400)] {
        let control = scripted(WorldModel::Continuous, delayed(rate, delay));
        let age = control.stability().expect("short").mean_push_age;
        let apart = age.as_secs_f64() - (delay as f64 * 1e-3 + 0.5 / rate);
        assert!(apart.abs() < 2e-9, "{age:?}");
    }
}

#[test]
fn the_age_limit_is_given_or_the_reason_for_its_absence() {
    let limit = |policy: &str, control: f64| {
        let limit = age_limit(&policy.parse().expect("policy"), rates(control, control));
        limit.map(millis).map_err(|error| error.to_string())
    };
    assert!((59.0..=62.0).contains(&limit("scripted", 50.0).expect("limit")));
    // At 10 Hz the hold alone is too long.
    near(limit("scripted", 10.0).expect("limit"), 50.0, 1e-6);
    assert_eq!(
        limit("zero", 50.0).expect_err("no theory"),
        "the policy zero does not answer to readings: their age is nothing to it"
    );
    assert!(limit("random", 50.0).is_err());
    assert_eq!(
        limit("policies/any.safetensors", 50.0).expect_err("no theory"),
        "the network any.safetensors has no gains: measure its limit by a sweep of delays"
    );
}

#[test]
fn the_age_limit_of_rates_that_seldom_meet_is_near_the_exact_one() {
    for control in [33.3, 12.4, 7.35] {
        let timing = Timing {
            sensor: Cadence::new(hz(50.0)),
            ..Timing::direct(hz(control))
        };
        let exact = scripted(WorldModel::Continuous, timing).delay_margin();
        let exact = exact.expect("a short hyper-period").expect("a margin");
        let exact = millis(exact.there.mean_push_age);
        let policy = "scripted".parse().expect("policy");
        let limit = millis(age_limit(&policy, rates(50.0, control)).expect("limit"));
        let apart = (limit - exact).abs();
        assert!(apart < 1.0, "{control} Hz: {limit}, exactly {exact}");
    }
}

#[test]
fn the_jitter_margins_of_an_integrator_match_their_closed_forms() {
    // Continuous: sup |ω·k/(iω + k)| = k. Sampled: the largest gain is at half the
    // rate, 2kT / (2 − kT).
    for gain in [0.5, 2.0, 8.0] {
        let control = scalar(0.0, gain, Timing::direct(hz(10.0)));
        let oldest = control.oldest_push().expect("stable");
        near(oldest.as_secs_f64(), 1.0 / gain, 1e-6);
        let kt = gain * 0.1;
        let most = (2.0 - kt) / (2.0 * kt);
        let whole = most.floor();
        let periods = whole + (most * most - whole * whole) / (2.0 * whole + 1.0);
        let margin = jitter(&control);
        near(margin.jitter.as_secs_f64(), periods * 0.1, 1e-6);
        assert_eq!(margin.oldest, margin.jitter + ms(100));
    }
}

#[test]
fn the_jitter_margins_match_another_program() {
    // Sensor (Hz), constant delay (ms), jitter (ms): masses and lengths from the
    // model, aliases of the response added one by one.
    const KNOWN: [(f64, u64, f64); 6] = [
        (50.0, 0, 36.808),
        (50.0, 10, 29.340),
        (50.0, 30, 11.459),
        (20.0, 20, 3.713),
        (100.0, 20, 25.808),
        (25.0, 10, 15.172),
    ];
    for (rate, constant, expected) in KNOWN {
        let control = scripted(WorldModel::Continuous, delayed(rate, constant));
        near(millis(jitter(&control).jitter), expected, 2e-4);
    }
    let control = scripted(WorldModel::Continuous, Timing::direct(hz(50.0)));
    let oldest = control.oldest_push().expect("stable");
    near(millis(oldest), 47.5245, 1e-5);
}

#[test]
fn the_jitter_margin_never_exceeds_the_delay_margin() {
    for rate in [20.0, 25.0, 50.0, 100.0, 500.0] {
        let mut last = Duration::MAX;
        for constant in [0, 10, 20, 30, 40, 50] {
            let [prompt, control] =
                [0, constant].map(|delay| scripted(WorldModel::Continuous, delayed(rate, delay)));
            let margin = shortest_unstable_delay(&prompt);
            let jitter = control.jitter_margin().expect("short");
            assert_eq!(jitter.is_some(), ms(constant) < margin);
            if let Some(jitter) = jitter {
                assert!(ms(constant) + jitter.jitter < margin);
                assert!(jitter.jitter < last);
                last = jitter.jitter;
            }
        }
    }
}

/// The share of a deviation left after 15 s, where the action in force is based on the
/// readings of `pushes`, in steps of 0.1 ms.
fn left(pushes: impl IntoIterator<Item = (u64, u64)>) -> f64 {
    const STEPS: usize = 150_000;
    let plant = Dynamics::cart_pole()
        .expect("plant")
        .step(Duration::from_micros(100));
    let gains = Answers::from(Scripted::GAINS);
    let mut starts: Vec<Vec<u64>> = vec![Vec::new(); STEPS];
    for (sensed, applied) in pushes {
        if let Some(start) = starts.get_mut(applied as usize) {
            start.push(sensed);
        }
    }
    let mut past = vec![States::identity()];
    let mut newest = 0;
    for start in starts {
        // If actions overtake each other, the newest counts.
        newest = start.into_iter().fold(newest, u64::max);
        let x = past[past.len() - 1];
        past.push(plant.a * x + plant.b * (gains * past[newest as usize]));
    }
    past[STEPS].amax()
}

#[test]
fn a_deviation_grows_where_the_delay_is_beyond_the_margin() {
    let late = |delay| left((0..750).map(|tick| (tick * 200, tick * 200 + delay)));
    assert!(late(490) < 1.0);
    assert!(late(515) > 1.0);
}

proptest! {
    #![proptest_config(cases(32))]

    #[test]
    fn no_pattern_of_delays_within_the_jitter_margin_makes_a_deviation_grow(
        rate in 0_usize..3,
        pattern in prop::collection::vec(prop_oneof![Just(0.0), Just(1.0), 0.0..1.0], 1..14),
    ) {
        let rate = [25.0, 50.0, 100.0][rate];
        let control = scripted(WorldModel::Continuous, Timing::direct(hz(rate)));
        let most = jitter(&control).jitter.as_secs_f64() * 1e4 - 1.0;
        let period = (1e4 / rate) as u64;
        let sensed = (0..).map(|tick| tick * period).take_while(|sensed| *sensed < 150_000);
        let pushes = sensed.zip(pattern.iter().cycle());
        let left = left(pushes.map(|(sensed, part)| (sensed, sensed + (part * most) as u64)));
        prop_assert!(left < 0.1, "{left}");
    }

    #[test]
    fn no_timing_makes_a_deviation_grow_while_no_push_is_too_old(
        pattern in prop::collection::vec((0.02_f64..1.0, prop_oneof![Just(0.0), Just(1.0), 0.0..1.0]), 1..14),
    ) {
        let control = scripted(WorldModel::Continuous, Timing::direct(hz(50.0)));
        let most = control.oldest_push().expect("stable").as_secs_f64() * 1e4 - 1.0;
        // Sensed a gap after the previous one, applied before that one is too old.
        let (mut sensed, mut applied) = (0.0_f64, 0.0_f64);
        let pushes = pattern.iter().cycle().map(|(gap, wait)| {
            let gap = gap * most;
            sensed += gap;
            applied = applied.max(sensed + wait * (most - gap));
            (sensed as u64, applied as u64)
        });
        let pushes: Vec<_> = pushes.take_while(|(sensed, _)| *sensed < 150_000).collect();
        let left = left(pushes);
        prop_assert!(left < 0.1, "{left}");
    }
}

#[test]
fn the_loss_margin_matches_another_program() {
    for (lost, expected) in [(Lost::Hold, 0.58), (Lost::Zero, 0.78)] {
        for world in [WorldModel::Continuous, WorldModel::Own(ms(1))] {
            let control = scripted(world, Timing::direct(hz(50.0)));
            let margin = control.loss_margin(lost).expect("short");
            // The first unstable share, in steps of 0.02.
            let known = expected - 0.02..=expected;
            assert!(known.contains(&margin), "{lost:?}: {margin}");
        }
    }
}

#[test]
fn the_loss_margin_without_force_matches_its_closed_form() {
    // A decision that removes the whole deviation, once every 1/p steps: p·a² < 1.
    let (rate, hz) = (3.0_f64, hz(10.0));
    let step = (rate * 0.1).exp();
    let gain = step * rate / (step - 1.0);
    let control = scalar(rate, gain, Timing::direct(hz));
    let margin = control.loss_margin(Lost::Zero).expect("short");
    near(margin, step.powi(-2), 1e-6);
}

#[test]
fn without_loss_the_square_of_a_deviation_grows_twice_as_fast() {
    for delay in [0, 30, 70] {
        let control = scripted(WorldModel::Own(ms(1)), delayed(50.0, delay));
        let square = control.mean_square_growth(Loss::NONE).expect("short");
        let apart = square - 2.0 * growth(&control);
        assert!(apart.abs() < 1e-6, "{delay} ms: {square}");
    }
}

/// Noise on the action alone.
const PUSHED: Noise = Noise {
    push: 0.3,
    reading: [0.0; 4],
};

#[test]
fn the_cost_of_a_sampled_integrator_matches_its_closed_form() {
    let (gain, period) = (4.0, 0.1);
    let control = scalar(0.0, gain, Timing::direct(hz(10.0)));
    let weights = Weights {
        state: [0.0, 0.0, 2.0, 0.0],
        action: 0.5,
    };
    let noise = Noise {
        push: 0.3,
        reading: [0.0, 0.0, 0.01, 0.0],
    };
    let left = 1.0 - gain * period;
    let error = gain * gain * 0.01;
    let square = (0.3 * period + error * period * period) / (1.0 - left * left);
    // x(t) = (1 − kt)·x − kt·e + w(t) until the next decision.
    let kt = gain * period;
    let between = square * (1.0 - left.powi(3)) / (3.0 * kt)
        + error * period * period / 3.0
        + 0.3 * period / 2.0;
    let expected = 2.0 * between + 0.5 * (gain * gain * square + error);
    let cost = cost(&control, &noise, &weights, Loss::NONE);
    near(cost.expect("bounded"), expected, 1e-9);
}

#[test]
fn the_cost_of_a_double_integrator_matches_its_closed_form() {
    let (stiffness, damping) = (4.0, 3.0);
    let control = double_integrator(stiffness, damping, Timing::direct(hz(10_000.0)));
    let weights = Weights {
        state: [1.0, 0.0, 2.0, 0.0],
        action: 0.5,
    };
    let (velocity, position) = (0.3 / (2.0 * damping), 0.3 / (2.0 * damping * stiffness));
    let action = stiffness.powi(2) * position + damping.powi(2) * velocity;
    let cost = cost(&control, &PUSHED, &weights, Loss::NONE);
    let expected = position + 2.0 * velocity + 0.5 * action;
    near(cost.expect("bounded"), expected, 1e-3);
}

#[test]
fn a_loop_that_grows_has_no_bound_to_its_cost() {
    let control = scripted(WorldModel::Own(ms(10)), Timing::direct(hz(50.0)));
    let lost = Lost::Hold;
    let costs = [0.0, 0.2, 0.4, 0.5, 0.6]
        .map(|probability| pushed_cost(&control, Loss { probability, lost }));
    let [costs @ .., beyond] = costs;
    assert_eq!(beyond, None);
    assert!(costs.is_sorted_by(|a, b| a.is_some() && a < b));
}

fn unit(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Mean zero, variance 1. The mean square depends on nothing else.
fn disturbance(random: &mut Pcg64) -> f64 {
    (2.0 * unit(random) - 1.0) * 3.0_f64.sqrt()
}

/// The mean cost per second in a run of 10 ms steps; `force` returns the force during
/// each step from the states so far and the previous force.
fn run_cost(
    steps: usize,
    random: &mut Pcg64,
    mut force: impl FnMut(&[Vector4<f64>], f64) -> f64,
) -> f64 {
    let LinearPlant { a, b } = Dynamics::cart_pole().expect("plant").step(ms(10));
    let weights = Weights::default();
    let mut states = vec![Vector4::zeros()];
    let (mut action, mut cost) = (0.0, 0.0);
    for step in 0..steps {
        action = force(&states, action);
        let x = states[step];
        let squares = x.component_mul(&x).dot(&Vector4::from(weights.state));
        cost += squares + weights.action * action * action;
        let push = disturbance(random) * (PUSHED.push / 0.01_f64).sqrt();
        states.push(a * x + b * (action + push));
    }
    cost / steps as f64
}

fn scripted_force(x: &Vector4<f64>) -> f64 {
    Vector4::from(Scripted::GAINS).dot(x)
}

#[test]
fn the_cost_of_random_loss_matches_the_mean_of_a_long_run() {
    let control = scripted(WorldModel::Own(ms(10)), Timing::direct(hz(50.0)));
    for (lost, seed) in [(Lost::Hold, 1), (Lost::Zero, 2)] {
        let probability = 0.3;
        let loss = Loss { probability, lost };
        let cost = pushed_cost(&control, loss);
        let mut random = generator(&[seed]);
        let mut lottery = generator(&[seed, 1]);
        let run = run_cost(2_000_000, &mut random, |states, before| {
            let x = &states[states.len() - 1];
            match (states.len() % 2 == 1, unit(&mut lottery) < probability) {
                (false, _) => before,
                (true, false) => scripted_force(x),
                (true, true) if lost == Lost::Hold => before,
                (true, true) => 0.0,
            }
        });
        near(run, cost.expect("bounded"), 0.04);
    }
}

#[test]
fn the_cost_of_drawn_delays_matches_the_mean_of_many_runs() {
    const TICKS: u64 = 500;
    let mut random = generator(&[3]);
    // Sensed every 20 ms, applied 0 to 40 ms later, never before an earlier one.
    let mut last = 0;
    let pushes: Vec<_> = (0..TICKS)
        .map(|tick| {
            last = last.max(2 * tick + (unit(&mut random) * 5.0) as u64);
            (2 * tick, last)
        })
        .collect();
    let at = |step: u64| Time::ZERO + ms(10) * step as u32;
    let timed = pushes.iter().map(|&(sensed, applied)| TimedPush {
        sensed: at(sensed),
        applied: at(applied),
    });
    let timed: Vec<_> = timed.collect();
    let control = scripted(WorldModel::Own(ms(10)), Timing::direct(hz(50.0)));
    let cost = control.cost_along(&timed, &PUSHED, &Weights::default());
    let runs = (0..4_000).map(|_| {
        run_cost(last as usize, &mut random, |states, before| {
            let now = states.len() as u64 - 1;
            let newest = pushes.iter().rev().find(|(_, applied)| *applied <= now);
            newest.map_or(before, |(sensed, _)| {
                scripted_force(&states[*sensed as usize])
            })
        })
    });
    let run = runs.sum::<f64>() / 4_000.0;
    near(run, cost, 0.04);
}

#[test]
fn the_cost_of_a_long_uniform_run_matches_its_steady_state() {
    let control = scripted(WorldModel::Own(ms(1)), Timing::direct(hz(50.0)));
    let steady = pushed_cost(&control, Loss::NONE);
    let times = (0..20_000_u32).map(|tick| Time::ZERO + ms(20) * tick);
    let pushes = times.map(|at| TimedPush {
        sensed: at,
        applied: at,
    });
    let pushes: Vec<_> = pushes.collect();
    let along = control.cost_along(&pushes, &PUSHED, &Weights::default());
    near(along, steady.expect("bounded"), 0.01);
}

/// The table of figures on the page about theory.
fn table() -> Vec<String> {
    let rates = rates(50.0, 50.0);
    let policies = ["scripted", "lqr"].map(|policy| policy.parse().expect("policy"));
    let loops = policies.each_ref().map(|policy| {
        let gains = gains(policy, rates.control).expect("gains");
        let timing = Timing::direct(rates.control);
        Loop::cart_pole(gains, WorldModel::Continuous, timing).expect("plant")
    });
    let continuous = |control: &Loop| control.continuous_margins().expect("margins");
    let row = |name: &str, figures: [String; 2]| format!("| {name} | {} |", figures.join(" | "));
    let of_loops = |name, figure: &dyn Fn(&Loop) -> String| row(name, loops.each_ref().map(figure));
    let in_millis = |age: Duration| format!("{:.1} ms", millis(age));
    let share = |control: &Loop, lost| {
        let share = control.loss_margin(lost).expect("short");
        format!("{:.1} %", share * 100.0)
    };
    let age = policies.map(|policy| in_millis(age_limit(&policy, rates).expect("limit")));
    vec![
        of_loops("crossover, in continuous time", &|known| {
            format!("{:.1} rad/s", continuous(known).crossover)
        }),
        of_loops("phase margin", &|known| {
            format!("{:.0}°", continuous(known).phase_margin.to_degrees())
        }),
        of_loops("delay margin", &|known| in_millis(continuous(known).delay)),
        row("mean push age where deviations grow, at 50 Hz", age),
        of_loops("oldest push, whatever the timing", &|known| {
            in_millis(known.oldest_push().expect("stable"))
        }),
        of_loops("jitter margin, at 50 Hz", &|known| {
            in_millis(jitter(known).jitter)
        }),
        of_loops("random loss where squares grow, held", &|known| {
            share(known, Lost::Hold)
        }),
        of_loops("random loss where squares grow, no force", &|known| {
            share(known, Lost::Zero)
        }),
    ]
}

#[test]
fn the_figures_of_the_page_match_the_theory() {
    let page = include_str!("../docs/theory.md");
    let table = table().join("\n");
    assert!(page.contains(&table), "docs/theory.md should have\n{table}");
}

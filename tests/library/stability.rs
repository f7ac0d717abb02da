//! The predictions of linear theory hold in runs.

use ratelab_cart_pole::stability::{LONGEST, Rates, Stability, StabilityError, measured_growth};

use crate::support::*;

fn rates(sensor: f64, control: f64) -> Rates {
    Rates {
        sensor: hz(sensor),
        control: hz(control),
    }
}

fn theory(control: f64) -> Stability {
    Stability::for_rates(rates(50.0, control)).expect("a short hyper-period")
}

#[test]
fn growth_rates_match_an_independent_computation() {
    // Results of another program, to two decimals.
    let known = [8.34, 5.79, 1.91, 1.71, 0.25, 1.82];
    let known = known.into_iter().chain([-0.49; 40]);
    for (control, growth) in (5..=50).zip(known) {
        let ours = theory(f64::from(control)).growth();
        assert!((ours - growth).abs() < 0.005, "{control} Hz: {ours}");
    }
}

#[test]
fn at_10_hz_a_deviation_changes_sides_with_every_decision() {
    let theory = theory(10.0);
    let dominant = theory.multipliers()[0];
    assert_eq!(theory.hyper_period, Duration::from_millis(100));
    assert!((dominant.re - -1.199).abs() < 0.0005, "{dominant}");
    assert_eq!(dominant.im, 0.0);
    assert!(!theory.is_stable());
}

#[test]
fn the_spectral_radius_is_the_growth_over_one_hyper_period() {
    for control in [5.0, 7.0, 10.0, 50.0] {
        let theory = theory(control);
        let grown = (theory.growth() * theory.hyper_period.as_secs_f64()).exp();
        let radius = theory.spectral_radius();
        assert!((grown / radius - 1.0).abs() < 1e-12);
        assert!((theory.multipliers()[0].norm_sqr().sqrt() / radius - 1.0).abs() < 1e-12);
        assert_eq!(theory.is_stable(), radius < 1.0);
    }
    // They change sides at 10 Hz, and swing at 50 Hz.
    let [sides, swing] = [10.0, 50.0].map(|control| theory(control).multipliers()[0]);
    assert!(
        sides.re < 0.0 && sides.im == 0.0 && swing.im != 0.0,
        "{sides} {swing}"
    );
}

#[test]
fn a_long_hyper_period_overflows_nothing() {
    let theory = Stability::for_rates(rates(50.0, 1.001)).expect("exactly the longest");
    assert_eq!(theory.hyper_period, LONGEST);
    assert!(theory.growth().is_finite() && theory.growth() > 5.0);
}

#[test]
fn rates_with_a_long_hyper_period_are_refused_with_the_reason() {
    let refused = Stability::for_rates(rates(50.0, 7.3333)).expect_err("10,000 s");
    assert!(matches!(refused, StabilityError::Aperiodic { .. }));
    assert_eq!(
        refused.to_string(),
        "a sensor at 50 Hz and a policy at 7.3333 Hz meet the plant only every 10000 s: linear \
         theory is worked out up to 1000 s; use rates with fewer decimals"
    );
}

#[test]
fn a_run_grows_as_predicted_until_the_action_clips() {
    for control in [5.0, 6.0, 7.0, 8.0] {
        let theory = theory(control);
        let settled = secs(30.0);
        let steps = run_bytes(&config(&format!("until 60; 30 control-hz {control}"))).steps;
        let measured = measured_growth(&steps, settled, theory.hyper_period).expect("growth");
        let apart = (measured - theory.growth()).abs();
        assert!(apart < 0.005, "{control} Hz: {measured}");
    }
}

#[test]
fn no_growth_is_measured_in_too_short_a_run() {
    let steps = run_bytes(&Config::default()).steps;
    let measure = |from, period| measured_growth(&steps, secs(from), Duration::from_secs(period));
    assert!(measure(0.0, 2).is_some());
    assert_eq!(measure(0.0, 6), None);
    assert_eq!(measure(11.0, 1), None);
    assert_eq!(measure(0.0, 0), None);
}

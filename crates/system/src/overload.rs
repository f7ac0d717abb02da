//! Nodes that are asked for more than they can do, as their costs tell before the run.

use std::time::Duration;

use ratelab::{Draw, Hz, Knob, KnobKind, Overrun, millis};

use super::Setup;

/// The share of the time above which a load is an overload; the rest is rounding.
pub(crate) const FULL: f64 = 1.0 + 1e-9;

/// The number of skipped periods per tick from which a node has too much to do.
const OFTEN: f64 = 0.1;

/// Returns what a tick of `node` takes with `setup`.
pub(crate) fn cost_of(setup: &Setup, node: &str) -> Draw {
    setup
        .knob(KnobKind::Takes, node)
        .and_then(Knob::draw)
        .cloned()
        .unwrap_or(Draw::NONE)
}

/// Returns a warning that `node`, which has a core of its own and ticks at `hz`, is asked for more
/// than it can do with `setup`, and the share of its periods that it skips; `None` if it is not.
///
/// A tick that takes `k` periods and a bit skips `k` of them: the next one begins when the
/// first period after its end does. So the share is exact for any distribution of costs.
///
/// ```
/// use ratelab_system::{Setup, overload};
///
/// let setup = Setup::default().with("takes planner 60..110".parse()?);
/// let hz = ratelab::Hz::new(11.7)?;
/// assert_eq!(
///     overload("planner", hz, &setup).as_deref(),
///     Some(
///         "planner is overloaded: 49 % of its ticks take longer than the \
///          period of 85.5 ms, so it will skip 33 % of its periods"
///     )
/// );
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn overload(node: &str, hz: Hz, setup: &Setup) -> Option<String> {
    let (cost, period) = (cost_of(setup, node), FULL / hz.get());
    let beyond = |took: Duration| (took.as_secs_f64() / period).ceil() - 1.0;
    let skipped = cost.mean_of(|took| beyond(took).max(0.0))?;
    let (mean, late) = (
        cost.mean_of(|took| took.as_secs_f64())?,
        cost.mean_of(|took| f64::from(beyond(took) > 0.0))?,
    );
    let why = match mean * hz.get() {
        share if share > FULL => format!(
            "{} ms at {hz} is {:.0} % of its time",
            shortest_ms(mean),
            share * 1e2
        ),
        _ if skipped >= OFTEN && !waits(setup, node) => format!(
            "{:.0} % of its ticks take longer than the period of {} ms",
            late * 1e2,
            millis::text(1e3 / hz.get())
        ),
        _ => return None,
    };
    let then = if waits(setup, node) {
        "so more and more of its due times will wait".to_owned()
    } else {
        let share = skipped / (1.0 + skipped) * 1e2;
        format!("so it will skip {share:.0} % of its periods")
    };
    Some(format!("{node} is overloaded: {why}, {then}"))
}

/// Seconds as a number of milliseconds without zeros at its end.
pub(crate) fn shortest_ms(seconds: f64) -> f64 {
    let ms = seconds * 1e3;
    let digits = if ms < 1.0 { 1e3 } else { 1e1 };
    (ms * digits).round() / digits
}

/// Returns whether due times of `node` wait while it is busy.
fn waits(setup: &Setup, node: &str) -> bool {
    let late = setup.knob(KnobKind::Late, node);
    matches!(late, Some(Knob::Late { overrun, .. }) if *overrun != Overrun::default())
}

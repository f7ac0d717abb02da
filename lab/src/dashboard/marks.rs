//! Marks of turned knobs in the chart of a signal.

use ratelab::{Event, Time};
use ratelab_study::system::System;

use super::settings::in_words;

/// Length of the chart (s of run time).
pub const TRACE_S: f64 = 10.0;

/// The marks of `events` in a chart that ends at `now`.
pub fn marks<'a>(
    system: &dyn System,
    events: impl Iterator<Item = &'a Event>,
    now: Time,
) -> Vec<(f64, String)> {
    let since = now.as_secs_f64() - TRACE_S;
    let knobs = events.filter(|event| event.at.as_secs_f64() >= since);
    let knobs: Vec<_> = knobs.filter_map(Event::knob).collect();
    let marks = in_words(system, &knobs).into_iter();
    marks.map(|(at, text)| (at.as_secs_f64(), text)).collect()
}

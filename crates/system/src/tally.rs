//! Figures that a system makes of the messages of a run: counts, means, and what deviations cost long
//! before a run is lost.

use ratelab::Time;

/// Adds up the messages of some recorded topics.
pub trait RunTally: Send {
    /// Returns the names of the topics.
    fn topics(&self) -> &'static [&'static str];

    /// Takes a message of `topic`, as its [`Fields`](ratelab_metrics::Fields).
    fn message(&mut self, topic: &str, row: &[f64]);

    /// Returns the figures so far.
    fn figures(&self) -> Vec<SystemFigure>;
}

/// A figure of a whole run, for tables and programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemFigure {
    /// The block of figures that it belongs to; `None` for a figure on its own.
    pub block: Option<&'static str>,
    /// Name, such as `stalls`.
    pub name: &'static str,
    /// Its text for people, with `{}` for the value; empty for one that only programs need.
    pub text: &'static str,
    /// Value.
    pub value: FigureValue,
}

impl SystemFigure {
    /// Returns its text with the value in it; `None` without a text, or without a value.
    pub fn shown(&self) -> Option<String> {
        let value = match self.value {
            FigureValue::Count(count) => count.to_string(),
            FigureValue::Number(number) => format!("{:.3}", number?),
        };
        (!self.text.is_empty()).then(|| self.text.replace("{}", &value))
    }
}

/// The value of a [`SystemFigure`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FigureValue {
    /// A number of things.
    Count(u64),
    /// A quantity; `None` for a mean or a quantile of nothing.
    Number(Option<f64>),
}

/// The weighted sum of squares by which a system judges the states of its plant.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticCost {
    /// The sum with its weights, for people, such as `(x/2.4 m)^2 + u^2`; in
    /// ASCII.
    pub sum: &'static str,
    /// The sum at a message of the topic of states, given as its
    /// [`Fields`](ratelab_metrics::Fields).
    pub of_state: fn(&[f64]) -> f64,
}

/// The mean of a [`QuadraticCost`] over run time: a state counts for as long as it is
/// the newest. Before the first there is no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeanCost {
    first: Option<Time>,
    since: Time,
    newest: f64,
    area: f64,
}

impl MeanCost {
    /// At run time `now` a state comes that costs `cost`.
    pub fn state(&mut self, now: Time, cost: f64) {
        self.area = self.area_at(now);
        self.first.get_or_insert(now);
        (self.since, self.newest) = (now, cost);
    }

    /// Returns the mean until run time `end`; `None` if no time has passed since the first
    /// state.
    pub fn until(&self, end: Time) -> Option<f64> {
        let time = end.since(self.first?).as_secs_f64();
        (time > 0.0).then(|| self.area_at(end) / time)
    }

    fn area_at(&self, now: Time) -> f64 {
        self.area + self.newest * now.since(self.since).as_secs_f64()
    }
}

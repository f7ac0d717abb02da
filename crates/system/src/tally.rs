//! Figures that a system makes of the messages of a run.

/// Adds up the messages of some recorded topics.
pub trait RunTally: Send {
    /// Names of the topics.
    fn topics(&self) -> &'static [&'static str];

    /// Takes a message of `topic`, as its [`Fields`](ratelab_metrics::Fields).
    fn message(&mut self, topic: &str, row: &[f64]);

    /// The figures so far.
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
    /// Its text with the value in it; `None` without a text, or without a value.
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

//! The quantities of a cliff map.

use std::{num::NonZeroUsize, ops::ControlFlow, thread};

use crossbeam_channel::{Receiver, unbounded};
use ratelab::{Draw, Hz, Interrupt, Knob, KnobKind, millis};
use ratelab_experiment::sweep::{AxisError, Cell, CellResult, Sweep, SweepAxis, SweepError};
use ratelab_metrics::Snapshot;
use ratelab_real_clock::lower_priority;
use ratelab_system::{KnobText, Setup, System, names, paced_node};

use crate::knobs::KnobFocus;

/// Number of rates on a map.
const RATES: u32 = 30;

/// Number of parts of the usual rate: the rates are multiples of one part, 1 Hz to 30 Hz
/// for a usual rate of 50 Hz.
const PARTS: f64 = 50.0;

/// Maximum length of the rate in force for a column of its own; the cursor begins at the
/// nearest column otherwise.
const LONGEST: usize = 5;

/// Number of quantities.
pub const COUNT: usize = 4;

/// A knob with a number in it, and the range of that number.
pub struct KnobQuantity {
    number: usize,
    name: String,
    kind: KnobKind,
    /// The node or the topic.
    target: String,
    texts: Vec<String>,
}

impl KnobQuantity {
    /// Quantity `number` of the nodes and topics in `focus`: the first alias of a rate, or
    /// else the rate of the node; delay and loss of the first topic; the cost of the
    /// node.
    pub fn number(
        system: &dyn System,
        graph: &Snapshot,
        focus: &KnobFocus,
        setup: &Setup,
        number: usize,
    ) -> Self {
        let (kind, target, name) = named(system, focus, number);
        let texts = match number {
            0 => rates(system, target, rate_in_force(graph, setup, target)),
            2 => (0..=24)
                .map(|part| (f64::from(part * 4) / 100.0).to_string())
                .collect(),
            _ => (0..30).map(|part| (part * 4).to_string()).collect(),
        };
        Self {
            number,
            name,
            kind,
            target: target.to_owned(),
            texts,
        }
    }

    /// Returns its knobs, set to its values.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob.
    pub fn axis(&self, system: &dyn System) -> Result<SweepAxis, AxisError> {
        let knobs = KnobText(system.knobs().aliases());
        SweepAxis::from_texts(knobs, &self.name, self.texts.iter().cloned())
    }

    /// Returns whether it is the same quantity of the nodes and topics in `focus`.
    pub fn is_of(&self, system: &dyn System, focus: &KnobFocus) -> bool {
        named(system, focus, self.number).2 == self.name
    }

    /// Returns whether `value` has a column of its own, if it can have one.
    pub fn covers(&self, value: f64) -> bool {
        let text = value.to_string();
        self.number != 0 || text.len() > LONGEST || self.texts.contains(&text)
    }

    /// Returns the value in force.
    pub fn value(&self, graph: &Snapshot, setup: &Setup) -> f64 {
        match (setup.knob(self.kind, &self.target), self.number) {
            (_, 0) => rate_in_force(graph, setup, &self.target),
            (Some(Knob::Link { link, .. }), 2) => link.loss,
            (Some(Knob::Link { link, .. }), _) => link.delay_ms().unwrap_or_default(),
            (Some(Knob::Takes { cost, .. }), _) => match cost.draw {
                Draw::Constant(cost) => millis::to_millis(cost),
                _ => 0.0,
            },
            _ => 0.0,
        }
    }

    /// Returns a short name with its unit.
    pub fn heading(&self) -> String {
        names::label(&self.name) + self.unit()
    }

    /// Returns a value with its unit.
    pub fn with_unit(&self, value: &str) -> String {
        value.to_owned() + self.unit()
    }

    /// Returns its unit, after a blank.
    pub fn unit(&self) -> &'static str {
        names::unit(&self.name, self.kind)
    }
}

/// Returns the kind, the node or topic, and the name of a quantity: the rate is that of the first
/// alias of one, or else of the node.
fn named<'a>(
    system: &dyn System,
    focus: &'a KnobFocus,
    number: usize,
) -> (KnobKind, &'a str, String) {
    let node = focus.node.as_str();
    let topic = focus.topics.first().map_or("", String::as_str);
    match (number, names::first_alias(system, KnobKind::Rate)) {
        (0, Some(alias)) => {
            let node = paced_node(system).unwrap_or(node);
            (KnobKind::Rate, node, alias.name.to_owned())
        }
        (0, None) => (KnobKind::Rate, node, format!("rate {node}")),
        (1, _) => (KnobKind::Link, topic, format!("link {topic} delay:{{}}")),
        (2, _) => (KnobKind::Link, topic, format!("link {topic} loss:{{}}")),
        _ => (KnobKind::Takes, node, format!("takes {node}")),
    }
}

/// Returns the rate of `node` (Hz).
fn rate_in_force(graph: &Snapshot, setup: &Setup, node: &str) -> f64 {
    let runs = graph.node(node).map_or(PARTS, |node| node.hz.get());
    setup.rate(node).map_or(runs, Hz::get)
}

/// Returns the rates of a map, ascending: the multiples of a part of the usual rate of `node`, and
/// the one in force.
fn rates(system: &dyn System, node: &str, in_force: f64) -> Vec<String> {
    let alias = names::rate_alias(system, |of| of == node);
    let part = alias
        .and_then(|alias| alias.default.parse().ok())
        .unwrap_or(in_force)
        / PARTS;
    let mut rates: Vec<f64> = (1..=RATES).map(|number| part * f64::from(number)).collect();
    // Its digits are rows of the map.
    if in_force.to_string().len() <= LONGEST && !rates.contains(&in_force) {
        rates.push(in_force);
        rates.sort_by(f64::total_cmp);
    }
    rates
        .into_iter()
        .filter_map(|hz| Hz::new(hz).ok())
        .map(|hz| hz.get().to_string())
        .collect()
}

/// A run and its result.
pub type Made = (Cell, CellResult);

/// A sweep on one low-priority thread, for the time that graph and screen leave idle.
/// Ends when dropped.
pub struct Fill {
    made: Receiver<Result<Made, SweepError>>,
    interrupt: Interrupt,
}

impl Fill {
    /// Starts the runs of `sweep`.
    pub fn start(sweep: Sweep) -> Self {
        // The queue holds at most one item per cell.
        let (sender, made) = unbounded();
        let interrupt = Interrupt::default();
        let asked = interrupt.clone();
        // Dropping does not wait for its end, which may take long on a busy machine.
        thread::spawn(move || {
            lower_priority();
            let swept = sweep.run_until(&asked, NonZeroUsize::MIN, |cell, outcome| {
                let told = sender.send(Ok((cell.clone(), outcome.clone())));
                match told {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()),
                }
            });
            if let Err(error) = swept {
                let _ = sender.send(Err(error)); // The receiver may be gone.
            }
        });
        Self { made, interrupt }
    }

    /// Returns the next finished run, if any.
    ///
    /// # Errors
    /// [`SweepError`] if a run failed; it is the last item.
    pub fn next(&self) -> Result<Option<Made>, SweepError> {
        self.made.try_recv().ok().transpose()
    }

    /// Waits for the next finished run, in place of looking for it again and again: its thread
    /// has a low priority.
    #[cfg(test)]
    pub fn wait(&self) {
        let mut select = crossbeam_channel::Select::new();
        select.recv(&self.made);
        select.ready();
    }

    #[cfg(test)]
    pub fn nobody() -> Self {
        Self {
            made: crossbeam_channel::never(),
            interrupt: Interrupt::default(),
        }
    }
}

impl Drop for Fill {
    fn drop(&mut self) {
        self.interrupt.ask();
    }
}

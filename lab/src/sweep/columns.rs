//! The knobs of a sweep as columns of a table.

use ratelab::{Knob, KnobKind};
use ratelab_experiment::sweep::{Cell, Sweep};
use ratelab_system::{Alias, names};

use crate::printable::in_line;

/// A knob of the runs of a sweep, swept or fixed.
#[derive(Clone)]
pub struct Column {
    /// Name of the knob.
    pub name: String,
    /// Kind of the knob.
    pub kind: KnobKind,
    alias: Option<&'static Alias>,
}

/// Puts `list` into the order of a sweep: messages change slowest, entry `main` fastest.
pub fn slowest_first<T>(mut list: Vec<T>, main: usize, kind: impl Fn(&T) -> KnobKind) -> Vec<T> {
    let main = (main < list.len()).then(|| list.remove(main));
    list.sort_by_key(|entry| kind(entry) != KnobKind::Send);
    list.extend(main);
    list
}

/// Returns the aliases of the system, and the other swept knobs.
pub fn all(sweep: &Sweep) -> Vec<Column> {
    let setup = &sweep.base.setup;
    let aliases = names::shown(&*sweep.system, |alias| {
        sweep.axis(alias.name).is_some() || names::is_set(alias, setup)
    });
    let known = |name: &str| aliases.iter().any(|alias| alias.name == name);
    let others = sweep
        .axes
        .iter()
        .filter(|axis| !known(&axis.name))
        .map(|axis| Column {
            name: axis.name.clone(),
            kind: axis.kind,
            alias: None,
        });
    let named = aliases.iter().map(|alias| Column {
        name: alias.name.to_owned(),
        kind: alias.kind(),
        alias: Some(alias),
    });
    slowest_first(named.chain(others).collect(), 0, |column| column.kind)
}

/// Returns the knob that changes fastest.
pub fn main(sweep: &Sweep) -> Option<Column> {
    let axis = sweep.axes.last()?;
    all(sweep)
        .into_iter()
        .find(|column| column.name == axis.name)
}

impl Column {
    /// Returns the number of values.
    pub fn count(&self, sweep: &Sweep) -> usize {
        sweep.axis(&self.name).map_or(1, |axis| axis.values.len())
    }

    /// Returns whether an axis with another name turns its knobs, such as `takes policy` for
    /// `think-ms`.
    pub fn is_swept_by_another(&self, sweep: &Sweep) -> bool {
        let Some(alias) = self.alias else {
            return false;
        };
        let turns = |knob: &Knob| {
            let mut knobs = alias.knobs.iter();
            knobs.any(|(kind, of)| knob.kind() == *kind && knob.subject() == *of)
        };
        let others = sweep.axes.iter().filter(|axis| axis.name != self.name);
        let mut values = others.filter_map(|axis| axis.values.first());
        values.any(|value| value.knobs.iter().any(turns))
    }

    /// Returns the value in `cell`.
    pub fn value(&self, sweep: &Sweep, cell: &Cell) -> String {
        match self.alias {
            Some(alias) => alias.value(&sweep.config(cell).setup),
            None => cell.value(&self.name).unwrap_or_default().to_owned(),
        }
    }

    /// Returns the short form of the value in `cell`, printable.
    pub fn short(&self, sweep: &Sweep, cell: &Cell) -> String {
        in_line(&match self.alias {
            Some(alias) => names::short_value(&*sweep.system, alias, &sweep.config(cell).setup),
            None => self.value(sweep, cell),
        })
    }

    /// Returns the subject of the knob, such as `control` or `queue depth`.
    pub fn label(&self) -> String {
        names::label(&self.name)
    }

    /// Returns the label with its unit, if the values have one.
    pub fn heading(&self) -> String {
        self.label() + names::unit(&self.name, self.kind)
    }

    /// Returns a value with its unit.
    pub fn with_unit(&self, value: &str) -> String {
        let unit = match value.parse::<f64>() {
            Ok(_) => names::unit(&self.name, self.kind),
            Err(_) => "",
        };
        value.to_owned() + unit
    }

    /// Returns a noun for its values: `control rate`, `depth`, `policy`.
    pub fn noun(&self) -> String {
        match (self.kind, self.alias) {
            (KnobKind::Rate, _) => self.label() + " rate",
            (KnobKind::Depth, Some(_)) => "depth".to_owned(),
            (KnobKind::Send, Some(_)) if self.name.contains('-') => self.label() + " setting",
            _ => self.label(),
        }
    }

    /// Returns a value with enough of the name to distinguish it from others.
    pub fn tag(&self, value: &str) -> String {
        match self.kind {
            KnobKind::Depth => format!("{} {value}", self.noun()),
            KnobKind::Send => value.to_owned(),
            _ => format!("{} {value}", self.label()),
        }
    }
}

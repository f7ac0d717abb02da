//! The columns of a sweep: its knobs, and the parts of its ages.

use ratelab::{Knob, KnobKind};
use ratelab_experiment::sweep::{Cell, CellResult, Sweep};
use ratelab_recording::printable::in_line;
use ratelab_system::{Alias, names};

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
pub fn knob_columns(sweep: &Sweep) -> Vec<Column> {
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
pub fn main_knob(sweep: &Sweep) -> Option<Column> {
    let axis = sweep.axes.last()?;
    knob_columns(sweep)
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
            alias
                .knobs
                .iter()
                .any(|(kind, of)| knob.kind() == *kind && knob.subject() == *of)
        };
        sweep
            .axes
            .iter()
            .filter(|axis| axis.name != self.name)
            .filter_map(|axis| axis.values.first())
            .any(|value| value.knobs.iter().any(turns))
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

/// The mean of an age, or of one of its parts.
#[derive(Clone, PartialEq)]
pub struct PartColumn {
    /// The chain; `None` for the push.
    chain: Option<String>,
    /// What it is, and whose; `None` for the age itself.
    part: Option<(&'static str, String)>,
}

/// Returns the columns of all `results`: the columns of an age side by side, in the order of their
/// first occurrence.
pub fn part_columns<'r>(results: impl Iterator<Item = &'r CellResult>) -> Vec<PartColumn> {
    let mut columns: Vec<PartColumn> = Vec::new();
    for age in results.flat_map(|result| &result.ages) {
        let keys = age
            .parts
            .iter()
            .map(|part| (part.stage.key(), part.owner.clone()));
        for part in [None].into_iter().chain(keys.map(Some)) {
            let chain = age.chain.clone();
            let column = PartColumn { chain, part };
            if !columns.contains(&column) {
                let after = columns
                    .iter()
                    .rposition(|known| known.chain == column.chain);
                columns.insert(after.map_or(columns.len(), |after| after + 1), column);
            }
        }
    }
    columns
}

impl PartColumn {
    /// Returns its name, with the unit.
    pub fn name(&self) -> String {
        let of = self.chain.as_deref().unwrap_or("push");
        match &self.part {
            None => format!("{of} age ms"),
            Some((key, owner)) => format!("{of} {key} {owner} ms"),
        }
    }

    /// Returns its value in a run (ms): zero for a part that an age lacks.
    pub fn value(&self, result: &CellResult) -> Option<f64> {
        let age = result.ages.iter().find(|age| age.chain == self.chain)?;
        let ns = match &self.part {
            None => age.mean_ns,
            Some((key, owner)) => {
                let part = age.parts.iter().find(|part| part.is(key, owner));
                part.map_or(0, |part| part.ns)
            }
        };
        Some(ns as f64 / 1e6)
    }
}

//! Tables of columns, by which rows are written, read, digested and compared.

use ratelab::{Time, Topology};

/// A row of numbers in a file: a message without its payload, or a tick.
pub trait RecordRow: Clone + Send + Sync + 'static {
    /// What one is called.
    const KIND: &'static str;
    /// Whether it has a payload of numbers.
    const HAS_PAYLOAD: bool;
    /// The table of its columns.
    const COLUMNS: &'static [RecordColumn];
    /// Its list of numbers, if any.
    const LIST: Option<ListColumn> = None;

    /// Returns its number, counted from the beginning of the run.
    fn number(&self) -> u64;

    /// Returns its run time.
    fn at(&self) -> Time;

    /// Returns whether it may come after `last`.
    fn follows(&self, last: &Self) -> bool;

    /// Returns whether nothing of it happens before it.
    fn is_possible(&self) -> bool;

    /// Returns the number in each of its columns: a count, or nanoseconds.
    fn cells(&self) -> Vec<Option<u64>>;

    /// Returns the numbers in its list.
    fn list(&self) -> Vec<u64> {
        Vec::new()
    }

    /// Returns whether all nodes and topics that it names are in the graph.
    fn is_in(&self, topology: &Topology) -> bool;

    /// Creates the row with these cells and this list; `None` if they do not fit.
    fn from_cells(cells: &[Option<u64>], list: &[u64]) -> Option<Self>;
}

/// A column of numbers.
pub struct RecordColumn {
    /// Name of its component; empty if it has none of its own.
    pub name: &'static str,
    /// Its name in a difference.
    pub what: &'static str,
    /// How it is written.
    pub form: ColumnForm,
}

/// A column with a list of numbers in each row.
pub struct ListColumn {
    /// Name of its component.
    pub name: &'static str,
    /// Its name in a difference.
    pub what: &'static str,
}

/// How a column is written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum ColumnForm {
    /// A count, in every row.
    Count,
    /// Run time: the row's place on the timeline.
    RunTime,
    /// An optional time.
    Nanos,
    /// A duration of the wall, where the clock measures one: a run that comes again may not.
    Wall,
    /// A time. The column is missing in a file where no row has one.
    Rare,
    /// A number, as [`Rare`](Self::Rare).
    RareCount,
    /// A time, unless it is that of the row. The column may be missing.
    Stamp,
    /// As [`Stamp`](Self::Stamp), or `LOST` if there is none.
    Delivery,
    /// A duration, to be plotted (µs): exact to the nanosecond up to 26 days. NaN without one.
    Plot,
}

impl RecordColumn {
    /// Creates the column with the component `name`, called `what` in a difference.
    pub const fn new(name: &'static str, what: &'static str, form: ColumnForm) -> Self {
        Self { name, what, form }
    }

    /// Returns the number in `cell`, in words.
    pub fn told(&self, cell: Option<u64>) -> String {
        match (cell, self.form) {
            (None, _) => "none".to_owned(),
            (Some(count), ColumnForm::Count | ColumnForm::RareCount) => count.to_string(),
            (Some(nanos), _) => format!("{nanos} ns"),
        }
    }

    /// Returns whether the column is missing in a file where no row has a number in it.
    pub fn is_rare(&self) -> bool {
        matches!(self.form, ColumnForm::Rare | ColumnForm::RareCount)
    }

    /// Returns whether each row has a number in this column.
    pub fn is_full(&self) -> bool {
        use ColumnForm::{Count, RunTime, Stamp};
        matches!(self.form, Count | RunTime | Stamp)
    }

    /// Returns whether the number of a `computed` row is not that of the recorded one. A duration
    /// of the wall may be missing in a run that comes again.
    pub fn differs(&self, recorded: Option<u64>, computed: Option<u64>) -> bool {
        let known = self.form != ColumnForm::Wall || computed.is_some();
        known && recorded != computed
    }
}

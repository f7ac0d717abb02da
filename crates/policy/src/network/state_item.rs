//! Something of a state dictionary, and what has no part in the action.

/// Beginnings of the first part of a name which has no part in the action.
const BESIDE: [&str; 5] = ["critic", "value", "vf", "qf", "optim"];

/// Parts of names of what has no part in the action.
const ASIDE: [&str; 4] = ["value_net", "critic.", "_target.", "optimizer"];

/// Parts of names of the deviation of exploration.
const DEVIATION: [&str; 2] = ["logstd", "log_std"];

/// Its whole names in rsl_rl, where they tell the library.
pub(super) const DEVIATIONS: [&str; 2] = ["std", "distribution.std_param"];

/// Something of a state dictionary.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateItem<'f> {
    pub(super) name: &'f str,
    pub(super) kind: StateKind<'f>,
}

/// What it is.
#[derive(Clone, Copy, Debug)]
pub(super) enum StateKind<'f> {
    /// A tensor of this shape.
    Tensor(&'f [usize]),
    /// A plain number.
    Number,
    /// A text.
    Text(&'f str),
    /// Nothing, or a truth value.
    Flag,
    /// A layer, with or without tensors.
    Layer,
    /// Something that holds other values, of this name.
    Container(&'static str),
}

impl StateKind<'_> {
    /// Returns what it is, in words.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Tensor(_) => "a tensor",
            Self::Number => "a number",
            Self::Text(_) => "a string",
            Self::Flag => "a truth value, or None",
            Self::Layer => "a layer",
            Self::Container(name) => name,
        }
    }
}

/// Returns whether something of this name has no part in the action.
pub(super) fn is_beside(name: &str) -> bool {
    let name = name.to_lowercase();
    let has = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
    BESIDE.iter().any(|beside| name.starts_with(beside))
        || has(&DEVIATION)
        || has(&ASIDE)
        || DEVIATIONS.contains(&&*name)
}

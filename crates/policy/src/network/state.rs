//! The tensors of an actor, by the library that named them.

use super::error::{listed, quoted, unfit};
use crate::{WeightsError, format::ProgramKind};

/// The tensors of the actor, in the order of their use.
pub(super) const ACTOR: [&str; 6] = [
    "actor_mean.0.weight",
    "actor_mean.0.bias",
    "actor_mean.2.weight",
    "actor_mean.2.bias",
    "actor_mean.4.weight",
    "actor_mean.4.bias",
];

/// The layers of the actor, with the activations between them.
const LAYERS: [&str; 6] = [
    "actor_mean",
    "actor_mean.0",
    "actor_mean.1",
    "actor_mean.2",
    "actor_mean.3",
    "actor_mean.4",
];

/// Beginnings of the first part of a name which has no part in the action.
const BESIDE: [&str; 5] = ["critic", "value", "vf", "qf", "optim"];

/// Parts of names of the deviation of exploration.
const DEVIATION: [&str; 2] = ["logstd", "log_std"];

/// Parts of names of a normaliser.
const NORMALISER: [&str; 6] = ["mean", "var", "std", "rms", "norm", "scaler"];

/// Parts of names of settings that change what the actor sees or says.
const CHANGES: [&str; 5] = ["scale", "bias", "clip", "norm", "offset"];

/// The longest name that is looked at (bytes): a file may have thousands of names as long as itself.
const LONGEST_NAME: usize = 256;

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

/// Everything in a state dictionary, sorted by name.
pub(super) struct StateItems<'f> {
    items: Vec<StateItem<'f>>,
    /// A state dictionary within it, and the names there.
    nested: Option<(&'f str, Vec<&'f str>)>,
}

/// Returns the part of a name that is looked at.
fn beginning(name: &str) -> &str {
    &name[..name.floor_char_boundary(LONGEST_NAME)]
}

impl<'f> StateItems<'f> {
    pub(super) fn new(
        mut items: Vec<StateItem<'f>>,
        nested: Option<(&'f str, Vec<&'f str>)>,
    ) -> Self {
        for item in &mut items {
            item.name = beginning(item.name);
        }
        items.sort_by_key(|item| item.name);
        let nested = nested.map(|(under, names)| {
            let mut names: Vec<&str> = names.into_iter().map(beginning).collect();
            names.sort_unstable();
            (under, names)
        });
        Self { items, nested }
    }

    /// Checks that nothing beside the tensors of the actor, which sees so many numbers, changes its action.
    pub(super) fn check(&self, inputs: usize) -> Result<(), WeightsError> {
        let unused = |item: &StateItem<'f>| Some((item.name, unused(item, inputs)?));
        let is_layer = |item: &&StateItem<'_>| matches!(item.kind, StateKind::Layer);
        // A layer with weights is named by these.
        let (layers, others): (Vec<_>, Vec<_>) = self.items.iter().partition(is_layer);
        let mut items = others.into_iter().chain(layers);
        items.find_map(unused).map_or(Ok(()), |(name, what)| {
            Err(unfit(format!(
                "expected nothing that changes the action beside actor_mean.0, .2 and .4 (two \
                 hidden layers of tanh), found {} ({what})",
                quoted(name)
            )))
        })
    }

    /// Returns the error for a tensor of the actor that is missing.
    pub(super) fn missing(&self, name: &str) -> WeightsError {
        let found = self.found(name);
        let why = format!("expected a tensor {name:?}, found {found}");
        let nested = self.nested.iter().flat_map(|(_, names)| names);
        let names = self
            .items
            .iter()
            .map(|item| item.name)
            .chain(nested.copied());
        match Library::detect(names) {
            Some(library) => WeightsError::Unfit {
                why: format!("{why}: this is {}", library.what),
                program: Some(library.program),
            },
            None => unfit(why),
        }
    }

    /// Returns what is there in the place of the tensor called `name`.
    fn found(&self, name: &str) -> String {
        if let Some((under, names)) = &self.nested {
            let names_listed = listed(names.iter().copied());
            let remedy = if names.contains(&name) {
                ": save that one alone"
            } else {
                ""
            };
            return format!(
                "a state_dict nested under {} ({names_listed}){remedy}",
                quoted(under)
            );
        }
        let mut names = self.items.iter().map(|item| item.name);
        if let Some((prefix, inner)) = names.find_map(|found| {
            let prefix = found.strip_suffix(name)?;
            prefix.ends_with('.').then_some((prefix, found))
        }) {
            return format!(
                "{}: save the state_dict of the module inside, whose names lack {}",
                quoted(inner),
                quoted(prefix)
            );
        }
        let mut same = self.items.iter();
        if let Some(same) = same.find(|item| item.name == name) {
            return format!("{} of that name", same.kind.name());
        }
        let tensors: Vec<&str> = self
            .items
            .iter()
            .filter(|item| !matches!(item.kind, StateKind::Layer))
            .map(|item| item.name)
            .collect();
        match tensors[..] {
            [] => "no tensors".to_owned(),
            _ => listed(tensors.into_iter()),
        }
    }
}

impl StateKind<'_> {
    fn name(self) -> &'static str {
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

/// Returns what `item` is, if it would change the action and is not read.
fn unused(item: &StateItem, inputs: usize) -> Option<&'static str> {
    let name = item.name.to_lowercase();
    let has = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
    if ACTOR.contains(&item.name) || LAYERS.contains(&item.name) {
        return None;
    }
    if name.starts_with("actor_mean") {
        return Some("another layer of the actor");
    }
    if BESIDE.iter().any(|beside| name.starts_with(beside)) || has(&DEVIATION) {
        return None;
    }
    let is_of_the_policy = has(&["act", "obs"]);
    match item.kind {
        StateKind::Tensor([size] | [1, size]) if *size == inputs => {
            Some("it looks like a normaliser")
        }
        StateKind::Tensor(_) | StateKind::Container(_) if has(&NORMALISER) => {
            Some("it looks like a normaliser")
        }
        StateKind::Tensor(_) | StateKind::Container(_) => Some("nothing here knows its use"),
        StateKind::Text(text) if name.contains("activation") => {
            let is_tanh = text.to_lowercase().ends_with("tanh");
            (!is_tanh).then_some("another activation")
        }
        StateKind::Text(_) | StateKind::Number if is_of_the_policy && has(&CHANGES) => {
            Some("it scales, moves or clips what the actor sees or says")
        }
        StateKind::Text(_) | StateKind::Number | StateKind::Flag | StateKind::Layer => None,
    }
}

/// A library, by a part of a name that only its policies have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Library {
    sign: &'static str,
    /// What its state dictionary is, for messages.
    pub(super) what: &'static str,
    /// The kind of program that runs its policies.
    pub(super) program: ProgramKind,
}

const LIBRARIES: [Library; 6] = [
    stable_baselines("mlp_extractor."),
    stable_baselines("actor.latent_pi."),
    stable_baselines("q_net.q_net."),
    stable_baselines("actor.mu.0."),
    Library {
        sign: "net_container.",
        what: "a policy of skrl",
        program: ProgramKind::Module,
    },
    Library {
        sign: "a2c_network.",
        what: "a policy of rl_games",
        program: ProgramKind::Module,
    },
];

const fn stable_baselines(sign: &'static str) -> Library {
    Library {
        sign,
        what: "a policy of Stable-Baselines3 (save the model with model.save)",
        program: ProgramKind::Sb3,
    }
}

impl Library {
    /// Detects the library that wrote these `names`, if it is known.
    pub(super) fn detect<'n>(mut names: impl Iterator<Item = &'n str>) -> Option<Self> {
        let sign = |name: &str| LIBRARIES.iter().find(|known| name.starts_with(known.sign));
        names.find_map(sign).copied()
    }
}

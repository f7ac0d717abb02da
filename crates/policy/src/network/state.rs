//! The tensors of an actor, by the library that named them.

use super::{
    Mlp,
    activation::Activation,
    chain::{LayerChain, NoChain},
    error::{listed, quoted, unfit},
    normaliser::Normaliser,
    state_item::{DEVIATIONS, StateItem, StateKind, is_beside},
    tensor::Tensor,
};
use crate::{WeightsError, format::ProgramKind};

/// Parts of names of a normaliser.
const NORMALISER: [&str; 6] = ["mean", "var", "std", "rms", "norm", "scaler"];

/// Parts of names of settings that change what the actor sees or says.
const CHANGES: [&str; 5] = ["scale", "bias", "clip", "norm", "offset"];

/// The tensor that is missed where nothing looks like a policy: the first one of the course's agent.
const FIRST: &str = "actor_mean.0.weight";

/// The longest name that is looked at (bytes): a file may have thousands of names as long as itself.
const LONGEST_NAME: usize = 256;

/// What is known of a network beside its state dictionary.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NetworkSettings {
    /// The activation, whatever the dictionary says.
    pub(super) activation: Option<Activation>,
    /// Whether it is in a model of Stable-Baselines3, which says the rest.
    pub(super) is_in_model: bool,
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

    /// Checks that nothing around the dictionary changes what the policy in it sees.
    pub(super) fn check_around(&self, chosen: &str) -> Result<(), WeightsError> {
        let sees = |item: &&StateItem<'_>| {
            let name = item.name.to_lowercase();
            let parts = NORMALISER.iter().chain(&["preprocess"]);
            let is_whole = matches!(item.kind, StateKind::Container(_) | StateKind::Tensor(_));
            is_whole && item.name != chosen && parts.clone().any(|part| name.contains(part))
        };
        self.items.iter().find(sees).map_or(Ok(()), |item| {
            Err(unfit(format!(
                "expected nothing that changes the action beside {}, found {} (it looks like a \
                 normaliser)",
                quoted(chosen),
                quoted(item.name)
            )))
        })
    }

    /// Returns whether a policy is in it, with all its tensors.
    pub(super) fn has_policy(&self, settings: NetworkSettings) -> bool {
        let chain = self.chain(settings);
        chain.is_ok_and(|chain| chain.is_whole(&self.items))
    }

    /// Finds the layers of the policy.
    ///
    /// # Errors
    /// [`NoChain`] if there are none, or several.
    fn chain(&self, settings: NetworkSettings) -> Result<LayerChain<'f>, NoChain> {
        match Library::detect(self.items.iter().map(|item| item.name)) {
            // What their layers do is not in the dictionary.
            Some(library) if !library.is_plain && !settings.is_in_model => Err(NoChain::None),
            _ => LayerChain::find(&self.items),
        }
    }

    /// Returns the activation that a setting names.
    ///
    /// # Errors
    /// [`WeightsError`] for one that is not computed here.
    pub(super) fn activation(&self) -> Result<Option<Activation>, WeightsError> {
        let mut settings = self.items.iter().filter_map(|item| match item.kind {
            StateKind::Text(text) if item.name.to_lowercase().contains("activation") => {
                Some((item.name, text))
            }
            _ => None,
        });
        let is_of_rsl_rl = |item: &StateItem<'_>| DEVIATIONS.contains(&item.name);
        if self.items.iter().any(is_of_rsl_rl) {
            return Err(unfit(
                "found a policy of rsl_rl, whose activation is in no file: name it, as in \
                 model.pt#elu"
                    .to_owned(),
            ));
        }
        settings.next().map_or(Ok(None), |(name, text)| {
            let found = Activation::named(text);
            found
                .map(Some)
                .ok_or_else(|| unfit(format!("found {} (another activation)", quoted(name))))
        })
    }

    /// Reads the network in it from the tensors that `read` returns by name.
    ///
    /// # Errors
    /// [`WeightsError`] if there is no network, or something would change its answers.
    pub(super) fn network(
        &self,
        settings: NetworkSettings,
        mut read: impl FnMut(&str) -> Result<Tensor, WeightsError>,
    ) -> Result<Mlp, WeightsError> {
        let chain = self.chain(settings).map_err(|why| match why {
            NoChain::None => self.missing(FIRST),
            NoChain::Other(what) => {
                unfit(format!("expected a chain of linear layers, found {what}"))
            }
        })?;
        let activation = match settings.activation {
            None => self.activation()?.unwrap_or_default(),
            Some(activation) => activation,
        };
        let mlp = Mlp::from_chain(&chain, activation, &mut read)?;
        self.check(&chain, settings)?;
        let normaliser = Normaliser::stem(&self.items)
            .map(|stem| Normaliser::read(stem, mlp.inputs(), read))
            .transpose()?;
        Ok(mlp.behind(normaliser))
    }

    /// Checks that nothing beside the layers of `chain` changes its action.
    fn check(&self, chain: &LayerChain<'_>, settings: NetworkSettings) -> Result<(), WeightsError> {
        let normaliser = Normaliser::stem(&self.items);
        let is_read = |name| normaliser.is_some_and(|stem| Normaliser::has(stem, name));
        let unused = |item: &StateItem<'f>| {
            let what = unused(item, chain).filter(|_| !is_read(item.name))?;
            Some((item.name, what))
        };
        let is_layer = |item: &&StateItem<'_>| matches!(item.kind, StateKind::Layer);
        // A layer with weights is named by these.
        let (layers, others): (Vec<_>, Vec<_>) = self.items.iter().partition(is_layer);
        let layers = layers.into_iter().filter(|_| !settings.is_in_model);
        others
            .into_iter()
            .chain(layers)
            .find_map(unused)
            .map_or(Ok(()), |(name, what)| {
                let layers: Vec<&str> = chain.layers.iter().map(|layer| layer.name).collect();
                Err(unfit(format!(
                    "expected nothing that changes the action beside {}, found {} ({what})",
                    layers.join(", "),
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

/// Returns what `item` is, if it would change the action and is not read.
fn unused(item: &StateItem, chain: &LayerChain<'_>) -> Option<&'static str> {
    let name = item.name.to_lowercase();
    let has = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
    if chain.has(item.name) {
        return None;
    }
    if is_beside(&name) {
        return None;
    }
    if chain.is_changed_by(item.name, matches!(item.kind, StateKind::Layer)) {
        return Some("another layer of the actor");
    }
    let inputs = chain.layers.first().map_or(0, |layer| layer.shape[1]);
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
            let is_known = Activation::named(text).is_some();
            (!is_known).then_some("another activation")
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
    /// Whether they are linear layers with a hyperbolic tangent in between.
    is_plain: bool,
}

const LIBRARIES: [Library; 6] = [
    stable_baselines("mlp_extractor.", true),
    stable_baselines("actor.latent_pi.", false),
    stable_baselines("q_net.q_net.", false),
    stable_baselines("actor.mu.0.", false),
    Library {
        sign: "net_container.",
        what: "a policy of skrl",
        program: ProgramKind::Module,
        is_plain: false,
    },
    Library {
        sign: "a2c_network.",
        what: "a policy of rl_games",
        program: ProgramKind::Module,
        is_plain: false,
    },
];

const fn stable_baselines(sign: &'static str, is_plain: bool) -> Library {
    Library {
        sign,
        what: "a policy of Stable-Baselines3 (save the model with model.save)",
        program: ProgramKind::Sb3,
        is_plain,
    }
}

impl Library {
    /// Detects the library that wrote these `names`, if it is known.
    pub(super) fn detect<'n>(mut names: impl Iterator<Item = &'n str>) -> Option<Self> {
        let sign = |name: &str| LIBRARIES.iter().find(|known| name.starts_with(known.sign));
        names.find_map(sign).copied()
    }
}

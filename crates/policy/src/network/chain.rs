//! Which tensors of a state dictionary are the layers of the policy: a chain of linear layers, by
//! their names and shapes.

use super::state_item::{StateItem, StateKind, is_beside};

/// Last parts of names of a policy's own layers, where there are others; the most telling one first.
const BODIES: [&str; 9] = [
    "actor_mean",
    "policy_net",
    "latent_pi",
    "mu",
    "actor",
    "pi",
    "policy",
    "q_net",
    "mlp",
];

/// Names of the last layer, where it stands by itself.
const HEADS: [&str; 9] = [
    "action_net",
    "mu",
    "mean",
    "actor_mean",
    "fc_mu",
    "action_head",
    "actor_head",
    "output",
    "head",
];

/// The most layers of a network.
const MOST_LAYERS: usize = 8;

/// The layers of a policy, in the order of their use.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LayerChain<'f> {
    pub(super) layers: Vec<ChainLayer<'f>>,
    /// The name of the layers that have a number.
    pub(super) stem: &'f str,
    /// The number of the last one of them.
    pub(super) last: usize,
    /// Whether the last layer stands by itself.
    pub(super) has_head: bool,
}

/// A linear layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChainLayer<'f> {
    /// Its name, without `.weight` and `.bias`.
    pub(super) name: &'f str,
    /// Outputs and inputs.
    pub(super) shape: [usize; 2],
    /// Whether an activation follows.
    pub(super) activates: bool,
}

/// Why there is no chain.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum NoChain {
    /// Nothing looks like one.
    None,
    /// What does not fit, and why.
    Other(String),
}

/// Returns the linear layers among `items`, each with its shape.
fn linear<'f>(items: &[StateItem<'f>]) -> Vec<(&'f str, [usize; 2])> {
    let weights = items.iter().filter_map(|item| {
        let name = item.name.strip_suffix("weight")?;
        let name = name.strip_suffix('.').filter(|_| !is_beside(item.name))?;
        match item.kind {
            StateKind::Tensor(&[outputs, inputs]) => Some((name, [outputs, inputs])),
            _ => None,
        }
    });
    weights.collect()
}

/// Returns the name and the number of a layer of a sequence.
fn numbered(name: &str) -> Option<(&str, usize)> {
    let (stem, number) = name.rsplit_once('.').unwrap_or(("", name));
    Some((stem, number.parse().ok()?))
}

fn last_part(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

impl<'f> LayerChain<'f> {
    /// Finds the layers of the policy among `items`.
    ///
    /// # Errors
    /// [`NoChain`] if there are none, or several.
    pub(super) fn find(items: &[StateItem<'f>]) -> Result<Self, NoChain> {
        let linear = linear(items);
        let mut stems: Vec<&str> = linear
            .iter()
            .filter_map(|(name, _)| Some(numbered(name)?.0))
            .collect();
        stems.sort_unstable();
        stems.dedup();
        let mut named = BODIES.iter().filter_map(|body| {
            let mut of_it = stems.iter().filter(|stem| last_part(stem) == *body);
            of_it.next().filter(|_| of_it.next().is_none())
        });
        let stem = match stems[..] {
            [stem] => stem,
            _ => named.next().copied().ok_or(NoChain::None)?,
        };
        let of_stem = |(name, shape): &(&'f str, [usize; 2])| match numbered(name) {
            Some((of, number)) if of == stem => Some((number, *name, *shape)),
            _ => None,
        };
        let mut body: Vec<_> = linear.iter().filter_map(of_stem).collect();
        body.sort_unstable();
        let mut heads = linear
            .iter()
            .filter(|(name, _)| numbered(name).is_none() && HEADS.contains(&last_part(name)));
        let head = heads.next();
        let mut layers = Vec::new();
        for (place, (number, name, shape)) in body.iter().enumerate() {
            let next = body.get(place + 1).map(|(next, ..)| next - number);
            if next.is_some_and(|steps| steps > 2) {
                let what = format!("more than an activation after {name:?}");
                return Err(NoChain::Other(what));
            }
            layers.push(ChainLayer {
                name,
                shape: *shape,
                activates: next == Some(2) || next.is_none() && head.is_some(),
            });
        }
        layers.extend(head.map(|(name, shape)| ChainLayer {
            name,
            shape: *shape,
            activates: false,
        }));
        if layers.len() > MOST_LAYERS {
            let what = format!("{} layers, and {MOST_LAYERS} is the most", layers.len());
            return Err(NoChain::Other(what));
        }
        Ok(Self {
            stem,
            last: body.last().map_or(0, |(number, ..)| *number),
            has_head: head.is_some(),
            layers,
        })
    }

    /// Returns whether all its tensors are among `items`.
    pub(super) fn is_whole(&self, items: &[StateItem<'_>]) -> bool {
        let has = |name: &str| items.iter().any(|item| item.name == name);
        self.layers
            .iter()
            .all(|layer| has(&format!("{}.bias", layer.name)))
    }

    /// Returns whether a tensor is one of its layers.
    pub(super) fn has(&self, tensor: &str) -> bool {
        let name = [".weight", ".bias"]
            .into_iter()
            .find_map(|part| tensor.strip_suffix(part));
        name.is_some_and(|name| self.layers.iter().any(|layer| layer.name == name))
    }

    /// Returns whether something called `name` is in its sequence, and no activation in it.
    pub(super) fn is_changed_by(&self, name: &str, is_layer: bool) -> bool {
        let inner = match self.stem {
            "" => Some(name),
            stem => name
                .strip_prefix(stem)
                .and_then(|rest| rest.strip_prefix('.')),
        };
        let Some(inner) = inner else {
            return false;
        };
        let number = inner
            .split('.')
            .next()
            .and_then(|text| text.parse::<usize>().ok());
        match number {
            Some(number) if is_layer => number > self.last + usize::from(self.has_head),
            Some(_) => true,
            None => !is_layer && !self.stem.is_empty(),
        }
    }
}

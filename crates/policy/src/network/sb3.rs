//! A model of Stable-Baselines3: a zip with the state dictionary of its policy, and its settings.

use serde_json::Value;

use super::{
    Mlp,
    activation::Activation,
    checkpoint::{Checkpoint, archive, entry, names},
    mlp::Ending,
    state::NetworkSettings,
};
use crate::{LARGEST_FILE, WeightsError, format::ProgramKind};

/// The longest settings (bytes).
const LONGEST_SETTINGS: u64 = 1 << 20;

/// Settings of a policy with which it is no chain of layers.
const OTHERS: [&str; 2] = ["features_extractor_class", "squash_output"];

/// Reads the network in the zip `content`; `None` if it is not such a model.
pub(super) fn read(content: &[u8], settings: NetworkSettings) -> Option<Result<Mlp, WeightsError>> {
    let mut zip = archive(content).ok()?;
    let names = names(&zip);
    let has = |wanted: &str| names.iter().any(|name| name == wanted);
    if !has("policy.pth") || !has("data") {
        return None;
    }
    let about = entry(&mut zip, "data", LONGEST_SETTINGS).ok()?;
    let about: Value = serde_json::from_slice(&about).ok()?;
    let policy = entry(&mut zip, "policy.pth", LARGEST_FILE).ok()?;
    Some(network(&about, &policy, settings))
}

fn unfit(why: &str) -> WeightsError {
    WeightsError::Unfit {
        why: format!("found a Stable-Baselines3 model with {why}"),
        program: Some(ProgramKind::Sb3),
    }
}

fn network(about: &Value, policy: &[u8], settings: NetworkSettings) -> Result<Mlp, WeightsError> {
    let options = &about["policy_kwargs"];
    let is_set = |name: &&&str| !matches!(options[**name], Value::Null | Value::Bool(false));
    if let Some(name) = OTHERS.iter().find(is_set) {
        return Err(unfit(name));
    }
    if about["use_sde"] == true {
        return Err(unfit("use_sde"));
    }
    // Of an actor whose critic sees actions, or of values of actions.
    let is_off_policy = !about["buffer_size"].is_null();
    let space = &about["action_space"];
    let chooses = text(&space[":type:"]).contains("Discrete");
    let activation = match &options["activation_fn"] {
        Value::Null if is_off_policy => Some(Activation::Relu),
        Value::Null => Some(Activation::Tanh),
        name => Some(Activation::named(text(name)).ok_or_else(|| unfit("another activation"))?),
    };
    let squashes = is_off_policy && !chooses;
    let known = NetworkSettings {
        activation: settings.activation.or(activation),
        is_in_model: true,
    };
    let mlp = Checkpoint::open(policy)
        .and_then(|checkpoint| checkpoint.mlp(known))
        .map_err(|error| match error {
            WeightsError::Unfit { why, .. } => WeightsError::Unfit {
                why,
                program: Some(ProgramKind::Sb3),
            },
            damaged => damaged,
        })?;
    let mlp = mlp.choosing(chooses);
    if chooses {
        return Ok(mlp);
    }
    let [low, high] = ["low", "high"].map(|end| numbers(text(&space[end])));
    let bounds: Vec<[f32; 2]> = low
        .into_iter()
        .zip(high)
        .map(|(low, high)| [low, high])
        .collect();
    if bounds.len() != mlp.actions() {
        return Err(unfit("bounds of actions that are not a list of numbers"));
    }
    Ok(mlp.ending(if squashes {
        Ending::Squashed(bounds)
    } else {
        Ending::Clipped(bounds)
    }))
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// Returns the numbers of an array of NumPy, as text.
fn numbers(text: &str) -> Vec<f32> {
    text.split(|c: char| c.is_whitespace() || "[],".contains(c))
        .filter(|word| !word.is_empty())
        .map(str::parse)
        .collect::<Result<_, _>>()
        .unwrap_or_default()
}

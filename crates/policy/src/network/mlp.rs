//! The network itself: linear layers with an activation between them.

use super::{
    activation::Activation, chain::LayerChain, error, normaliser::Normaliser, tensor::Tensor,
};
use crate::WeightsError;

/// Maximum number of units in a hidden layer.
pub const LARGEST_WIDTH: usize = 1_024;

/// Maximum number of weights: four layers of the largest width.
const MOST_NUMBERS: usize = 4 * LARGEST_WIDTH * LARGEST_WIDTH;

/// The weights of a network: a chain of linear layers with an activation between two of them, in
/// single precision as PyTorch computes it.
///
/// Widths and the number of layers come from the file, up to `LARGEST_WIDTH`, and so does the number of
/// actions: those of one moment, or of a chunk.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    /// What is done to an observation first.
    normaliser: Option<Normaliser>,
    layers: Vec<Layer>,
    activation: Activation,
    ending: Ending,
    /// Whether its outputs are values of choices; `None` if nothing says it.
    chooses: Option<bool>,
}

/// What becomes of the outputs of the last layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Ending {
    /// They are the answer.
    #[default]
    Plain,
    /// They are clipped to these bounds.
    Clipped(Vec<[f32; 2]>),
    /// They are squashed into these bounds, by a hyperbolic tangent.
    Squashed(Vec<[f32; 2]>),
}

/// `y = W·x + b`.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    /// W column by column: all outputs of one input are adjacent, which allows vectorised
    /// addition.
    columns: Vec<f32>,
    bias: Vec<f32>,
    /// Whether an activation follows.
    activates: bool,
}

impl Mlp {
    /// Builds the network of a chain from the tensors that `read` returns by name.
    pub(super) fn from_chain(
        chain: &LayerChain<'_>,
        activation: Activation,
        mut read: impl FnMut(&str) -> Result<Tensor, WeightsError>,
    ) -> Result<Self, WeightsError> {
        let mut layers = Vec::new();
        let (mut wide, mut numbers) = (None, 0);
        for layer in &chain.layers {
            let name = format!("{}.weight", layer.name);
            let rows = read(&name)?;
            let fits = |size: usize| (1..=LARGEST_WIDTH).contains(&size);
            let [outputs, inputs] = layer.shape;
            if !fits(outputs) || wide.unwrap_or(inputs) != inputs || !fits(inputs) {
                let inputs = wide.map_or("inputs".to_owned(), |wide: usize| wide.to_string());
                let expected = format!("[width, {inputs}] with 1 to {LARGEST_WIDTH} of each");
                return Err(error::shape(&name, &expected, &layer.shape));
            }
            numbers += outputs * inputs;
            if numbers > MOST_NUMBERS {
                return Err(error::unfit(format!(
                    "expected {MOST_NUMBERS} weights at most, found more"
                )));
            }
            let rows = checked(&name, rows, &layer.shape)?;
            let name = format!("{}.bias", layer.name);
            let bias = checked(&name, read(&name)?, &[outputs])?;
            layers.push(Layer::new(&rows, bias, layer.activates));
            wide = Some(outputs);
        }
        Ok(Self {
            normaliser: None,
            layers,
            activation,
            ending: Ending::Plain,
            chooses: None,
        })
    }

    /// Returns the same behind a normaliser.
    pub(super) fn behind(self, normaliser: Option<Normaliser>) -> Self {
        Self { normaliser, ..self }
    }

    /// Does to an observation what comes before the first layer.
    pub(super) fn prepare(&self, observation: &mut [f32]) {
        if let Some(normaliser) = &self.normaliser {
            normaliser.apply(observation);
        }
    }

    /// Returns the same with another ending.
    pub(super) fn ending(self, ending: Ending) -> Self {
        Self { ending, ..self }
    }

    /// Returns the same, known to choose, or not to.
    pub(super) fn choosing(self, chooses: bool) -> Self {
        let chooses = Some(chooses);
        Self { chooses, ..self }
    }

    /// Returns whether its outputs are values of choices; `None` if nothing says it.
    pub fn chooses(&self) -> Option<bool> {
        self.chooses
    }

    /// Numbers in an observation.
    pub fn inputs(&self) -> usize {
        let layer = &self.layers[0];
        layer.columns.len() / layer.bias.len()
    }

    /// Numbers in an answer.
    pub fn actions(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.bias.len())
    }
}

impl Ending {
    fn apply(&self, outputs: &mut [f32]) {
        match self {
            Self::Plain => {}
            Self::Clipped(bounds) => {
                for (number, [low, high]) in outputs.iter_mut().zip(bounds) {
                    *number = number.max(*low).min(*high);
                }
            }
            Self::Squashed(bounds) => {
                for (number, [low, high]) in outputs.iter_mut().zip(bounds) {
                    *number = low + 0.5 * (number.tanh() + 1.0) * (high - low);
                }
            }
        }
    }
}

/// Returns the numbers of `tensor`, if it has this shape and all are finite.
fn checked(name: &str, tensor: Tensor, shape: &[usize]) -> Result<Vec<f32>, WeightsError> {
    if tensor.shape != shape {
        return Err(error::shape(name, &format!("{shape:?}"), &tensor.shape));
    }
    let mut values = tensor.values.iter().copied().enumerate();
    match values.find(|(_, value)| !value.is_finite()) {
        Some((index, value)) => Err(WeightsError::Damaged(format!(
            "expected finite numbers, found {value} in {name:?} at {index}"
        ))),
        None => Ok(tensor.values),
    }
}

impl Layer {
    /// Creates a layer from weights in row order.
    fn new(rows: &[f32], bias: Vec<f32>, activates: bool) -> Self {
        let outputs = bias.len();
        let inputs = rows.len() / outputs;
        let weights = (0..inputs).flat_map(|input| {
            let column = rows[input..].iter().step_by(inputs);
            column.copied()
        });
        Self {
            columns: weights.collect(),
            bias,
            activates,
        }
    }

    /// Computes the layer's `outputs` for `inputs`; their length is that of the layer.
    fn apply(&self, inputs: &[f32], outputs: &mut [f32]) {
        outputs.copy_from_slice(&self.bias);
        let columns = self.columns.chunks_exact(self.bias.len());
        for (input, column) in inputs.iter().zip(columns) {
            for (output, weight) in outputs.iter_mut().zip(column) {
                *output += weight * input;
            }
        }
    }
}

impl Mlp {
    /// Computes the last of the outputs of all layers from `inputs`.
    pub(super) fn run<'o>(&self, inputs: &[f32], outputs: &'o mut [Vec<f32>]) -> &'o [f32] {
        let mut known: &[f32] = inputs;
        for (layer, output) in self.layers.iter().zip(outputs.iter_mut()) {
            layer.apply(known, output);
            if layer.activates {
                self.activation.apply(output);
            }
            known = output;
        }
        if let Some(last) = outputs.last_mut() {
            self.ending.apply(last);
        }
        outputs.last().map_or(&[], |outputs| outputs)
    }

    /// Room for the outputs of all layers.
    pub(super) fn room(&self) -> Vec<Vec<f32>> {
        self.layers
            .iter()
            .map(|layer| layer.bias.len())
            .map(|size| vec![0.0; size])
            .collect()
    }
}

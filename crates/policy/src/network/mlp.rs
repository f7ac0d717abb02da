//! The network itself: two hidden layers of tanh, one action or a chunk of them.

use super::{error, tensor::Tensor};
use crate::WeightsError;

/// Maximum number of units in a hidden layer.
pub const LARGEST_WIDTH: usize = 1_024;

/// The weights of an actor: observation → `width` tanh → `width` tanh → mean
/// actions, in single precision as PyTorch computes it.
///
/// Named as in the course's agent: `actor_mean.0`, `.2` and `.4`, each a `weight` of
/// shape `[out, in]` and a `bias` of shape `[out]`. The width comes from the file, up to
/// `LARGEST_WIDTH`, and so does the number of actions: one, or a chunk.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    layers: [Layer; 3],
}

/// `y = W·x + b`.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    /// W column by column: all outputs of one input are adjacent, which allows vectorised
    /// addition.
    columns: Vec<f32>,
    bias: Vec<f32>,
}

impl Mlp {
    /// Builds the actor from the tensors that `read` returns by name.
    pub(super) fn from_tensors(
        mut read: impl FnMut(&'static str) -> Result<Tensor, WeightsError>,
    ) -> Result<Self, WeightsError> {
        let first = read("actor_mean.0.weight")?;
        let [width @ 1..=LARGEST_WIDTH, inputs @ 1..=LARGEST_WIDTH] = first.shape[..] else {
            let expected = format!("[width, inputs] with 1 to {LARGEST_WIDTH} of each");
            return Err(error::shape("actor_mean.0.weight", &expected, &first.shape));
        };
        let mut numbers = |name, shape: &[usize]| checked(name, read(name)?, shape);
        let below = Layer::new(
            &checked("actor_mean.0.weight", first, &[width, inputs])?,
            numbers("actor_mean.0.bias", &[width])?,
        );
        let above = Layer::new(
            &numbers("actor_mean.2.weight", &[width, width])?,
            numbers("actor_mean.2.bias", &[width])?,
        );
        let last = read("actor_mean.4.weight")?;
        let actions = last
            .shape
            .first()
            .copied()
            .unwrap_or(1)
            .clamp(1, LARGEST_WIDTH);
        let last = Layer::new(
            &checked("actor_mean.4.weight", last, &[actions, width])?,
            checked("actor_mean.4.bias", read("actor_mean.4.bias")?, &[actions])?,
        );
        Ok(Self {
            layers: [below, above, last],
        })
    }

    /// Units in each hidden layer.
    pub fn width(&self) -> usize {
        self.layers[0].bias.len()
    }

    /// Numbers in an observation.
    pub fn inputs(&self) -> usize {
        let layer = &self.layers[0];
        layer.columns.len() / layer.bias.len()
    }

    /// Numbers in an answer.
    pub fn actions(&self) -> usize {
        self.layers[2].bias.len()
    }
}

/// Returns the numbers of `tensor`, if it has this shape and all are finite.
fn checked(name: &'static str, tensor: Tensor, shape: &[usize]) -> Result<Vec<f32>, WeightsError> {
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
    fn new(rows: &[f32], bias: Vec<f32>) -> Self {
        let outputs = bias.len();
        let inputs = rows.len() / outputs;
        let weights = (0..inputs).flat_map(|input| {
            let column = rows[input..].iter().step_by(inputs);
            column.copied()
        });
        Self {
            columns: weights.collect(),
            bias,
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
        let last = self.layers.len() - 1;
        for (place, (layer, output)) in self.layers.iter().zip(outputs.iter_mut()).enumerate() {
            layer.apply(known, output);
            if place < last {
                squash(output);
            }
            known = output;
        }
        outputs.last().map_or(&[], |outputs| outputs)
    }

    /// Room for the outputs of all layers.
    pub(super) fn room(&self) -> Vec<Vec<f32>> {
        let sizes = self.layers.iter().map(|layer| layer.bias.len());
        sizes.map(|size| vec![0.0; size]).collect()
    }
}

fn squash(layer: &mut [f32]) {
    for unit in layer {
        *unit = unit.tanh();
    }
}

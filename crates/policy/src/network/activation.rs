//! What stands between two linear layers.

use strum::{Display, EnumString};

/// A function of each number between two layers, as PyTorch computes it.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Display,
    EnumString,
    serde::Serialize,
    serde::Deserialize,
)]
#[strum(serialize_all = "lowercase", ascii_case_insensitive)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// The hyperbolic tangent.
    #[default]
    Tanh,
    /// max(0, x).
    Relu,
    /// x, or e^x - 1 below zero.
    Elu,
    /// x times its sigmoid.
    #[strum(to_string = "silu", serialize = "swish")]
    Silu,
    /// x, or a hundredth of it below zero.
    #[strum(to_string = "leakyrelu", serialize = "leaky_relu")]
    LeakyRelu,
    /// The scaled one of ELU.
    Selu,
    /// 1 / (1 + e^-x).
    Sigmoid,
}

impl Activation {
    /// Reads the name of a class or a function, such as `torch.nn.modules.activation.ReLU`.
    pub(super) fn named(text: &str) -> Option<Self> {
        let name = text.trim_matches(|c: char| !c.is_alphanumeric());
        let name = name.rsplit('.').next().unwrap_or_default();
        name.parse().ok()
    }

    /// Applies it to all numbers of a layer.
    pub(super) fn apply(self, layer: &mut [f32]) {
        let function: fn(f32) -> f32 = match self {
            Self::Tanh => f32::tanh,
            Self::Relu => |x| x.max(0.0),
            Self::Elu => |x| if x > 0.0 { x } else { x.exp_m1() },
            Self::Silu => |x| x / (1.0 + (-x).exp()),
            Self::LeakyRelu => |x| if x > 0.0 { x } else { 0.01 * x },
            Self::Selu => |x| {
                const ALPHA: f32 = 1.673_263_2;
                const SCALE: f32 = 1.050_701;
                SCALE * if x > 0.0 { x } else { ALPHA * x.exp_m1() }
            },
            Self::Sigmoid => |x| 1.0 / (1.0 + (-x).exp()),
        };
        for unit in layer {
            *unit = function(*unit);
        }
    }
}

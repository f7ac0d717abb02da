//! The values in a pickle of tensors.

use std::fmt;

use super::super::tensor::Float;

/// Index of a value in the interpreter's list. Values refer to each other by index, so
/// that cyclic and shared values are harmless.
pub(super) type ValueIndex = usize;

/// A value of the pickle.
#[derive(Clone, Debug)]
pub(super) enum Value<'a> {
    None,
    Bool,
    Int(i64),
    Float,
    Text(&'a str),
    Tuple(Vec<ValueIndex>),
    List(Vec<ValueIndex>),
    Dict(Vec<(ValueIndex, ValueIndex)>),
    Callable(Callable),
    Storage(Storage<'a>),
    Tensor(Box<TensorView<'a>>),
}

impl Value<'_> {
    /// Kind of the value, for messages.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::None => "None",
            Self::Bool => "a truth value",
            Self::Int(_) => "an integer",
            Self::Float => "a number",
            Self::Text(_) => "a string",
            Self::Tuple(_) => "a tuple",
            Self::List(_) => "a list",
            Self::Dict(_) => "a dictionary",
            Self::Callable(_) => "a type or function",
            Self::Storage(_) => "a storage",
            Self::Tensor(_) => "a tensor",
        }
    }
}

/// Everything that a pickle may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Callable {
    OrderedDict,
    RebuildTensor,
    RebuildParameter,
    StorageOf(ElementType),
}

impl Callable {
    /// Looks up a name; `None` if it is forbidden.
    pub(super) fn named(module: &str, name: &str) -> Option<Self> {
        match (module, name) {
            ("collections", "OrderedDict") => Some(Self::OrderedDict),
            ("torch._utils", "_rebuild_tensor_v2") => Some(Self::RebuildTensor),
            ("torch._utils", "_rebuild_parameter") => Some(Self::RebuildParameter),
            ("torch", name) => ElementType::of_storage(name).map(Self::StorageOf),
            _ => None,
        }
    }
}

/// Kinds of numbers in a storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ElementType {
    Float(Float),
    /// Unsupported, but harmless in tensors that are never read.
    Other(&'static str),
}

impl ElementType {
    fn of_storage(name: &str) -> Option<Self> {
        Some(match name {
            "HalfStorage" => Self::Float(Float::F16),
            "FloatStorage" => Self::Float(Float::F32),
            "DoubleStorage" => Self::Float(Float::F64),
            "BFloat16Storage" => Self::Other("bfloat16"),
            "BoolStorage" => Self::Other("bool"),
            "ByteStorage" => Self::Other("uint8"),
            "CharStorage" => Self::Other("int8"),
            "ShortStorage" => Self::Other("int16"),
            "IntStorage" => Self::Other("int32"),
            "LongStorage" => Self::Other("int64"),
            _ => return None,
        })
    }
}

impl fmt::Display for ElementType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Float(Float::F16) => "float16",
            Self::Float(Float::F32) => "float32",
            Self::Float(Float::F64) => "float64",
            Self::Other(name) => name,
        })
    }
}

/// Numbers in an entry of the zip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storage<'a> {
    pub(super) kind: ElementType,
    /// Name of the entry in the folder `data`.
    pub(super) key: &'a str,
}

/// The part of a storage that belongs to a tensor.
#[derive(Clone, Debug)]
pub(super) struct TensorView<'a> {
    pub(super) storage: Storage<'a>,
    pub(super) offset: usize,
    pub(super) shape: Vec<usize>,
    pub(super) strides: Vec<usize>,
}

impl TensorView<'_> {
    /// Number of elements; `None` on overflow.
    pub(super) fn count(&self) -> Option<usize> {
        self.shape
            .iter()
            .try_fold(1, |count: usize, size| count.checked_mul(*size))
    }

    /// Index in the storage of element `index`, counted row by row; `None` on overflow.
    pub(super) fn place(&self, index: usize) -> Option<usize> {
        let mut rest = index;
        let mut dimensions = self.shape.iter().zip(&self.strides).rev();
        dimensions.try_fold(self.offset, |place, (size, stride)| {
            let at = rest.checked_rem(*size)?;
            rest /= size;
            place.checked_add(at.checked_mul(*stride)?)
        })
    }
}

//! The values in a pickle of tensors.

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
            ("torch", name) => ElementType::from_storage(name).map(Self::StorageOf),
            _ => None,
        }
    }
}

/// Kind of the numbers in a storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ElementType {
    pub(super) name: &'static str,
    /// How they are read; the others are harmless in tensors that are never read.
    pub(super) float: Option<Float>,
}

impl ElementType {
    fn from_storage(name: &str) -> Option<Self> {
        let (name, float) = match name {
            "HalfStorage" => ("float16", Some(Float::F16)),
            "FloatStorage" => ("float32", Some(Float::F32)),
            "DoubleStorage" => ("float64", Some(Float::F64)),
            "BFloat16Storage" => ("bfloat16", Some(Float::BF16)),
            "BoolStorage" => ("bool", None),
            "ByteStorage" => ("uint8", None),
            "CharStorage" => ("int8", None),
            "ShortStorage" => ("int16", None),
            "IntStorage" => ("int32", None),
            "LongStorage" => ("int64", None),
            _ => return None,
        };
        Some(Self { name, float })
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
    /// Returns the number of elements; `None` on overflow.
    pub(super) fn count(&self) -> Option<usize> {
        self.shape
            .iter()
            .try_fold(1, |count: usize, size| count.checked_mul(*size))
    }

    /// Returns the index in the storage of element `index`, counted row by row; `None` on overflow.
    pub(super) fn place(&self, index: usize) -> Option<usize> {
        let mut rest = index;
        self.shape
            .iter()
            .zip(&self.strides)
            .rev()
            .try_fold(self.offset, |place, (size, stride)| {
                let at = rest.checked_rem(*size)?;
                rest /= size;
                place.checked_add(at.checked_mul(*stride)?)
            })
    }
}

//! A pickle interpreter that can create tensors only.
//!
//! Python's pickle is a program for a small stack machine, which includes the instruction
//! "call this function". This interpreter knows four functions, all of them for tensors
//! and their containers; any other is refused by name. It has no recursion and creates at
//! most one value per instruction, so its time and memory are bounded by the length of
//! the pickle.
//!
//! Source of the instructions: Python's `pickletools`.

use std::{collections::HashMap, fmt::Display, rc::Rc};

use super::{
    super::{
        error::quoted,
        state::{Library, StateItems},
        state_item::{StateItem, StateKind, is_beside},
    },
    archive::{Bytes, PickleError, PickleResult, nonsense, utf8},
    value::{Callable, Storage, TensorView, Value, ValueIndex},
};

/// The result of a pickle.
pub(super) struct Pickle<'a> {
    values: Rc<Vec<Value<'a>>>,
    /// The state dictionary.
    place: ValueIndex,
    /// The pairs of it.
    state: Vec<(ValueIndex, ValueIndex)>,
    /// The attributes of dictionaries.
    attributes: Rc<HashMap<ValueIndex, ValueIndex>>,
}

/// The attribute of a state dictionary with the names of all layers, also of layers without tensors.
const LAYERS: &str = "_metadata";

/// How many dictionaries are searched for one that is nested.
const MAX_SEARCHED: usize = 64;

impl<'a> Pickle<'a> {
    /// Runs the pickle `bytes`, which must create a dictionary.
    pub(super) fn read(bytes: &'a [u8]) -> PickleResult<Self> {
        let machine = Machine {
            rest: Bytes(bytes),
            ..Machine::default()
        };
        machine.run()
    }

    /// Returns the tensor called `name`; the last one of several, as in Python.
    pub(super) fn tensor(&self, name: &str) -> Option<&TensorView<'a>> {
        let named = self
            .state
            .iter()
            .rfind(|(key, _)| self.text(*key) == Some(name));
        match named.and_then(|(_, value)| self.values.get(*value)) {
            Some(Value::Tensor(view)) => Some(view),
            _ => None,
        }
    }

    /// Everything in the state dictionary.
    pub(super) fn items(&self) -> StateItems<'_> {
        let items = self.state.iter().filter_map(|(key, value)| {
            let (name, kind) = (self.text(*key)?, self.kind(*value));
            Some(StateItem { name, kind })
        });
        let layers = self.layers().filter_map(|(key, _)| {
            let (name, kind) = (self.text(*key)?, StateKind::Layer);
            Some(StateItem { name, kind })
        });
        StateItems::new(items.chain(layers).collect(), self.nested())
    }

    fn kind(&self, value: ValueIndex) -> StateKind<'_> {
        match &self.values[value] {
            Value::Tensor(view) => StateKind::Tensor(&view.shape),
            Value::Int(_) | Value::Float => StateKind::Number,
            Value::Text(text) => StateKind::Text(text),
            Value::None | Value::Bool => StateKind::Flag,
            Value::Dict(pairs) if pairs.is_empty() => StateKind::Flag,
            Value::List(items) | Value::Tuple(items) if items.is_empty() => StateKind::Flag,
            other => StateKind::Container(other.name()),
        }
    }

    /// Returns the layers of the module whose state this is.
    fn layers(&self) -> impl Iterator<Item = &(ValueIndex, ValueIndex)> {
        let attributes = self.pairs(self.attributes.get(&self.place).copied());
        let found = attributes
            .iter()
            .find(|(key, _)| self.text(*key) == Some(LAYERS));
        self.pairs(found.map(|(_, layers)| *layers)).iter()
    }

    /// Returns the dictionaries with weights within the state dictionary, each with its name, sorted by
    /// these.
    pub(super) fn inner(&self) -> Vec<(&'a str, Self)> {
        let pairs = self.state.iter().take(MAX_SEARCHED);
        let inner = pairs.filter_map(|(key, place)| {
            let (name, pairs) = (self.text(*key)?, self.pairs(Some(*place)));
            let has_weights = pairs.iter().any(|(key, value)| {
                let is_weight = self.text(*key).is_some_and(|name| name.ends_with("weight"));
                is_weight && matches!(self.values[*value], Value::Tensor(_))
            });
            let inner = Self {
                values: self.values.clone(),
                place: *place,
                state: pairs.to_vec(),
                attributes: self.attributes.clone(),
            };
            (has_weights && !is_beside(name)).then_some((name, inner))
        });
        let mut inner: Vec<_> = inner.collect();
        inner.sort_by_key(|(name, _)| *name);
        inner
    }

    /// Returns the first of them: its name, and the names in it.
    fn nested(&self) -> Option<(&'a str, Vec<&'a str>)> {
        let (name, inner) = self.inner().into_iter().next()?;
        let names = inner.state.iter().filter_map(|(key, _)| inner.text(*key));
        Some((name, names.collect()))
    }

    fn text(&self, place: ValueIndex) -> Option<&'a str> {
        match self.values.get(place) {
            Some(Value::Text(text)) => Some(*text),
            _ => None,
        }
    }

    /// Returns the pairs of a dictionary; none of anything else.
    fn pairs(&self, place: Option<ValueIndex>) -> &[(ValueIndex, ValueIndex)] {
        match place.and_then(|place| self.values.get(place)) {
            Some(Value::Dict(pairs)) => pairs,
            _ => &[],
        }
    }
}

#[derive(Default)]
struct Machine<'a> {
    /// The remaining instructions.
    rest: Bytes<'a>,
    values: Vec<Value<'a>>,
    stack: Vec<ValueIndex>,
    /// The height of the stack at each mark.
    marks: Vec<usize>,
    memo: HashMap<u32, ValueIndex>,
    /// The attributes of dictionaries.
    attributes: HashMap<ValueIndex, ValueIndex>,
}

impl<'a> Machine<'a> {
    fn run(mut self) -> PickleResult<Pickle<'a>> {
        loop {
            match self.rest.byte()? {
                b'.' => break,
                instruction => self.step(instruction)?,
            }
        }
        let made = self.pop()?;
        match &self.values[made] {
            Value::Dict(pairs) => Ok(Pickle {
                state: pairs.clone(),
                place: made,
                attributes: Rc::new(self.attributes),
                values: Rc::new(self.values),
            }),
            other => Err(PickleError::NoDictionary(other.name())),
        }
    }

    fn step(&mut self, instruction: u8) -> PickleResult {
        match instruction {
            0x80 => self.rest.take(1).map(drop),         // PROTO
            0x95 => self.rest.take(8).map(drop),         // FRAME
            b'}' => self.push(Value::Dict(Vec::new())),  // EMPTY_DICT
            b']' => self.push(Value::List(Vec::new())),  // EMPTY_LIST
            b')' => self.push(Value::Tuple(Vec::new())), // EMPTY_TUPLE
            b'N' => self.push(Value::None),              // NONE
            0x88 | 0x89 => self.push(Value::Bool),       // NEWTRUE, NEWFALSE
            b'(' => {
                self.marks.push(self.stack.len()); // MARK
                Ok(())
            }
            b'0' => self.pop().map(drop), // POP
            b't' | 0x85..=0x87 => self.tuple(instruction),
            b's' | b'u' | b'a' | b'e' => self.fill(instruction),
            b'q' | b'r' | 0x94 | b'h' | b'j' => self.remember(instruction),
            b'K' | b'M' | b'J' | 0x8a | b'G' => self.number(instruction),
            b'X' | 0x8c => self.text(instruction),
            b'c' | 0x93 => self.name(instruction),
            b'Q' => self.storage(),
            b'R' => self.call(),
            b'b' => self.build(),
            other => self.forbidden(format!(
                "the pickle instruction {}",
                instruction_name(other)
            )),
        }
    }

    /// TUPLE, TUPLE1, TUPLE2, TUPLE3.
    fn tuple(&mut self, instruction: u8) -> PickleResult {
        let items = match instruction {
            b't' => self.pop_mark()?,
            _ => {
                let size = usize::from(instruction - 0x84);
                self.pop_many(size)?
            }
        };
        self.push(Value::Tuple(items))
    }

    /// SETITEM, SETITEMS, APPEND, APPENDS.
    fn fill(&mut self, instruction: u8) -> PickleResult {
        let items = match instruction {
            b's' => self.pop_many(2)?,
            b'a' => self.pop_many(1)?,
            _ => self.pop_mark()?,
        };
        let container = self.top()?;
        match (&mut self.values[container], instruction) {
            (Value::Dict(pairs), b's' | b'u') if items.len().is_multiple_of(2) => {
                pairs.extend(items.chunks_exact(2).map(|pair| (pair[0], pair[1])));
                Ok(())
            }
            (Value::List(list), b'a' | b'e') => {
                list.extend(items);
                Ok(())
            }
            (other, _) => nonsense(format!("{} items for {}", items.len(), other.name())),
        }
    }

    /// BINPUT, LONG_BINPUT, MEMOIZE, BINGET, LONG_BINGET.
    fn remember(&mut self, instruction: u8) -> PickleResult {
        let number = match instruction {
            b'q' | b'h' => u32::from(self.rest.byte()?),
            0x94 => self.memo.len() as u32,
            _ => u32::from_le_bytes(self.rest.array()?),
        };
        if matches!(instruction, b'h' | b'j') {
            let Some(place) = self.memo.get(&number) else {
                return nonsense(format!("it recalls number {number}, which it never kept"));
            };
            self.stack.push(*place);
        } else {
            let top = self.top()?;
            self.memo.insert(number, top);
        }
        Ok(())
    }

    /// BININT1, BININT2, BININT, LONG1, BINFLOAT.
    fn number(&mut self, instruction: u8) -> PickleResult {
        let value = match instruction {
            b'K' => i64::from(self.rest.byte()?),
            b'M' => i64::from(u16::from_le_bytes(self.rest.array()?)),
            b'J' => i64::from(i32::from_le_bytes(self.rest.array()?)),
            0x8a => self.long()?,
            _ => {
                self.rest.take(8)?;
                return self.push(Value::Float);
            }
        };
        self.push(Value::Int(value))
    }

    /// Returns an integer of a given number of bytes, in two's complement.
    fn long(&mut self) -> PickleResult<i64> {
        let size = usize::from(self.rest.byte()?);
        let given = self.rest.take(size)?;
        let sign = if given.last().is_some_and(|last| *last >= 0x80) {
            0xff
        } else {
            0
        };
        let mut bytes = [sign; 8];
        match bytes.get_mut(..size) {
            Some(low) => low.copy_from_slice(given),
            None => return nonsense(format!("an integer of {size} bytes")),
        }
        Ok(i64::from_le_bytes(bytes))
    }

    /// BINUNICODE, SHORT_BINUNICODE.
    fn text(&mut self, instruction: u8) -> PickleResult {
        let size = match instruction {
            b'X' => u32::from_le_bytes(self.rest.array()?) as usize,
            _ => usize::from(self.rest.byte()?),
        };
        let text = utf8(self.rest.take(size)?)?;
        self.push(Value::Text(text))
    }

    /// GLOBAL, STACK_GLOBAL: the only instructions that name a function.
    fn name(&mut self, instruction: u8) -> PickleResult {
        let (module, name) = match instruction {
            b'c' => (self.rest.line()?, self.rest.line()?),
            _ => {
                let words = self.pop_many(2)?;
                match (&self.values[words[0]], &self.values[words[1]]) {
                    (Value::Text(module), Value::Text(name)) => (*module, *name),
                    (module, _) => return nonsense(format!("a name that is {}", module.name())),
                }
            }
        };
        match Callable::named(module, name) {
            Some(callable) => self.push(Value::Callable(callable)),
            None => self.forbidden(quoted(&format!("{module}.{name}"))),
        }
    }

    /// BINPERSID: in a checkpoint, `("storage", type, key, device, size)`.
    fn storage(&mut self) -> PickleResult {
        let given = self.pop()?;
        let parts = match &self.values[given] {
            Value::Tuple(parts) => parts.iter().map(|part| &self.values[*part]).collect(),
            _ => Vec::new(),
        };
        let [
            Value::Text("storage"),
            Value::Callable(Callable::StorageOf(kind)),
            Value::Text(key),
            ..,
        ] = parts[..]
        else {
            return self.forbidden("an external object other than a storage");
        };
        let storage = Storage { kind: *kind, key };
        self.push(Value::Storage(storage))
    }

    /// REDUCE: calls a function with a tuple.
    fn call(&mut self) -> PickleResult {
        let given = self.pop_many(2)?;
        let Value::Callable(callable) = &self.values[given[0]] else {
            return self.forbidden(format!("a call of {}", self.values[given[0]].name()));
        };
        let Value::Tuple(arguments) = &self.values[given[1]] else {
            return nonsense(format!("a call with {}", self.values[given[1]].name()));
        };
        let values: Vec<&Value> = arguments.iter().map(|place| &self.values[*place]).collect();
        let made = match (callable, &values[..]) {
            (Callable::OrderedDict, []) => Value::Dict(Vec::new()),
            (Callable::RebuildParameter, [Value::Tensor(_), ..]) => {
                // A parameter is represented by its tensor.
                let tensor = arguments[0];
                self.stack.push(tensor);
                return Ok(());
            }
            (
                Callable::RebuildTensor,
                [
                    Value::Storage(storage),
                    Value::Int(offset),
                    Value::Tuple(shape),
                    Value::Tuple(strides),
                    ..,
                ],
            ) if shape.len() == strides.len() => Value::Tensor(Box::new(TensorView {
                storage: *storage,
                offset: size(*offset)?,
                shape: self.sizes(shape)?,
                strides: self.sizes(strides)?,
            })),
            (callable, _) => return nonsense(format!("{callable:?} with what it does not take")),
        };
        self.push(made)
    }

    /// BUILD: sets the attributes of an object. Dictionaries of tensors may have some; other
    /// objects may have none.
    fn build(&mut self) -> PickleResult {
        let attributes = self.pop()?;
        let object = self.top()?;
        match &self.values[object] {
            Value::Dict(_) => {
                self.attributes.insert(object, attributes);
                Ok(())
            }
            other => self.forbidden(format!("attributes of {}", other.name())),
        }
    }

    /// Returns the error for something that is code.
    fn forbidden<T>(&self, what: impl Display) -> PickleResult<T> {
        let texts = self.values.iter().filter_map(|value| match value {
            Value::Text(text) => Some(*text),
            _ => None,
        });
        Err(PickleError::Code {
            what: what.to_string(),
            is_whole: self.stack.is_empty(),
            library: Library::detect(texts),
        })
    }

    fn sizes(&self, places: &[ValueIndex]) -> PickleResult<Vec<usize>> {
        let sizes = places.iter().map(|place| match &self.values[*place] {
            Value::Int(number) => size(*number),
            other => nonsense(format!("{} for a size", other.name())),
        });
        sizes.collect()
    }

    fn push(&mut self, value: Value<'a>) -> PickleResult {
        self.stack.push(self.values.len());
        self.values.push(value);
        Ok(())
    }

    fn top(&self) -> PickleResult<ValueIndex> {
        self.stack
            .last()
            .copied()
            .map_or_else(|| nonsense("its stack is empty"), Ok)
    }

    fn pop(&mut self) -> PickleResult<ValueIndex> {
        let top = self.top()?;
        self.stack.pop();
        Ok(top)
    }

    fn pop_many(&mut self, count: usize) -> PickleResult<Vec<ValueIndex>> {
        match self.stack.len().checked_sub(count) {
            Some(rest) => Ok(self.stack.split_off(rest)),
            None => nonsense("its stack is too short"),
        }
    }

    fn pop_mark(&mut self) -> PickleResult<Vec<ValueIndex>> {
        match self.marks.pop() {
            Some(mark) if mark <= self.stack.len() => Ok(self.stack.split_off(mark)),
            _ => nonsense("a mark is missing"),
        }
    }
}

fn size(number: i64) -> PickleResult<usize> {
    usize::try_from(number).or_else(|_| nonsense(format!("{number} for a size")))
}

/// Returns the names the instructions typical of harmful pickles, and gives the others as numbers.
fn instruction_name(instruction: u8) -> String {
    match instruction {
        b'i' => "INST".to_owned(),
        b'o' => "OBJ".to_owned(),
        b'P' => "PERSID".to_owned(),
        0x81 => "NEWOBJ".to_owned(),
        0x92 => "NEWOBJ_EX".to_owned(),
        0x82..=0x84 => "EXT".to_owned(),
        other => format!("{other:#04x}"),
    }
}

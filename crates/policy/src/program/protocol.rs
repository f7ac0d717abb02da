//! The lines that the lab and a program exchange.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::{PolicyContext, ProgramError, RowShape};

/// How long a program may take to be ready: it may load a large network.
pub const START: Duration = Duration::from_secs(60);

/// How long it may take to answer, unless it says so.
const LIMIT: Duration = Duration::from_secs(5);

/// The longest limit that it may ask for.
const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// The first line to a program.
#[derive(Serialize)]
pub struct Greeting {
    protocol: u32,
    seed: u64,
    control_hz: f64,
    chunk: Option<usize>,
    action_ms: f64,
}

impl Greeting {
    pub fn new(context: PolicyContext, shape: RowShape) -> Self {
        Self {
            protocol: 1,
            seed: context.seed,
            control_hz: context.control_hz.get(),
            chunk: context.chunk,
            action_ms: shape.action_ns as f64 / 1e6,
        }
    }
}

/// A question about a reading.
#[derive(Serialize)]
pub struct ProgramQuestion<'o> {
    /// Its number, from 1.
    pub id: u64,
    /// Run time of the reading (s).
    pub time: f64,
    /// The age that the reading is expected to have when the chunk begins to be played (ms).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_ms: Option<f64>,
    /// What the policy sees, in all digits.
    pub observation: &'o [f64],
}

/// Returns a greeting or a question as a line of text.
pub fn line(value: &impl Serialize) -> String {
    // Numbers that are not finite become null.
    let mut line = serde_json::to_string(value).unwrap_or_default();
    line.push('\n');
    line
}

/// What a program says when it is ready.
#[derive(Clone, Copy, Debug)]
pub struct Ready {
    /// Whether it answers with chunks.
    pub chunks: bool,
    /// How long it may take to answer.
    pub limit: Duration,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReadyLine {
    ready: ReadyKind,
    limit_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum ReadyKind {
    Actions,
    Chunks,
}

impl Ready {
    /// Reads the first line of a program.
    ///
    /// # Errors
    /// What is wrong with it, as the end of a sentence about the program.
    pub fn read(line: &str) -> Result<Self, ProgramError> {
        let expected = "{\"ready\":\"actions\"} or {\"ready\":\"chunks\"}";
        let ready: ReadyLine = parsed(line, expected)?;
        let limit = match ready.limit_s {
            None => LIMIT,
            Some(limit) if limit > 0.0 && limit <= LONGEST.as_secs_f64() => {
                Duration::from_secs_f64(limit)
            }
            Some(limit) => {
                return Err(ProgramError::Limit {
                    limit: limit.to_string(),
                    max: LONGEST.as_secs(),
                });
            }
        };
        let chunks = matches!(ready.ready, ReadyKind::Chunks);
        Ok(Self { chunks, limit })
    }
}

/// An answer of a program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerLine {
    id: u64,
    action: Option<ActionNumbers>,
    actions: Option<Vec<ActionNumbers>>,
}

/// The action in an answer.
#[derive(Deserialize)]
#[serde(untagged)]
enum ActionNumbers {
    One(f64),
    Many(Vec<f64>),
}

impl ActionNumbers {
    /// Returns the numbers of an action with `width` numbers, or of one that is a number by itself.
    fn numbers(self, width: Option<usize>) -> Option<Vec<f64>> {
        match self {
            Self::One(number) if width.is_none_or(|width| width == 1) => Some(vec![number]),
            Self::Many(numbers) if width == Some(numbers.len()) => Some(numbers),
            Self::One(_) | Self::Many(_) => None,
        }
    }
}

/// What an answer has.
#[derive(Clone, Copy, Debug)]
pub enum AnswerSize {
    /// A number.
    Number,
    /// A list of so many numbers.
    Numbers(usize),
    /// A chunk of so many actions, each a number or a list of `width` numbers.
    Chunk {
        actions: usize,
        width: Option<usize>,
    },
}

impl AnswerSize {
    /// Returns the size of a single action.
    pub fn from_shape(shape: RowShape) -> Self {
        shape.acts.map_or(Self::Number, Self::Numbers)
    }
}

/// Reads the actions in the answer to question number `id`.
///
/// # Errors
/// What is wrong with it, as the end of a sentence about the program.
pub fn actions(line: &str, id: u64, size: AnswerSize) -> Result<Vec<f64>, ProgramError> {
    let expected_line = match size {
        AnswerSize::Number => format!("{{\"id\":{id},\"action\":0.5}}"),
        AnswerSize::Numbers(size) => format!("{{\"id\":{id},\"action\":[… {size} numbers]}}"),
        AnswerSize::Chunk {
            actions,
            width: None | Some(1),
        } => format!("{{\"id\":{id},\"actions\":[… {actions} numbers]}}"),
        AnswerSize::Chunk {
            actions,
            width: Some(width),
        } => format!("{{\"id\":{id},\"actions\":[… {actions} lists of {width} numbers]}}"),
    };
    let answer: AnswerLine = parsed(line, &expected_line)?;
    if answer.id != id {
        return Err(ProgramError::Question {
            found: answer.id,
            asked: id,
        });
    }
    let actions = match (answer.action, answer.actions, size) {
        (Some(ActionNumbers::One(action)), None, AnswerSize::Number | AnswerSize::Numbers(1)) => {
            vec![action]
        }
        (Some(ActionNumbers::Many(numbers)), None, AnswerSize::Numbers(expected)) => {
            if numbers.len() != expected {
                return Err(ProgramError::ActionLength {
                    found: numbers.len(),
                    expected,
                });
            }
            numbers
        }
        (
            None,
            Some(actions),
            AnswerSize::Chunk {
                actions: expected,
                width,
            },
        ) => {
            if actions.len() != expected {
                return Err(ProgramError::ChunkLength {
                    found: actions.len(),
                    expected,
                });
            }
            let flat = actions.into_iter().map(|action| action.numbers(width));
            let flat: Option<Vec<Vec<f64>>> = flat.collect();
            flat.ok_or_else(|| unexpected(line, &expected_line))?
                .concat()
        }
        _ => return Err(unexpected(line, &expected_line)),
    };
    match actions.iter().find(|action| !(**action as f32).is_finite()) {
        Some(action) => Err(ProgramError::NotFinite(format!("{action:e}"))),
        None => Ok(actions),
    }
}

fn parsed<'a, T: Deserialize<'a>>(line: &'a str, expected: &str) -> Result<T, ProgramError> {
    serde_json::from_str(line).map_err(|_| unexpected(line, expected))
}

/// Returns the error for a line that is not an answer, with the beginning of the line.
fn unexpected(line: &str, expected: &str) -> ProgramError {
    const MAX_SHOWN: usize = 60;
    let shown: String = line.chars().take(MAX_SHOWN).collect();
    let rest = if shown.len() < line.len() { "…" } else { "" };
    ProgramError::Unexpected {
        shown: format!("{shown:?}{rest}"),
        expected: expected.to_owned(),
    }
}

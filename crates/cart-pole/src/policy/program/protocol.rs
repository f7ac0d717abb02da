//! The lines that the lab and a program exchange.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::{super::PolicyContext, error::ProgramError};
use crate::CONTROL_HZ;

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
    pub fn new(context: PolicyContext) -> Self {
        Self {
            protocol: 1,
            seed: context.seed,
            control_hz: context.control_hz.get(),
            chunk: context.chunk,
            action_ms: 1e3 / CONTROL_HZ,
        }
    }
}

/// A question about a reading.
#[derive(Serialize)]
pub struct ProgramQuestion {
    /// Its number, from 1.
    pub id: u64,
    /// Run time of the reading (s).
    pub time: f64,
    /// The age that the reading is expected to have when the chunk begins to be played (ms).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_ms: Option<f64>,
    /// Position, velocity, cosine, sine, angular velocity: float32 in all digits, so that a
    /// reader in double precision has the same numbers.
    pub observation: [f64; 5],
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
    ready: AnswerKind,
    limit_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum AnswerKind {
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
        let chunks = matches!(ready.ready, AnswerKind::Chunks);
        Ok(Self { chunks, limit })
    }
}

/// An answer of a program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerLine {
    id: u64,
    action: Option<f64>,
    actions: Option<Vec<f64>>,
}

/// Reads the actions in the answer to question number `id`: a single one, or a chunk of the
/// `horizon`.
///
/// # Errors
/// What is wrong with it, as the end of a sentence about the program.
pub fn actions(line: &str, id: u64, horizon: Option<usize>) -> Result<Vec<f32>, ProgramError> {
    let expected = match horizon {
        None => format!("{{\"id\":{id},\"action\":0.5}}"),
        Some(horizon) => format!("{{\"id\":{id},\"actions\":[… {horizon} numbers]}}"),
    };
    let answer: AnswerLine = parsed(line, &expected)?;
    if answer.id != id {
        return Err(ProgramError::Question {
            found: answer.id,
            asked: id,
        });
    }
    let actions = match (answer.action, answer.actions, horizon) {
        (Some(action), None, None) => vec![action],
        (None, Some(actions), Some(horizon)) if actions.len() == horizon => actions,
        (None, Some(actions), Some(horizon)) => {
            return Err(ProgramError::ChunkLength {
                found: actions.len(),
                expected: horizon,
            });
        }
        _ => return Err(unexpected(line, &expected)),
    };
    let finite = |action: f64| match action as f32 {
        finite if finite.is_finite() => Ok(finite),
        _ => Err(ProgramError::NotFinite(format!("{action:e}"))),
    };
    actions.into_iter().map(finite).collect()
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

//! The lines that the lab and a program exchange.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::super::PolicyContext;
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

/// A greeting or a question as a line of text.
pub fn line(value: &impl Serialize) -> String {
    // Numbers that are not finite become null.
    let mut line = serde_json::to_string(value).unwrap_or_default();
    line.push('\n');
    line
}

/// What a program says when it is ready.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub fn read(line: &str) -> Result<Self, String> {
        let expected = "{\"ready\":\"actions\"} or {\"ready\":\"chunks\"}";
        let ready: ReadyLine = parsed(line, expected)?;
        let limit = match ready.limit_s {
            None => LIMIT,
            Some(limit) if limit > 0.0 && limit <= LONGEST.as_secs_f64() => {
                Duration::from_secs_f64(limit)
            }
            Some(limit) => {
                return Err(format!(
                    "asked for a limit_s of {limit}: expected seconds up to {}",
                    LONGEST.as_secs()
                ));
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
pub fn actions(line: &str, id: u64, horizon: Option<usize>) -> Result<Vec<f32>, String> {
    let expected = match horizon {
        None => format!("{{\"id\":{id},\"action\":0.5}}"),
        Some(horizon) => format!("{{\"id\":{id},\"actions\":[… {horizon} numbers]}}"),
    };
    let answer: AnswerLine = parsed(line, &expected)?;
    if answer.id != id {
        return Err(format!(
            "answered question {} where {id} was asked",
            answer.id
        ));
    }
    let actions = match (answer.action, answer.actions, horizon) {
        (Some(action), None, None) => vec![action],
        (None, Some(actions), Some(horizon)) if actions.len() == horizon => actions,
        (None, Some(actions), Some(horizon)) => {
            let count = actions.len();
            return Err(format!(
                "answered with {count} actions, and a chunk has {horizon}"
            ));
        }
        _ => return Err(unexpected(line, &expected)),
    };
    let finite = |action: f64| match action as f32 {
        finite if finite.is_finite() => Ok(finite),
        _ => Err(format!(
            "answered {action:e}: an action must be a finite float32"
        )),
    };
    actions.into_iter().map(finite).collect()
}

fn parsed<'a, T: Deserialize<'a>>(line: &'a str, expected: &str) -> Result<T, String> {
    serde_json::from_str(line).map_err(|_| unexpected(line, expected))
}

/// A line that is no answer, as far as it is of use in an error.
fn unexpected(line: &str, expected: &str) -> String {
    const MOST: usize = 60;
    let shown: String = line.chars().take(MOST).collect();
    let rest = if shown.len() < line.len() { "…" } else { "" };
    format!("answered {shown:?}{rest}: expected {expected}")
}

#[cfg(test)]
#[path = "../../../../../tests/support/table.rs"]
mod table;

#[cfg(test)]
mod tests {
    use super::{table::rows, *};

    #[test]
    fn a_program_says_what_it_answers_with_and_how_long_it_takes() {
        let ready = |chunks, seconds| {
            let limit = Duration::from_secs_f64(seconds);
            Some(Ready { chunks, limit })
        };
        for (line, expected) in [
            (r#"{"ready":"actions"}"#, ready(false, 5.0)),
            (r#"{"ready":"chunks","limit_s":0.5}"#, ready(true, 0.5)),
            (r#"{"ready":"chunks","limit_s":0}"#, None),
            (r#"{"ready":"chunks","limit_s":1e300}"#, None),
            (r#"{"ready":true}"#, None),
            (r#"{"id":1,"action":0}"#, None),
            ("", None),
        ] {
            assert_eq!(Ready::read(line).ok(), expected, "{line}");
        }
    }

    #[test]
    fn only_an_answer_to_the_question_is_taken() {
        for [line, horizon, wrong] in rows(
            r#"
            {"id":7,"action":0.5}               |   |
            {"id":7,"actions":[1,-1]}           | 2 |
            {"id":6,"action":0.5}               |   | answered question 6 where 7 was asked
            {"id":7,"actions":[1]}              | 2 | 1 actions, and a chunk has 2
            {"id":7,"actions":[1,2,3]}          | 2 | 3 actions, and a chunk has 2
            {"id":7,"action":0.5}               | 2 | expected {"id":7,"actions"
            {"id":7,"actions":[1]}              |   | expected {"id":7,"action":0.5}
            {"id":7,"action":1,"actions":[1]}   |   | expected
            {"id":7,"action":NaN}               |   | expected
            {"id":7,"action":"0.5"}             |   | expected
            {"id":7,"action":[0.5]}             |   | expected
            {"id":7,"action":null}              |   | expected
            {"id":7,"action":1e39}              |   | a finite float32
            {"id":7,"actions":[0,1e39]}         | 2 | a finite float32
            {"id":7,"action":1e999}             |   | expected
            {"id":7,"action":1,"dropped":0}     |   | expected
            hello                               |   | answered "hello"
                                                |   | answered ""
            "#,
        ) {
            let horizon = horizon.parse().ok();
            match actions(&line, 7, horizon) {
                Ok(_) => assert_eq!(wrong, "", "{line}"),
                Err(why) => assert!(!wrong.is_empty() && why.contains(&wrong), "{line}: {why}"),
            }
        }
    }

    #[test]
    fn numbers_go_both_ways_without_a_change() {
        for number in [0.1_f32, -0.0, 1e-45, f32::MAX, 0.333_333_34] {
            let question = ProgramQuestion {
                id: 1,
                time: 0.24,
                delay_ms: None,
                observation: [number.into(); 5],
            };
            let said: serde_json::Value =
                serde_json::from_str(&super::line(&question)).expect("JSON");
            let text = said["observation"][0].to_string();
            assert_eq!(text.parse(), Ok(f64::from(number)), "{text}");
            let answer = format!("{{\"id\":1,\"action\":{text}}}");
            let back = actions(&answer, 1, None).expect(&answer)[0];
            assert_eq!(back.to_bits(), number.to_bits(), "{text}");
        }
    }
}

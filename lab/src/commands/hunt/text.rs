//! The outcome of a hunt, as text and as a file of knobs.

use std::collections::BTreeMap;

use ratelab::{Knob, TimedKnob, millis::to_millis};
use ratelab_experiment::hunt::{Budget, Found, Proof};
use ratelab_system::{KnobText, System, names::good};
use serde_json::{Value, json};

use crate::summary::text::lines;

/// Returns a description of the budget.
pub fn budget(budget: &Budget) -> String {
    let topic = &budget.topic;
    let mut parts = Vec::new();
    match budget.lose {
        0 => {}
        1 => parts.push(format!("1 message of {topic} lost")),
        lose => parts.push(format!("{lose} messages of {topic} lost")),
    }
    if !budget.delay.is_zero() {
        let [delay, part] = [budget.delay, budget.parts.delay].map(to_millis);
        parts.push(format!(
            "{delay} ms of delay on {topic}, all together, in parts of {part} ms"
        ));
    }
    if let Some((node, longest)) = &budget.hang {
        let [longest, part] = [*longest, budget.parts.hang].map(to_millis);
        parts.push(format!(
            "one tick of {node} {longest} ms long, in parts of {part} ms"
        ));
    }
    if let Some((node, most)) = &budget.shift {
        let [most, part] = [*most, budget.parts.shift].map(to_millis);
        parts.push(format!("{node} due {most} ms later, in parts of {part} ms"));
    }
    format!("at most {}", listed(&parts))
}

/// Returns the outcome in lines: the verdict, the faults, and the evidence.
pub fn outcome(system: &dyn System, found: &Found) -> String {
    let mut rows = vec![("verdict", found.verdict.to_string())];
    let knobs = KnobText(system.knobs().aliases()).lines(&found.knobs);
    rows.extend(knobs.into_iter().map(|knob| ("fault", knob)));
    rows.push(("proven", proven(system, found)));
    rows.push(("tried", format!("{} lists of faults", found.runs)));
    lines(&rows)
}

/// Returns the evidence, in one or two sentences.
pub fn proven(system: &dyn System, found: &Found) -> String {
    let good = good(system);
    let good = match &*good {
        "not lost" => "was not lost",
        good => good,
    };
    let proof = match found.proof {
        Proof::EverySmaller(0) => format!("without it the run {good}"),
        Proof::EverySmaller(1) => format!("with the one smaller list the run {good}"),
        Proof::EverySmaller(count) => {
            format!("with each of the {count} smaller lists the run {good}")
        }
        Proof::EachPart(count) => {
            format!("without any one of these {count} parts the run {good}")
        }
        Proof::Stopped => "whether less is was not found out: the hunt was stopped".to_owned(),
    };
    format!("{} is enough; {proof}", faults(&found.knobs))
}

/// Returns the faults, as the beginning of a sentence.
fn faults(knobs: &[TimedKnob]) -> String {
    let (mut lost, mut late, mut others) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
    for TimedKnob { at, knob } in knobs {
        match knob {
            Knob::Lose { topic, seq } => lost.entry(topic).or_insert_with(Vec::new).push(*seq),
            Knob::Postpone { topic, seq, delay } => {
                late.entry(topic)
                    .or_insert_with(Vec::new)
                    .push(format!("message {seq} by {} ms", to_millis(*delay)));
            }
            Knob::Hang { node, cost } => {
                let ms = to_millis(*cost);
                others.push(format!("a tick of {node} at {at} that takes {ms} ms"));
            }
            Knob::Offset { node, offset } => {
                others.push(format!("an offset of {node} of {} ms", to_millis(*offset)));
            }
            other => others.push(other.to_string()),
        }
    }
    let losses = lost.into_iter().map(|(topic, numbers)| {
        let messages = if numbers.len() == 1 {
            "message"
        } else {
            "messages"
        };
        format!("losing {messages} {} of {topic}", listed(&ranges(&numbers)))
    });
    let late = late.into_iter();
    let parts: Vec<String> = losses
        .chain(late.map(|(topic, late)| format!("postponing {} on {topic}", listed(&late))))
        .chain(others)
        .collect();
    listed(&parts)
}

/// Numbers as text, with three or more in a row as a range.
fn ranges(numbers: &[u64]) -> Vec<String> {
    let rows = numbers.chunk_by(|one, next| one + 1 == *next);
    let texts = rows.flat_map(|row| match row {
        [first, _, .., last] => vec![format!("{first} to {last}")],
        few => few.iter().map(ToString::to_string).collect(),
    });
    texts.collect()
}

/// Returns `parts` joined by commas, and an "and" before the last.
fn listed(parts: &[String]) -> String {
    match parts {
        [first @ .., before, last] => {
            let first: String = first.iter().map(|part| format!("{part}, ")).collect();
            format!("{first}{before} and {last}")
        }
        few => few.concat(),
    }
}

/// Returns a file of knobs: the faults, after the other knobs turned in the run.
pub fn file(system: &dyn System, found: &Found, knobs: &[TimedKnob]) -> String {
    let lines = KnobText(system.knobs().aliases()).lines(knobs);
    let comment = proven(system, found);
    format!("# {comment}\n{}\n", lines.join("\n"))
}

/// Returns the outcome as JSON.
pub fn json(system: &dyn System, found: &Found) -> Value {
    let proof = match found.proof {
        Proof::EverySmaller(_) => "every_smaller",
        Proof::EachPart(_) => "each_part",
        Proof::Stopped => "stopped",
    };
    json!({
        "found": true,
        "knobs": KnobText(system.knobs().aliases()).lines(&found.knobs),
        "proof": proof,
        "proven": proven(system, found),
        "lists_tried": found.runs,
        "cause_of_end": found.verdict.name(),
        "lost_at_s": found.verdict.at.as_secs_f64(),
    })
}

//! Policies as the libraries write them answer as they do there, or are refused in one line; see
//! `tests/fixtures/policies/libraries/make.py`.

use std::{fs, path::PathBuf};

use ratelab_policy::{AnswerKind, PolicyFile, RowPolicy, RowShape};
use serde_json::Value;

use crate::{clone::root, support::*};

/// The folder of the files, or another one made by the same script with more readings.
fn folder() -> PathBuf {
    let other = std::env::var_os("RATELAB_POLICIES").map(PathBuf::from);
    other.unwrap_or_else(|| root().join("tests/fixtures/policies/libraries"))
}

/// The lists of numbers in a JSON value.
fn numbers(rows: &Value) -> Vec<Vec<f64>> {
    let rows = rows.as_array().expect("rows").iter();
    let number = |number: &Value| number.as_f64().expect("a number");
    rows.map(|row| row.as_array().expect("a row").iter().map(number).collect())
        .collect()
}

/// The policy in a file of the folder, for observations of so many numbers.
fn opened(name: &str, sees: usize) -> Result<Box<dyn RowPolicy>, String> {
    let path = folder().join(name);
    let told = |error: PolicyError| error.to_string();
    let loaded = PolicyFile::parse(path.to_str().expect("UTF-8"))
        .load()
        .map_err(told)?;
    let context = PolicyContext {
        seed: 0,
        control_hz: hz(50.0),
        chunk: name.contains("chunk").then_some(4),
    };
    let shape = RowShape {
        sees,
        acts: None,
        action_ns: 20_000_000,
    };
    loaded.check_chunk(context.chunk, shape).map_err(told)?;
    loaded.policy(context, shape).map_err(told)
}

/// How far the answers of a policy are from these, as a share of the greatest of them; at least as a
/// share of one.
fn apart(policy: &mut dyn RowPolicy, readings: &[Vec<f64>], answers: &[Vec<f64>]) -> f64 {
    let greatest = answers.iter().flatten();
    let greatest = greatest.fold(1.0, |most: f64, one| most.max(one.abs()));
    let differences = readings.iter().zip(answers).map(|(reading, expected)| {
        let answer = policy.answer(reading);
        assert_eq!(answer.len(), expected.len());
        let pairs = answer.iter().zip(expected);
        let differences = pairs.map(|(found, expected)| (found - expected).abs());
        differences.fold(0.0, |most: f64, one| {
            if one > most || one.is_nan() {
                one
            } else {
                most
            }
        })
    });
    let differences: Vec<f64> = differences.collect();
    assert!(differences.iter().all(|one| one.is_finite()));
    differences.into_iter().fold(0.0, f64::max) / greatest
}

#[test]
fn each_policy_answers_as_in_its_library() {
    let expected = fs::read_to_string(folder().join("expected.json")).expect("answers");
    let expected: Value = serde_json::from_str(&expected).expect("JSON");
    let [x5, x4] = ["x5", "x4"].map(|name| numbers(&expected[name]));
    let answers = expected["out"].as_object().expect("answers");
    assert!(answers.len() > 20);
    let has_onnx = cfg!(feature = "onnx") && std::env::var_os("ORT_DYLIB_PATH").is_some();
    if !has_onnx {
        eprintln!("SKIPPED in part: set ORT_DYLIB_PATH to an ONNX Runtime library");
    }
    let mut wrong = Vec::new();
    let is_read = |name: &str| has_onnx || !name.contains(".onnx");
    for (name, answers) in answers.iter().filter(|(name, _)| is_read(name)) {
        let mut answers = numbers(answers);
        let has_choices = ["cartpole", "dqn", "logits"]
            .iter()
            .any(|part| name.contains(part));
        if has_choices {
            // Gymnasium's choices are 0 and 1.
            let choices = answers.iter_mut().flatten();
            choices.for_each(|choice| *choice = 2.0 * *choice - 1.0);
        }
        let readings = if has_choices { &x4 } else { &x5 };
        match opened(name, readings[0].len()) {
            Err(why) => wrong.push(why),
            Ok(mut policy) => {
                let apart = apart(&mut *policy, readings, &answers);
                println!("{name}: largest difference {apart:e}");
                let is_chunk = policy.kind() == AnswerKind::Chunk;
                if apart > 1e-6 || is_chunk != name.contains("chunk") {
                    wrong.push(format!("{name}: {apart:e}, a chunk: {is_chunk}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_policy_with_more_than_its_layers_is_refused_in_one_line_with_the_way_out() {
    let files = fs::read_dir(folder()).expect("a folder");
    let names = files.map(|file| file.expect("a file").file_name().into_string());
    let refused: Vec<String> = names
        .flatten()
        .filter(|name| name.starts_with("R_"))
        .collect();
    assert!(refused.len() > 5, "{refused:?}");
    for name in refused {
        let error = opened(&name, 5).err().unwrap_or_else(|| panic!("{name}"));
        assert!(!error.contains('\n'), "{error}");
        assert!(error.contains("docs/policies.md"), "{error}");
    }
}

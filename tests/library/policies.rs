//! A run has the requested policy or none: only numbers are read from files, and invalid
//! policies are refused by name.

use std::{fs, ops::ControlFlow, path::Path, path::PathBuf};

use rand_pcg::rand_core::RngCore;
use ratelab_experiment::sweep::{Sweep, all_cores};
use tempfile::TempDir;

use crate::{checkpoint, clone::root, support::*, table::rows};

/// Observations with known answers; see `tests/fixtures/policies/make.py`.
const OBSERVATIONS: usize = 1_000;

fn fixture(name: &str) -> String {
    checkpoint::fixture(&root(), name).display().to_string()
}

fn spec(text: &str) -> PolicySpec {
    text.parse().expect("a policy")
}

/// `text`, pinned to the current content of its file.
fn pinned(text: &str) -> PolicySpec {
    let pinned = PolicyCache::default().pin(&spec(text));
    pinned.expect("a policy").spec().clone()
}

/// The values of numpy's `default_rng(0).uniform(-1, 1, (1000, 5))`.
fn observations() -> Vec<Observation> {
    let mut numbers = generator(&[0]);
    let mut uniform = || {
        let unit = (numbers.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        (-1.0 + 2.0 * unit) as f32
    };
    let mut observation = || Observation {
        cart_position: uniform(),
        cart_velocity: uniform(),
        cos_theta: uniform(),
        sin_theta: uniform(),
        pole_velocity: uniform(),
    };
    (0..OBSERVATIONS).map(|_| observation()).collect()
}

/// What the policy in `file` answers to them.
fn answers(file: &str) -> Vec<f32> {
    let mut policy = policy(file);
    let observations = observations();
    observations.iter().map(|seen| policy.act(seen).0).collect()
}

/// The largest difference between two lists of answers.
fn apart(ours: &[f32], others: impl IntoIterator<Item = f64>) -> f64 {
    let pairs = ours.iter().zip(others);
    let worst = pairs.map(|(one, other)| (f64::from(*one) - other).abs());
    let worst = worst.fold(0.0, f64::max);
    println!("largest difference: {worst:e}");
    worst
}

#[test]
fn a_network_agrees_with_double_precision_to_a_millionth() {
    let expected = include_str!("../fixtures/policies/answers.txt").lines();
    let expected: Vec<f64> = expected.map(|line| line.parse().expect("number")).collect();
    assert_eq!(expected.len(), OBSERVATIONS);
    let worst = apart(&answers(&fixture("actor.safetensors")), expected);
    assert!(worst < 1e-6, "{worst:e}");
}

#[test]
fn the_same_weights_are_the_same_policy_from_any_kind_of_file() {
    let [expected, same, parameters, half] =
        ["actor.safetensors", "actor.pt", "parameters.pt", "half.pt"]
            .map(|name| answers(&fixture(name)));
    assert!(expected == same);
    // Float64, column by column, in one storage, as parameters, protocol 4.
    assert!(expected == parameters);
    // Half precision within its accuracy.
    let worst = apart(&half, expected.into_iter().map(f64::from));
    assert!(worst > 0.0 && worst < 0.02, "{worst}");
}

#[test]
fn a_policy_is_named_after_its_file() {
    assert_eq!(policy(&fixture("actor.pt")).name(), "actor.pt");
    assert_eq!(spec("./scripted").name(), "scripted");
    assert!(matches!(spec("./scripted"), PolicySpec::File(_)));
}

#[test]
fn a_written_policy_is_read_again() {
    let built_in = PolicyKind::ALL.map(PolicySpec::from);
    for spec in built_in
        .into_iter()
        .chain([spec("some where/x.pt"), pinned(&fixture("actor.pt"))])
    {
        assert_eq!(spec.to_string().parse(), Ok(spec.clone()));
        let json = serde_json::to_string(&spec).expect("JSON");
        let read: PolicySpec = serde_json::from_str(&json).expect(&json);
        assert_eq!(read, spec);
    }
    // The format in recordings of earlier versions.
    let old: PolicySpec = serde_json::from_str("\"Scripted\"").expect("JSON");
    assert_eq!(old, PolicyKind::Scripted.into());
}

#[test]
fn a_pinned_file_that_changes_is_refused() {
    let folder = TempDir::new().expect("folder");
    let path = folder.path().join("actor.pt");
    fs::copy(fixture("actor.pt"), &path).expect("copy");
    let pinned = pinned(path.to_str().expect("UTF-8"));
    assert!(pinned.load().is_ok());
    fs::copy(fixture("half.pt"), &path).expect("copy");
    let error = pinned.load().expect_err("another file").to_string();
    assert!(
        error.contains("actor.pt") && error.contains("SHA-256"),
        "{error}"
    );
    fs::remove_file(&path).expect("gone");
    let error = crate::support::refusal(&config(&format!("policy {pinned}")));
    assert!(error.contains("actor.pt: expected"), "{error}");
}

/// The error for `text`, which is no policy.
fn refusal(text: &str) -> String {
    let error = spec(text).load().expect_err(text).to_string();
    assert!(error.starts_with(text), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

#[test]
fn invalid_files_of_weights_are_refused_with_the_expected_and_actual_content() {
    let folder = TempDir::new().expect("folder");
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, content).expect("written");
        path.to_str().expect("UTF-8").to_owned()
    };
    let whole = fs::read(fixture("actor.pt")).expect("fixture");
    let safe = fs::read(fixture("actor.safetensors")).expect("fixture");
    let huge = folder.path().join("huge.pt");
    let made = fs::File::create(&huge).expect("file");
    made.set_len(1 << 40).expect("a terabyte of nothing");
    let half = |whole: &[u8]| whole[..whole.len() / 2].to_vec();
    let cases = [
        ("skripted".to_owned(), "scripted, zero, random, lqr, a file"),
        (folder.path().display().to_string(), "found a directory"),
        ("/dev/zero".to_owned(), "found a device"),
        (huge.display().to_string(), "1099511627776 bytes"),
        (file("empty.pt", b""), "0 bytes are all there is"),
        (file("text.pt", b"no weights at all"), "found none"),
        (
            file("half.pt", &half(&whole)),
            "found a zip that is not one",
        ),
        (file("half.safetensors", &half(&safe)), "found none of them"),
        (fixture("asks.pt"), "asks for \"posix.system\""),
        (fixture("legacy.pt"), "before 1.6"),
    ];
    for (text, found) in cases {
        let error = refusal(&text);
        let remedy = error.contains("expected") || error.contains("never code");
        assert!(remedy && error.contains(found), "{error}");
    }
}

/// A safetensors file of float32 tensors: each with its name, its shape and the value of all its
/// elements.
fn safetensors(folder: &Path, tensors: &str) -> String {
    use safetensors::{Dtype, serialize, tensor::TensorView};
    let tensors = tensors.split(';').filter(|tensor| !tensor.is_empty());
    let tensors = tensors.map(|tensor| {
        let words: Vec<&str> = tensor.split_whitespace().collect();
        let [name, shape, value] = words[..] else {
            panic!("{tensor}");
        };
        let shape = shape.split('x').map(|side| side.parse().expect(side));
        let (shape, value) = (shape.collect::<Vec<usize>>(), value.parse().expect(value));
        let data = f32::to_le_bytes(value).repeat(shape.iter().product());
        (name, shape, data)
    });
    let tensors: Vec<_> = tensors.collect();
    let views = tensors.iter().map(|(name, shape, data)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), data);
        (*name, view.expect("a tensor"))
    });
    let path = folder.join("made.safetensors");
    fs::write(&path, serialize(views, None).expect("a file")).expect("written");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn statistics_of_a_known_normaliser_are_used_and_others_refused() {
    let folder = TempDir::new().expect("folder");
    let actor = "actor.0.weight 1x5 0.25;actor.0.bias 1 0.5";
    let statistics = "NORM._mean 1x5 0.5;NORM._std 1x5 1.99;NORM._var 1x5 9;NORM.count 1 100";
    let [plain, normalised] = ["", statistics].map(|statistics| {
        let named = statistics.replace("NORM", "actor_obs_normalizer");
        answers(&safetensors(folder.path(), &format!("{actor};{named}")))
    });
    // Each number less a half, by two: the sum of five is less by 2.5.
    let expected = plain
        .iter()
        .map(|sum| 0.25 * ((f64::from(*sum) - 0.5) / 0.25 - 2.5) / 2.0 + 0.5);
    let worst = apart(&normalised, expected);
    assert!(worst < 1e-6, "{worst:e}");
    for [changed, found] in rows(
        "NORM.count 1 100 → x 1 100             | \"obs._mean\" (it looks like a normaliser)
         NORM._std 1x5 1.99 → NORM._std 1x4 1    | expected 5 finite numbers in \"obs._std\"
         NORM._std 1x5 1.99 → NORM._std 1x5 NaN  | expected 5 finite numbers in \"obs._std\"
         NORM._std 1x5 1.99 → NORM._std 1x5 -1   | expected deviations in \"obs._std\"
         NORM._mean 1x5 0.5 → NORM._mean 1x5 inf | expected 5 finite numbers in \"obs._mean\"",
    ) {
        let (before, after) = changed.split_once(" → ").expect("a change");
        let named = statistics.replace(before, after).replace("NORM", "obs");
        let error = refusal(&safetensors(folder.path(), &format!("{actor};{named}")));
        assert!(error.contains(&found), "{changed}: {error}");
    }
}

#[test]
fn tensors_that_are_no_actor_for_this_robot_are_refused_by_name() {
    let folder = TempDir::new().expect("folder");
    for [tensors, found] in rows(
        "critic 1 0              | expected a tensor \"actor_mean.0.weight\", found \"critic\"
                                 | found no tensors
         WEIGHT 2000x5 0         | found [2000, 5]
         WEIGHT 8x5 0;BIAS 7 0   | \"actor_mean.0.bias\" of shape [8], found [7]
         WEIGHT 8x5 NaN          | found NaN in \"actor_mean.0.weight\" at 0
         WEIGHT 8x5 0;BIAS 8 inf | found inf in \"actor_mean.0.bias\"",
    ) {
        let named = tensors.replace("WEIGHT", "actor_mean.0.weight");
        let named = named.replace("BIAS", "actor_mean.0.bias");
        let error = refusal(&safetensors(folder.path(), &named));
        assert!(error.contains(&found), "{tensors}: {error}");
    }
}

#[test]
fn the_regulator_and_every_policy_in_policies_balance_every_start() {
    let files = fs::read_dir(root().join("policies")).expect("policies");
    let files = files.map(|entry| entry.expect("entry").path());
    let learned = files.filter(|path| path.extension().is_some_and(|kind| kind == "safetensors"));
    let learned = learned.map(|path| {
        let size = fs::metadata(&path).expect("file").len();
        assert!(size < 100_000, "{}: {size} bytes", path.display());
        let weights = read_weights(&fs::read(&path).expect("file")).expect("weights");
        (spec(path.to_str().expect("UTF-8")), weights.actions())
    });
    let specs: Vec<_> = learned.chain([(PolicyKind::Lqr.into(), 1)]).collect();
    assert!(specs.len() > 1);
    for (spec, actions) in specs {
        let chunk = Some(actions).filter(|actions| *actions > 1);
        let chunk = chunk.map_or("none".to_owned(), |actions| actions.to_string());
        let base = config(&format!("policy {spec}; chunk {chunk}"));
        let sweep = Sweep {
            seeds: (0..100).collect(),
            ..Sweep::new(cart_pole(), base)
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()));
        let held = swept
            .expect("a sweep")
            .survival()
            .map(|survival| survival.held)
            .sum::<usize>();
        assert_eq!(held, 100, "{spec}");
    }
}

#[test]
fn a_network_with_several_actions_is_for_chunks_of_just_so_many() {
    let folder = TempDir::new().expect("folder");
    let file = |name: &str, actions: usize| {
        let folder = folder.path().join(name);
        fs::create_dir(&folder).expect("folder");
        let layers = [(0, 8, 5), (2, 8, 8), (4, actions, 8)];
        let layers = layers.map(|(layer, out, inputs)| {
            format!("actor_mean.{layer}.weight {out}x{inputs} 0;actor_mean.{layer}.bias {out} 0.5")
        });
        safetensors(&folder, &layers.join(";"))
    };
    let files = [file("one", 1), file("two", 2), file("four", 4)];
    for [actions, chunk, found] in rows(
        "1 | none | made
         1 | 3    | made
         4 | 4    | made
         2 | none | made
         4 | none | answers are 4 numbers, and the run wants one action: give --chunk 4 if they are
         4 | 3    | are 4 numbers, and the run wants chunks of 3 actions: give --chunk 4 if they are",
    ) {
        let place = actions.parse::<usize>().expect("a number") / 2;
        let file = &files[place];
        let made = started(&spec(file), chunk.parse().ok());
        let made = made.map_or_else(
            |error| error.why.to_string(),
            |mut policy| {
                let answer = policy.chunk_from(&observations()[0]);
                let wanted = (actions == "4").then(|| vec![0.5; 4]);
                assert_eq!(answer, wanted, "{actions}");
                "made".to_owned()
            },
        );
        assert!(made.contains(&found), "{actions} {chunk}: {made}");
    }
    assert!(refusal(&file("none", 0)).contains("of each, found [0, 8]"));
}

/// Number of steps until the fall of an agent trained by the course, seeds 0 to 9.
const COURSE_STEPS: [u64; 10] = [293, 164, 263, 280, 195, 172, 246, 165, 163, 228];

#[test]
fn an_agent_trained_by_the_course_runs_and_answers_as_it_does_there_from_any_format() {
    let Some(folder) = std::env::var_os("RATELAB_FIXTURES").map(PathBuf::from) else {
        eprintln!("SKIPPED: set RATELAB_FIXTURES to the folder of ppo_agent.pt");
        return;
    };
    let mut formats = vec!["pt", "safetensors"];
    if cfg!(feature = "onnx") && std::env::var_os("ORT_DYLIB_PATH").is_some() {
        formats.push("onnx");
    } else {
        eprintln!("SKIPPED in part: set ORT_DYLIB_PATH to an ONNX Runtime library");
    }
    let file = |format: &str| {
        folder
            .join(format!("ppo_agent.{format}"))
            .display()
            .to_string()
    };
    let steps = |format: &str, rate: f64| -> Vec<u64> {
        let setup = format!("control-hz {rate}; policy {}", file(format));
        let config = |seed| config(&format!("seed {seed}; {setup}"));
        (0..10).map(|seed| run(&config(seed)).steps).collect()
    };
    let expected = answers(&file("pt"));
    for format in formats {
        assert_eq!(steps(format, 50.0), COURSE_STEPS, "{format}");
        assert_eq!(steps(format, 25.0), steps("pt", 25.0), "{format}");
        let worst = apart(
            &answers(&file(format)),
            expected.iter().copied().map(f64::from),
        );
        assert!(worst < 1e-6, "{format}: {worst:e}");
    }
}

#[test]
fn an_onnx_file_that_cannot_run_is_refused_with_a_remedy() {
    let folder = TempDir::new().expect("folder");
    let path = folder.path().join("broken.onnx");
    fs::write(&path, b"\x08\x08\x12\x07pytorch").expect("written");
    let error = refusal(path.to_str().expect("UTF-8"));
    assert!(error.contains("ONNX Runtime"), "{error}");
    if error.contains("was not found") {
        assert!(error.contains("pip install onnxruntime"), "{error}");
        assert!(error.contains("ORT_DYLIB_PATH"), "{error}");
    }
}

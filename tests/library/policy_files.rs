//! A policy runs right or not at all: each kind of file that people have is told as what it is,
//! with the way out, and nothing in a file that could change the action is left out.

use std::{fs, os::unix::fs::PermissionsExt, path::Path};

use tempfile::TempDir;

use crate::{
    checkpoint::{content, entries, fixture, zipped},
    clone::root,
    saved::{Saved, as_torch_writes, checkpoint, pickled, state},
    support::*,
};

/// The tensors of an actor.
const ACTOR: &str = "actor_mean.0.weight 8x5; actor_mean.0.bias 8; actor_mean.2.weight 8x8;
    actor_mean.2.bias 8; actor_mean.4.weight 1x8; actor_mean.4.bias 1";

/// A checkpoint of an actor, with these items as well.
fn actor_and(items: &str) -> Vec<u8> {
    saved(&format!("{ACTOR};{items}"))
}

fn saved(items: &str) -> Vec<u8> {
    checkpoint("policy", &Saved::Dict(state(items)))
}

/// A dictionary of a dictionary of `items`, beside that of an optimiser.
fn nested(name: &str, items: &str) -> Vec<u8> {
    let outer = [
        ("optimizer_state_dict", Saved::Dict(state("step"))),
        (name, Saved::Dict(state(items))),
    ];
    let outer = outer.map(|(name, value)| (name.to_owned(), value));
    checkpoint("policy", &Saved::Dict(outer.into()))
}

/// A state dictionary of an actor in a module with these layers.
fn with_layers(layers: &str) -> Vec<u8> {
    with_layers_and(layers, "critic 1")
}

/// The same with more tensors.
fn with_layers_and(layers: &str, more: &str) -> Vec<u8> {
    let layers = layers.split(' ').map(str::to_owned).collect();
    let state = state(&format!("{ACTOR}; {more}"));
    checkpoint("policy", &Saved::Module(state, layers))
}

/// A zip of empty files.
fn zip_of(names: &str) -> Vec<u8> {
    let entries = names.split(' ').map(|name| (name.to_owned(), Vec::new()));
    zipped(&entries.collect::<Vec<_>>())
}

/// Writes a file of some mode; returns its path.
fn file(folder: &Path, name: &str, content: &[u8], mode: u32) -> String {
    let path = folder.join(name);
    fs::write(&path, content).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(mode)).expect("a mode");
    path.to_str().expect("UTF-8").to_owned()
}

/// Loads the policy in a file; an error is one line that begins with the file.
fn load(file: &str) -> Result<LoadedPolicy, String> {
    let spec: PolicySpec = file.parse().expect("a policy");
    spec.load().map_err(|error| {
        let error = error.to_string();
        assert!(!error.contains(char::is_control), "{error}");
        error.strip_prefix(file).expect("the file").to_owned()
    })
}

const SB3: &str = "ratelab new policy.py --policy sb3 (docs/policies.md)";
const SCRIPT: &str = "ratelab new policy.py --policy torchscript (docs/policies.md)";
const MODULE: &str = "ratelab new policy.py --policy module (docs/policies.md)";
const OWN: &str = "a program of your own can run it (docs/policies.md)";
/// A file that no program reads: what to do is in the text before.
const MENDED: &str = "";

#[rustfmt::skip]
fn kinds() -> Vec<(Vec<u8>, &'static str, &'static str)> {
    let normaliser = "stable_baselines3.common.vec_env.vec_normalize\nVecNormalize\n";
    let lists = Saved::List(vec![Saved::Dict(state("num_actions; action_scale"))]);
    vec![
        // Stable-Baselines3: a model, its state dictionary, its normaliser.
        (zip_of("data pytorch_variables.pth policy.pth policy.optimizer.pth _stable_baselines3_version"),
            "found a Stable-Baselines3 model (policy.pth and _stable_baselines3_version in the zip)", SB3),
        (saved("log_std 1; mlp_extractor.policy_net.0.weight 64x4; action_net.weight 1x64"),
            "this is a policy of Stable-Baselines3", SB3),
        (nested("state_dict", "mlp_extractor.policy_net.0.weight 64x4"), "this is a policy of Stable-Baselines3", SB3),
        (pickled(&Saved::Object(normaliser)), "statistics of a normaliser, not a policy", SB3),
        // PyTorch's other formats, and what its users save.
        (zip_of("policy/data.pkl policy/code/__torch__/net.py policy/constants.pkl policy/version"), "found TorchScript", SCRIPT),
        (zip_of("m/models/model.json m/data/weights/weight_0 m/archive_format"), "exported by torch.export (.pt2)", SCRIPT),
        (checkpoint("agent", &Saved::Object("__main__\nAgent\n")), "a whole object of \"__main__.Agent\"", MODULE),
        (nested("policy_state_dict", "fc1.weight 8x4; fc2.weight 2x8"),
            "found a state_dict nested under \"policy_state_dict\" (\"fc1.weight\", \"fc2.weight\");", MODULE),
        (nested("policy", "net_container.0.weight 8x5"), "a policy of skrl", MODULE),
        (nested("model", "a2c_network.mu.weight 1x8"), "a policy of rl_games", MODULE),
        (nested("actor_state_dict", "mlp.0.weight 8x5"), "nested under \"actor_state_dict\"", MODULE),
        (saved("shared_net.0.weight 64x4; actor_mean.weight 1x64"), "found \"actor_mean.weight\", \"shared_net.0.weight\"", MODULE),
        (saved("fc2.weight 2x8; fc1.weight 8x4"), "found \"fc1.weight\", \"fc2.weight\"", MODULE),
        (saved("net.0.weight 8x6; log_std 1"), "found \"log_std\", \"net.0.weight\"", MODULE),
        (saved("0.weight 8x5; 2.weight 8x8; 4.weight 1x8"), "found \"0.weight\"", MODULE),
        (saved(&ACTOR.replace("8x8", "4x8")), "\"actor_mean.2.bias\" of shape [4], found [8]", MODULE),
        // What would change the action.
        (actor_and("actor_mean.1.weight 8"), "found \"actor_mean.1.weight\" (another layer of the actor)", MODULE),
        (with_layers("actor_mean actor_mean.3 actor_mean.4 actor_mean.5"), "found \"actor_mean.5\" (another layer of the actor)", MODULE),
        (actor_and("obs_mean 5; obs_var 5"), "found \"obs_mean\" (it looks like a normaliser)", MODULE),
        (actor_and("obs_rms.running_mean 5"), "found \"obs_rms.running_mean\" (it looks like a normaliser)", MODULE),
        (actor_and("shift 5"), "found \"shift\" (it looks like a normaliser)", MODULE),
        (actor_and("shift 1x5"), "found \"shift\" (it looks like a normaliser)", MODULE),
        (actor_and("running_stats 11"), "found \"running_stats\" (nothing here knows its use)", MODULE),
        (actor_and("lstm.weight_ih_l0 32x5"), "found \"lstm.weight_ih_l0\" (nothing here knows its use)", MODULE),
        (actor_and("encoder.0.weight 5x5"), "found \"encoder.0.weight\"", MODULE),
        (actor_and("activation = mish"), "found \"activation\" (another activation)", MODULE),
        (actor_and("action_scale"), "found \"action_scale\" (it scales, moves or clips", MODULE),
        // Other formats.
        (pickled(&lists), "found a Python pickle;", MODULE),
        (pickled(&Saved::Object("numpy._core.multiarray\n_reconstruct\n")), "a Python pickle that asks for \"numpy._core.multiarray._reconstruct\"", MODULE),
        (zip_of("arr_0.npy arr_1.npy"), "arrays of NumPy (.npz): \"arr_0.npy\", \"arr_1.npy\"", OWN),
        (zip_of("metadata.json config.json model.weights.h5"), "a model of Keras", OWN),
        (zip_of("word/document.xml"), "there is no data.pkl in a folder", OWN),
        (b"\x89HDF\r\n\x1a\n\0\0".to_vec(), "found HDF5", OWN),
        (b"\x93NUMPY\x01\x00v\x00".to_vec(), "found an array of NumPy (.npy)", OWN),
        (b"\x1c\0\0\0TFL3\x14\0".to_vec(), "found a TensorFlow Lite model", OWN),
        (b"{\"weights\": [[0.1]]}".to_vec(), "found a text in JSON", OWN),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n".to_vec(), "git lfs pull fetches the file", MENDED),
        (content(&root(), "legacy.pt"), "as PyTorch wrote before 1.6", MENDED),
        (content(&root(), "asks.pt"), "asks for \"posix.system\": save the state_dict alone", MODULE),
    ]
}

#[test]
fn every_kind_of_file_that_is_not_read_is_told_with_the_way_out_whatever_its_mode_and_name() {
    let folder = TempDir::new().expect("a folder");
    for (content, found, way_out) in kinds() {
        let error = load(&file(folder.path(), "policy.pt", &content, 0o644));
        let error = error.expect_err(found);
        assert!(error.contains(found), "{found:?}: {error}");
        assert!(error.ends_with(way_out), "{way_out:?}: {error}");
        assert_eq!(error.contains("program"), way_out != MENDED, "{error}");
        let other = file(folder.path(), "policy", &content, 0o755);
        let other = load(&other).expect_err(found);
        assert_eq!(other, error);
    }
    let error = load(folder.path().to_str().expect("UTF-8")).expect_err("a folder");
    assert!(
        error.contains("found a directory") && error.ends_with(OWN),
        "{error}"
    );
}

#[test]
fn what_has_no_part_in_the_action_may_stand_beside_the_actor() {
    let folder = TempDir::new().expect("a folder");
    let beside = "critic.0.weight 8x5; value_head.bias 1; actor_logstd 1x1; log_std 1; lr;
        global_step; exp_name = ppo; activation = Tanh; activation_fn = torch.nn.Tanh";
    let layers = "critic critic.0 actor_mean actor_mean.0 actor_mean.1 actor_mean.4";
    let wrapped = |prefix: &str| {
        let names = ACTOR.replace("actor_mean", &format!("{prefix}actor_mean"));
        saved(&format!("{names}; {prefix}critic.0.weight 8x5"))
    };
    let deep = "actor_mean.6.weight 2x1; actor_mean.6.bias 2";
    for content in [
        actor_and(beside),
        with_layers(layers),
        with_layers_and("actor_mean actor_mean.5 actor_mean.6", deep),
        nested("model_state_dict", ACTOR),
        wrapped("module."),
        wrapped("_orig_mod."),
    ] {
        let loaded = load(&file(folder.path(), "policy.pt", &content, 0o755));
        loaded.expect("a policy");
    }
}

#[test]
fn a_checkpoint_may_have_a_name_of_any_length() {
    let folder = TempDir::new().expect("a folder");
    for letters in 1..=60 {
        let content = checkpoint(&"n".repeat(letters), &Saved::Dict(state(ACTOR)));
        let loaded = load(&file(
            folder.path(),
            "policy.cleanrl_model",
            &content,
            0o644,
        ));
        loaded.unwrap_or_else(|error| panic!("{letters} letters: {error}"));
    }
    // The entries of a real one.
    let real = zipped(&entries(&content(&root(), "actor.pt")));
    let loaded = load(&file(
        folder.path(),
        "actor.pt",
        &as_torch_writes(real),
        0o644,
    ));
    loaded.expect("a policy");
}

/// The length of its header, with which a safetensors file begins, may look like another format.
#[test]
fn a_safetensors_file_may_begin_with_any_byte() {
    use safetensors::{SafeTensors, serialize};
    let folder = TempDir::new().expect("a folder");
    let whole = content(&root(), "actor.safetensors");
    let whole = SafeTensors::deserialize(&whole).expect("safetensors");
    let mut beginnings = Vec::new();
    for padding in 0..256 {
        let note = ("note".to_owned(), " ".repeat(padding));
        let content = serialize(whole.tensors(), Some([note].into()));
        let content = content.expect("a file");
        beginnings.push(content[0]);
        for mode in [0o644, 0o755] {
            let loaded = load(&file(folder.path(), "policy", &content, mode));
            loaded.unwrap_or_else(|error| panic!("{:?}: {error}", &content[..9]));
        }
    }
    // Those of a pickle and of ONNX.
    assert!([0x80, 0x08].iter().all(|sign| beginnings.contains(sign)));
}

#[test]
fn names_in_an_error_are_sorted() {
    use safetensors::{Dtype, serialize, tensor::TensorView};
    let folder = TempDir::new().expect("a folder");
    let view = || TensorView::new(Dtype::F32, vec![1], &[0; 4]).expect("a tensor");
    let tensors = ["z", "b", "y", "c", "a", "x", "d"].map(|name| (name, view()));
    let content = serialize(tensors, None).expect("a file");
    let sorted = "found \"a\", \"b\", \"c\", \"d\", \"x\", \"y\", 1 more;";
    for content in [content, saved("z 1; b 1; y 1; c 1; a 1; x 1; d 1")] {
        let error = load(&file(folder.path(), "policy", &content, 0o644)).expect_err("names");
        assert!(error.contains(sorted), "{error}");
    }
}

#[test]
fn settings_in_the_header_of_a_safetensors_file_are_read_as_well() {
    use safetensors::{SafeTensors, serialize};
    let folder = TempDir::new().expect("a folder");
    let whole = fs::read(fixture(&root(), "actor.safetensors")).expect("fixture");
    let whole = SafeTensors::deserialize(&whole).expect("safetensors");
    for (name, text, is_right) in [
        ("format", "pt", true),
        ("activation", "tanh", true),
        ("activation", "relu", true),
        ("action_scale", "3", false),
    ] {
        let setting = (name.to_owned(), text.to_owned());
        let content = serialize(whole.tensors(), Some([setting].into())).expect("a file");
        let loaded = load(&file(folder.path(), "policy", &content, 0o644));
        assert_eq!(loaded.is_ok(), is_right, "{name} {text}");
    }
}

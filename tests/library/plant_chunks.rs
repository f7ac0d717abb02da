//! Robots whose policy answers with chunks: rows of controls, plans of a model, two plans and their mean.

use std::{fs, sync::Arc};

use ratelab_experiment::Experiment;
use ratelab_system::{FigureValue, System};

use crate::{
    clone::root,
    plants::{fixture, folder, opened, published, run_with_program, text},
    support::*,
};

/// How runs of this robot with these knobs end, by seed.
fn verdicts(system: &Arc<dyn System>, knobs: &str) -> Vec<String> {
    let run = |seed: u64| {
        let setup = format!("until 10; seed {seed}; {knobs}");
        run_of(system.clone(), &config(&setup))
            .verdict
            .name()
            .to_owned()
    };
    (0..3).map(run).collect()
}

/// Weights of a network that sees one number, and gives these whatever it is.
fn answering(outputs: &[f32]) -> Vec<u8> {
    use safetensors::{Dtype, serialize, tensor::TensorView};
    let count = outputs.len();
    let tensors = [
        ("actor_mean.0.weight", vec![1, 1], vec![0.0]),
        ("actor_mean.0.bias", vec![1], vec![0.0]),
        ("actor_mean.2.weight", vec![count, 1], vec![0.0; count]),
        ("actor_mean.2.bias", vec![count], outputs.to_vec()),
    ];
    let tensors = tensors.map(|(name, shape, values)| {
        let bytes: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
        (name, shape, bytes)
    });
    let views = tensors.iter().map(|(name, shape, bytes)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes);
        (name, view.expect("a tensor"))
    });
    serialize(views, None).expect("a file")
}

#[test]
fn a_network_answers_with_controls_one_action_after_the_other() {
    let folder = folder(&fixture("quad"));
    // Three actions of two controls, whatever it sees.
    let outputs: [f32; 6] = [0.5, -0.5, 1.0, 0.25, 0.0, 2.0];
    fs::write(folder.path().join("net.safetensors"), answering(&outputs)).expect("weights");
    let keys = "policy = \"net.safetensors\"\nobserve = [\"1\"]\naction = 0.1\n";
    let limits = "limits = { \"*\" = inf }\nchunk = 3";
    let (rows, summary) = published(&folder, &format!("{keys}{limits}"), "/action");
    assert_eq!(rows.len(), 51);
    // A new chunk at each tick, of which the first action is for now.
    let first = |row: &Vec<f64>| {
        row.iter()
            .zip([4.955, 4.855])
            .all(|(a, b)| (a - b).abs() < 1e-6)
    };
    assert!(rows.iter().all(first), "{rows:?}");
    let stalls = summary
        .figures
        .iter()
        .find(|figure| figure.name == "stalls");
    assert_eq!(stalls.expect("a figure").value, FigureValue::Count(0));
    let system = opened(folder.path(), &text(&format!("{keys}{limits}"))).expect("a robot");
    let experiment = Experiment::new(system, &config("until 1; rate policy 10"));
    let experiment = experiment.expect("a run");
    let tap = experiment.taps().rows("/action", 1_000).expect("actions");
    experiment.run().expect("a run");
    let mut rows = tap.rows();
    tap.take(&mut rows);
    // Three of the five ticks from one chunk to the next have an action.
    let rows: Vec<Vec<f64>> = rows.iter().map(|(_, row)| row.to_vec()).collect();
    for (place, row) in rows.iter().enumerate() {
        let place = 2 * (place % 3);
        let planned = [outputs[place], outputs[place + 1]].map(f64::from);
        for (control, output) in row.iter().zip(planned) {
            assert!((control - (4.905 + 0.1 * output)).abs() < 1e-6, "{rows:?}");
        }
    }
    assert!((30..=33).contains(&rows.len()), "{}", rows.len());
    let single = opened(folder.path(), &text(keys)).expect("a robot");
    let refused = Experiment::new(single, &config("until 1")).err();
    let error = refused.expect("an error").to_string();
    assert!(error.contains("give --chunk 3"), "{error}");
}

#[test]
fn a_plan_that_knows_what_is_played_bears_a_delay_that_loses_single_actions() {
    let keys = "limits = { slider = 1, low = 0.2, high = 0.2 }\nstart = 0.02";
    let system = opened(folder(&fixture("double")).path(), &text(keys)).expect("a robot");
    let slow = "takes policy 80; rate policy 10";
    assert!(
        verdicts(&system, slow)
            .iter()
            .all(|name| name.starts_with("lost"))
    );
    for (plan, verdict) in [("committed", "stood"), ("hold", "lost")] {
        let chunks = format!("{slow}; set policy chunk 20; set policy expect-delay 80");
        let ends = verdicts(&system, &format!("{chunks}; set policy plan {plan}"));
        assert!(
            ends.iter().all(|name| name.starts_with(verdict)),
            "{plan}: {ends:?}"
        );
    }
}

#[test]
fn the_mean_of_two_plans_is_the_plan_of_neither() {
    let folder = folder(&fixture("pendulum"));
    let file = fs::read(root().join("graphs/robots/plans.safetensors")).expect("a policy");
    fs::write(folder.path().join("plans.safetensors"), file).expect("a policy");
    let keys =
        "policy = \"plans.safetensors\"\nobserve = [\"joints\", \"joint-speeds\"]\nchunk = 25";
    let system = opened(folder.path(), &text(keys)).expect("a robot");
    let slow =
        "takes policy 40; rate policy 25; set policy plan committed; set policy expect-delay 40";
    for (knobs, verdict) in [
        ("set player merge newest", "stood"),
        ("set player merge ensemble:0.01", "lost_hinge"),
        ("set player merge ensemble:0.01; send policy lqr", "stood"),
    ] {
        let ends = verdicts(&system, &format!("{slow}; {knobs}"));
        assert!(ends.iter().all(|name| name == verdict), "{knobs}: {ends:?}");
    }
}

#[test]
fn a_program_answers_with_lists_of_controls() {
    let ready = "{\"ready\":\"chunks\"}";
    let answers = [
        ready,
        "{\"id\":1,\"actions\":[[5,5],[4,6]]}",
        "{\"id\":2,\"actions\":[[5,5],[5,5]]}",
        "{\"id\":3,\"actions\":[[5,5],[5,5]]}",
    ];
    let keys = "start = 0\nchunk = 2";
    let (told, asked) = run_with_program(&folder(&fixture("quad")), keys, &answers);
    assert!(told.starts_with("STOOD"), "{told}");
    assert!(asked[0].contains("\"chunk\":2"), "{asked:?}");
    assert!(asked[1].contains("\"delay_ms\":"), "{asked:?}");
    let flat = [ready, "{\"id\":1,\"actions\":[5,5]}"];
    let (_, asked) = run_with_program(&folder(&fixture("quad")), keys, &flat);
    assert_eq!(
        asked.len(),
        2,
        "it is ended after a wrong answer: {asked:?}"
    );
}

#[test]
fn chunks_are_for_a_reference_that_stands_still() {
    let keys = "chunk = 5\nreference = [\"shoulder sine 0.5 0.2\"]";
    let system = opened(folder(&fixture("reacher")).path(), &text(keys)).expect("a robot");
    let refused = Experiment::new(system, &config("until 1")).err();
    let error = refused.expect("an error").to_string();
    assert!(error.contains("whose reference stands still"), "{error}");
}

//! The file that a recording gets.

use std::path::PathBuf;

use ratelab::Topology;
use ratelab_cart_pole::CartPole;
use ratelab_experiment::Config;
use ratelab_recording::{
    Destination, Origin, Recorder, Source,
    rrd::{RrdFormat, scene::lanes::TIMELINE},
};

use super::{chunks_of, experiment, file, finish, read, to, verify, with_knobs};

/// The origin of a run of the cart-pole.
fn origin() -> Origin {
    let topology = Topology {
        nodes: Vec::new(),
        topics: Vec::new(),
    };
    Origin::new(&CartPole::default(), Config::default(), topology)
}

/// The name of the file created by `destination`.
fn claimed(destination: &mut Destination) -> PathBuf {
    let made = destination.create(&origin());
    made.expect("a file").0
}

#[test]
fn a_name_is_kept_once_and_numbered_after() {
    let folder = tempfile::tempdir().expect("folder");
    for (name, second) in [("run.rrd", "run-2.rrd"), ("bare", "bare-2")] {
        let file = folder.path().join(name);
        let mut destination = to(&file);
        assert_eq!(claimed(&mut destination), file);
        assert_eq!(claimed(&mut destination), folder.path().join(second));
        // A second destination of the same name finds the file taken.
        let mut other = to(&file);
        let refused = other.create(&origin());
        assert_eq!(refused.err().expect("taken").path, file);
    }
}

#[test]
fn a_folder_gets_files_named_after_their_runs() {
    let folder = tempfile::tempdir().expect("folder");
    let mut destination = to(folder.path());
    for number in 1..4 {
        let path = claimed(&mut destination);
        assert_eq!(path.parent(), Some(folder.path()));
        let name = path.to_string_lossy();
        assert!(
            name.contains("_cart-pole_virtual_seed0"),
            "{number}: {name}"
        );
    }
}

#[test]
fn a_recording_whose_end_is_overdue_is_whole_and_says_what_it_leaves_out() {
    let record = |is_overdue: fn() -> bool| {
        let (_folder, path) = file("run.rrd");
        let format = RrdFormat {
            is_overdue,
            ..RrdFormat::default()
        };
        let experiment = experiment(&with_knobs("", ""));
        let mut to = Destination::new(Some(path.clone()), format);
        let recorder = Recorder::from_the_start(&mut to, &Source::for_experiment(&experiment));
        let finished = finish(recorder.expect("a recorder"), &experiment.run());
        verify(&read(&path)).expect("identical");
        let chunks = chunks_of(&path);
        let has_lanes = chunks.iter().any(|chunk| {
            let entity = chunk.entity_path().to_string();
            entity.starts_with(&format!("/{TIMELINE}"))
        });
        (finished.hurried, has_lanes)
    };
    assert_eq!(record(|| false), (false, true));
    assert_eq!(record(|| true), (true, false));
}

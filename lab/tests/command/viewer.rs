//! `ratelab run --rerun`: a copy of the recording for a viewer.

use std::net::TcpListener;

use crate::support::{Folder, Said, error_line};

/// Somebody who accepts connections and never answers, and their address.
fn silent_viewer() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    (listener, format!("rerun+http://127.0.0.1:{port}/proxy"))
}

const RUN: &str = "run --clock virtual --json --break";

#[test]
fn without_a_viewer_the_run_goes_on_with_one_line() {
    let folder = Folder::new();
    let plain = folder.says(RUN);
    let (_, nobody) = silent_viewer();
    for (address, why) in [
        (&*nobody, "no viewer listens at 127.0.0.1"),
        ("nonsense", "is not the address of a viewer"),
    ] {
        let output = folder.does(&format!("{RUN} --rerun {address}"));
        let note = error_line(address, &output, 0);
        assert_eq!(Said::new(&output.stdout), plain);
        assert!(note.starts_with("note: --rerun: "), "{note:?}");
        note.has(why);
    }
}

#[test]
fn a_viewer_that_takes_nothing_changes_neither_the_run_nor_the_recording() {
    let folder = Folder::new();
    let (_listener, address) = silent_viewer();
    let run = format!("{RUN} --rerun {address} --record run.rrd");
    assert_eq!(folder.says(&run), folder.says(RUN));
    folder.says("verify run.rrd");
}

//! `ratelab run --rerun`: a copy of the recording for a viewer.

mod support;

use std::{fs, net::TcpListener};

use support::{folder, path, ratelab, text};

/// An address at `port`.
fn address(port: u16) -> String {
    format!("rerun+http://127.0.0.1:{port}/proxy")
}

const RUN: [&str; 5] = ["run", "--clock", "virtual", "--json", "--break"];

#[test]
fn without_a_viewer_the_run_goes_on_with_one_line() {
    let plain = ratelab(&RUN);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    drop(listener);
    for (address, why) in [
        (address(port), "no viewer listens at 127.0.0.1"),
        ("nonsense".to_owned(), "is no address of a viewer"),
    ] {
        let output = ratelab(&[&RUN[..], &["--rerun", &address]].concat());
        assert!(output.status.success(), "{output:?}");
        assert_eq!(output.stdout, plain.stdout);
        let said = text(&output.stderr);
        assert!(
            said.starts_with("note: --rerun: ") && said.contains(why),
            "{said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

#[test]
fn a_viewer_that_takes_nothing_changes_neither_the_run_nor_the_recording() {
    // It accepts connections and never answers.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let folder = folder();
    let file = path(&folder, "run.rrd");
    let plain = ratelab(&RUN);
    let asked = ["--rerun", &address(port), "--record", &file];
    let output = ratelab(&[&RUN[..], &asked].concat());
    assert!(output.status.success(), "{output:?}");
    assert_eq!(output.stdout, plain.stdout);
    assert!(fs::metadata(&file).is_ok());
    let verified = ratelab(&["verify", &file]);
    assert!(verified.status.success(), "{verified:?}");
}

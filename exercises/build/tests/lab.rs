//! The run on the types of this crate in the lab: compared with the lab's own.

use std::process::Command;

#[test]
fn the_lab_finds_the_run_identical_to_its_own() {
    for (hz, expected) in [
        ("5", "91 messages, 91 ticks"),
        ("50", "1,503 messages, 1,503 ticks"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_build-it"))
            .arg(hz)
            .output()
            .expect("it runs");
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let identical = format!("your runtime: identical, 3 topics, {expected}\n");
        assert_eq!(printed, identical, "{output:?}");
        assert!(output.status.success(), "{output:?}");
    }
}

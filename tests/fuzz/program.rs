//! The command with limits on its time and memory, with the properties that hold for any
//! input.

use std::{
    ffi::OsStr,
    os::unix::process::ExitStatusExt,
    path::Path,
    process::{Command, Output, Stdio},
    sync::mpsc::channel,
    thread,
    time::Duration,
};

use crate::support::words;

/// Limit of a command's processor time (s).
const MAX_SECONDS: u64 = 20;

/// Limit of a command's address space (kB): far more than it needs, because every thread
/// reserves some.
const MAX_MEMORY: u64 = 4 << 20;

/// Maximum time to wait for a command.
const PATIENCE: Duration = Duration::from_secs(120);

/// The output of `ratelab` with `args` in `folder`, with `home` for the user's own files
/// and an empty search path.
///
/// # Panics
/// If it ends by a signal, such as that of a limit, does not end, or panics.
pub fn ratelab<S: AsRef<OsStr>>(args: &[S], folder: &Path, home: &Path) -> Output {
    let limits = format!("ulimit -t {MAX_SECONDS}; ulimit -v {MAX_MEMORY}; exec \"$@\"");
    let mut command = Command::new("/bin/sh");
    command.args(["-c", &limits, "sh", env!("CARGO_BIN_EXE_ratelab")]);
    command.args(args).current_dir(folder);
    command.env_clear().env("HOME", home).env("PATH", home);
    command.stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("ratelab starts");
    let pid = child.id().to_string();
    let (sender, output) = channel();
    thread::spawn(move || sender.send(child.wait_with_output()));
    let Ok(output) = output.recv_timeout(PATIENCE) else {
        let _ = Command::new("kill").args(["-KILL", &pid]).status();
        panic!("it does not end");
    };
    let output = output.expect("an end");
    assert_eq!(
        output.status.signal(),
        None,
        "ended by a signal: {output:?}"
    );
    assert!(
        matches!(output.status.code(), Some(0..=2)),
        "{}: {}",
        output.status,
        stderr(&output)
    );
    if output.status.code() == Some(2) {
        refusal(&output);
    }
    output
}

/// The output of `ratelab` with the words of `line`, in a folder that is the user's home, too.
pub fn does(line: &str, folder: &Path) -> Output {
    let words: Vec<&str> = words(line).collect();
    ratelab(&words, folder, folder)
}

/// The standard error output, which must be text.
pub fn stderr(output: &Output) -> &str {
    str::from_utf8(&output.stderr).expect("UTF-8")
}

/// The error line of a refusal, without notes.
fn refusal(output: &Output) -> &str {
    let text = stderr(output);
    let mut errors = text.lines().filter(|line| !line.starts_with("note: "));
    let line = errors.next().expect("an error line");
    assert!(line.starts_with("error: "), "no error: {text:?}");
    assert_eq!(errors.next(), None, "more than one line: {text:?}");
    let control = text.chars().find(|c| c.is_control() && *c != '\n');
    assert_eq!(control, None, "a control character: {text:?}");
    line
}

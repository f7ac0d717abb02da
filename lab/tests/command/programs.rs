//! Policies in programs of their own: what they answer, how they die, and who may start them.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use crate::support::{Folder, send, table::rows};

/// Reads the greeting, and is ready to answer with actions.
const READY: &str = "import json, os, sys, time
def say(line): print(line, flush=True)
sys.stdin.readline()
say('{\"ready\":\"actions\",\"limit_s\":20}')
";

/// Answers each question, the tenth in its own way.
const ANSWERS: &str = "for n, line in enumerate(sys.stdin):
    id = json.loads(line)['id']
    if n == 9: TENTH
    say(json.dumps({'id': id, 'action': 0.1}))
";

fn script(folder: &Folder, name: &str, code: &str) {
    folder.write(name, format!("#!/usr/bin/env python3\n{code}"));
    let executable = fs::Permissions::from_mode(0o755);
    fs::set_permissions(folder.path(name), executable).expect("a mode");
}

/// A policy that answers its tenth question like this.
fn tenth(folder: &Folder, code: &str) {
    let answers = ANSWERS.replace("TENTH", code);
    script(folder, "policy.py", &format!("{READY}{answers}"));
}

#[test]
fn the_scripted_policy_in_python_gives_the_bytes_of_the_built_in_one() {
    let folder = Folder::with(&["policies/balance.py"]);
    for setup in [
        "",
        "--world own --control-hz 20 --think-ms 30",
        "--world own --chunk 20",
    ] {
        let run = format!("run --clock virtual --duration-s 3 {setup} --csv");
        folder.says(&format!("{run} built-in.csv"));
        for file in ["first.csv", "again.csv"] {
            folder.says(&format!("{run} {file} --policy balance.py"));
            assert_eq!(folder.read(file), folder.read("built-in.csv"), "{setup}");
        }
    }
}

/// Stand-ins for libraries: each answers as the scripted policy, to the model or graph of its usual
/// name, and with one of two choices to one called `choice`. They print what is not an answer.
const LIBRARIES: [(&str, &str); 5] = [
    (
        "law.py",
        "print('hello from a library')
def push(seen):
    x, v, theta, omega = seen
    return 10.0 * theta + 2.0 * omega + 0.4 * x + 0.8 * v
",
    ),
    (
        "numpy.py",
        "float16, float32, float64 = 'efd'
class Kind:
    def __init__(self, kind): self.kind = kind
class Array(list):
    dtype = Kind('f')
    def reshape(self, shape):
        assert shape == [1, -1], shape
        return Array([list(self)])
    def flatten(self): return self
    def tolist(self): return list(self)
def array(seen, kind): return Array(seen)
",
    ),
    (
        "stable_baselines3.py",
        "import law, numpy
class PPO:
    def load(path, device):
        model = PPO()
        model.is_choice, model.action_space = path.endswith('/choice.zip'), PPO
        if model.is_choice: PPO.n = 2
        return model
    def predict(self, seen, deterministic):
        push = law.push(seen)
        return (int(push > 0.0) if self.is_choice else numpy.Array([push])), None
",
    ),
    (
        "onnxruntime.py",
        "import law, numpy
class InferenceSession:
    name, shape, type = 'obs', [1, 4], 'tensor(float)'
    def __init__(self, path, providers): self.is_choice = path.endswith('/choice.onnx')
    def get_inputs(self): return [self]
    def run(self, names, inputs):
        (seen,) = inputs['obs']
        answer = numpy.Array([law.push(seen)])
        if self.is_choice:
            answer = numpy.Array([int(law.push(seen) > 0.0)])
            answer.dtype = numpy.Kind('i')
        return [answer, numpy.Array([7.0])]
",
    ),
    (
        "torch/__init__.py",
        "import contextlib, law, numpy, sys, types
float32 = None
def no_grad(): return contextlib.nullcontext()
def tensor(rows, dtype): return rows
class Module:
    def __init__(self, *layers): self.is_choice = False
    def eval(self): return self
    def load_state_dict(self, state): assert sorted(state) == ['0.bias', '0.weight'], state
    def __call__(self, rows):
        (seen,) = rows
        push = law.push(seen)
        return numpy.Array([0.0, push] if self.is_choice else [push])
def load_script(path, map_location):
    module = Module()
    module.is_choice = path.endswith('/choice.pt')
    return module
def load(path, map_location, weights_only):
    assert path.endswith('/policy.pt') and weights_only
    return {'critic.0.bias': 1, 'actor_mean.0.weight': 2, 'actor_mean.0.bias': 3}
jit = types.SimpleNamespace(load=load_script)
nn = types.ModuleType('torch.nn')
nn.Sequential, nn.Linear, nn.Tanh, nn.ReLU = Module, Module, Module, Module
sys.modules['torch.nn'] = nn
",
    ),
];

#[test]
fn a_program_that_new_writes_runs_a_policy_of_its_library() {
    let folder = Folder::new();
    for (name, code) in LIBRARIES {
        folder.write(&format!("libraries/{name}"), code);
    }
    let run = "ratelab run --clock virtual --duration-s 3 --csv";
    folder.plays(&format!("{run} built-in.csv"));
    let run = format!("PYTHONPATH=libraries {run}");
    for kind in ["sb3", "torchscript", "onnx", "module"] {
        folder.plays(&format!(
            "ratelab new {kind}.py --policy {kind}
             {run} {kind}.csv --policy ./{kind}.py"
        ));
        let [ours, built_in] = [kind, "built-in"].map(|name| folder.read(&format!("{name}.csv")));
        assert_eq!(ours, built_in, "{kind}");
    }
    for kind in ["sb3", "torchscript", "onnx"] {
        folder.plays(&format!(
            "sed -i -E 's/^(MODEL = .)(model|policy)/\\1choice/' {kind}.py
             grep -q ^MODEL.*choice {kind}.py
             {run} choice.csv --policy ./{kind}.py"
        ));
        let pushes = folder.read("choice.csv");
        let mut pushes = pushes.lines();
        let header = pushes.next().expect("a header").split(',');
        let place = header.clone().position(|name| name == "action");
        let place = place.expect("a column of actions");
        let mut pushes: Vec<&str> = pushes.filter_map(|row| row.split(',').nth(place)).collect();
        pushes.sort_unstable();
        pushes.dedup();
        assert_eq!(pushes, ["-1", "1"], "{kind}");
    }
}

#[test]
fn a_policy_that_plans_its_chunks_balances_where_one_that_holds_falls() {
    let folder = Folder::with(&["policies/chunks.py"]);
    let run = "run --clock virtual --world own --chunk 50 --think-ms 300 --control-hz 3 \
               --expect-delay 300 --plan";
    folder
        .says(&format!("{run} committed --policy ./chunks.py"))
        .has("BALANCED");
    folder
        .says(&format!("{run} hold --policy scripted"))
        .has("FELL");
}

#[test]
fn what_kills_a_policy_is_said_and_its_recording_is_verified_without_it() {
    let folder = Folder::new();
    let run = "run --clock virtual --world own --duration-s 0.5 --policy ./policy.py";
    for [code, said] in rows(
        r#"os.kill(os.getpid(), 9) | was ended by signal 9
           sys.exit(3) | ended with exit code 3
           raise ValueError('no such joint') | saying "ValueError: no such joint"
           raise ValueError('no such file: ' + 300 * 'x') | saying "ValueError: no such file: xxx
           say('hello') | answered "hello": expected {"id":10,"action":0.5}
           say('x' * 70000) | a line of more than 64 KiB
           os.write(1, bytes([255, 10])) | bytes that are not text"#,
    ) {
        tenth(&folder, &code);
        let printed = folder.says(&format!("{run} --record run.rrd"));
        printed.has("crashed   0.180 s: policy crashed: policy.py ");
        printed.has(&said).has("\"restart policy\" starts it again");
        fs::remove_file(folder.path("policy.py")).expect("removed");
        folder.says("verify run.rrd").has("identical");
        folder.says("info run.rrd").has(&said);
        fs::remove_file(folder.path("run.rrd")).expect("removed");
    }
}

#[test]
fn a_policy_that_is_silent_is_ended_at_its_limit_and_can_be_started_again() {
    let folder = Folder::new();
    let answers = ANSWERS.replace("TENTH", "time.sleep(3600)");
    let ready = READY
        .replace("20}", "0.2}")
        .replace("import", "import signal,");
    script(&folder, "policy.py", &format!("{ready}{answers}"));
    folder.write("again.knobs", "0.3 restart policy\n");
    let run = "run --clock virtual --world own --duration-s 0.6 --knobs again.knobs";
    // A busy machine may be late with any answer.
    let printed = folder.says(&format!("{run} --policy ./policy.py"));
    printed.has("policy.py gave no answer for 0.2 s, and was ended");
    printed.has("knob      0.3 restart policy");
}

#[test]
fn a_policy_that_is_not_ready_is_bad_input() {
    let folder = Folder::new();
    for [mode, content, said] in rows(
        r#"755 | #!/usr/bin/env python3 | policy.py: ended with exit code 0
           755 | #!/usr/bin/env python3\nimport nosuch | No module named 'nosuch'
           755 | #!/usr/bin/env python3\nprint('{"ready":"chunks"}') | chunks: give --chunk H
           755 | #!/no/such/python | the interpreter in its first line is missing
           755 | #!/usr/bin/env nosuch | ended with exit code 127
           755 | print(1) | has no first line #!
           644 | #!/usr/bin/env python3 | not executable: chmod +x ./policy.py
           644 | print(1) | policy.py"#,
    ) {
        folder.write("policy.py", format!("{content}\n"));
        folder.plays(&format!("chmod {mode} policy.py"));
        folder.fails("run --policy ./policy.py", 2).0.has(&said);
    }
}

#[test]
fn a_recording_starts_no_program_that_is_not_named_here() {
    let folder = Folder::with(&["policies/balance.py"]);
    let says = "open('started', 'w')\n";
    let balance =
        folder
            .read("balance.py")
            .replacen("import json", &format!("{says}import json"), 1);
    folder.write("balance.py", balance.replacen("open", "\nopen", 1));
    folder.says("run --duration-s 0.2 --policy ./balance.py --record run.rrd");
    fs::remove_file(folder.path("started")).expect("it was started");
    folder.plays(
        "ratelab verify run.rrd && test ! -e started
         ratelab verify --perturb run.rrd && test ! -e started
         ratelab info run.rrd && test ! -e started
         2 ratelab branch run.rrd --at 0.1 --knob 'takes policy 1'
         2 ratelab run --like run.rrd
         test ! -e started
         ratelab verify run.rrd --ask-policy balance.py && rm started
         ratelab branch run.rrd --at 0.1 --knob 'policy balance.py' && rm started
         ratelab run --like run.rrd --policy balance.py && rm started
         echo >> balance.py
         1 ratelab verify run.rrd --ask-policy balance.py => starts a program",
    );
}

#[test]
#[cfg(target_os = "linux")]
fn what_a_policy_has_started_ends_with_it_whatever_session_it_is_in() {
    let folder = Folder::new();
    let starts = "import subprocess
def note(pid): open('pids', 'a').write(f'{pid}\\n')
sleep = ['sleep', '3600']
note(subprocess.Popen(sleep).pid)
note(subprocess.Popen(sleep, start_new_session=True).pid)
note(subprocess.Popen(['sh', '-c', 'setsid sleep 3600 & echo $! >> pids']).pid)
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        note(os.getpid())
        os.execvp('sleep', sleep)
    os._exit(0)
# It answers only when all five are noted: on a busy machine they start after it.
while open('pids').read().count('\\n') < 5:
    time.sleep(0.005)
";
    let ready = READY.replace(
        "sys.stdin.readline()",
        &format!("{starts}sys.stdin.readline()"),
    );
    for tenth in ["pass", "sys.exit(3)", "time.sleep(3600)"] {
        let answers = ANSWERS.replace("TENTH", tenth);
        let ready = ready.replace("20}", "1}");
        script(&folder, "policy.py", &format!("{ready}{answers}"));
        folder.says("run --clock virtual --world own --duration-s 0.5 --policy ./policy.py");
        let pids = folder.read("pids");
        assert!(pids.lines().count() >= 5, "{pids}");
        for pid in pids.lines() {
            let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            let ended = state.is_empty() || state.contains(") Z ");
            assert!(ended, "{tenth}: {pid} lives: {state}");
        }
        fs::remove_file(folder.path("pids")).expect("removed");
    }
}

#[test]
fn a_signal_ends_the_run_and_a_policy_that_thinks_for_an_hour() {
    let folder = Folder::new();
    let code = "open('pid', 'w').write(str(os.getpid()) + '\\n'); time.sleep(3600)";
    let answers = ANSWERS.replace("TENTH", code);
    let ready = READY.replace("20}", "7200}");
    script(&folder, "policy.py", &format!("{ready}{answers}"));
    for clock in ["real", "virtual"] {
        let mut run = folder.command(&format!("run --clock {clock} --policy ./policy.py"));
        let mut run = run.stdout(Stdio::null()).spawn().expect("ratelab starts");
        let pid = loop {
            let written = fs::read_to_string(folder.path("pid")).unwrap_or_default();
            match written.strip_suffix('\n') {
                Some(pid) => break pid.to_owned(),
                None => thread::sleep(Duration::from_millis(1)),
            }
        };
        send("-TERM", run.id());
        let status = run.wait().expect("it ends");
        assert_eq!(status.code(), Some(128 + 15), "{clock}");
        let lives = Command::new("kill").args(["-0", &pid]).status();
        assert!(!lives.expect("kill").success(), "{clock}");
        fs::remove_file(folder.path("pid")).expect("removed");
    }
}

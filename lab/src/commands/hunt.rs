//! `ratelab hunt`: a short list of faults that loses a run.

use std::collections::BTreeMap;

use ratelab::{Command, Knob, TimedKnob, millis::to_millis};
use ratelab_experiment::{
    Config, Experiment,
    hunt::{Budget, Found, Hunt, Hunted, Proof},
};
use ratelab_recording::StopReason;
use ratelab_system::{KnobText, System, names::good};
use serde::Serialize;

use crate::{
    cli::HuntArgs,
    error::Error,
    options::{self, Defaults},
    output::{OutputFile, print_line, print_recorded, print_result, refuse_existing, try_new},
    program::Program,
    results::{destination_of, read_topics, record},
    signals,
    summary::text::{line, lines},
};

/// Defaults of the run.
const DEFAULTS: Defaults =
    Defaults::virtual_only("a hunt runs on the virtual clock: leave --clock real out");

/// Runs the hunt; prints and writes its outcome. Ctrl-C keeps the best list so far.
pub fn hunt(program: &Program, args: &HuntArgs) -> Result<(), Error> {
    let (config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let budget = budget(program, args, &config)?;
    let save = prepare_outputs(args)?;
    let mut hunt = Hunt::new(program.system.clone(), config);
    hunt.threads = args.threads.unwrap_or(hunt.threads);
    hunt.interrupt = signals::interrupt();
    let hunted = hunt.run(&budget, &|| false)?;
    if !args.json {
        print_line(&line("hunt", &budget_text(&budget)))?;
    }
    match hunted {
        Hunted::Held { runs, stopped } => print_held(program, args, runs, stopped),
        Hunted::Lost(found) => {
            let config = hunt.with(&found.knobs);
            let system = &*program.system;
            let report = FoundReport::new(system, &found);
            print_result(args.json, &report, &report.text())?;
            if let Some(file) = save {
                file.write(knobs_file(system, &found, &config.knobs).as_bytes())?;
            }
            record_run(program, args, &config)
        }
    }
}

/// Checks the files to write, because the hunt takes long, and must not overwrite a file. Returns
/// that of `--save`.
fn prepare_outputs(args: &HuntArgs) -> Result<Option<OutputFile>, Error> {
    if args.save.is_some() && args.save == args.record {
        let why = "--save and --record name the same file: choose another name for one of them";
        return Err(Error::BadInput(why.to_owned()));
    }
    for (option, path) in [("--save", &args.save), ("--record", &args.record)] {
        path.as_deref()
            .map_or(Ok(()), |path| refuse_existing(option, path))?;
    }
    let record = args.record.as_deref();
    record.map_or(Ok(()), |path| try_new("--record", path))?;
    let save = args.save.as_deref();
    save.map(|path| OutputFile::open("--save", path))
        .transpose()
}

fn budget(program: &Program, args: &HuntArgs, config: &Config) -> Result<Budget, Error> {
    let experiment = Experiment::new(program.system.clone(), config)?;
    // The last topic that is read, in the order in which nodes were added.
    let last = || read_topics(&experiment).pop().unwrap_or_default();
    let topic = args.topic.clone().unwrap_or_else(last);
    let offset = args
        .shift
        .as_ref()
        .and_then(|(node, _)| config.setup.offset(node));
    let budget = Budget {
        topic,
        lose: args.lose,
        delay: args.delay_ms.unwrap_or_default(),
        hang: args.hang.clone(),
        shift: args.shift.clone(),
        offset: offset.unwrap_or_default(),
        ..Budget::default()
    };
    let mut setup = program.system.about().setup();
    setup.extend(config.setup.iter().cloned());
    Ok(budget.fitted(&experiment.observer().topology(), &setup))
}

fn print_held(program: &Program, args: &HuntArgs, runs: usize, stopped: bool) -> Result<(), Error> {
    let good = good(&*program.system);
    let report = HeldReport {
        found: false,
        lists_tried: runs,
        stopped,
    };
    let text = if stopped {
        format!("nothing in the {runs} lists of faults tried until the stop")
    } else {
        format!("none: the run {good} with each of {runs} lists of faults; allow more")
    };
    print_result(args.json, &report, &line("found", &text))
}

/// Records the run of `config`, if it is to be recorded.
fn record_run(program: &Program, args: &HuntArgs, config: &Config) -> Result<(), Error> {
    let Some(path) = &args.record else {
        return Ok(());
    };
    let experiment = Experiment::new(program.system.clone(), config)?;
    let recorder = record(destination_of(Some(path.clone()), None), &experiment)?;
    let commands = experiment.commands();
    // The run of a hunt that was stopped is recorded whole: the next signal ends the program.
    signals::watch(move || drop(commands.send(Command::Stop)), || ());
    let outcome = experiment.run();
    recorder.end(StopReason::from_outcome(&outcome));
    print_recorded(args.json, &recorder.finish()?)?;
    outcome.map(drop).map_err(Error::from)
}

/// Returns a description of the budget.
fn budget_text(budget: &Budget) -> String {
    let topic = &budget.topic;
    let mut parts = Vec::new();
    match budget.lose {
        0 => {}
        1 => parts.push(format!("1 message of {topic} lost")),
        lose => parts.push(format!("{lose} messages of {topic} lost")),
    }
    if !budget.delay.is_zero() {
        let [delay, part] = [budget.delay, budget.parts.delay].map(to_millis);
        parts.push(format!(
            "{delay} ms of delay on {topic}, all together, in parts of {part} ms"
        ));
    }
    if let Some((node, longest)) = &budget.hang {
        let [longest, part] = [*longest, budget.parts.hang].map(to_millis);
        parts.push(format!(
            "one tick of {node} {longest} ms long, in parts of {part} ms"
        ));
    }
    if let Some((node, most)) = &budget.shift {
        let [most, part] = [*most, budget.parts.shift].map(to_millis);
        parts.push(format!("{node} due {most} ms later, in parts of {part} ms"));
    }
    format!("at most {}", listed(&parts))
}

/// The faults that a hunt has found, for people and for programs.
#[derive(Serialize)]
struct FoundReport {
    found: bool,
    knobs: Vec<String>,
    proof: &'static str,
    proven: String,
    lists_tried: usize,
    cause_of_end: String,
    lost_at_s: f64,
    #[serde(skip)]
    verdict: String,
}

impl FoundReport {
    fn new(system: &dyn System, found: &Found) -> Self {
        Self {
            found: true,
            knobs: KnobText(system.knobs().aliases()).lines(&found.knobs),
            proof: match found.proof {
                Proof::EverySmaller(_) => "every_smaller",
                Proof::EachPart(_) => "each_part",
                Proof::Stopped => "stopped",
            },
            proven: proven(system, found),
            lists_tried: found.runs,
            cause_of_end: found.verdict.name().to_owned(),
            lost_at_s: found.verdict.at.as_secs_f64(),
            verdict: found.verdict.to_string(),
        }
    }

    /// Returns the outcome in lines: the verdict, the faults, and the evidence.
    fn text(&self) -> String {
        let faults = self.knobs.iter().map(|knob| ("fault", knob.clone()));
        let rows: Vec<_> = [("verdict", self.verdict.clone())]
            .into_iter()
            .chain(faults)
            .chain([
                ("proven", self.proven.clone()),
                ("tried", format!("{} lists of faults", self.lists_tried)),
            ])
            .collect();
        lines(&rows)
    }
}

/// A hunt that found nothing.
#[derive(Serialize)]
struct HeldReport {
    found: bool,
    lists_tried: usize,
    stopped: bool,
}

/// Returns the evidence, in one or two sentences.
fn proven(system: &dyn System, found: &Found) -> String {
    let good = good(system);
    let good = match &*good {
        "not lost" => "was not lost",
        good => good,
    };
    let proof = match found.proof {
        Proof::EverySmaller(0) => format!("without it the run {good}"),
        Proof::EverySmaller(1) => format!("with the one smaller list the run {good}"),
        Proof::EverySmaller(count) => {
            format!("with each of the {count} smaller lists the run {good}")
        }
        Proof::EachPart(count) => {
            format!("without any one of these {count} parts the run {good}")
        }
        Proof::Stopped => "whether less is was not found out: the hunt was stopped".to_owned(),
    };
    format!("{} is enough; {proof}", faults(&found.knobs))
}

/// Returns the faults, as the beginning of a sentence.
fn faults(knobs: &[TimedKnob]) -> String {
    let (mut lost, mut late, mut others) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
    for TimedKnob { at, knob } in knobs {
        match knob {
            Knob::Lose { topic, seq } => lost.entry(topic).or_insert_with(Vec::new).push(*seq),
            Knob::Postpone { topic, seq, delay } => {
                late.entry(topic)
                    .or_insert_with(Vec::new)
                    .push(format!("message {seq} by {} ms", to_millis(*delay)));
            }
            Knob::Hang { node, cost } => {
                let ms = to_millis(*cost);
                others.push(format!("a tick of {node} at {at} that takes {ms} ms"));
            }
            Knob::Offset { node, offset } => {
                others.push(format!("an offset of {node} of {} ms", to_millis(*offset)));
            }
            other => others.push(other.to_string()),
        }
    }
    let losses = lost.into_iter().map(|(topic, numbers)| {
        let messages = if numbers.len() == 1 {
            "message"
        } else {
            "messages"
        };
        format!("losing {messages} {} of {topic}", listed(&ranges(&numbers)))
    });
    let late = late.into_iter();
    let parts: Vec<String> = losses
        .chain(late.map(|(topic, late)| format!("postponing {} on {topic}", listed(&late))))
        .chain(others)
        .collect();
    listed(&parts)
}

/// Numbers as text, with three or more in a row as a range.
fn ranges(numbers: &[u64]) -> Vec<String> {
    let rows = numbers.chunk_by(|one, next| one + 1 == *next);
    let texts = rows.flat_map(|row| match row {
        [first, _, .., last] => vec![format!("{first} to {last}")],
        few => few.iter().map(ToString::to_string).collect(),
    });
    texts.collect()
}

/// Returns `parts` joined by commas, and an "and" before the last.
fn listed(parts: &[String]) -> String {
    match parts {
        [first @ .., before, last] => {
            let first: String = first.iter().map(|part| format!("{part}, ")).collect();
            format!("{first}{before} and {last}")
        }
        few => few.concat(),
    }
}

/// Returns a file of knobs: the faults, after the other knobs turned in the run.
fn knobs_file(system: &dyn System, found: &Found, knobs: &[TimedKnob]) -> String {
    let lines = KnobText(system.knobs().aliases()).lines(knobs);
    let comment = proven(system, found);
    format!("# {comment}\n{}\n", lines.join("\n"))
}

//! Advice as text and as JSON.

use std::env;

use ratelab::millis;
use serde::Serialize;

use super::{ChangedRun, Score};
use crate::{
    program::{self, Program, command_line},
    summary::{
        ages, rounded,
        text::{lines, ms},
    },
};
use ratelab_experiment::{RunAge, Summary, advise::AgeChange};

/// Number of printed changes.
const PRINTED: usize = 20;

/// What the advice is about.
pub struct Subject<'a> {
    system: &'a str,
    age: Option<&'a RunAge>,
}

impl<'a> Subject<'a> {
    /// Creates the advice on an `age`, or else on the overruns of the system.
    pub fn new(program: &'a Program, age: Option<&'a RunAge>) -> Self {
        let system = program.system.name();
        Self { system, age }
    }

    fn title(&self) -> (&'static str, String) {
        match self.age {
            Some(age) => ("age of", ages::title(age)),
            None => ("overruns", format!("of the nodes in {}", self.system)),
        }
    }
}

/// Returns what it is without a change, which of the `measured` ones help, and how many do not.
pub fn render(subject: &Subject<'_>, base: &ChangedRun, measured: &[ChangedRun]) -> String {
    let helps = |run: &&ChangedRun| run.is_better(base);
    let best: Vec<&ChangedRun> = measured.iter().filter(helps).collect();
    let others = measured.len() - best.len();
    let mut rows = vec![subject.title(), ("now", figures(base))];
    let cells = best.iter().take(PRINTED);
    let cells: Vec<[String; 2]> = cells.map(|run| [figures(run), price(base, run)]).collect();
    let [first, second] = [0, 1].map(|of| {
        cells
            .iter()
            .map(|cells| cells[of].len())
            .max()
            .unwrap_or_default()
    });
    for (run, [figures, price]) in best.iter().zip(&cells) {
        let command = command(&run.change);
        let text = format!("{figures:first$}  {price:second$}  {command}");
        rows.push(("with", text));
    }
    let hidden = best.len().saturating_sub(PRINTED);
    if hidden > 0 {
        rows.push(("", format!("{hidden} more help less: --json has them")));
    }
    if best.is_empty() {
        let text = format!(
            "no change that was tried makes the data of {} younger",
            subject.system
        );
        rows.push(("with", text));
    }
    rows.push((
        "",
        format!("{others} changes help by less than 1 %, or harm"),
    ));
    lines(&rows)
}

fn figures(run: &ChangedRun) -> String {
    let verdict = run.summary.verdict.to_string();
    let word = verdict.split_whitespace().next().unwrap_or_default();
    match run.score {
        Score::Age { mean_ns, p99_ns } => {
            let [mean, p99] = [mean_ns, p99_ns].map(|ns| millis::text(ns as f64 / 1e6));
            let within = run.within_text.iter();
            let within: String = within
                .map(|share| format!("  {share:>8} within the limit"))
                .collect();
            format!("{mean:>6} ms mean  {p99:>6} ms p99{within}  {word}")
        }
        Score::Overruns {
            skipped,
            due,
            lateness,
        } => {
            let late = ms(lateness.as_secs_f64());
            format!("{skipped:>6} of {due} ticks skipped  {late:>9} late on average  {word}")
        }
    }
}

/// Returns messages per second, and the cores that ticks take.
fn costs(summary: &Summary) -> [f64; 2] {
    let seconds = summary.sim_time.as_secs_f64().max(f64::MIN_POSITIVE);
    let sent: u64 = summary
        .topics
        .iter()
        .filter(|topic| topic.is_read())
        .map(|topic| topic.published)
        .sum();
    let worked = summary.nodes.iter().map(|node| {
        let ticks = &node.tick_time;
        ticks.mean_s().unwrap_or_default() * ticks.count() as f64
    });
    [sent as f64, worked.sum::<f64>()].map(|sum| sum / seconds)
}

/// Returns what a change costs more than `base`, or less.
fn more(base: &ChangedRun, run: &ChangedRun) -> [f64; 2] {
    let ([sent, worked], [usual, work]) = (costs(&run.summary), costs(&base.summary));
    [sent - usual, worked - work]
}

fn price(base: &ChangedRun, run: &ChangedRun) -> String {
    let [sent, worked] = more(base, run);
    let parts = [
        (sent.abs() >= 0.05).then(|| format!("{sent:+.1} msg/s")),
        (worked.abs() >= 5e-3).then(|| format!("{:+.0} % of a core", worked * 1e2)),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The advice for programs, the best change first. Ages in nanoseconds go with a later version.
#[derive(Serialize)]
pub struct Advice<'a> {
    at: Option<&'a str>,
    base: ChangeRow<'a>,
    changes: Vec<ChangeRow<'a>>,
    of: &'a str,
}

impl<'a> Advice<'a> {
    /// Creates the advice on `subject` from the run as it is and the `measured` changes.
    pub fn new(subject: &'a Subject<'_>, base: &'a ChangedRun, measured: &'a [ChangedRun]) -> Self {
        Self {
            at: subject.age.map(|age| &*age.node),
            base: ChangeRow::new(base, base),
            changes: measured
                .iter()
                .map(|run| ChangeRow::new(base, run))
                .collect(),
            of: subject.age.map_or("overruns", RunAge::name),
        }
    }
}

/// A run with a change, beside the run as it is.
#[derive(Serialize)]
struct ChangeRow<'a> {
    cause_of_end: &'a str,
    command: String,
    lost: bool,
    mean_ms: Option<f64>,
    mean_ns: Option<i64>,
    more_cores: f64,
    more_messages_per_s: f64,
    overruns: Option<u64>,
    p99_ms: Option<f64>,
    p99_ns: Option<i64>,
    within: Option<f64>,
}

impl<'a> ChangeRow<'a> {
    fn new(base: &ChangedRun, run: &'a ChangedRun) -> Self {
        let [sent, worked] = more(base, run);
        let (mean_ns, p99_ns, overruns) = match run.score {
            Score::Age { mean_ns, p99_ns } => (Some(mean_ns), Some(p99_ns), None),
            Score::Overruns { skipped, .. } => (None, None, Some(skipped)),
        };
        Self {
            cause_of_end: run.summary.verdict.name(),
            command: command(&run.change),
            lost: run.summary.verdict.is_lost(),
            mean_ms: mean_ns.map(ages::in_ms),
            mean_ns,
            more_cores: rounded(worked),
            more_messages_per_s: rounded(sent),
            overruns,
            p99_ms: p99_ns.map(ages::in_ms),
            p99_ns,
            within: run.within,
        }
    }
}

/// Returns the command line of the run with a change, made of that of this command.
fn command(change: &AgeChange) -> String {
    let mut given = env::args().skip(1);
    let mut words = vec![program::name()];
    while let Some(word) = given.next() {
        match &*word {
            "advise" if words.iter().all(|known| known != "run") => words.push("run".to_owned()),
            "--json" => {}
            "--threads" => drop(given.next()),
            of if of.starts_with("--threads=") => {}
            _ => words.push(word),
        }
    }
    let is_clock = |word: &String| word == "--clock" || word.starts_with("--clock=");
    if !words.iter().any(is_clock) {
        words.extend(["--clock", "virtual"].map(str::to_owned));
    }
    let knobs = change.knobs.iter().map(|knob| ("--knob", knob.to_string()));
    let with = change.with.iter().map(|with| ("--with", with.clone()));
    let changes = knobs.chain(with);
    words.extend(changes.flat_map(|(option, text)| [option.to_owned(), text]));
    command_line(words)
}

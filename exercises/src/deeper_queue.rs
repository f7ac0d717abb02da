//! A deeper queue: no message loss, but the same fall.

use ratelab_cart_pole::{BROKEN_HZ, CartPole, pole_angle};
use ratelab_experiment::sweep::CellResult;
use ratelab_system::Verdict;

use crate::{
    cliff::STARTS,
    framework::{
        Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, obs_dropped,
        survey,
    },
};

/// Queue depths to compare (messages).
const DEPTHS: [usize; 2] = [1, 100];

pub(crate) fn measure() -> Result<Findings, Failure> {
    let broken = CartPole::config(&format!("control-hz {BROKEN_HZ}"))?;
    let depths = survey(broken, "queue-depth", DEPTHS, STARTS)?;
    let [shallow, deep] = &depths;
    let unchanged = unchanged(shallow, deep);
    let mut measurements: Vec<_> = depths.iter().flat_map(measurements).collect();
    let name = "runs that the depth did not change";
    measurements.push(Measurement::new(name, unchanged as f64));
    let drops = |depth: &KnobRuns| depth.runs.iter().map(obs_dropped).sum::<u64>();
    Ok(Findings {
        table: table(&depths),
        place: PredictionPlace::Column(3),
        answer: Answer::Exactly(deep.up() as f64),
        meaning: format!(
            "The deeper queue took the drops from {} to {}. In {unchanged} of {} runs it changed \
             nothing else: the same last step, the same angle to the last bit. The policy reads \
             the newest reading either way, and decides no more often. Drops were the symptom. A queue \
             that loses nothing does not make a controller faster.",
            drops(shallow),
            drops(deep),
            deep.runs.len(),
        ),
        measurements,
    })
}

/// Returns the number of starts with identical runs for both queue depths.
fn unchanged(shallow: &KnobRuns, deep: &KnobRuns) -> usize {
    shallow
        .runs
        .iter()
        .zip(&deep.runs)
        .filter(|(one, other)| course(one) == course(other))
        .count()
}

/// Returns what is compared of a run.
fn course(run: &CellResult) -> (u64, &Verdict, u64) {
    (run.steps, &run.verdict, pole_angle(&run.state).to_bits())
}

fn table(depths: &[KnobRuns]) -> Table {
    let runs: Vec<_> = depths.iter().flat_map(runs).collect();
    let age_ms = |run: &CellResult| run.push_age.map_or(f64::NAN, |age| age.late_s * 1e3);
    Table::from_items(
        &runs,
        &[
            ("depth", &|(depth, _, _)| (*depth).to_owned()),
            ("seed", &|(_, seed, _)| seed.to_string()),
            ("/obs dropped", &|(_, _, run)| obs_dropped(run).to_string()),
            ("verdict", &|(_, _, run)| run.verdict.name().to_owned()),
            ("steps", &|(_, _, run)| run.steps.to_string()),
            ("push age", &|(_, _, run)| format!("{:.1} ms", age_ms(run))),
        ],
    )
}

fn measurements(depth: &KnobRuns) -> impl Iterator<Item = Measurement> {
    runs(depth).flat_map(|(depth, seed, run)| {
        Measurement::list(
            format_args!("depth {depth}, seed {seed}"),
            [
                ("/obs dropped", obs_dropped(run) as f64),
                ("balanced", f64::from(!run.verdict.is_lost())),
                ("steps", run.steps as f64),
            ],
        )
    })
}

/// Returns the runs with one depth: the depth, the seed and the result.
fn runs(depth: &KnobRuns) -> impl Iterator<Item = (&str, usize, &CellResult)> {
    depth
        .runs
        .iter()
        .enumerate()
        .map(|(seed, run)| (depth.value.as_str(), seed, run))
}

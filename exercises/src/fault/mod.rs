//! Whose fault is it? One fault in a graph, to be found from its figures.

mod graph;

use std::iter;

use graph::{FaultyGraph, SUSPECTS};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::{NodeAccount, TopicAccount};

use crate::framework::{
    Answer, Brief, Failure, Findings, Measurement, PredictionPlace, Table, cart_pole, mean_ms,
};

/// Returns the figures of the graph's run, to look at before the prediction.
pub(crate) fn evidence(seed: u64) -> Result<Table, Failure> {
    Ok(Run::execute(&FaultyGraph::drawn(seed))?.evidence())
}

/// Returns the graph, to watch in the lab.
pub(crate) fn scene(seed: u64) -> Result<Config, Failure> {
    FaultyGraph::drawn(seed).config()
}

/// Mends each suspect alone; the choices of the question are their names.
pub(crate) fn measure(brief: &Brief, seed: u64) -> Result<Findings, Failure> {
    let (graph, names) = (FaultyGraph::drawn(seed), &brief.choices);
    let as_it_is = Run::execute(&graph)?;
    let mended = (0..SUSPECTS.len())
        .map(|place| Run::execute(&graph.mended(place)))
        .collect::<Result<Vec<_>, _>>()?;
    let (culprit, (_, _, what_it_did)) = (graph.fault, SUSPECTS[graph.fault]);
    let refuted = names.iter().zip(&mended).map(|(name, run)| {
        format!(
            "You named {name}: with that mended it {} all the same, with pushes {:.0} ms old.",
            run.did(),
            run.push_age_ms(),
        )
    });
    Ok(Findings {
        table: table(names, &as_it_is, &mended),
        place: PredictionPlace::Cell,
        answer: Answer::Choice {
            number: culprit as f64 + 1.0,
            refuted: refuted.collect(),
        },
        meaning: format!(
            "{what_it_did} With the fault the pushes were {:.0} ms old in the last second and the \
             pole {}. With only that mended they were {:.0} ms old, and it {}. The oddities \
             are still there: not everything odd is to blame. Follow the age: find where a reading \
             grows old, and which node or topic makes it old.",
            as_it_is.push_age_ms(),
            as_it_is.did(),
            mended[culprit].push_age_ms(),
            mended[culprit].did(),
        ),
        measurements: measurements(names, &as_it_is, &mended, culprit),
    })
}

/// A run of the graph.
struct Run(Summary);

impl Run {
    fn execute(graph: &FaultyGraph) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), &graph.config()?)?;
        Ok(Self(experiment.run()?))
    }

    fn fell(&self) -> bool {
        self.0.verdict.is_lost()
    }

    fn did(&self) -> String {
        if self.fell() {
            format!("fell at {}", self.0.sim_time)
        } else {
            "stood".to_owned()
        }
    }

    fn push_age_ms(&self) -> f64 {
        mean_ms(self.0.push_age().map(|age| age.late_s))
    }

    /// Returns what the screen shows of the graph, without its settings.
    fn evidence(&self) -> Table {
        let nodes = self.0.nodes.iter().filter(|node| &*node.name != "world");
        let topics = self.0.topics.iter().filter(|topic| topic.is_read());
        let parts = nodes.map(|node| self.node(node));
        let mut parts: Vec<[Option<String>; 8]> =
            parts.chain(topics.map(|topic| self.topic(topic))).collect();
        let mut run = [const { None }; 8];
        run[0] = Some("the run".to_owned());
        run[1] = Some(self.0.verdict.name().to_owned());
        run[2] = Some(self.0.sim_time.to_string());
        parts.push(run);
        let cells = |part: [Option<String>; 8]| part.map(|cell| cell.unwrap_or("-".to_owned()));
        Table {
            headers: EVIDENCE.map(str::to_owned).to_vec(),
            rows: parts.into_iter().map(|part| cells(part).to_vec()).collect(),
            named: false,
        }
    }

    fn per_second(&self, count: u64) -> f64 {
        count as f64 / self.0.sim_time.as_secs_f64()
    }

    fn node(&self, node: &NodeAccount) -> [Option<String>; 8] {
        [
            Some(node.name.to_string()),
            Some(format!("{:.1} ticks", self.per_second(node.ticks))),
            None,
            node.tick_time.mean_s().map(whole_ms),
            Some(node.overruns.to_string()),
            None,
            None,
            None,
        ]
    }

    fn topic(&self, topic: &TopicAccount) -> [Option<String>; 8] {
        let reader = topic.readers.first();
        [
            Some(topic.name.to_string()),
            Some(format!("{:.1} sent", self.per_second(topic.published))),
            topic.newest.map(|at| at.to_string()),
            None,
            None,
            Some(topic.lost.to_string()),
            Some(topic.dropped().to_string()),
            reader.and_then(|reader| reader.ages.mean_s()).map(whole_ms),
        ]
    }
}

/// The columns of the evidence.
const EVIDENCE: [&str; 8] = [
    "part",
    "per second",
    "last at",
    "takes",
    "overruns",
    "lost",
    "dropped",
    "age when read",
];

fn whole_ms(seconds: f64) -> String {
    format!("{:.0} ms", seconds * 1e3)
}

/// Two runs in each row, so that the head stays in sight.
fn table(names: &[String], as_it_is: &Run, mended: &[Run]) -> Table {
    let runs: Vec<(&str, &Run)> = iter::once("nothing")
        .chain(names.iter().map(String::as_str))
        .zip(iter::once(as_it_is).chain(mended))
        .collect();
    let end = |run: &Run| {
        if run.fell() {
            format!("fell {:.2} s", run.0.sim_time.as_secs_f64())
        } else {
            "stood".to_owned()
        }
    };
    let mut table = Table::from_items(
        &runs,
        &[
            ("mended", &|(name, _)| (*name).to_owned()),
            ("run", &|(_, run)| end(run)),
            ("age", &|(_, run)| format!("{:.0} ms", run.push_age_ms())),
        ],
    );
    let half = table.rows.len().div_ceil(2);
    let beside = table
        .rows
        .split_off(half)
        .into_iter()
        .chain(iter::repeat_with(|| vec![String::new(); 3]));
    table
        .rows
        .iter_mut()
        .zip(beside)
        .for_each(|(row, beside)| row.extend(beside));
    table.headers.extend_from_within(..);
    table
}

fn measurements(
    names: &[String],
    as_it_is: &Run,
    mended: &[Run],
    culprit: usize,
) -> Vec<Measurement> {
    let saved = mended
        .iter()
        .enumerate()
        .filter(|(index, _)| *index != culprit)
        .filter(|(_, run)| !run.fell())
        .count();
    let mut measured = vec![
        Measurement::new("as it is: fell", u32::from(as_it_is.fell())),
        Measurement::new("as it is: push age (ms)", as_it_is.push_age_ms()),
        Measurement::new("mended: fell", u32::from(mended[culprit].fell())),
        Measurement::new("mended: push age (ms)", mended[culprit].push_age_ms()),
        Measurement::new("saved by mending another", saved as f64),
    ];
    measured.extend(names.iter().zip(mended).map(|(name, run)| {
        let name = format!("{name} mended: run time (s)");
        Measurement::new(name, run.0.sim_time.as_secs_f64())
    }));
    measured
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn for_every_number_the_pole_falls_and_mending_the_culprit_alone_saves_it() {
        let mut found = HashSet::new();
        for seed in 0..60 {
            let graph = FaultyGraph::drawn(seed);
            let (knob, ..) = SUSPECTS[graph.fault];
            found.insert(knob);
            let broken = Run::execute(&graph).expect("run");
            assert!(broken.fell(), "{seed}: {knob}");
            for (place, (mended, ..)) in SUSPECTS.iter().enumerate() {
                let run = Run::execute(&graph.mended(place)).expect("run");
                assert_eq!(
                    run.fell(),
                    *mended != knob,
                    "{seed}: {knob}, mended {mended}"
                );
            }
        }
        assert_eq!(found.len(), SUSPECTS.len(), "{found:?}");
    }
}

//! Whose fault is it? One fault in a graph, to be found from its figures.

mod graph;
mod suspect;

use graph::FaultyGraph;
use ratelab_account::{Snapshot, TopicAccount};
use ratelab_study::experiment::{Config, Experiment, Summary};
use suspect::SUSPECTS;

use crate::framework::{Answer, Brief, Failure, Findings, Measurement, Table, cart_pole, mean_ms};

/// The figures of the graph's run, to look at before the prediction.
pub(crate) fn evidence(seed: u64) -> Result<Table, Failure> {
    Ok(Run::of(&FaultyGraph::drawn(seed))?.evidence())
}

/// The graph, to watch in the lab.
pub(crate) fn scene(seed: u64) -> Result<Config, Failure> {
    FaultyGraph::drawn(seed).config()
}

/// Mends each suspect alone; the choices of the question are their names.
pub(crate) fn measure(brief: &Brief, seed: u64) -> Result<Findings, Failure> {
    let (graph, names) = (FaultyGraph::drawn(seed), &brief.choices);
    let as_it_is = Run::of(&graph)?;
    let mended = SUSPECTS.map(|suspect| Run::of(&graph.mended(suspect)));
    let mended = mended.into_iter().collect::<Result<Vec<_>, _>>()?;
    let culprit = SUSPECTS.iter().position(|suspect| *suspect == graph.fault);
    let culprit = culprit.unwrap_or_default();
    let refuted = names.iter().zip(&mended).map(|(name, run)| {
        format!(
            "You named {name}: with that mended it {} all the same, with pushes {:.0} ms old.",
            run.did(),
            run.push_age_ms(),
        )
    });
    Ok(Findings {
        table: table(names, &as_it_is, &mended),
        answer: Answer::Choice {
            number: culprit as f64 + 1.0,
            refuted: refuted.collect(),
        },
        meaning: format!(
            "{} With the fault the pushes were {:.0} ms old in the last second and the pole {}; \
             with nothing but that mended they were {:.0} ms old, and it {}. The oddities beside \
             it are still there: not everything that looks odd is to blame. Follow the age: find \
             where a reading grows old, and who owns that place.",
            graph.fault.sentence(),
            as_it_is.push_age_ms(),
            as_it_is.did(),
            mended[culprit].push_age_ms(),
            mended[culprit].did(),
        ),
        measurements: measurements(names, &as_it_is, &mended, culprit),
    })
}

/// A run of the graph.
struct Run {
    summary: Summary,
    end: Snapshot,
}

impl Run {
    fn of(graph: &FaultyGraph) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), &graph.config()?)?;
        let observer = experiment.observer();
        let summary = experiment.run()?;
        let end = observer.snapshot();
        Ok(Self { summary, end })
    }

    fn fell(&self) -> bool {
        self.summary.verdict.is_lost()
    }

    fn did(&self) -> String {
        match self.fell() {
            true => format!("fell at {}", self.summary.sim_time),
            false => "stood".to_owned(),
        }
    }

    fn push_age_ms(&self) -> f64 {
        mean_ms(self.summary.push_age().map(|age| age.late_s))
    }

    /// What the screen shows of the graph, without its settings.
    fn evidence(&self) -> Table {
        let mut table = Table::new([
            "part",
            "per second",
            "last at",
            "takes",
            "overruns",
            "lost",
            "dropped",
            "age when read",
        ]);
        let none = || "-".to_owned();
        let seconds = self.summary.sim_time.as_secs_f64();
        let nodes = self.summary.nodes.iter();
        for node in nodes.filter(|node| node.name != "world") {
            let takes = node.tick_time.mean_s();
            table.row([
                node.name.clone(),
                format!("{:.1} ticks", node.ticks as f64 / seconds),
                none(),
                takes.map_or_else(none, |takes| format!("{:.0} ms", takes * 1e3)),
                node.overruns.to_string(),
                none(),
                none(),
                none(),
            ]);
        }
        for topic in self.end.topics.iter().filter(|topic| is_read(topic)) {
            let age = topic.readers.first().and_then(|read| read.ages.mean_s());
            table.row([
                topic.name.to_string(),
                format!("{:.1} sent", topic.published as f64 / seconds),
                topic.newest.map_or_else(none, |at| at.to_string()),
                none(),
                none(),
                topic.lost.to_string(),
                topic.dropped().to_string(),
                age.map_or_else(none, |age| format!("{:.0} ms", age * 1e3)),
            ]);
        }
        let mut end = std::array::from_fn(|_| none());
        end[0] = "the run".to_owned();
        end[1] = self.summary.verdict.name().to_owned();
        end[2] = self.summary.sim_time.to_string();
        table.row::<8>(end);
        table
    }
}

fn is_read(topic: &TopicAccount) -> bool {
    !topic.readers.is_empty()
}

/// Two runs in each row, so that the head stays in sight.
fn table(names: &[String], as_it_is: &Run, mended: &[Run]) -> Table {
    let names = ["nothing"]
        .into_iter()
        .chain(names.iter().map(String::as_str));
    let runs = names.zip([as_it_is].into_iter().chain(mended));
    let cells = |(name, run): (&str, &Run)| {
        let age = format!("{:.0} ms", run.push_age_ms());
        let end = match run.fell() {
            true => format!("fell {:.2} s", run.summary.sim_time.as_secs_f64()),
            false => "stood".to_owned(),
        };
        [name.to_owned(), end, age]
    };
    let cells: Vec<[String; 3]> = runs.map(cells).collect();
    let half = cells.len().div_ceil(2);
    let mut table = Table::new(["mended", "run", "age", "mended", "run", "age"]);
    for (at, [a, b, c]) in cells[..half].iter().cloned().enumerate() {
        let [d, e, f] = cells.get(half + at).cloned().unwrap_or_default();
        table.row([a, b, c, d, e, f]);
    }
    table
}

fn measurements(
    names: &[String],
    as_it_is: &Run,
    mended: &[Run],
    culprit: usize,
) -> Vec<Measurement> {
    let others = mended.iter().enumerate();
    let others = others.filter(|(index, _)| *index != culprit);
    let saved = others.filter(|(_, run)| !run.fell()).count();
    let mut measured = vec![
        Measurement::new("as it is: fell", u32::from(as_it_is.fell())),
        Measurement::new("as it is: push age (ms)", as_it_is.push_age_ms()),
        Measurement::new("mended: fell", u32::from(mended[culprit].fell())),
        Measurement::new("mended: push age (ms)", mended[culprit].push_age_ms()),
        Measurement::new("saved by mending another", saved as f64),
    ];
    measured.extend(names.iter().zip(mended).map(|(name, run)| {
        let name = format!("{name} mended: run time (s)");
        Measurement::new(name, run.summary.sim_time.as_secs_f64())
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
            found.insert(graph.fault);
            let broken = Run::of(&graph).expect("run");
            assert!(broken.fell(), "{seed}: {:?}", graph.fault);
            for suspect in SUSPECTS {
                let mended = Run::of(&graph.mended(suspect)).expect("run");
                assert_eq!(
                    mended.fell(),
                    suspect != graph.fault,
                    "{seed}: {:?}, mended {suspect:?}",
                    graph.fault
                );
            }
        }
        assert_eq!(found.len(), SUSPECTS.len(), "{found:?}");
    }
}

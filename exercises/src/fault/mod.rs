//! Whose fault is it? One fault in a graph, to be found from its figures.

mod graph;
mod suspect;

use graph::FaultyGraph;
use ratelab_account::{NodeAccount, TopicAccount};
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
struct Run(Summary);

impl Run {
    fn of(graph: &FaultyGraph) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), &graph.config()?)?;
        Ok(Self(experiment.run()?))
    }

    fn fell(&self) -> bool {
        self.0.verdict.is_lost()
    }

    fn did(&self) -> String {
        match self.fell() {
            true => format!("fell at {}", self.0.sim_time),
            false => "stood".to_owned(),
        }
    }

    fn push_age_ms(&self) -> f64 {
        mean_ms(self.0.push_age().map(|age| age.late_s))
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
        let nodes = self.0.nodes.iter();
        let nodes = nodes.filter(|node| &*node.name != "world");
        nodes.for_each(|node| table.row(self.node(node)));
        let topics = self.0.topics.iter().filter(|topic| topic.is_read());
        topics.for_each(|topic| table.row(self.topic(topic)));
        let end = self.0.sim_time.to_string();
        table.row(row("the run", [self.0.verdict.name().to_owned(), end]));
        table
    }

    fn per_second(&self, count: u64) -> f64 {
        count as f64 / self.0.sim_time.as_secs_f64()
    }

    fn node(&self, node: &NodeAccount) -> [String; 8] {
        let takes = node.tick_time.mean_s();
        row(
            &node.name,
            [
                format!("{:.1} ticks", self.per_second(node.ticks)),
                none(),
                takes.map_or_else(none, |takes| format!("{:.0} ms", takes * 1e3)),
                node.overruns.to_string(),
            ],
        )
    }

    fn topic(&self, topic: &TopicAccount) -> [String; 8] {
        let readers = topic.readers.first();
        let age = readers.and_then(|read| read.ages.mean_s());
        row(
            &topic.name,
            [
                format!("{:.1} sent", self.per_second(topic.published)),
                topic.newest.map_or_else(none, |at| at.to_string()),
                none(),
                none(),
                topic.lost.to_string(),
                topic.dropped().to_string(),
                age.map_or_else(none, |age| format!("{:.0} ms", age * 1e3)),
            ],
        )
    }
}

/// A cell without a figure.
fn none() -> String {
    "-".to_owned()
}

/// The row of a part, whose last cells may be without a figure.
fn row<const N: usize>(part: &str, cells: [String; N]) -> [String; 8] {
    let mut cells = [part.to_owned()].into_iter().chain(cells);
    std::array::from_fn(|_| cells.next().unwrap_or_else(none))
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
            true => format!("fell {:.2} s", run.0.sim_time.as_secs_f64()),
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

//! The results of a check: as text, as JSON and as JUnit XML.

use ratelab::Time;
use ratelab_screen::escaped;
use serde_json::{Value, json};

use crate::{error::Error, summary::text::lines};

/// What the runs of a graph make of its limits.
pub struct Results {
    pub graph: String,
    /// Number of runs.
    pub runs: usize,
    pub limits: Vec<LimitResult>,
}

/// A limit, and the runs that miss it.
pub struct LimitResult {
    pub limit: String,
    pub misses: Vec<Miss>,
}

/// A run that misses a limit.
pub struct Miss {
    pub seed: u64,
    /// Its figure, or its verdict.
    pub text: String,
}

impl LimitResult {
    /// Returns what was missed, of so many `runs`.
    fn miss(&self, runs: usize) -> Option<String> {
        let first = self.misses.first()?;
        let others = match (self.misses.len(), runs) {
            (1, 1) => String::new(),
            (missed, _) => format!(" ({missed} of {runs} runs)"),
        };
        Some(format!("{} with seed {}{others}", first.text, first.seed))
    }
}

impl Results {
    fn missed(&self) -> impl Iterator<Item = (&LimitResult, String)> {
        let limits = self.limits.iter();
        limits.filter_map(|limit| Some((limit, limit.miss(self.runs)?)))
    }

    /// Returns a line for each missed limit, and one for the others; the runs were to last to
    /// `end`.
    pub fn text(&self, end: Time) -> String {
        let missed = self
            .missed()
            .map(|(limit, miss)| ("missed", format!("{}: {miss}", limit.limit)));
        let mut rows: Vec<_> = missed.collect();
        let (all, runs, end) = (self.limits.len(), self.runs, end.as_secs_f64());
        let kept = all - rows.len();
        let runs = match runs {
            1 => "1 run".to_owned(),
            runs => format!("{runs} runs"),
        };
        let text = format!("{kept} of {all} limits, in {runs} of {end} s");
        rows.push(("kept", text));
        lines(&rows)
    }

    /// Returns all limits for programs.
    pub fn json(&self) -> Value {
        let limits = self.limits.iter().map(|limit| {
            let misses = limit
                .misses
                .iter()
                .map(|miss| json!({ "seed": miss.seed, "found": miss.text }));
            json!({ "limit": limit.limit, "missed": misses.collect::<Vec<_>>() })
        });
        json!({
            "graph": self.graph,
            "kept": self.missed().next().is_none(),
            "limits": limits.collect::<Vec<_>>(),
            "runs": self.runs,
        })
    }

    /// Returns a test for each limit, as JUnit XML.
    pub fn junit(&self) -> String {
        let (graph, failures) = (escaped(&self.graph), self.missed().count());
        let tests = self.limits.iter().map(|limit| {
            let name = escaped(&limit.limit);
            let failure = limit.miss(self.runs).map_or_else(String::new, |miss| {
                format!("<failure message=\"{}\"/>", escaped(&miss))
            });
            format!("  <testcase classname=\"{graph}\" name=\"{name}\">{failure}</testcase>\n")
        });
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"{graph}\" tests=\"{}\" \
             failures=\"{failures}\">\n{}</testsuite>\n",
            self.limits.len(),
            tests.collect::<String>(),
        )
    }

    /// # Errors
    /// [`Error::Unfinished`] if a limit is missed.
    pub fn outcome(&self) -> Result<(), Error> {
        match self.missed().count() {
            0 => Ok(()),
            missed => {
                let (graph, all) = (&self.graph, self.limits.len());
                Err(Error::Unfinished(format!(
                    "{graph} misses {missed} of {all} limits"
                )))
            }
        }
    }
}

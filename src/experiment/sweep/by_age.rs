//! How often runs were not lost, by how old the sensing behind their actions was.

use super::CellResult;

/// Runs by age, whatever made it old.
///
/// The age of a run is the mean push age in its last second: of one that was lost,
/// before it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ByAge {
    /// Ages (s), to a tenth of a millisecond, and whether the run was held; the youngest
    /// first.
    runs: Vec<(f64, bool)>,
}

/// The runs of some ages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeBin {
    /// From this age on (s).
    pub from_s: f64,
    /// Below this one (s).
    pub to_s: f64,
    /// Runs.
    pub runs: usize,
    /// Runs that were not lost.
    pub held: usize,
}

/// The one age that parts runs that are lost from others best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeSplit {
    /// The age (s).
    pub at_s: f64,
    /// Runs on the wrong side of it: held above, lost below.
    pub misjudged: usize,
}

impl ByAge {
    /// `results` by age. Runs that never pushed have none, and are left out.
    pub fn of<'r>(results: impl IntoIterator<Item = &'r CellResult>) -> Self {
        let runs = results.into_iter().filter_map(|result| {
            let age = result.push_age?;
            Some((age.late_s, !result.verdict.is_lost()))
        });
        runs.collect()
    }

    /// Age (s) of each run, and whether it was held; the youngest first.
    pub fn runs(&self) -> impl Iterator<Item = (f64, bool)> {
        self.runs.iter().copied()
    }

    /// How many runs there are.
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// The youngest of the runs that were lost (s).
    pub fn youngest_lost_s(&self) -> Option<f64> {
        let mut lost = self.runs.iter().filter(|(_, held)| !held);
        lost.next().map(|(age, _)| *age)
    }

    /// The oldest of the runs that were not (s).
    pub fn oldest_held_s(&self) -> Option<f64> {
        let mut held = self.runs.iter().rev().filter(|(_, held)| *held);
        held.next().map(|(age, _)| *age)
    }

    /// The runs in bins `width_s` wide, without those that are empty.
    pub fn bins(&self, width_s: f64) -> Vec<AgeBin> {
        // Ages are rounded, quotients are not.
        let number = |age: f64| (age / width_s + 1e-6).floor();
        let same = |one: &(f64, bool), next: &(f64, bool)| number(one.0) == number(next.0);
        let bins = self.runs.chunk_by(same).map(|runs| {
            let first = number(runs[0].0);
            AgeBin {
                from_s: first * width_s,
                to_s: (first + 1.0) * width_s,
                runs: runs.len(),
                held: runs.iter().filter(|(_, held)| *held).count(),
            }
        });
        bins.collect()
    }

    /// The age with the fewest runs on its wrong side: in the middle between two runs,
    /// the youngest of several. `None` if all runs were lost, or none was.
    pub fn split(&self) -> Option<AgeSplit> {
        self.youngest_lost_s().zip(self.oldest_held_s())?;
        let held = self.runs.iter().filter(|(_, held)| *held).count();
        // Of a limit below all runs, and then past one run after the other.
        let (mut misjudged, mut best) = (held, None::<AgeSplit>);
        for pair in self.runs.windows(2) {
            let ((younger, was_held), (older, _)) = (pair[0], pair[1]);
            misjudged = if was_held {
                misjudged - 1
            } else {
                misjudged + 1
            };
            let at_s = f64::midpoint(younger, older);
            if older > younger && best.is_none_or(|best| misjudged < best.misjudged) {
                best = Some(AgeSplit { at_s, misjudged });
            }
        }
        best
    }

    /// How many runs are on the wrong side of the age `at_s`.
    pub fn misjudged_at(&self, at_s: f64) -> usize {
        let wrong = |(age, held): &&(f64, bool)| *held == (*age >= at_s);
        self.runs.iter().filter(wrong).count()
    }
}

impl FromIterator<(f64, bool)> for ByAge {
    /// Of ages (s), and whether the run was held.
    fn from_iter<I: IntoIterator<Item = (f64, bool)>>(runs: I) -> Self {
        let runs = runs.into_iter();
        let mut runs: Vec<(f64, bool)> = runs.map(|(age, held)| (rounded(age), held)).collect();
        runs.sort_by(|one, other| one.0.total_cmp(&other.0));
        Self { runs }
    }
}

/// To a tenth of a millisecond: what is less differs by the order of summing up.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_age_parts_the_runs_with_the_fewest_on_the_wrong_side() {
        let ages = [
            (0.08, true),
            (0.01, true),
            (0.09, false),
            (0.07, false),
            (0.05, true),
        ];
        let by_age: ByAge = ages.into_iter().collect();
        let split = by_age.split().expect("some of both");
        assert!((split.at_s - 0.06).abs() < 1e-12, "{split:?}");
        assert_eq!(split.misjudged, 1);
        assert_eq!(by_age.misjudged_at(split.at_s), 1);
        // Ages that differ by less than they are known are not parted.
        let near: ByAge = [(0.09, true), (0.09 + 1e-12, false)].into_iter().collect();
        assert_eq!(near.split(), None);
        assert_eq!(by_age.misjudged_at(0.0), 3);
        assert_eq!(by_age.youngest_lost_s(), Some(0.07));
        assert_eq!(by_age.oldest_held_s(), Some(0.08));
        let figures = by_age
            .bins(0.05)
            .into_iter()
            .map(|bin| (bin.runs, bin.held));
        assert_eq!(figures.collect::<Vec<_>>(), [(1, 1), (4, 2)]);
    }

    #[test]
    fn there_is_no_limit_where_all_runs_came_out_alike() {
        let alike: ByAge = [(0.1, true), (0.2, true)].into_iter().collect();
        assert_eq!(alike.split(), None);
    }
}

//! Runs of a sweep by the age of their pushes: the age that parts those held from those lost.

use ratelab_experiment::sweep::ByAge;

#[test]
fn one_age_parts_the_runs_with_the_fewest_on_the_wrong_side_and_none_runs_that_are_alike() {
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
    // Ages closer than their accuracy are not separated.
    let near: ByAge = [(0.09, true), (0.09 + 1e-12, false)].into_iter().collect();
    assert_eq!(near.split(), None);
    // There is no limit where all runs came out alike.
    let alike: ByAge = [(0.1, true), (0.2, true)].into_iter().collect();
    assert_eq!(alike.split(), None);
    assert_eq!(by_age.misjudged_at(0.0), 3);
    assert_eq!(by_age.youngest_lost_s(), Some(0.07));
    assert_eq!(by_age.oldest_held_s(), Some(0.08));
    let figures = by_age.bins(0.05);
    let figures: Vec<_> = figures.iter().map(|bin| (bin.runs, bin.held)).collect();
    assert_eq!(figures, [(1, 1), (4, 2)]);
}

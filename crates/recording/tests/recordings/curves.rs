//! Curves over an axis that is no run time.

use ratelab_recording::rrd::{CurvePlot, CurvePlots, RecordingFile};
use rerun::Scalars;

use super::chunks_of;

#[test]
fn curves_come_back_over_their_axis_with_a_line_at_zero() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("curves.rrd");
    let drawn = CurvePlots {
        name: "two runs".to_owned(),
        axis: "control_millihz".to_owned(),
        plots: vec![CurvePlot {
            entity: "growth",
            title: "growth (1/s)".to_owned(),
            range: None,
            zero: vec![5_000, 7_500],
            curves: vec![
                ("policy a.pt".to_owned(), vec![(5_000, 1.5), (7_500, -0.5)]),
                ("none".to_owned(), Vec::new()),
            ],
        }],
    };
    let file = RecordingFile::create(&path).expect("a new file");
    drawn.write(file).expect("written");
    let scalars = Scalars::descriptor_scalars().component;
    let chunks = chunks_of(&path);
    let rows = chunks.iter().filter_map(|chunk| {
        let places = chunk.timelines().get(&"control_millihz".into())?;
        let values: Vec<f64> = chunk
            .iter_slices::<f64>(scalars)
            .flatten()
            .copied()
            .collect();
        Some((
            chunk.entity_path().to_string(),
            places.times_raw().to_vec(),
            values,
        ))
    });
    let mut rows: Vec<_> = rows.filter(|(.., values)| !values.is_empty()).collect();
    rows.sort_by(|one, other| one.0.cmp(&other.0));
    let places = vec![5_000, 7_500];
    assert_eq!(
        rows,
        [
            (
                "/growth/policy_a_pt".to_owned(),
                places.clone(),
                vec![1.5, -0.5]
            ),
            ("/growth/zero".to_owned(), places, vec![0.0, 0.0]),
        ]
    );
}

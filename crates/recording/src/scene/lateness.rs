//! How late the ticks of each node began. Virtual time is never late.

use ratelab_account::Snapshot;
use rerun::{RecordingStream, SeriesPoints};

use super::palette;
use crate::{schema::node_entity, timeline::Written};

/// Size of a point.
const SIZE: f32 = 1.5;

/// Names and colours of the points; the ticks themselves are recorded for
/// readers too.
pub fn begin(rec: &RecordingStream, start: &Snapshot) -> Written {
    let colours: Vec<_> = palette::series(start.nodes.len()).collect();
    for (node, colour) in start.nodes.iter().zip(colours) {
        let points = SeriesPoints::new()
            .with_names([format!("{} (µs late)", node.name)])
            .with_colors([colour])
            .with_marker_sizes([SIZE]);
        rec.log_static(node_entity(&node.name), &points)?;
    }
    Ok(())
}

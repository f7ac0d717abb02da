//! The robots of graph files, loaded from their models or from recordings.

use std::{path::Path, sync::Arc};

use ratelab_plant::RobotPlant;
use ratelab_recording::Recording;
use ratelab_system::{
    System,
    graph_file::{GraphFile, GraphFileError},
};

/// Returns the systems that `graph` may have in its middle: the built-in one, and its plant with
/// files in `folder` or below.
///
/// # Errors
/// [`GraphFileError`] with the key that is wrong.
pub fn known(
    graph: &GraphFile,
    folder: &Path,
    built_in: &Arc<dyn System>,
) -> Result<Vec<Arc<dyn System>>, GraphFileError> {
    let mut known = vec![built_in.clone()];
    if let Some(spec) = graph.plant() {
        // An empty path means the current folder, which is opened as `.`.
        let plant = RobotPlant::load(&folder.join("."), spec);
        let plant =
            plant.map_err(|defect| graph.plant_error(defect.key, defect.item, defect.what))?;
        known.push(Arc::new(plant));
    }
    Ok(known)
}

/// Returns the systems that the graph of `recording` may have in its middle; its plant needs no file.
pub fn recorded(recording: &Recording, built_in: &Arc<dyn System>) -> Vec<Arc<dyn System>> {
    let origin = &recording.origin;
    let plant = || {
        let graph = GraphFile::parse(origin.graph_file.as_ref()?).ok()?;
        let plant = RobotPlant::recorded(origin.plant.as_ref()?, graph.plant()?);
        Some(Arc::new(plant.ok()?) as Arc<dyn System>)
    };
    [built_in.clone()].into_iter().chain(plant()).collect()
}

//! `ratelab export-web`: recordings as a page for the browser.

use std::sync::Arc;

use ratatui::layout::Size;
use ratelab_recording::Recording;
use ratelab_screen::{Look, picture};
use ratelab_system::{Alias, System, names};
use serde_json::Value;

use crate::{
    cli::ExportWebArgs,
    error::Error,
    output::{OutputKind, print_line},
    printable::shown,
    program::Program,
    reading,
    screen::{pictured, theme},
    web,
};

/// Size of the picture for readers without JavaScript.
const SIZE: Size = Size::new(120, 35);

/// Writes the page; of damaged recordings with their intact part.
pub fn export_web(program: &Program, args: &ExportWebArgs) -> Result<(), Error> {
    let recordings = args
        .files
        .iter()
        .map(|file| Ok(Arc::new(reading::read(file)?)))
        .collect::<Result<Vec<_>, Error>>()?;
    let program = &program.for_recording(&recordings[0]);
    refuse_strangers(program, &recordings)?;
    let system = &*program.system;
    let differs = differing(system, &recordings);
    let mut runs: Vec<(String, Arc<Recording>)> = recordings
        .iter()
        .map(|recording| (setting(system, differs, recording), recording.clone()))
        .collect();
    if differs.is_some() {
        let number = |text: &str| text.split(' ').next().and_then(|n| n.parse::<f64>().ok());
        runs.sort_by(|(one, _), (other, _)| {
            let [one, other] = [one, other].map(|text| number(text).unwrap_or(f64::MAX));
            one.total_cmp(&other)
        });
    }
    let first = runs[0].1.clone();
    let (at, theme) = (first.until, theme(false, Some(Look::Light)));
    let poster = picture::draw_recording(first, pictured(program, args.limits), at, SIZE, &theme)?;
    let data = runs.iter().map(|(setting, recording)| {
        let mut data = web::data(recording, program, setting);
        if args.limits {
            data["limits"] = web::limits(recording, system);
        }
        data
    });
    let runs: Vec<Value> = data.collect();
    let quantity = differs.map_or_else(String::new, |alias| names::label(alias.name));
    let page = web::page(system.name(), &quantity, &runs, &poster);
    OutputKind::Page.write("--output", &args.output, &args.files, page.as_bytes())?;
    let file = shown(&args.output);
    print_line(&format!("{file}: open it in a browser"))?;
    recordings.iter().try_for_each(|one| Error::if_damaged(one))
}

/// Refuses recordings of other systems.
fn refuse_strangers(program: &Program, recordings: &[Arc<Recording>]) -> Result<(), Error> {
    for (place, recording) in recordings.iter().enumerate() {
        if recording.is_of(&*program.system) {
            continue;
        }
        let (file, of) = (recording.path.display(), &recording.origin.system);
        return Err(Error::BadInput(match place {
            0 => format!("{file}: this is a recording of {of:?}: use the program that has it"),
            _ => format!(
                "{file}: this is a recording of another graph ({of:?}) than the first: \
                 a page holds runs of one graph"
            ),
        }));
    }
    Ok(())
}

/// Returns the first of the system's settings in which the recordings differ.
fn differing(system: &dyn System, recordings: &[Arc<Recording>]) -> Option<&'static Alias> {
    let value = |alias: &Alias, of: &Recording| alias.value(&of.origin.config.setup);
    let mut aliases = system.knobs().aliases().iter();
    aliases.find(|alias| {
        let mut values = recordings.iter().map(|recording| value(alias, recording));
        let first = values.next();
        values.any(|other| Some(other) != first)
    })
}

/// Returns the value of that setting in a recording, with its unit.
fn setting(system: &dyn System, alias: Option<&Alias>, of: &Recording) -> String {
    alias.map_or_else(String::new, |alias| {
        let value = names::short_value(system, alias, &of.origin.config.setup);
        format!("{value}{}", names::unit(alias.name, alias.kind()))
    })
}

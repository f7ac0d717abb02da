//! `ratelab picture`: the dashboard at a moment, as an SVG file.

use std::{path::PathBuf, slice, sync::Arc};

use ratelab_screen::picture as pictures;

use crate::{
    cli::PictureArgs,
    error::Error,
    options::{self, Defaults},
    output::OutputKind,
    program::Program,
    reading,
    screen::{pictured, theme},
};

/// Defaults of the run: on the virtual clock, the same picture bit for bit.
const DEFAULTS: Defaults = Defaults::virtual_only(
    "a picture is of the virtual clock: leave --clock real out, or name a recording",
);

/// Draws a recording or a run, and writes the picture.
pub fn picture(program: &Program, args: &PictureArgs) -> Result<(), Error> {
    let theme = theme(args.ascii, Some(args.theme));
    let output = |picture: &str, read: &[PathBuf]| {
        OutputKind::Drawing.write("--output", &args.output, read, picture.as_bytes())
    };
    if let Some(file) = &args.file {
        refuse_options(args)?;
        let recording = Arc::new(reading::read(file)?);
        let at = args.at.unwrap_or(recording.until);
        Error::if_after_end(at, &recording)?;
        let (setup, size) = (
            pictured(&program.for_recording(&recording), args.limits),
            args.size,
        );
        let picture = match args.animate {
            None => pictures::draw_recording(recording.clone(), setup, at, size, &theme),
            Some(speed) => pictures::moving(recording.clone(), setup, at, speed, size, &theme),
        }?;
        output(&picture, slice::from_ref(file))?;
        return Error::if_damaged(&recording);
    }
    let end = args.at.unwrap_or(DEFAULTS.end);
    let defaults = Defaults { end, ..DEFAULTS };
    let (config, _) = options::graph(program, &args.graph, &defaults)?;
    let picture = pictures::draw_run(&config, pictured(program, args.limits), args.size, &theme)?;
    output(&picture, &[])
}

/// Refuses options of a run beside a recording, whose run is given.
fn refuse_options(args: &PictureArgs) -> Result<(), Error> {
    let graph = &args.graph;
    let given = !graph.system.given.is_empty()
        || graph.system.broken
        || !graph.knob.is_empty()
        || graph.knobs.is_some()
        || graph.clock.is_some()
        || graph.duration_s.is_some()
        || graph.seed.is_some()
        || graph.like.is_some();
    if given {
        let why = "the run of a recording is what it was: leave the options of the graph out";
        Err(Error::BadInput(why.to_owned()))
    } else {
        Ok(())
    }
}

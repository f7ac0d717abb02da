//! Builds a sweep from the command line.

use std::{collections::HashSet, sync::Arc};

use ratelab::{Knob, KnobKind};
use ratelab_experiment::{
    Config, Experiment,
    sweep::{Sweep, SweepAxis},
};

use crate::{
    cli::{DEFAULT_RATES, SweepArgs},
    error::Error,
    options::{read_knob, resolved, setup, timing, world},
    program::Program,
    sweep::columns::slowest_first,
};

/// Number of seeds, if none are given.
const SEEDS: u64 = 20;

impl SweepArgs {
    /// Builds the sweep from the options.
    ///
    /// # Errors
    /// [`Error::BadInput`] if they are invalid for the system.
    pub fn sweep(&self, program: &Program) -> Result<Sweep, Error> {
        let knobs = self
            .knob
            .iter()
            .map(|knob| read_knob(program, "--knob", knob));
        let knobs = timing(&self.timing).map(Ok).chain(knobs);
        let usual = Config::default();
        let base = Config {
            end: self.duration_s.unwrap_or(usual.end),
            world: world(&self.timing, usual.world)?,
            knobs: program.system.about().events.to_vec(),
            setup: setup(program, usual.seed, knobs.collect::<Result<_, _>>()?)?,
            ..usual
        };
        let mut axes = self.axes(program)?;
        for axis in &mut axes {
            resolve(program, &base, axis)?;
        }
        if let Some(count) = self.phases {
            axes.push(Experiment::new(program.system.clone(), &base)?.phases(count));
        }
        check_distinct(&axes)?;
        let only_seeds = axes.is_empty() && self.seeds.is_some();
        if !only_seeds {
            add_default(program, &base, &mut axes)?;
        }
        if axes.is_empty() {
            if self.seeds.is_none() {
                let why =
                    "which knob is swept? try --axis \"rate NODE\" 1,10,100, or --seeds 0..19";
                return Err(Error::BadInput(why.to_owned()));
            }
            axes.push(SweepAxis::as_given());
        }
        let first = program.system.knobs().aliases().first();
        let main = axes
            .iter()
            .position(|axis| first.is_some_and(|first| first.name == axis.name));
        Ok(Sweep {
            axes: slowest_first(axes, main.unwrap_or(0), |axis| axis.kind),
            seeds: self
                .seeds
                .clone()
                .map_or_else(|| (0..SEEDS).collect(), Vec::from),
            parts: self.parts,
            ..Sweep::new(program.system.clone(), base)
        })
    }

    /// Returns all requested axes; the values of a repeated option form one axis.
    fn axes(&self, program: &Program) -> Result<Vec<SweepAxis>, Error> {
        let mut axes: Vec<SweepAxis> = Vec::new();
        for axis in &self.system.given {
            match axes.iter_mut().find(|known| known.name == axis.name) {
                Some(known) => known.values.extend(axis.values.iter().cloned()),
                None => axes.push(axis.clone()),
            }
        }
        for pair in self.axis.chunks_exact(2) {
            let (knob, list) = (pair[0].split_whitespace().collect::<Vec<_>>(), &pair[1]);
            let knob_text = knob.join(" ");
            let alias = program.knobs().alias(&knob_text);
            let axis = SweepAxis::parse(
                program.knobs(),
                alias.map_or(knob_text.as_str(), |alias| alias.name),
                list,
            );
            let refused = |why| Error::BadInput(format!("--axis {knob_text:?} {list}: {why}"));
            axes.push(axis.map_err(refused)?);
        }
        Ok(axes)
    }
}

/// Puts the messages of `axis` into recordable form.
fn resolve(program: &Program, base: &Config, axis: &mut SweepAxis) -> Result<(), Error> {
    let (name, hole) = (axis.name.clone(), axis.has_hole());
    let option = match program.knobs().alias(&name) {
        Some(_) => format!("--{name}"),
        None => format!("--axis {name:?}"),
    };
    let mut texts: HashSet<String> = HashSet::new();
    for value in &mut axis.values {
        if !texts.insert(value.text.clone()) {
            let why = format!("{option} lists {} twice: give each {name} once", value.text);
            return Err(Error::BadInput(why));
        }
        let value = Arc::make_mut(value);
        for knob in &mut value.knobs {
            *knob = resolved(program, base.seed, &base.setup, knob.clone())
                .map_err(|why| Error::BadInput(format!("{option} {why}")))?;
        }
        if let (Some(Knob::Send { text, .. }), false) = (value.knobs.first(), hole) {
            value.text.clone_from(text);
        }
    }
    Ok(())
}

/// Refuses a knob that occurs in two axes.
fn check_distinct(axes: &[SweepAxis]) -> Result<(), Error> {
    for (place, axis) in axes.iter().enumerate() {
        let same = |other: &&SweepAxis| knobs(axis).any(|my| knobs(other).any(|of| my.is_of(of)));
        if let Some(other) = axes.iter().take(place).find(same) {
            let (one, other) = (&other.name, &axis.name);
            let why = format!("{one} and {other} turn the same knob: give one of them");
            return Err(Error::BadInput(why));
        }
    }
    Ok(())
}

/// Adds the axis of the system's first alias if it is a rate, not yet in use, and no node refuses it
/// with any value of the other axes.
fn add_default(program: &Program, base: &Config, axes: &mut Vec<SweepAxis>) -> Result<(), Error> {
    let first = program.system.knobs().aliases().first();
    if let Some(alias) = first.filter(|alias| alias.kind() == KnobKind::Rate) {
        let axis = SweepAxis::parse(program.knobs(), alias.name, DEFAULT_RATES)
            .map_err(|why| Error::BadInput(why.to_string()))?;
        let is_own = |knob: &Knob| knobs(&axis).any(|own| own.is_of(knob));
        let mut turned = axes.iter().flat_map(knobs);
        let is_turned = turned.any(is_own) || base.setup.iter().any(is_own);
        drop(turned);
        if !is_turned && is_accepted(program, base, axes, &axis) {
            axes.push(axis);
        }
    }
    Ok(())
}

/// Returns whether the graph has the knobs of `axis` with each value of the `others`; what is wrong
/// with these values is told where they are run.
fn is_accepted(program: &Program, base: &Config, others: &[SweepAxis], axis: &SweepAxis) -> bool {
    let values = others.iter().flat_map(|other| &other.values);
    let firsts = others.iter().filter_map(|other| other.values.first());
    values
        .map(|value| &value.knobs[..])
        .chain([&[][..]])
        .all(|own| {
            let mut config = base.clone();
            let first = firsts.clone().flat_map(|value| &value.knobs);
            config.setup.extend(first.chain(own).cloned());
            let graph = Experiment::new(program.system.clone(), &config);
            graph.map_or(true, |graph| {
                knobs(axis).all(|knob| graph.check(knob).is_ok())
            })
        })
}

/// Returns the knobs of `axis`.
fn knobs(axis: &SweepAxis) -> impl Iterator<Item = &Knob> {
    axis.values.iter().take(1).flat_map(|value| &value.knobs)
}

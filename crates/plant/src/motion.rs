//! A reference that moves: what joints of a robot are to follow.

use std::{f64::consts::TAU, str::FromStr};

use mujoco_rs::prelude::MjtObjBase;
use ratelab::Time;

use crate::{
    PlantDefect,
    model::{AXES, RobotModel},
};

/// The key of the file.
pub(crate) const REFERENCE: &str = "reference";

/// What a joint may be asked to do, for errors.
const FORMS: &str =
    "\"NAME step AMOUNT S\", \"NAME sine AMOUNT HZ\" or \"NAME way S:AMOUNT S:AMOUNT\"";

/// The greatest amount, time and frequency.
const MOST: f64 = 1e6;

/// How something moves beside the pose.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum MotionPath {
    /// By an amount from a run time on (s).
    Step { amount: f64, at_s: f64 },
    /// To and fro by an amount, so many times a second.
    Sine { amount: f64, hz: f64 },
    /// On straight lines from amount to amount, each at a run time (s).
    Way(Vec<[f64; 2]>),
}

/// A coordinate that moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointMotion {
    /// The coordinate, by its index.
    pub(crate) index: usize,
    path: MotionPath,
}

/// A site that moves along an axis of the world.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SiteMotion {
    /// Its name with the axis, such as `tip.x`.
    pub(crate) name: String,
    pub(crate) site: usize,
    pub(crate) body: usize,
    pub(crate) axis: usize,
    pub(crate) path: MotionPath,
}

/// What moves of a reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Motions {
    pub(crate) joints: Vec<JointMotion>,
    pub(crate) sites: Vec<SiteMotion>,
}

impl FromStr for MotionPath {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let number = |text: &str| {
            let number: Option<f64> = text.parse().ok();
            number.filter(|number| number.abs() <= MOST).ok_or(())
        };
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            ["step", amount, at] => Ok(Self::Step {
                amount: number(amount)?,
                at_s: number(at)?,
            }),
            ["sine", amount, hz] => Ok(Self::Sine {
                amount: number(amount)?,
                hz: number(hz)?,
            }),
            ["way", ref points @ ..] if !points.is_empty() => {
                let point = |point: &&str| {
                    let (at, amount) = point.split_once(':').ok_or(())?;
                    Ok([number(at)?, number(amount)?])
                };
                let points: Vec<[f64; 2]> = points.iter().map(point).collect::<Result<_, ()>>()?;
                if points.is_sorted_by(|[one, _], [next, _]| one < next) {
                    Ok(Self::Way(points))
                } else {
                    Err(())
                }
            }
            _ => Err(()),
        }
    }
}

impl MotionPath {
    /// Amount and speed at run time `now`.
    pub(crate) fn at(&self, now: Time) -> [f64; 2] {
        let seconds = now.as_secs_f64();
        match self {
            Self::Step { amount, at_s } if seconds >= *at_s => [*amount, 0.0],
            Self::Step { .. } => [0.0, 0.0],
            Self::Sine { amount, hz } => {
                let (sin, cos) = (TAU * hz * seconds).sin_cos();
                [amount * sin, amount * TAU * hz * cos]
            }
            Self::Way(points) => {
                let next = points.partition_point(|[at, _]| *at <= seconds);
                match (
                    next.checked_sub(1).and_then(|last| points.get(last)),
                    points.get(next),
                ) {
                    (Some([from, before]), Some([to, after])) => {
                        let speed = (after - before) / (to - from);
                        [before + speed * (seconds - from), speed]
                    }
                    (Some([_, amount]), None) | (None, Some([_, amount])) => [*amount, 0.0],
                    (None, None) => [0.0, 0.0],
                }
            }
        }
    }
}

impl JointMotion {
    /// Returns how far the coordinate is to be from the pose at run time `now`, and its speed.
    pub(crate) fn at(&self, now: Time) -> [f64; 2] {
        self.path.at(now)
    }
}

/// Reads the motions of a robot, each a text of the key `reference`.
///
/// # Errors
/// [`PlantDefect`] for another form, and for a name that is neither a joint with one coordinate nor a site
/// with an axis.
pub(crate) fn motions(model: &RobotModel, texts: &[String]) -> Result<Motions, PlantDefect> {
    let mut motions = Motions::default();
    for text in texts {
        let refused = || {
            let what = format!("{REFERENCE}: {text:?}: expected {FORMS}");
            PlantDefect::new(REFERENCE, what)
        };
        let split = text.trim().split_once(char::is_whitespace);
        let (name, path) = split.ok_or_else(refused)?;
        let parsed = || path.parse().map_err(|()| refused());
        if let Some(index) = coordinate(model, name) {
            motions.joints.push(JointMotion {
                index,
                path: parsed()?,
            });
        } else if let Some([site, axis]) = site(model, name) {
            motions.sites.push(SiteMotion {
                name: name.to_owned(),
                site,
                body: model.mujoco.site_bodyid()[site] as usize,
                axis,
                path: parsed()?,
            });
        } else {
            let known = known(model);
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let kind = "hinge, slide or site";
            return Err(PlantDefect::unknown(REFERENCE, kind, name, &known));
        }
    }
    Ok(motions)
}

/// Returns the coordinate of a hinge or a slide.
pub(crate) fn coordinate(model: &RobotModel, name: &str) -> Option<usize> {
    model
        .joints
        .iter()
        .find(|joint| joint.name == name && joint.is_single())?;
    model.coordinates.iter().position(|group| group == name)
}

/// Returns the site and the axis in a name such as `tip.x`.
fn site(model: &RobotModel, name: &str) -> Option<[usize; 2]> {
    let (site, axis) = name.rsplit_once('.')?;
    let axis = AXES.iter().position(|known| *known == axis)?;
    let site = model.named(MjtObjBase::mjOBJ_SITE, site).ok()?;
    Some([site, axis])
}

/// Returns the names of what may move.
fn known(model: &RobotModel) -> Vec<String> {
    let sites = model
        .names(MjtObjBase::mjOBJ_SITE)
        .into_iter()
        .filter(|site| !site.is_empty())
        .flat_map(|site| AXES.map(|axis| format!("{site}.{axis}")));
    model
        .joints
        .iter()
        .filter(|joint| joint.is_single())
        .map(|joint| joint.name.clone())
        .chain(sites)
        .collect()
}

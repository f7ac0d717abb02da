//! A reference that moves: what joints of a robot are to follow.

use std::{f64::consts::TAU, str::FromStr};

use ratelab::Time;

use crate::{PlantDefect, model::RobotModel};

/// The key of the file.
pub(crate) const REFERENCE: &str = "reference";

/// What a joint may be asked to do, for errors.
const FORMS: &str =
    "\"JOINT step AMOUNT S\", \"JOINT sine AMOUNT HZ\" or \"JOINT way S:AMOUNT S:AMOUNT\"";

/// The greatest amount, time and frequency.
const MOST: f64 = 1e6;

/// How a coordinate moves beside the pose.
#[derive(Clone, Debug, PartialEq)]
enum Path {
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
    path: Path,
}

impl FromStr for Path {
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

impl Path {
    /// Amount and speed at a run time (s).
    fn at(&self, seconds: f64) -> [f64; 2] {
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
    /// How far the coordinate is to be from the pose at run time `now`, and its speed.
    pub(crate) fn at(&self, now: Time) -> [f64; 2] {
        self.path.at(now.as_secs_f64())
    }
}

/// Reads the motions of a robot, each a text of the key `reference`.
///
/// # Errors
/// [`PlantDefect`] for another form, and for a joint that has not one coordinate.
pub(crate) fn motions(
    model: &RobotModel,
    texts: &[String],
) -> Result<Vec<JointMotion>, PlantDefect> {
    texts.iter().map(|text| motion(model, text)).collect()
}

fn motion(model: &RobotModel, text: &str) -> Result<JointMotion, PlantDefect> {
    let refused = || {
        let what = format!("{REFERENCE}: {text:?}: expected {FORMS}");
        PlantDefect::new(REFERENCE, what)
    };
    let (name, path) = text
        .trim()
        .split_once(char::is_whitespace)
        .ok_or_else(refused)?;
    let joints = model.joints.iter();
    let single = joints.filter(|joint| joint.numbers() == [1, 1]);
    let names: Vec<&str> = single.map(|joint| &*joint.name).collect();
    if !names.contains(&name) {
        return Err(PlantDefect::unknown(
            REFERENCE,
            "hinge or slide",
            name,
            &names,
        ));
    }
    let mut coordinates = model.coordinates.iter();
    let index = coordinates.position(|group| group == name);
    Ok(JointMotion {
        index: index.ok_or_else(refused)?,
        path: path.parse().map_err(|()| refused())?,
    })
}

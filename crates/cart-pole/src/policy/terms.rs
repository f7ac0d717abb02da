//! What a policy in a file sees of the cart-pole: numbers by their names.

use std::{fmt, str::FromStr};

use crate::{Observation, ParameterError};

/// The most numbers of an observation.
const MOST: usize = 64;

/// What a policy in a file sees. As text such as `x v theta spin`, each also with a factor: `theta*2`.
#[derive(Clone, Debug, PartialEq)]
pub struct CartTerms(Vec<ScaledTerm>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct ScaledTerm {
    term: CartTerm,
    factor: f64,
}

/// A number of a reading, or always the same one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CartTerm {
    X,
    V,
    Cos,
    Sin,
    Theta,
    Spin,
    Number(f64),
}

/// The terms with their names.
const NAMES: [(&str, CartTerm); 6] = [
    ("x", CartTerm::X),
    ("v", CartTerm::V),
    ("cos", CartTerm::Cos),
    ("sin", CartTerm::Sin),
    ("theta", CartTerm::Theta),
    ("spin", CartTerm::Spin),
];

/// The terms of a reading itself.
const USUAL: [CartTerm; 5] = [
    CartTerm::X,
    CartTerm::V,
    CartTerm::Cos,
    CartTerm::Sin,
    CartTerm::Spin,
];

impl Default for CartTerms {
    fn default() -> Self {
        let factor = 1.0;
        Self(USUAL.map(|term| ScaledTerm { term, factor }).to_vec())
    }
}

impl CartTerms {
    /// Returns the numbers of an observation.
    pub(super) fn size(&self) -> usize {
        self.0.len()
    }

    /// Puts what is seen of `reading` into `row`, whose length is that of an observation.
    pub(super) fn put(&self, reading: &Observation, row: &mut [f64]) {
        for (number, scaled) in row.iter_mut().zip(&self.0) {
            *number = scaled.factor * scaled.term.value_in(reading);
        }
    }
}

impl CartTerm {
    fn value_in(self, reading: &Observation) -> f64 {
        let [x, v, cos, sin, spin] = reading.to_array().map(f64::from);
        match self {
            Self::X => x,
            Self::V => v,
            Self::Cos => cos,
            Self::Sin => sin,
            Self::Theta => sin.atan2(cos),
            Self::Spin => spin,
            Self::Number(number) => number,
        }
    }
}

impl fmt::Display for CartTerms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, ScaledTerm { term, factor }) in self.0.iter().enumerate() {
            if place > 0 {
                f.write_str(" ")?;
            }
            match (NAMES.iter().find(|(_, known)| known == term), term) {
                (Some((name, _)), _) => f.write_str(name)?,
                (None, CartTerm::Number(number)) => write!(f, "{number}")?,
                (None, _) => {}
            }
            if *factor != 1.0 {
                write!(f, "*{factor}")?;
            }
        }
        Ok(())
    }
}

impl FromStr for CartTerms {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let invalid = || ParameterError::Observe(text.to_owned());
        let finite = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
        let terms = text.split_whitespace().map(|word| {
            let (name, factor) = word.split_once('*').unwrap_or((word, "1"));
            let known = NAMES.iter().find(|(known, _)| *known == name);
            let term = known.map(|(_, term)| *term);
            Some(ScaledTerm {
                term: term.or_else(|| finite(name).map(CartTerm::Number))?,
                factor: finite(factor)?,
            })
        });
        let terms: Vec<ScaledTerm> = terms.collect::<Option<_>>().ok_or_else(invalid)?;
        match terms.len() {
            1..=MOST => Ok(Self(terms)),
            _ => Err(invalid()),
        }
    }
}

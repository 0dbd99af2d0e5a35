//! What sensors see of a user's own model, given as text.

use std::sync::Arc;

use super::MAX_SURFACES;
use crate::formula::{Expression, Mistake, Names, Place};
use crate::scalar::Scalar;

/// The most intermediate values of a formula.
const DEEP: usize = 64;

/// A sensor's channel: what it sees, the parameter by how much it is late, and whether it is an angle.
#[derive(Clone, Debug, PartialEq)]
struct Channel {
    formula: Expression,
    delay: Option<usize>,
    angle: bool,
}

/// Channels that see formulas of state, rates, parameters and time. Where there are none the state is seen as it is.
///
/// ```
/// use udd::formula::Names;
/// use udd::model::Observation;
/// let (states, parameters) = (["x".to_owned()], ["gain".to_owned()]);
/// let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: true };
/// let seen = Observation::parse(&[("gain*x + x'", None, false)], names).unwrap();
/// assert_eq!(seen.values(0.0, &[3.0], &[0.5], &[2.0]), [6.5]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    channels: Arc<[Channel]>,
}

impl Observation {
    /// Parses the channels' formulas, each with the number of the parameter by how much it is late, and whether it is an
    /// angle.
    ///
    /// # Errors
    /// The number of the channel and what is wrong with its formula, in words that continue "the formula ...".
    pub fn parse(texts: &[(&str, Option<usize>, bool)], names: Names<'_>) -> Result<Self, (usize, Mistake)> {
        let mut channels = Vec::with_capacity(texts.len());
        for (n, &(text, delay, angle)) in texts.iter().enumerate() {
            let wrong = |what: String| Err((n, Mistake(what)));
            if text.replace("<=", "").replace(">=", "").contains('=') {
                return wrong("has =, but only what is seen is wanted".to_owned());
            }
            let formula = Expression::parse(text, names).map_err(|mistake| (n, mistake))?;
            if formula.depth() > DEEP {
                return wrong(format!("has brackets that leave more than {DEEP} numbers open at once"));
            }
            channels.push(Channel { formula, delay, angle });
        }
        Ok(Self { channels: channels.into() })
    }

    /// Whether the state is seen as it is.
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    pub fn len(&self) -> usize {
        self.channels.len()
    }

    pub fn is_angle(&self, channel: usize) -> bool {
        self.channels.get(channel).is_some_and(|own| own.angle)
    }

    /// The parameter that says by how much a channel is late.
    pub fn delay(&self, channel: usize) -> Option<usize> {
        self.channels.get(channel)?.delay
    }

    /// What the channels see; zero beyond the last one.
    #[inline(never)]
    pub fn values<S: Scalar, const M: usize>(&self, t: S, x: &[S], rates: &[S], parameters: &[S]) -> [S; M] {
        let place = Place { t, x, rates, parameters, inputs: &[] };
        let (mut all, mut stack) = ([S::zero(); M], [S::zero(); DEEP]);
        for (value, channel) in all.iter_mut().zip(&self.channels[..]) {
            *value = channel.formula.value_on(&place, &[S::mask(true); MAX_SURFACES], &mut stack);
        }
        all
    }
}

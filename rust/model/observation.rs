//! The observation of a user-defined model by sensors, as text.

use std::sync::Arc;

use super::MAX_SURFACES;
use crate::formula::{Expression, Mistake, Names, Place, Program};
use crate::scalar::Scalar;

/// A sensor's channel: the parameter of its delay, and whether it is an angle.
#[derive(Clone, Debug, PartialEq)]
struct Channel {
    delay: Option<usize>,
    angle: bool,
}

/// Channels that see formulas of state, rates, parameters and time. If there are none, the channels are the state itself.
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
    /// The readings of the channels.
    seen: Arc<Program>,
}

impl Observation {
    /// Parses the channels' formulas, each with the number of the parameter of its delay, and whether it is an angle.
    ///
    /// # Errors
    /// The number of the channel and what is wrong with its formula, in words that continue "the formula ...".
    pub fn parse(texts: &[(&str, Option<usize>, bool)], names: Names<'_>) -> Result<Self, (usize, Mistake)> {
        let (mut channels, mut formulas) = (Vec::with_capacity(texts.len()), Vec::with_capacity(texts.len()));
        for (n, &(text, delay, angle)) in texts.iter().enumerate() {
            let wrong = |what: String| Err((n, Mistake(what)));
            if text.replace("<=", "").replace(">=", "").contains('=') {
                return wrong("has =, but only what is seen is wanted".to_owned());
            }
            formulas.push(Expression::parse(text, names).map_err(|mistake| (n, mistake))?);
            channels.push(Channel { delay, angle });
        }
        Ok(Self { channels: channels.into(), seen: Arc::new(Program::of(&formulas)) })
    }

    /// Returns true if the state is seen as it is.
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    pub fn len(&self) -> usize {
        self.channels.len()
    }

    pub fn is_angle(&self, channel: usize) -> bool {
        self.channels.get(channel).is_some_and(|own| own.angle)
    }

    /// The parameter for the delay of a channel.
    pub fn delay(&self, channel: usize) -> Option<usize> {
        self.channels.get(channel)?.delay
    }

    /// The readings of the channels; zero beyond the last one.
    #[inline(never)]
    pub fn values<S: Scalar, const M: usize>(&self, t: S, x: &[S], rates: &[S], parameters: &[S]) -> [S; M] {
        let mut all = [S::zero(); M];
        let place = Place { t, x, rates, inputs: &[] };
        self.seen.run_with(&place, parameters, &[S::mask(true); MAX_SURFACES], &mut all);
        all
    }
}

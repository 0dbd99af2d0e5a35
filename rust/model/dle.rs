//! The diffusionless Lorenz equations.

use super::{Family, Parameter, Sides, System, parameter};
use crate::scalar::Scalar;

/// The diffusionless Lorenz equations with drive `w` and damping `b` of the rolling constraint
/// (the paper's `B`), for the state `[omega, y, z]`:
///
/// ```text
/// omega' = y - omega
/// y'     = omega z
/// z'     = -omega y + w - B w z
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Dle<S> {
    /// The dimensionless drive `w`.
    pub w: S,
    /// The paper's `B`.
    pub b: S,
}

impl<S: Scalar> System<S, 3> for Dle<S> {
    const SMOOTH: bool = true;

    #[inline(always)]
    fn rates(&self, _t: S, &[omega, y, z]: &[S; 3], _sides: &Sides<S>) -> [S; 3] {
        [y - omega, omega * z, self.w - omega * y - self.b * self.w * z]
    }
}

/// Builds [`Dle`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DleFamily;

impl Family<3> for DleFamily {
    type Built<S: Scalar> = Dle<S>;

    const PACKETS: bool = true;

    fn goes_in_packets(&self) -> bool {
        true
    }

    fn parameters(&self) -> Vec<Parameter> {
        vec![parameter("w", ""), parameter("B", "")]
    }

    fn build<S: Scalar>(&self, values: &[S]) -> Dle<S> {
        Dle { w: values[0], b: values[1] }
    }
}

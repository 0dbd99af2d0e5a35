//! A contact of bristles that bend before they slide: the LuGre friction model.

use super::effects::Contact;
use super::{
    Disk, DiskFamily, EnclosedSurfaces, Family, Parameter, Pendulum, PendulumFamily, Sides, System, parameter,
};
use crate::scalar::Scalar;

/// A model whose dry friction comes from bristles, with their deflection in rad as one more state, the last.
///
/// Dry friction that is treated as [LuGre](super::FrictionModel::Lugre) acts through them:
///
/// ```text
/// torque = -(s z + d dz/dT)      dz/dT = Omega - s |Omega| z/friction(Omega)
/// s = friction(0)/eps            d = sqrt(s I)
/// ```
///
/// Steady sliding feels the friction itself; below it the contact gives way like a spring of stiffness `s`,
/// and creeps (Canudas de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419).
#[derive(Clone, Debug, PartialEq)]
pub struct WithLuGre<M>(pub M);

fn contact<S: Scalar>(bristle: S) -> Contact<S> {
    Contact { sign: S::zero(), bristle }
}

impl<S: Scalar> System<S, 5> for WithLuGre<Disk<S>> {
    #[inline]
    fn rates(&self, t: S, &[omega, y, z, beta, bristle]: &[S; 5], sides: &Sides<S>) -> [S; 5] {
        let motion = self.0.equation_of_motion(t, &[omega, y, z, beta], &contact(bristle), sides);
        let (torque, rate) = motion.dry.bristles(omega, bristle, motion.inertia, sides);
        let (dy, dz) = motion.velocity;
        [(motion.torque + torque) / motion.inertia, dy, dz, omega, rate]
    }

    fn surfaces(&self) -> usize {
        self.0.surfaces()
    }

    #[inline(always)]
    fn surface(&self, j: usize, t: S, &[omega, y, z, beta, _]: &[S; 5], sides: &Sides<S>) -> S {
        self.0.surface(j, t, &[omega, y, z, beta], sides)
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<5> + '_>> {
        Some(Box::new(WithLuGre(self.0.enclosed(lane))))
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        self.0.surface_name(j, side)
    }

    #[inline(always)]
    fn wall(&self, &[omega, y, z, beta, _]: &[S; 5]) -> Option<S> {
        self.0.wall(&[omega, y, z, beta])
    }
}

impl<S: Scalar> System<S, 3> for WithLuGre<Pendulum<S>> {
    #[inline]
    fn rates(&self, t: S, &[omega, theta, bristle]: &[S; 3], sides: &Sides<S>) -> [S; 3] {
        let (own, dry) = self.0.torque(t, &[omega, theta], contact(bristle), sides);
        let (torque, rate) = dry.bristles(omega, bristle, self.0.inertia, sides);
        [(own + torque) / self.0.inertia, omega, rate]
    }

    fn surfaces(&self) -> usize {
        self.0.surfaces()
    }

    #[inline(always)]
    fn surface(&self, j: usize, t: S, &[omega, theta, _]: &[S; 3], sides: &Sides<S>) -> S {
        self.0.surface(j, t, &[omega, theta], sides)
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<3> + '_>> {
        Some(Box::new(WithLuGre(self.0.enclosed(lane))))
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        self.0.surface_name(j, side)
    }
}

/// The family's parameters, where its LuGre effects' `eps` is an angle.
fn parameters(list: Vec<Parameter>) -> Vec<Parameter> {
    let angle = |p: &Parameter| p.name.ends_with(".eps");
    list.into_iter().map(|p| if angle(&p) { parameter(&p.name, "rad") } else { p }).collect()
}

impl Family<5> for WithLuGre<DiskFamily> {
    type Built<S: Scalar> = WithLuGre<Disk<S>>;

    fn parameters(&self) -> Vec<Parameter> {
        parameters(self.0.parameters())
    }

    fn build<S: Scalar>(&self, values: &[S]) -> WithLuGre<Disk<S>> {
        WithLuGre(self.0.build(values))
    }
}

impl Family<3> for WithLuGre<PendulumFamily> {
    type Built<S: Scalar> = WithLuGre<Pendulum<S>>;

    fn parameters(&self) -> Vec<Parameter> {
        parameters(self.0.parameters())
    }

    fn build<S: Scalar>(&self, values: &[S]) -> WithLuGre<Pendulum<S>> {
        WithLuGre(self.0.build(values))
    }
}

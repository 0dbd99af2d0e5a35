//! How a state is seen.

use crate::integrate::{Tolerance, propagate};
use crate::model::{FormulaFamily, Observation, System, sides_of};
use crate::scalar::{Scalar, vector};

/// A state as a sensor meets it: when, how it changes, and the parameters of its law.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a, S, const D: usize> {
    pub t: S,
    pub x: &'a [S; D],
    pub rate: &'a [S; D],
    pub parameters: &'a [S],
}

/// How `M` channels see a state of `D` numbers.
pub trait Sensor<const D: usize, const M: usize>: Clone + Send + Sync {
    /// The camera's parameters with their units.
    const PARAMETERS: &'static [(&'static str, &'static str)];

    /// How many of the channels there are; what would be seen by any further one plays no part.
    fn channels(&self) -> usize {
        M
    }

    /// Whether a channel is an angle: what was seen of it counts modulo a turn.
    fn is_angle(&self, channel: usize) -> bool;

    /// The model's parameter for the delay of a channel.
    fn delay(&self, _channel: usize) -> Option<usize> {
        None
    }

    /// The observation of a state.
    fn observe<S: Scalar>(&self, camera: &[S], at: &Moment<'_, S, D>) -> [S; M];
}

/// How closely the way back to a late sensor's moment is followed.
const BACK: Tolerance = Tolerance::new(1e-8, 1e-10);

/// The observation by a sensor; for delayed channels the observation at the earlier time. Not a number where the law
/// leads from nowhere to
/// that moment's state.
#[inline(always)]
pub fn seen<S, C, const D: usize, const M: usize>(
    sensor: &C,
    system: &impl System<S, D>,
    camera: &[S],
    at: &Moment<'_, S, D>,
) -> [S; M]
where
    S: Scalar<Real = f64, Mask = bool>,
    C: Sensor<D, M>,
{
    let mut all = sensor.observe(camera, at);
    see_late(sensor, system, camera, at, &mut all);
    all
}

/// Puts what late channels see in its place.
#[inline(always)]
pub(super) fn see_late<S, C, const D: usize, const M: usize>(
    sensor: &C,
    system: &impl System<S, D>,
    camera: &[S],
    at: &Moment<'_, S, D>,
    all: &mut [S; M],
) where
    S: Scalar<Real = f64, Mask = bool>,
    C: Sensor<D, M>,
{
    for (m, own) in all.iter_mut().enumerate() {
        let Some(delay) = sensor.delay(m) else { continue };
        *own = late(sensor, system, camera, at, at.parameters[delay])[m];
    }
}

/// The observation of an earlier state.
#[inline(never)]
fn late<S, C, const D: usize, const M: usize>(
    sensor: &C,
    system: &impl System<S, D>,
    camera: &[S],
    at: &Moment<'_, S, D>,
    by: S,
) -> [S; M]
where
    S: Scalar<Real = f64, Mask = bool>,
    C: Sensor<D, M>,
{
    let before = at.t.real() - by.real();
    let Ok(x) = propagate(system, at.t.real(), before, *at.x, &BACK) else {
        return [S::constant(f64::NAN); M];
    };
    // A delay that is longer by little leads back by as much more at that moment's rate.
    let (t, longer) = (at.t - by, by - S::constant(by.real()));
    let rate = rates(system, t, &x);
    let x = vector!(S, D; n => x[n] - longer * rate[n]);
    sensor.observe(camera, &Moment { t, x: &x, rate: &rates(system, t, &x), ..*at })
}

#[inline(always)]
pub(super) fn rates<S: Scalar, const D: usize>(system: &impl System<S, D>, t: S, x: &[S; D]) -> [S; D] {
    system.rates(t, x, &sides_of(system, t, x))
}

/// The distance at which `lens` counts, m.
const ARM: f64 = 0.1;

/// A camera that sees `Y`, `Z` and `beta` of the disk, with its imperfections:
///
/// ```text
/// p = (1 + scale) Rot(tilt) [(Y, Z)(t - row Z) + shutter (Y, Z)'' + Rot(beta) (right, up)] + (y0, z0)
/// (Y, Z)_seen = p + lens |p - m|^2/A^2 (p - m),   m = (middle_y, middle_z)
/// beta_seen = beta(t - row Z - lag) + shutter Omega' + tilt
/// ```
///
/// `y0, z0` is where the pivot really is in the measurement's coordinates, `tilt` turns the picture
/// clockwise, `lens` is how much farther from the picture's middle `m` a lens shows what lies at the distance
/// A = 0.1 m from there, `(right, up)` is where the marks' centre lies on the disk, seen with the red mark on top
/// (marks are glued by hand), the orientation is seen as it was `lag` before the position, and with a rolling
/// shutter a point at height `Z` is exposed at `t - row Z`. A mean over an exposure of duration `e` lies off the
/// middle of a curved path: `shutter` is then `e^2/24`.
#[derive(Clone, Copy, Debug)]
pub struct DiskCamera;

impl Sensor<4, 3> for DiskCamera {
    const PARAMETERS: &'static [(&'static str, &'static str)] = &[
        ("y0", "m"),
        ("z0", "m"),
        ("tilt", "rad"),
        ("scale", ""),
        ("right", "m"),
        ("up", "m"),
        ("lag", "s"),
        ("row", "s/m"),
        ("shutter", "s^2"),
        ("lens", ""),
        ("middle_y", "m"),
        ("middle_z", "m"),
    ];

    fn is_angle(&self, channel: usize) -> bool {
        channel == 2
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, camera: &[S], &Moment { x, rate, .. }: &Moment<'_, S, 4>) -> [S; 3] {
        let &[y0, z0, tilt, scale, right, up, lag, row, shutter, lens, middle_y, middle_z] =
            camera.first_chunk().expect("twelve camera parameters");
        let late = -(row * x[2]);
        let later = late - lag;
        // Paths are followed to the second order in time. The disk turns about a contact whose drive is steady.
        let bend = |delay: S| shutter + delay.square().scale(0.5);
        let curved = [rate[0] * x[2] + x[0] * rate[2], -(rate[0] * x[1] + x[0] * rate[1])];
        let turned = x[3] + late * rate[3];
        let (sin, cos) = (turned.sin(), turned.cos());
        let y = x[1] + late * rate[1] + bend(late) * curved[0] + right * cos + up * sin;
        let z = x[2] + late * rate[2] + bend(late) * curved[1] + up * cos - right * sin;
        let beta = x[3] + later * rate[3] + bend(later) * rate[0];
        let (sin, cos, size) = (tilt.sin(), tilt.cos(), S::one() + scale);
        let (y, z) = (size * (cos * y + sin * z) + y0, size * (cos * z - sin * y) + z0);
        let (across, upward) = (y - middle_y, z - middle_z);
        let bent = lens * (across.square() + upward.square()).scale(1.0 / (ARM * ARM));
        [y + bent * across, z + bent * upward, beta + tilt]
    }
}

/// A sensor that sees a pendulum's angle, with an unknown zero, from a pivot that is a little off:
///
/// ```text
/// theta_seen = theta + theta0 - aside cos(theta) + above sin(theta)
/// ```
///
/// The true pivot lies `aside` (to the right) and `above` the one that the angle was measured from, in lengths of
/// the pendulum.
#[derive(Clone, Copy, Debug)]
pub struct AngleSensor;

impl Sensor<2, 1> for AngleSensor {
    const PARAMETERS: &'static [(&'static str, &'static str)] =
        &[("theta0", "rad"), ("aside", ""), ("above", "")];

    fn is_angle(&self, _channel: usize) -> bool {
        true
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, camera: &[S], &Moment { x, .. }: &Moment<'_, S, 2>) -> [S; 1] {
        let &[theta0, aside, above] = camera.first_chunk().expect("three camera parameters");
        let (sin, cos) = x[1].sin_cos();
        [x[1] + theta0 - aside * cos + above * sin]
    }
}

/// Sensors of a user's own model: formulas of state, rates, parameters and time, or the state's components as they
/// are. Channels beyond the last formula see nothing, and those that a record lacks have no information.
#[derive(Clone, Debug)]
pub struct FormulaSensor<const D: usize> {
    observation: Observation,
    /// The number of live states.
    states: usize,
    /// The components that are angles, where they are seen as they are.
    angles: [bool; D],
}

impl<const D: usize> FormulaSensor<D> {
    /// The sensors that were given with a model's equations.
    pub fn of(family: &FormulaFamily<D>) -> Self {
        let (states, mut angles) = (family.states(), [false; D]);
        for (own, (_, angle)) in angles.iter_mut().zip(&states) {
            *own = *angle;
        }
        Self { observation: family.observation().clone(), states: states.len(), angles }
    }
}

impl<const D: usize> Sensor<D, D> for FormulaSensor<D> {
    const PARAMETERS: &'static [(&'static str, &'static str)] = &[];

    fn channels(&self) -> usize {
        if self.observation.is_empty() { self.states } else { self.observation.len() }
    }

    fn is_angle(&self, channel: usize) -> bool {
        match self.observation.is_empty() {
            true => self.angles[channel],
            false => self.observation.is_angle(channel),
        }
    }

    fn delay(&self, channel: usize) -> Option<usize> {
        self.observation.delay(channel)
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, _camera: &[S], at: &Moment<'_, S, D>) -> [S; D] {
        match self.observation.is_empty() {
            true => *at.x,
            false => self.observation.values(at.t, at.x, at.rate, at.parameters),
        }
    }
}

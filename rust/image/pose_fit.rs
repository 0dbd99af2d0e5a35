//! The pose of a marked rigid disk in a picture, by Gauss-Newton steps from a nearby one.

use nalgebra::{Complex, Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use super::coverage::{Local, Mark, Motion, Pose};
use super::lens::Lens;
use super::mark_localization::{Appearance, MarkObservation, Plane, locate};

/// How fast the disk moves at mid-exposure, for rows that are exposed at times of their own.
#[derive(Clone, Copy, Debug, Default)]
pub struct PoseRate {
    /// The velocity of its centre [pixels/s].
    pub rate: [f64; 2],
    /// Of turning [rad/s].
    pub spin: f64,
    /// Acceleration of its centre [pixels/s^2].
    pub bending: [f64; 2],
    /// Of turning [rad/s^2].
    pub twisting: f64,
}

/// The marked disk before its camera.
pub struct MarkSet<'a> {
    pub marks: &'a [Mark],
    /// Amount of light of each code about each mark: a mix of its colour and the disk's has a code of its own.
    pub lights: &'a [[f64; 256]],
    pub lens: Lens,
    /// Time between the exposures of neighbouring rows [s].
    pub per_row: f64,
    /// Light by which a mark must differ from the disk.
    pub faint: f64,
}

/// A correction of the pose.
pub struct PoseStep {
    /// Pixels, pixels, rad.
    pub change: [f64; 3],
    /// Its information for unit noise.
    pub information: Matrix3<f64>,
    /// The residual offset of each mark [pixels]; None if it is not visible.
    pub leftover: Vec<Option<[f64; 2]>>,
    /// The square of that in units of its noise.
    pub chi2: Vec<Option<f64>>,
}

/// The input and the result of the last round.
pub struct PoseFit {
    pub pose: Pose,
    pub sightings: Vec<Option<MarkObservation>>,
    pub used: Vec<bool>,
    /// None where fewer than two marks hold the disk.
    pub step: Option<PoseStep>,
    /// Size of the last correction, in pixels at the marks.
    pub moved: f64,
}

const LEAST: f64 = 0.15; // share of a mark's edges below which it is not used
const PALE: f64 = 0.5; // how far from 1 a used mark's contrast may be
const STREAKY: f64 = 0.01; // share of a streak's length by which its ends are not where they should be
const SETTLED: f64 = 0.04; // pixels; the next correction would be far smaller
const WIDE: (f64, f64) = (3.0, 0.5); // blur per pixel of tolerance above this: farther marks come into reach

/// Moves `pose` onto the picture, each round with its tolerance [pixels] for the places of edges: a large one
/// reaches further. The mark `without` is left out.
pub fn align(
    plane: Plane<'_>,
    look: &Appearance<'_>,
    body: &MarkSet<'_>,
    pose: Pose,
    motion: &Motion,
    speed: &PoseRate,
    rounds: &[f64],
    without: Option<usize>,
    keep: bool,
) -> PoseFit {
    let reach = body.marks.iter().map(|m| m.place[0].hypot(m.place[1])).fold(0.0, f64::max);
    let path = motion.shift[0].hypot(motion.shift[1]) + motion.turn.abs() * reach;
    let mut fit = PoseFit { pose, sightings: Vec::new(), used: Vec::new(), step: None, moved: f64::INFINITY };
    for &tolerance in rounds {
        let wide = Appearance {
            psf: look.psf.hypot(WIDE.0 * (tolerance - WIDE.1).max(0.0)),
            misfit: tolerance.hypot(STREAKY * path),
            ..*look
        };
        let each = body.marks.iter().zip(body.lights).map(|(mark, light)| {
            if mark.level.abs() < body.faint {
                return None;
            }
            let (pose, local) = seen_at(mark, body, &fit.pose, speed, plane.height);
            locate(plane, &Appearance { light, ..wide }, mark, &pose, motion, &local, keep)
        });
        fit.sightings = each.collect();
        fit.used = (fit.sightings.iter().enumerate())
            .map(|(k, s)| {
                let clear = |s: &MarkObservation| s.complete > LEAST && (s.gain - 1.0).abs() < PALE;
                s.as_ref().is_some_and(clear) && without != Some(k)
            })
            .collect();
        fit.step = solve(body.marks, &fit.sightings, fit.pose.angle, &fit.used, reach);
        let Some(step) = &fit.step else { return fit };
        let [u, v, angle] = step.change;
        fit.pose.centre[0] += u;
        fit.pose.centre[1] += v;
        fit.pose.angle += angle;
        fit.moved = u.hypot(v).hypot(angle * reach);
        // rounds with the last one's tolerance only repeat it
        if fit.moved < SETTLED && Some(&tolerance) == rounds.last() {
            break;
        }
    }
    fit
}

/// The pose that a mark's rows of the picture see, and the map there. A rolling shutter sees each row at
/// a time of its own; within a mark that is a shear.
fn seen_at(mark: &Mark, body: &MarkSet<'_>, pose: &Pose, speed: &PoseRate, height: usize) -> (Pose, Local) {
    let place = Complex::new(mark.place[0], mark.place[1]);
    let start = Complex::new(pose.centre[0], pose.centre[1]);
    let rate = Complex::new(speed.rate[0], speed.rate[1]);
    let bending = Complex::new(speed.bending[0], speed.bending[1]);
    let (mut centre, mut angle) = (start, pose.angle);
    let mut at = centre + place * Complex::cis(angle);
    if body.per_row == 0.0 {
        return (*pose, body.lens.local(at));
    }
    let mut late = 0.0;
    for _ in 0..3 {
        late = body.per_row * (body.lens.picture(at).im + 0.5 - height as f64 / 2.0);
        centre = start + (rate + bending * (0.5 * late)) * late;
        angle = pose.angle + (speed.spin + 0.5 * speed.twisting * late) * late;
        at = centre + place * Complex::cis(angle);
    }
    let mut local = body.lens.local(at);
    let moving =
        rate + bending * late + Complex::new(0.0, speed.spin + speed.twisting * late) * (at - centre);
    local.slope[1] -= moving.re * body.per_row;
    local.slope[3] -= moving.im * body.per_row;
    (Pose { centre: [centre.re, centre.im], angle }, local)
}

/// The least-squares correction from the marks used; None where fewer than two, or they do not determine it.
fn solve(
    marks: &[Mark],
    sightings: &[Option<MarkObservation>],
    angle: f64,
    used: &[bool],
    reach: f64,
) -> Option<PoseStep> {
    let turn = Complex::new(0.0, 1.0) * Complex::cis(angle);
    let maps: Vec<_> = (marks.iter())
        .map(|m| {
            let arm = Complex::new(m.place[0], m.place[1]) * turn;
            Matrix2x3::new(1.0, 0.0, arm.re, 0.0, 1.0, arm.im)
        })
        .collect();
    let facts: Vec<_> = (sightings.iter())
        .map(|s| {
            let s = s.as_ref()?;
            let [a, b, c, d] = s.information;
            Some((Vector2::from(s.offset), Matrix2::new(a, b, c, d)))
        })
        .collect();
    let (mut normal, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
    for ((map, fact), _) in maps.iter().zip(&facts).zip(used).filter(|(_, used)| **used) {
        let (offset, information) = fact.as_ref()?;
        let weighted = map.transpose() * information;
        normal += weighted * map;
        right += weighted * offset;
        count += 1;
    }
    if count < 2 || !(reach > 0.0 && normal.iter().all(|x| x.is_finite())) {
        return None;
    }
    // so that pixels compare with pixels
    let scale = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / reach));
    let eigen = (scale * normal * scale).symmetric_eigenvalues();
    if eigen.min() <= 1e-4 * eigen.max().max(1e-12) {
        return None;
    }
    let change = normal.lu().solve(&right)?;
    let left: Vec<_> = (maps.iter().zip(&facts))
        .map(|(map, fact)| fact.as_ref().map(|(offset, information)| (offset - map * change, information)))
        .collect();
    Some(PoseStep {
        change: change.into(),
        information: normal,
        leftover: left.iter().map(|l| l.as_ref().map(|(off, _)| (*off).into())).collect(),
        chi2: left.iter().map(|l| l.as_ref().map(|(off, info)| off.dot(&(*info * off)))).collect(),
    })
}

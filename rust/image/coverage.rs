//! The share of each pixel that a mark covers, averaged over an exposure.

use crate::scalar::{InstructionSet, Isa, Work};

/// A rectangular mark in the body frame of the disk, in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    /// Its centre.
    pub place: [f64; 2],
    /// Half the lengths of its sides.
    pub half: [f64; 2],
    /// Orientation of its first side against the body frame.
    pub turn: f64,
    /// Its light minus that of the disk.
    pub level: f64,
}

/// Where the disk is at mid-exposure: its centre in its plane, pixels; its angle.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub centre: [f64; 2],
    pub angle: f64,
}

/// How it moves: at the share s of the exposure, -1/2 to 1/2, it is off by `s shift + s^2 bend` pixels
/// and `s turn + s^2 twist` rad.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    pub shift: [f64; 2],
    pub bend: [f64; 2],
    pub turn: f64,
    pub twist: f64,
}

/// The map from the picture to the plane of the disk about one point.
#[derive(Clone, Copy, Debug)]
pub struct Local {
    pub picture: [f64; 2],
    pub plane: [f64; 2],
    /// d plane / d picture, by rows.
    pub slope: [f64; 4],
}

impl Local {
    /// The picture point of a nearby point of the plane.
    #[inline(always)]
    pub fn back(&self, plane: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d] = self.slope;
        let (x, y) = (plane[0] - self.plane[0], plane[1] - self.plane[1]);
        let det = a * d - b * c;
        [self.picture[0] + (d * x - b * y) / det, self.picture[1] + (a * y - c * x) / det]
    }
}

/// Rows from, to, columns from, to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub rows: (usize, usize),
    pub columns: (usize, usize),
}

impl Window {
    pub fn height(&self) -> usize {
        self.rows.1.saturating_sub(self.rows.0)
    }
    pub fn width(&self) -> usize {
        self.columns.1.saturating_sub(self.columns.0)
    }
}

/// Where the mark's centre is in the plane at the share `s` of the exposure, and the disk's angle.
#[inline(always)]
fn at(mark: &Mark, pose: &Pose, motion: &Motion, s: f64) -> ([f64; 2], f64) {
    let angle = pose.angle + s * (motion.turn + s * motion.twist);
    let (sine, cosine) = angle.sin_cos();
    let [x, y] = mark.place;
    let place = [
        pose.centre[0] + s * (motion.shift[0] + s * motion.bend[0]) + cosine * x - sine * y,
        pose.centre[1] + s * (motion.shift[1] + s * motion.bend[1]) + sine * x + cosine * y,
    ];
    (place, angle)
}

/// The pixels that hold the mark over the exposure and `margin` more, within a picture of that height and width.
pub fn window(
    mark: &Mark,
    pose: &Pose,
    motion: &Motion,
    local: &Local,
    shape: (usize, usize),
    margin: f64,
) -> Window {
    let reach = mark.half[0].hypot(mark.half[1]) + margin;
    let ends = [-0.5, 0.0, 0.5].map(|s| local.back(at(mark, pose, motion, s).0));
    let range = |k: usize, size: usize| {
        let low = ends.iter().fold(f64::INFINITY, |m, e| m.min(e[k]));
        let high = ends.iter().fold(f64::NEG_INFINITY, |m, e| m.max(e[k]));
        // `as` takes what is not finite or out of range for the nearest bound
        let from = (low - reach).max(0.0) as usize;
        (from.min(size), ((high + reach + 2.0).max(0.0) as usize).min(size))
    };
    Window { rows: range(1, shape.0), columns: range(0, shape.1) }
}

/// The share of each pixel of a window, by rows, that the mark covers on average over the exposure.
///
/// The picture's blur is Gaussian with the standard deviation `psf` pixels.
pub fn coverage(
    mark: &Mark,
    pose: &Pose,
    motion: &Motion,
    psf: f64,
    window: Window,
    local: &Local,
) -> Vec<f64> {
    let mut total = vec![0.0_f32; window.height() * window.width()];
    Isa::best().run(ExposureIntegral { mark, pose, motion, psf, window, local, total: &mut total });
    total.into_iter().map(f64::from).collect()
}

/// The mark's copies along its path, added up.
pub(super) struct ExposureIntegral<'a> {
    pub mark: &'a Mark,
    pub pose: &'a Pose,
    pub motion: &'a Motion,
    pub psf: f64,
    pub window: Window,
    pub local: &'a Local,
    pub total: &'a mut [f32],
}

const MOST_COPIES: f64 = 160.0;

impl Work for ExposureIntegral<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let Self { mark, pose, motion, psf, window, local, total } = self;
        let (first, _) = at(mark, pose, motion, -0.5);
        let (middle, _) = at(mark, pose, motion, 0.0);
        let (last, _) = at(mark, pose, motion, 0.5);
        let path = (middle[0] - first[0]).hypot(middle[1] - first[1])
            + (last[0] - middle[0]).hypot(last[1] - middle[1]);
        let copies = (path / (1.5 * psf + 0.8)).ceil().clamp(1.0, MOST_COPIES);
        let count = copies as usize;
        for k in 0..count {
            let s = (k as f64 + 0.5) / copies - 0.5;
            // its place is the mean of its part, which lies off the middle where the path bends: of s^2 that is
            // s^2 + 1/(12 n^2)
            let off = 1.0 / (12.0 * copies * copies);
            let bent = Pose {
                centre: [pose.centre[0] + off * motion.bend[0], pose.centre[1] + off * motion.bend[1]],
                angle: pose.angle + off * motion.twist,
            };
            let (centre, angle) = at(mark, &bent, motion, s);
            // each copy is smeared over its part of the path: a box of that length has its variance over 12
            let (from, _) = at(mark, pose, motion, s - 0.5 / copies);
            let (to, _) = at(mark, pose, motion, s + 0.5 / copies);
            let step = [to[0] - from[0], to[1] - from[1]];
            add(mark, psf, window, local, centre, angle + mark.turn, step, (1.0 / copies) as f32, total);
        }
    }
}

/// Adds one copy of the mark.
#[inline(always)]
fn add(
    mark: &Mark,
    psf: f64,
    window: Window,
    local: &Local,
    centre: [f64; 2],
    angle: f64,
    step: [f64; 2],
    share: f32,
    total: &mut [f32],
) {
    let (d, c) = angle.sin_cos();
    let blur = |along: f64| 2.646 * (psf * psf + along * along / 12.0).sqrt();
    let wide = [blur(c * step[0] + d * step[1]), blur(c * step[1] - d * step[0])];
    let [uu, uv, vu, vv] = local.slope;
    let middle = local.back(centre);
    // half the diagonal in the picture: what a tilted camera magnifies is not much
    let reach = 1.25 * (mark.half[0] + wide[0]).hypot(mark.half[1] + wide[1]) + 1.0;
    let clip = |x: f64, (from, to): (usize, usize)| (x.max(0.0) as usize).clamp(from, to);
    let rows = clip(middle[1] - reach, window.rows)..clip(middle[1] + reach + 1.0, window.rows);
    let columns = clip(middle[0] - reach, window.columns)..clip(middle[0] + reach + 1.0, window.columns);
    let inverse = [(1.0 / wide[0]) as f32, (1.0 / wide[1]) as f32];
    let half = [mark.half[0] as f32, mark.half[1] as f32];
    let (du0, width) = (columns.start as f64 - middle[0], window.width());
    let (along_u, across_u) = ((c * uu + d * vu) as f32, (c * vu - d * uu) as f32);
    for row in rows {
        let dv = row as f64 - middle[1];
        // from the copy's centre, to its pixel's row and first column, in the mark's own directions
        let (pu, pv) = (uu * du0 + uv * dv, vu * du0 + vv * dv);
        let (along, across) = ((c * pu + d * pv) as f32, (c * pv - d * pu) as f32);
        let begin = (row - window.rows.0) * width + (columns.start - window.columns.0);
        for (k, pixel) in total[begin..begin + columns.len()].iter_mut().enumerate() {
            let u = k as f32;
            let a = slab(along + along_u * u, half[0], inverse[0]);
            let b = slab(across + across_u * u, half[1], inverse[1]);
            *pixel += share * a * b;
        }
    }
}

/// Blurred indicator of |x| < half: the quintic smooth step of equal variance replaces the error function.
#[inline(always)]
fn slab(x: f32, half: f32, inverse: f32) -> f32 {
    let z = ((half - x.abs()) * inverse).clamp(-1.0, 1.0);
    let square = z * z;
    0.5 + z * (0.9375 + square * (0.1875 * square - 0.625))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Local = Local { picture: [0.0; 2], plane: [0.0; 2], slope: [1.0, 0.0, 0.0, 1.0] };
    const ALL: Window = Window { rows: (0, 120), columns: (0, 160) };

    fn mark() -> Mark {
        Mark { place: [30.0, -4.0], half: [9.0, 7.0], turn: 0.3, level: -100.0 }
    }

    #[test]
    fn a_streak_keeps_the_marks_area_and_lies_about_the_mean_of_its_path() {
        let pose = Pose { centre: [50.0, 60.0], angle: 0.2 };
        let motion = Motion { shift: [30.0, -8.0], bend: [4.0, 6.0], turn: 0.3, twist: 0.1 };
        let cover = coverage(&mark(), &pose, &motion, 0.8, ALL, &PLAIN);
        let area: f64 = cover.iter().sum();
        // single precision and pixels as points of a smooth function
        assert!((area / (18.0 * 14.0) - 1.0).abs() < 2e-4, "{area}");
        let mut mean = [0.0; 2];
        for (k, c) in cover.iter().enumerate() {
            mean[0] += c * (k % 160) as f64 / area;
            mean[1] += c * (k / 160) as f64 / area;
        }
        let fine = 20_000;
        let mut path = [0.0; 2];
        for k in 0..fine {
            let (p, _) = at(&mark(), &pose, &motion, (k as f64 + 0.5) / fine as f64 - 0.5);
            path = [path[0] + p[0] / fine as f64, path[1] + p[1] / fine as f64];
        }
        // A copy on an arc of 30 pixels' radius that turns by 0.3/16 stands off the chord's mean by 30 (0.3/16)^2/24;
        // single precision does the rest.
        assert!((mean[0] - path[0]).abs() < 1e-3 && (mean[1] - path[1]).abs() < 1e-3, "{mean:?} {path:?}");
    }

    #[test]
    fn a_mark_that_comes_and_goes_is_at_the_mean_of_its_path() {
        let pose = Pose { centre: [50.0, 60.0], angle: 0.2 };
        let motion = Motion { shift: [0.3, 0.0], bend: [1.2, -0.6], twist: 0.02, ..Motion::default() };
        let cover = coverage(&mark(), &pose, &motion, 0.8, ALL, &PLAIN);
        let area: f64 = cover.iter().sum();
        let mut mean = [0.0; 2];
        for (k, c) in cover.iter().enumerate() {
            mean[0] += c * (k % 160) as f64 / area;
            mean[1] += c * (k / 160) as f64 / area;
        }
        let still = coverage(&mark(), &pose, &Motion::default(), 0.8, ALL, &PLAIN);
        let area: f64 = still.iter().sum();
        let (sine, cosine) = 0.2_f64.sin_cos();
        let [x, y] = mark().place;
        let arm = [cosine * x - sine * y, sine * x + cosine * y];
        for (k, c) in still.iter().enumerate() {
            mean[0] -= c * (k % 160) as f64 / area;
            mean[1] -= c * (k / 160) as f64 / area;
        }
        let path = [(1.2 - 0.02 * arm[1]) / 12.0, (-0.6 + 0.02 * arm[0]) / 12.0];
        // a tenth of a pixel, which a single copy at the middle would miss; the arc's own curvature is 1e-5
        assert!((mean[0] - path[0]).abs() < 1e-3 && (mean[1] - path[1]).abs() < 1e-3, "{mean:?} {path:?}");
    }

    #[test]
    fn few_smeared_copies_are_as_good_as_many() {
        let pose = Pose { centre: [50.0, 60.0], angle: 0.2 };
        let motion = Motion { shift: [40.0, 10.0], turn: 0.2, ..Motion::default() };
        let few = coverage(&mark(), &pose, &motion, 0.8, ALL, &PLAIN);
        let mut many = vec![0.0; few.len()];
        let parts = 16;
        for k in 0..parts {
            let s = (f64::from(k) + 0.5) / f64::from(parts) - 0.5;
            let (here, angle) = (
                [pose.centre[0] + s * motion.shift[0], pose.centre[1] + s * motion.shift[1]],
                pose.angle + s * motion.turn,
            );
            let part = Motion {
                shift: [motion.shift[0] / f64::from(parts), motion.shift[1] / f64::from(parts)],
                turn: motion.turn / f64::from(parts),
                ..Motion::default()
            };
            let cover = coverage(&mark(), &Pose { centre: here, angle }, &part, 0.8, ALL, &PLAIN);
            for (m, c) in many.iter_mut().zip(cover) {
                *m += c / f64::from(parts);
            }
        }
        // a smeared copy's corners are rounded a little differently: half a code of a hundred
        let worst = few.iter().zip(&many).fold(0.0_f64, |w, (a, b)| w.max((a - b).abs()));
        assert!(worst < 5e-3, "{worst}");
    }
}

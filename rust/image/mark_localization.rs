//! Where in a picture a mark is against where it was expected.

use nalgebra::{Matrix2, Matrix4, SMatrix, Vector4};

use super::coverage::{ExposureIntegral, Local, Mark, Motion, Pose, Window, window};
use crate::inverse::invert;
use crate::scalar::{InstructionSet, Isa, Work};

/// A picture: its brightness codes by rows, and where nothing stands before the disk.
#[derive(Clone, Copy)]
pub struct Plane<'a> {
    pub codes: &'a [u8],
    pub view: &'a [bool],
    /// Factors of each pixel's light that make the bare disk equally bright everywhere; empty if it is.
    pub even: &'a [f32],
    pub height: usize,
    pub width: usize,
}

/// How the marked disk looks in a film.
#[derive(Clone, Copy)]
pub struct Appearance<'a> {
    /// Amount of light of each code.
    pub light: &'a [f64; 256],
    /// Blur of lens and pixels, standard deviation in pixels.
    pub psf: f64,
    /// The noise of the light on a flat part of the disk.
    pub noise: f64,
    /// Pixels by which edges may differ from the ideal shape.
    pub misfit: f64,
    /// How far from 1 the contrast may be.
    pub gain_slack: f64,
    /// Distance from the disk's centre up to which the picture shows the disk, in pixels of the picture.
    pub rim: f64,
}

/// The estimate from one mark.
pub struct MarkObservation {
    /// How far it is off, in pixels of the plane.
    pub offset: [f64; 2],
    /// The information about that, by rows.
    pub information: [f64; 4],
    /// The share of its edges that is seen as expected.
    pub complete: f64,
    /// The share of them before which nothing is known to stand.
    pub in_view: f64,
    /// Residual light over the window.
    pub rms: f64,
    /// Contrast against that expected.
    pub gain: f64,
    pub window: Window,
    /// Weights and residuals of the window's pixels, by rows, where asked for.
    pub pixels: Option<(Vec<f64>, Vec<f64>)>,
}

const MARGIN: f64 = 5.0;
const SMALLEST: usize = 6; // pixels along a side of a window
const FEWEST: usize = 25; // pixels that tell anything
const ROUNDS: usize = 3;
const EXPLAINED: f32 = 1.0 / (6.0 * 6.0); // beyond six standard deviations a pixel shows something else

/// Finds the offset of a mark by least squares on the visible pixels.
///
/// The light in the window is modelled as white + level (gain c - du dc/du - dv dc/dv), with white, gain, du
/// and dv free. Pixels that nothing of this explains lose their weight. None where too little is seen.
pub fn locate(
    plane: Plane<'_>,
    look: &Appearance<'_>,
    mark: &Mark,
    pose: &Pose,
    motion: &Motion,
    local: &Local,
    keep: bool,
) -> Option<MarkObservation> {
    let window = window(mark, pose, motion, local, (plane.height, plane.width), MARGIN);
    if window.height() < SMALLEST || window.width() < SMALLEST {
        return None;
    }
    Isa::best().run(Locate { plane, look, mark, pose, motion, local, window, keep })
}

struct Locate<'a> {
    plane: Plane<'a>,
    look: &'a Appearance<'a>,
    mark: &'a Mark,
    pose: &'a Pose,
    motion: &'a Motion,
    local: &'a Local,
    window: Window,
    keep: bool,
}

impl Work for Locate<'_> {
    type Output = Option<MarkObservation>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Option<MarkObservation> {
        let Self { plane, look, mark, pose, motion, local, window, keep } = self;
        let (height, width) = (window.height(), window.width());
        let size = height * width;
        let mut cover = vec![0.0_f32; padded(size)];
        let total = &mut cover[..size];
        ExposureIntegral { mark, pose, motion, psf: look.psf, window, local, total }.run::<V>();
        let mut slope_u = vec![0.0_f32; cover.len()];
        let mut slope_v = vec![0.0_f32; cover.len()];
        slopes(&cover, height, width, &mut slope_u, &mut slope_v);
        // what each pixel is trusted before its own value is looked at; nothing beyond the window's last
        let mut precise = vec![0.0_f32; cover.len()];
        let mut patch = vec![0.0_f32; cover.len()];
        let middle = local.back(pose.centre);
        let rim = look.rim - 0.5 * motion.shift[0].hypot(motion.shift[1]);
        let light = look.light.map(|x| x as f32);
        let mut seen = 0_usize;
        for i in 0..height {
            let row = window.rows.0 + i;
            let begin = row * plane.width + window.columns.0;
            let away_v = row as f64 - middle[1];
            // the disk's columns in this row
            let chord = (rim * rim - away_v * away_v).max(0.0).sqrt();
            let left = (middle[0] - chord).ceil() - window.columns.0 as f64;
            let right = (middle[0] + chord).floor() - window.columns.0 as f64;
            let (left, right) = (left.max(0.0) as usize, ((right + 1.0).max(0.0) as usize).min(width));
            let codes = &plane.codes[begin..begin + width];
            for (p, &code) in patch[i * width..].iter_mut().zip(codes) {
                *p = light[usize::from(code)];
            }
            if !plane.even.is_empty() {
                for (p, &even) in patch[i * width..].iter_mut().zip(&plane.even[begin..begin + width]) {
                    *p *= even;
                }
            }
            if left < right {
                let view = &plane.view[begin + left..begin + right];
                seen += view.iter().filter(|&&open| open).count();
                for (p, &open) in precise[i * width + left..].iter_mut().zip(view) {
                    *p = f32::from(u8::from(open));
                }
            }
        }
        let (cover, slope_u, slope_v) = (lanes(&cover), lanes(&slope_u), lanes(&slope_v));
        let patch = lanes(&patch);
        let total = dot(slope_u, slope_u) + dot(slope_v, slope_v);
        let visible = {
            let open = lanes(&precise);
            dot(&product(open, slope_u), slope_u) + dot(&product(open, slope_v), slope_v)
        };
        if total <= 0.0 || seen < FEWEST {
            return None;
        }
        let edge = ((look.misfit * mark.level) * (look.misfit * mark.level)) as f32;
        let noise = (look.noise * look.noise) as f32;
        for (p, (u, v)) in precise.as_chunks_mut::<LANES>().0.iter_mut().zip(slope_u.iter().zip(slope_v)) {
            for l in 0..LANES {
                p[l] /= noise + edge * (u[l] * u[l] + v[l] * v[l]);
            }
        }
        let precise = lanes(&precise);
        let mut weight = precise.to_vec();
        let mut residual = vec![[0.0_f32; LANES]; weight.len()];
        let slack = look.gain_slack.powi(-2);
        let prior = Matrix4::from_diagonal(&Vector4::new(1e-12, slack, 1e-12, 1e-12));
        let (mut normal, mut x) = (prior, Vector4::zeros());
        for _ in 0..ROUNDS {
            let sums = normal_equations(&weight, cover, slope_u, slope_v, patch, mark.level);
            normal = sums.0 + prior;
            x = normal.lu().solve(&(sums.1 + prior.column(1)))?;
            let level = mark.level;
            let share = [x[0], level * x[1], level * x[2], level * x[3]].map(|x| x as f32);
            let columns = cover.iter().zip(slope_u.iter().zip(slope_v));
            let given = patch.iter().zip(precise);
            let mut used = [0.0_f32; LANES];
            for ((r, w), ((c, (u, v)), (y, p))) in
                residual.iter_mut().zip(&mut weight).zip(columns.zip(given))
            {
                for l in 0..LANES {
                    let rest = y[l] - (share[0] + share[1] * c[l] - share[2] * u[l] - share[3] * v[l]);
                    let inside = (1.0 - rest * rest * p[l] * EXPLAINED).max(0.0);
                    r[l] = rest;
                    w[l] = p[l] * inside * inside;
                    used[l] += if w[l] > 0.0 { 1.0 } else { 0.0 };
                }
            }
            if used.iter().sum::<f32>() < FEWEST as f32 {
                return None;
            }
        }
        let mut whole = [0.0_f32; LANES];
        for ((w, p), (u, v)) in weight.iter().zip(precise).zip(slope_u.iter().zip(slope_v)) {
            for l in 0..LANES {
                let e2 = u[l] * u[l] + v[l] * v[l];
                whole[l] += if w[l] > 0.1 * p[l] { e2 } else { 0.0 };
            }
        }
        let complete = whole.iter().map(|&x| f64::from(x)).sum::<f64>();
        let squares = dot(&product(&weight, &residual), &residual);
        let covariance = inverted(normal)?.fixed_view::<2, 2>(2, 2).into_owned();
        let [a, b, c, d] = local.slope;
        let map = Matrix2::new(a, b, c, d);
        let information = inverted(map * covariance * map.transpose())?;
        let offset = map * x.fixed_rows::<2>(2);
        let flat = |x: &[[f32; LANES]]| x.as_flattened()[..size].iter().map(|&x| f64::from(x)).collect();
        Some(MarkObservation {
            offset: [offset[0], offset[1]],
            information: [information[(0, 0)], information[(0, 1)], information[(1, 0)], information[(1, 1)]],
            complete: complete / total,
            in_view: visible / total,
            rms: (squares / sum(&weight)).sqrt(),
            gain: x[1],
            window,
            pixels: keep.then(|| (flat(&weight), flat(&residual))),
        })
    }
}

/// The inverse, if there is one.
fn inverted<const N: usize>(mut matrix: SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    invert(matrix.as_mut_slice(), N).then_some(matrix)
}

/// Pixels that go together. Sums are kept apart in as many, so that any instruction set adds in one order.
const LANES: usize = 16;

fn padded(size: usize) -> usize {
    size.next_multiple_of(LANES)
}

#[inline(always)]
fn lanes(x: &[f32]) -> &[[f32; LANES]] {
    x.as_chunks().0
}

#[inline(always)]
fn sum(a: &[[f32; LANES]]) -> f64 {
    let mut sums = [0.0_f32; LANES];
    for a in a {
        for l in 0..LANES {
            sums[l] += a[l];
        }
    }
    sums.iter().map(|&x| f64::from(x)).sum()
}

#[inline(always)]
fn dot(a: &[[f32; LANES]], b: &[[f32; LANES]]) -> f64 {
    let mut sums = [0.0_f32; LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sums[l] += a[l] * b[l];
        }
    }
    sums.iter().map(|&x| f64::from(x)).sum()
}

#[inline(always)]
fn product(a: &[[f32; LANES]], b: &[[f32; LANES]]) -> Vec<[f32; LANES]> {
    let mut out = a.to_vec();
    for (a, b) in out.iter_mut().zip(b) {
        for l in 0..LANES {
            a[l] *= b[l];
        }
    }
    out
}

/// Central differences, one-sided at the window's edge.
#[inline(always)]
fn slopes(cover: &[f32], height: usize, width: usize, slope_u: &mut [f32], slope_v: &mut [f32]) {
    for i in 0..height {
        let row = &cover[i * width..(i + 1) * width];
        let out = &mut slope_u[i * width..(i + 1) * width];
        for (o, (next, last)) in out[1..width - 1].iter_mut().zip(row[2..].iter().zip(row)) {
            *o = 0.5 * (next - last);
        }
        out[0] = row[1] - row[0];
        out[width - 1] = row[width - 1] - row[width - 2];
        let (up, down) = (i.saturating_sub(1), (i + 1).min(height - 1));
        let share = 1.0 / (down - up) as f32;
        let (above, below) = (&cover[up * width..(up + 1) * width], &cover[down * width..(down + 1) * width]);
        let out = &mut slope_v[i * width..(i + 1) * width];
        for (o, (below, above)) in out.iter_mut().zip(below.iter().zip(above)) {
            *o = share * (below - above);
        }
    }
}

type Lanes<'a> = &'a [[f32; LANES]];

/// The weighted normal equations of the four unknowns.
#[inline(always)]
fn normal_equations(
    w: Lanes<'_>,
    c: Lanes<'_>,
    u: Lanes<'_>,
    v: Lanes<'_>,
    y: Lanes<'_>,
    level: f64,
) -> (Matrix4<f64>, Vector4<f64>) {
    let (wc, wu, wv) = (product(w, c), product(w, u), product(w, v));
    let (cc, cu, cv) = (dot(&wc, c), dot(&wc, u), dot(&wc, v));
    let (uu, uv, vv) = (dot(&wu, u), dot(&wu, v), dot(&wv, v));
    let (oc, ou, ov) = (sum(&wc), sum(&wu), sum(&wv));
    #[rustfmt::skip]
    let normal = Matrix4::new(
        sum(w), oc, -ou, -ov,
        oc, cc, -cu, -cv,
        -ou, -cu, uu, uv,
        -ov, -cv, uv, vv,
    );
    let right = Vector4::new(dot(w, y), dot(&wc, y), -dot(&wu, y), -dot(&wv, y));
    let scale = Matrix4::from_diagonal(&Vector4::new(1.0, level, level, level));
    (scale * normal * scale, scale * right)
}

#[cfg(test)]
mod tests {
    use super::super::coverage::coverage;
    use super::*;

    /// A mark half hidden by a board is found where it is, not where its visible half is.
    #[test]
    fn a_half_hidden_streak_is_found_where_it_is() {
        let (height, width) = (90, 120);
        let mark = Mark { place: [0.0; 2], half: [10.0, 10.0], turn: 0.3, level: -120.0 };
        let plain = Local { picture: [0.0; 2], plane: [0.0; 2], slope: [1.0, 0.0, 0.0, 1.0] };
        let motion = Motion { shift: [12.0, 5.0], ..Motion::default() };
        let all = Window { rows: (0, height), columns: (0, width) };
        let truth = Pose { centre: [60.4, 44.7], angle: 0.0 };
        let cover = coverage(&mark, &truth, &motion, 0.8, all, &plain);
        let hidden = 56;
        let codes: Vec<u8> = (0..height * width)
            .map(|k| if k % width < hidden { 20 } else { (180.0 + mark.level * cover[k]).round() as u8 })
            .collect();
        let view: Vec<bool> = (0..height * width).map(|k| k % width >= hidden).collect();
        let light: [f64; 256] = std::array::from_fn(|k| k as f64);
        let look =
            Appearance { light: &light, psf: 0.8, noise: 1.0, misfit: 0.12, gain_slack: 0.1, rim: 300.0 };
        let mut pose = Pose { centre: [60.0, 45.0], angle: 0.0 };
        let plane = Plane { codes: &codes, view: &view, even: &[], height, width };
        let mut complete = 1.0;
        for _ in 0..6 {
            let seen = locate(plane, &look, &mark, &pose, &motion, &plain, false).expect("it is seen");
            pose.centre = [pose.centre[0] + seen.offset[0], pose.centre[1] + seen.offset[1]];
            complete = seen.complete;
        }
        // codes are whole numbers: 0.3 of 120 on some fifty pixels of edge
        let off = (pose.centre[0] - 60.4).hypot(pose.centre[1] - 44.7);
        assert!(off < 0.01, "{off}");
        assert!(complete < 0.8);
    }
}

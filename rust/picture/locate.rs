//! Where in a picture a mark is against where it was expected.

use nalgebra::{Matrix2, Matrix4, Vector4};

use super::coverage::{Expose, Local, Mark, Motion, Pose, Window, window};
use crate::scalar::{Instructions, Isa, Work};

/// A picture: its brightness codes by rows, and where nothing stands before the disk.
#[derive(Clone, Copy)]
pub struct Plane<'a> {
    pub codes: &'a [u8],
    pub view: &'a [bool],
    pub height: usize,
    pub width: usize,
}

/// How the marked disk looks in a film.
#[derive(Clone, Copy)]
pub struct Look<'a> {
    /// Amount of light of each code.
    pub light: &'a [f64; 256],
    /// Blur of lens and pixels, standard deviation in pixels.
    pub psf: f64,
    /// Of the light on a flat part of the disk.
    pub noise: f64,
    /// Pixels by which edges may differ from the ideal shape.
    pub misfit: f64,
    /// How far from 1 the contrast may be.
    pub gain_slack: f64,
    /// Distance from the disk's centre up to which the picture shows the disk, in pixels of the picture.
    pub rim: f64,
}

/// What one mark says.
pub struct Sighting {
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
    /// Of each pixel of the window.
    pub weight: Vec<f64>,
    pub residual: Vec<f64>,
}

const MARGIN: f64 = 5.0;
const SMALLEST: usize = 6; // pixels along a side of a window
const FEWEST: usize = 25; // pixels that tell anything
const ROUNDS: usize = 3;
const EXPLAINED: f64 = 6.0; // standard deviations beyond which a pixel shows something else

/// Finds the offset of a mark by least squares on the visible pixels.
///
/// The light in the window is modelled as white + level (gain c - du dc/du - dv dc/dv), with white, gain, du
/// and dv free. Pixels that nothing of this explains lose their weight. None where too little is seen.
pub fn locate(
    plane: Plane<'_>,
    look: &Look<'_>,
    mark: &Mark,
    pose: &Pose,
    motion: &Motion,
    local: &Local,
) -> Option<Sighting> {
    let window = window(mark, pose, motion, local, (plane.height, plane.width), MARGIN);
    if window.height() < SMALLEST || window.width() < SMALLEST {
        return None;
    }
    Isa::best().run(Locate { plane, look, mark, pose, motion, local, window })
}

struct Locate<'a> {
    plane: Plane<'a>,
    look: &'a Look<'a>,
    mark: &'a Mark,
    pose: &'a Pose,
    motion: &'a Motion,
    local: &'a Local,
    window: Window,
}

impl Work for Locate<'_> {
    type Output = Option<Sighting>;

    #[inline(always)]
    fn run<V: Instructions>(self) -> Option<Sighting> {
        let Self { plane, look, mark, pose, motion, local, window } = self;
        let (height, width) = (window.height(), window.width());
        let size = height * width;
        let mut cover = vec![0.0_f32; size];
        Expose { mark, pose, motion, psf: look.psf, window, local, total: &mut cover }.run::<V>();
        let mut slope_u = vec![0.0; size];
        let mut slope_v = vec![0.0; size];
        slopes(&cover, height, width, &mut slope_u, &mut slope_v);
        // what each pixel is trusted before its own value is looked at
        let middle = local.back(pose.centre);
        let rim = look.rim - 0.5 * motion.shift[0].hypot(motion.shift[1]);
        let mut precise = vec![0.0; size];
        let mut patch = vec![0.0; size];
        let (mut total, mut visible, mut seen) = (0.0, 0.0, 0_usize);
        let edge = (look.misfit * mark.level) * (look.misfit * mark.level);
        let noise = look.noise * look.noise;
        for i in 0..height {
            let row = window.rows.0 + i;
            let begin = row * plane.width + window.columns.0;
            let codes = &plane.codes[begin..begin + width];
            let view = &plane.view[begin..begin + width];
            let away_v = row as f64 - middle[1];
            let chord = rim * rim - away_v * away_v;
            for j in 0..width {
                let k = i * width + j;
                let e2 = slope_u[k] * slope_u[k] + slope_v[k] * slope_v[k];
                let away_u = (window.columns.0 + j) as f64 - middle[0];
                let open = view[j] && away_u * away_u < chord;
                total += e2;
                visible += if open { e2 } else { 0.0 };
                seen += usize::from(open);
                precise[k] = if open { 1.0 / (noise + edge * e2) } else { 0.0 };
                patch[k] = look.light[usize::from(codes[j])];
            }
        }
        if total <= 0.0 || seen < FEWEST {
            return None;
        }
        let mut weight = precise.clone();
        let mut residual = vec![0.0; size];
        let slack = look.gain_slack.powi(-2);
        let prior = Matrix4::from_diagonal(&Vector4::new(1e-12, slack, 1e-12, 1e-12));
        let (mut normal, mut x) = (prior, Vector4::zeros());
        for _ in 0..ROUNDS {
            let sums = normal_equations(&weight, &cover, &slope_u, &slope_v, &patch, mark.level);
            normal = sums.0 + prior;
            x = normal.lu().solve(&(sums.1 + prior.column(1)))?;
            let mut used = 0_usize;
            for k in 0..size {
                let fit =
                    x[0] + mark.level * (x[1] * f64::from(cover[k]) - x[2] * slope_u[k] - x[3] * slope_v[k]);
                let rest = patch[k] - fit;
                let inside = (1.0 - rest * rest * precise[k] / (EXPLAINED * EXPLAINED)).max(0.0);
                residual[k] = rest;
                weight[k] = precise[k] * inside * inside;
                used += usize::from(weight[k] != 0.0);
            }
            if used < FEWEST {
                return None;
            }
        }
        let (mut complete, mut squares, mut weights) = (0.0, 0.0, 0.0);
        for k in 0..size {
            let e2 = slope_u[k] * slope_u[k] + slope_v[k] * slope_v[k];
            complete += if weight[k] > 0.1 * precise[k] { e2 } else { 0.0 };
            squares += weight[k] * residual[k] * residual[k];
            weights += weight[k];
        }
        let covariance = normal.try_inverse()?.fixed_view::<2, 2>(2, 2).into_owned();
        let [a, b, c, d] = local.slope;
        let map = Matrix2::new(a, b, c, d);
        let information = (map * covariance * map.transpose()).try_inverse()?;
        let offset = map * x.fixed_rows::<2>(2);
        Some(Sighting {
            offset: [offset[0], offset[1]],
            information: [information[(0, 0)], information[(0, 1)], information[(1, 0)], information[(1, 1)]],
            complete: complete / total,
            in_view: visible / total,
            rms: (squares / weights).sqrt(),
            gain: x[1],
            window,
            weight,
            residual,
        })
    }
}

/// Central differences, one-sided at the window's edge.
#[inline(always)]
fn slopes(cover: &[f32], height: usize, width: usize, slope_u: &mut [f64], slope_v: &mut [f64]) {
    for i in 0..height {
        let row = &cover[i * width..(i + 1) * width];
        let out = &mut slope_u[i * width..(i + 1) * width];
        for j in 1..width - 1 {
            out[j] = 0.5 * (f64::from(row[j + 1]) - f64::from(row[j - 1]));
        }
        out[0] = f64::from(row[1]) - f64::from(row[0]);
        out[width - 1] = f64::from(row[width - 1]) - f64::from(row[width - 2]);
        let (up, down) = (i.saturating_sub(1), (i + 1).min(height - 1));
        let share = 1.0 / (down - up) as f64;
        let (above, below) = (&cover[up * width..(up + 1) * width], &cover[down * width..(down + 1) * width]);
        let out = &mut slope_v[i * width..(i + 1) * width];
        for j in 0..width {
            out[j] = share * (f64::from(below[j]) - f64::from(above[j]));
        }
    }
}

const LANES: usize = 8; // sums are kept apart in as many, so that any instruction set adds in one order

/// The weighted normal equations of the four unknowns.
#[inline(always)]
fn normal_equations(
    weight: &[f64],
    cover: &[f32],
    slope_u: &[f64],
    slope_v: &[f64],
    patch: &[f64],
    level: f64,
) -> (Matrix4<f64>, Vector4<f64>) {
    let mut sums = [[0.0_f64; LANES]; 14];
    let mut k = 0;
    while k + LANES <= weight.len() {
        for l in 0..LANES {
            let i = k + l;
            let columns = [level * f64::from(cover[i]), -level * slope_u[i], -level * slope_v[i]];
            accumulate(&mut sums, l, weight[i], columns, patch[i]);
        }
        k += LANES;
    }
    for i in k..weight.len() {
        let columns = [level * f64::from(cover[i]), -level * slope_u[i], -level * slope_v[i]];
        accumulate(&mut sums, i - k, weight[i], columns, patch[i]);
    }
    let s: [f64; 14] = std::array::from_fn(|n| sums[n].iter().sum());
    #[rustfmt::skip]
    let normal = Matrix4::new(
        s[0], s[1], s[2], s[3],
        s[1], s[4], s[5], s[6],
        s[2], s[5], s[7], s[8],
        s[3], s[6], s[8], s[9],
    );
    (normal, Vector4::new(s[10], s[11], s[12], s[13]))
}

#[inline(always)]
fn accumulate(sums: &mut [[f64; LANES]; 14], l: usize, w: f64, [c, u, v]: [f64; 3], y: f64) {
    let (wc, wu, wv) = (w * c, w * u, w * v);
    sums[0][l] += w;
    sums[1][l] += wc;
    sums[2][l] += wu;
    sums[3][l] += wv;
    sums[4][l] += wc * c;
    sums[5][l] += wc * u;
    sums[6][l] += wc * v;
    sums[7][l] += wu * u;
    sums[8][l] += wu * v;
    sums[9][l] += wv * v;
    sums[10][l] += w * y;
    sums[11][l] += wc * y;
    sums[12][l] += wu * y;
    sums[13][l] += wv * y;
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
        let look = Look { light: &light, psf: 0.8, noise: 1.0, misfit: 0.12, gain_slack: 0.1, rim: 300.0 };
        let mut pose = Pose { centre: [60.0, 45.0], angle: 0.0 };
        let plane = Plane { codes: &codes, view: &view, height, width };
        let mut complete = 1.0;
        for _ in 0..6 {
            let seen = locate(plane, &look, &mark, &pose, &motion, &plain).expect("it is seen");
            pose.centre = [pose.centre[0] + seen.offset[0], pose.centre[1] + seen.offset[1]];
            complete = seen.complete;
        }
        // codes are whole numbers: 0.3 of 120 on some fifty pixels of edge
        let off = (pose.centre[0] - 60.4).hypot(pose.centre[1] - 44.7);
        assert!(off < 0.01, "{off}");
        assert!(complete < 0.8);
    }
}

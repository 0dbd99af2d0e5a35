//! The tracker's inner loop: marks in a picture.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::image::{
    Appearance, Lens, Local, Mark, MarkSet, Motion, Plane, Pose, PoseRate, Window, align, coverage,
};

fn exactly<const N: usize>(numbers: &[f64]) -> PyResult<[f64; N]> {
    let message = || PyValueError::new_err(format!("{N} numbers are needed, not {}", numbers.len()));
    numbers.try_into().map_err(|_| message())
}

fn mark_of(row: &[f64]) -> PyResult<Mark> {
    let [u, v, first, second, turn, level] = exactly(row)?;
    Ok(Mark { place: [u, v], half: [first, second], turn, level })
}

fn pose_of(row: &[f64]) -> PyResult<Pose> {
    let [u, v, angle] = exactly(row)?;
    Ok(Pose { centre: [u, v], angle })
}

fn motion_of(row: &[f64]) -> PyResult<Motion> {
    let [shift_u, shift_v, turn, bend_u, bend_v, twist] = exactly(row)?;
    Ok(Motion { shift: [shift_u, shift_v], bend: [bend_u, bend_v], turn, twist })
}

fn local_of(row: &[f64]) -> PyResult<Local> {
    let [picture_u, picture_v, plane_u, plane_v, uu, uv, vu, vv] = exactly(row)?;
    Ok(Local { picture: [picture_u, picture_v], plane: [plane_u, plane_v], slope: [uu, uv, vu, vv] })
}

/// The share of each pixel of a window (rows from, to, columns from, to) that a mark covers; flat.
#[pyfunction]
fn mark_coverage<'py>(
    py: Python<'py>,
    mark: PyReadonlyArray1<'py, f64>,
    pose: PyReadonlyArray1<'py, f64>,
    motion: PyReadonlyArray1<'py, f64>,
    psf: f64,
    window: (usize, usize, usize, usize),
    local: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (mark, pose) = (mark_of(mark.as_slice()?)?, pose_of(pose.as_slice()?)?);
    let (motion, local) = (motion_of(motion.as_slice()?)?, local_of(local.as_slice()?)?);
    let window = Window { rows: (window.0, window.1), columns: (window.2, window.3) };
    let cover = py.detach(|| coverage(&mark, &pose, &motion, psf, window, &local));
    Ok(PyArray1::from_vec(py, cover))
}

type Pixels<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);
type Seen<'py> = (
    (f64, f64),
    (f64, f64, f64, f64),
    (f64, f64, f64, f64),
    (usize, usize, usize, usize),
    Option<Pixels<'py>>,
);
type Stepped = ([f64; 3], [[f64; 3]; 3], Vec<[f64; 2]>, Vec<f64>);
type Aligned<'py> = ((f64, f64, f64), Vec<Option<Seen<'py>>>, Vec<bool>, Option<Stepped>, f64);

/// The codes of a picture's pixels, which of them are in view, and by what the light of each is multiplied.
#[derive(FromPyObject)]
struct Picture<'py> {
    codes: PyReadonlyArray2<'py, u8>,
    view: PyReadonlyArray2<'py, bool>,
    even: Option<PyReadonlyArray2<'py, f32>>,
}

/// How the disk shows. `lights` has a row of 256 for each mark: the light of each code. `look` is psf, noise,
/// gain_slack, rim, the least contrast of a mark, the time between rows; `lens` its middle, size, curve, tilts,
/// aspect, shear.
#[derive(FromPyObject)]
struct Appearing<'py> {
    lights: PyReadonlyArray2<'py, f64>,
    look: [f64; 6],
    marks: PyReadonlyArray2<'py, f64>,
    lens: [f64; 8],
}

/// Moves a pose (u, v, angle) onto a picture by one Gauss-Newton step for each of `rounds` (tolerances, pixels).
///
/// `motion` is shift, turn, bend, twist, rate, spin, bending, twisting. Returns the pose, what the last round saw
/// of each mark, which it used, the step that it made of them (None: the disk is not held; NaN: a mark not seen)
/// and its size in pixels. With `keep`, weights and residuals of the pixels are returned.
#[pyfunction]
#[pyo3(signature = (picture, disk, pose, motion, rounds, without = None, keep = false))]
fn align_marks<'py>(
    py: Python<'py>,
    picture: Picture<'py>,
    disk: Appearing<'py>,
    pose: [f64; 3],
    motion: [f64; 12],
    rounds: Vec<f64>,
    without: Option<usize>,
    keep: bool,
) -> PyResult<Aligned<'py>> {
    let Picture { codes, view, even } = picture;
    let Appearing { lights, look, marks, lens } = disk;
    let (height, width) = (codes.shape()[0], codes.shape()[1]);
    if view.shape() != codes.shape() {
        return Err(PyValueError::new_err("picture and view must have one shape"));
    }
    let lights = lights.as_slice()?.chunks(256).map(exactly).collect::<PyResult<Vec<[f64; 256]>>>()?;
    let [psf, noise, gain_slack, rim, faint, per_row] = look;
    let [u, v, size, curve, tilt_u, tilt_v, aspect, shear] = lens;
    let lens = Lens { middle: [u, v], size, curve, tilt: [tilt_u, tilt_v], aspect, shear };
    let [rate_u, rate_v, spin, bending_u, bending_v, twisting] = exactly(&motion[6..])?;
    let speed = PoseRate { rate: [rate_u, rate_v], spin, bending: [bending_u, bending_v], twisting };
    let motion = motion_of(&motion[..6])?;
    let marks = marks.as_slice()?.chunks(6).map(mark_of).collect::<PyResult<Vec<_>>>()?;
    if lights.len() != marks.len() {
        return Err(PyValueError::new_err("there must be one row of light for each mark"));
    }
    let even = even.as_ref().map_or(Ok(&[][..]), |even| even.as_slice())?;
    if !even.is_empty() && even.len() != height * width {
        return Err(PyValueError::new_err("picture and evenness must have one shape"));
    }
    let plane = Plane { codes: codes.as_slice()?, view: view.as_slice()?, even, height, width };
    let fit = py.detach(|| {
        // the rounds say how far edges may be off, and each mark has its own light
        let look = Appearance { light: &[0.0; 256], psf, noise, misfit: 0.0, gain_slack, rim };
        let body = MarkSet { marks: &marks, lights: &lights, lens, per_row, faint };
        let pose = Pose { centre: [pose[0], pose[1]], angle: pose[2] };
        align(plane, &look, &body, pose, &motion, &speed, &rounds, without, keep)
    });
    let seen = fit.sightings.into_iter().map(|s| {
        s.map(|s| {
            let Window { rows, columns } = s.window;
            let pixels = s.pixels.map(|(w, r)| (PyArray1::from_vec(py, w), PyArray1::from_vec(py, r)));
            let shares = (s.complete, s.in_view, s.rms, s.gain);
            (s.offset.into(), s.information.into(), shares, (rows.0, rows.1, columns.0, columns.1), pixels)
        })
    });
    let step = fit.step.map(|s| {
        let leftover = s.leftover.iter().map(|l| l.unwrap_or([f64::NAN; 2])).collect();
        let chi2 = s.chi2.iter().map(|c| c.unwrap_or(f64::NAN)).collect();
        (s.change, s.information.transpose().into(), leftover, chi2)
    });
    let Pose { centre, angle } = fit.pose;
    Ok(((centre[0], centre[1], angle), seen.collect(), fit.used, step, fit.moved))
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(mark_coverage, module)?)?;
    module.add_function(wrap_pyfunction!(align_marks, module)?)
}

//! The tracker's inner loop: marks in a picture.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::picture::{Local, Look, Mark, Motion, Plane, Pose, Window, coverage, locate};

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

type Box4 = (usize, usize, usize, usize);
type Seen<'py> = (
    (f64, f64),
    (f64, f64, f64, f64),
    (f64, f64, f64, f64),
    Box4,
    Option<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)>,
);

/// Finds marks (rows of six numbers) near their expected places, each with its own pose and map; None for
/// those too little of which is seen.
///
/// `look` is psf, noise, misfit, gain_slack, rim. With `keep`, weights and residuals of the pixels are returned.
#[pyfunction]
#[pyo3(signature = (codes, view, light, look, marks, poses, motion, locals, keep = false))]
#[allow(clippy::too_many_arguments)]
fn locate_marks<'py>(
    py: Python<'py>,
    codes: PyReadonlyArray2<'py, u8>,
    view: PyReadonlyArray2<'py, bool>,
    light: PyReadonlyArray1<'py, f64>,
    look: PyReadonlyArray1<'py, f64>,
    marks: PyReadonlyArray2<'py, f64>,
    poses: PyReadonlyArray2<'py, f64>,
    motion: PyReadonlyArray1<'py, f64>,
    locals: PyReadonlyArray2<'py, f64>,
    keep: bool,
) -> PyResult<Vec<Option<Seen<'py>>>> {
    let (height, width) = (codes.shape()[0], codes.shape()[1]);
    if view.shape() != codes.shape() {
        return Err(PyValueError::new_err("picture and view must have one shape"));
    }
    let light: [f64; 256] = exactly(light.as_slice()?)?;
    let [psf, noise, misfit, gain_slack, rim] = exactly(look.as_slice()?)?;
    let motion = motion_of(motion.as_slice()?)?;
    let (marks, poses, locals) = (marks.as_slice()?, poses.as_slice()?, locals.as_slice()?);
    let each = marks.chunks(6).zip(poses.chunks(3)).zip(locals.chunks(8));
    let jobs = each.map(|((m, p), l)| Ok((mark_of(m)?, pose_of(p)?, local_of(l)?)));
    let jobs = jobs.collect::<PyResult<Vec<_>>>()?;
    let plane = Plane { codes: codes.as_slice()?, view: view.as_slice()?, height, width };
    let found = py.detach(|| {
        let look = Look { light: &light, psf, noise, misfit, gain_slack, rim };
        jobs.iter()
            .map(|(mark, pose, local)| locate(plane, &look, mark, pose, &motion, local, keep))
            .collect::<Vec<_>>()
    });
    let shown = found.into_iter().map(|s| {
        s.map(|s| {
            let Window { rows, columns } = s.window;
            (
                s.offset.into(),
                s.information.into(),
                (s.complete, s.in_view, s.rms, s.gain),
                (rows.0, rows.1, columns.0, columns.1),
                s.pixels.map(|(w, r)| (PyArray1::from_vec(py, w), PyArray1::from_vec(py, r))),
            )
        })
    });
    Ok(shown.collect())
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(mark_coverage, module)?)?;
    module.add_function(wrap_pyfunction!(locate_marks, module)?)
}

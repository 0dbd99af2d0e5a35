"""What each frame brings that the frames before it did not foretell: white noise, if the model is right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from udd.fitting import Fit, predicted
from udd.models import Model

Array = NDArray[np.float64]

_CHUNK = 48  # frames that are filtered together with all other chunks
_MEMORY = {"disk": 5.0, "pendulum": 20.0}  # s after which a filter has forgotten how it began
_SUBSTEPS = 6  # of a Runge-Kutta method of order 4 in a frame: far better than the noise needs
_VAGUE = (30.0, 0.3, 0.3, 30.0)  # what is known of a state beforehand: rad/s, m, m, rad


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of a fitted model in units of their own standard deviation.

    Attributes
    ----------
    names : tuple of str
        The channels.
    dt : float
        Time between frames, s.
    values : ndarray (n, m)
        NaN where nothing was seen or too little was known.
    """

    names: tuple[str, ...]
    dt: float
    values: Array

    @property
    def chi2(self) -> Array:
        """Mean square of every channel; 1 where model and noise are right."""
        result: Array = np.nanmean(self.values**2, axis=0)
        return result

    def autocorrelation(self, lags: int) -> tuple[Array, Array]:
        """Autocorrelation at lags 1 to `lags`, (lags, m), and its standard deviation for white noise."""
        seen = np.isfinite(self.values)
        x = np.where(seen, self.values - np.nanmean(self.values, axis=0), 0.0)
        power = (x**2).sum(axis=0) / seen.sum(axis=0)
        pairs = np.array([(seen[k:] & seen[:-k]).sum(axis=0) for k in range(1, lags + 1)])
        products = np.array([(x[k:] * x[:-k]).sum(axis=0) for k in range(1, lags + 1)])
        return products / np.maximum(pairs, 1) / power, 1.0 / np.sqrt(np.maximum(pairs, 1))

    def ljung_box(self, lags: int) -> tuple[Array, Array]:
        """Ljung and Box's statistic of every channel, and its probability for white noise."""
        rho, sd = self.autocorrelation(lags)
        q = ((rho / sd) ** 2).sum(axis=0)  # the pairs' number stands for n (n + 2)/(n - k), for gaps' sake
        return q, chi2.sf(q, lags)


def innovations(fit: Fit) -> Innovations:
    """The innovations of a fit: what was seen less what a Kalman filter foretold, parameters held.

    The filter runs along the fitted motion, where everything is linear, with the noise and the model error
    that the fit assumed.
    """
    record, n = fit.record, len(fit.record.t)
    d, m = fit.states.shape[1], fit.misfit.shape[1]
    flow, defect = _flow(fit)
    sight = _sight(fit)
    dt = np.append(np.diff(record.t), 0.0)
    noise = (np.array(fit.problem.diffusion) ** 2)[None, :] * dt[:, None]
    information = fit.noise.information(record, fit.states[:, 0])
    there: NDArray[np.bool_] = np.asarray(record.observed.all(axis=1))
    seen_noise = np.linalg.inv(np.where(there[:, None, None], information, np.eye(m)))
    misfit = np.nan_to_num(fit.misfit)
    linked = np.append(record.linked, False)

    warm = max(round(_MEMORY[fit.measurement.kind] / float(np.median(np.diff(record.t)))), 4)
    starts = np.arange(0, n, _CHUNK)
    vague = np.diag(np.array(_VAGUE[: d - 1] + _VAGUE[-1:]) ** 2)
    at, spread = np.zeros((len(starts), d)), np.tile(vague, (len(starts), 1, 1))
    known = np.zeros(len(starts), dtype=int)  # frames that each filter has seen since it began
    values = np.full((n, m), np.nan)
    for step in range(-warm, _CHUNK):
        # All chunks at once; each filter begins before its chunk, and where it does matters no more inside.
        i = np.clip(starts + step, 0, n - 1)
        use: NDArray[np.bool_] = np.asarray((starts + step >= 0) & (starts + step < n))
        seen = use & there[i]
        h = sight[i]
        expected = h @ spread @ h.transpose(0, 2, 1) + seen_noise[i]
        rest = misfit[i] - np.einsum("cmd,cd->cm", h, at)
        if step >= 0:
            told = seen & (known >= min(warm, 25) // 2)
            sd = np.sqrt(np.einsum("cmm->cm", expected))
            values[i[told]] = (rest / sd)[told]
        gain = np.linalg.solve(expected, h @ spread).transpose(0, 2, 1)
        after = spread - gain @ h @ spread
        at = np.where(seen[:, None], at + np.einsum("cdm,cm->cd", gain, rest), at)
        spread = np.where(seen[:, None, None], after, spread)
        known = known + seen
        f = flow[i]
        ahead = np.einsum("cij,cj->ci", f, at) + defect[i]
        wide = f @ spread @ f.transpose(0, 2, 1)
        wide[:, range(d), range(d)] += noise[i]
        go = use & linked[i]
        reset = use & ~linked[i]
        at = np.where(go[:, None], ahead, np.where(reset[:, None], 0.0, at))
        spread = np.where(go[:, None, None], (wide + wide.transpose(0, 2, 1)) / 2, spread)
        spread = np.where(reset[:, None, None], vague, spread)
        known = np.where(reset, 0, known)
    return Innovations(fit.measurement.names, float(np.median(np.diff(record.t))), values)


def _flow(fit: Fit) -> tuple[Array, Array]:
    """The tangent of the flow from every frame to the next, (n, d, d), and how far it misses it, (n, d)."""
    x = fit.states
    n, d = x.shape
    pace = 1.0 + np.array([clock for _model, _camera, clock in fit.point.sets])[fit.record.film]
    t = fit.record.t * pace
    h = np.append(np.where(fit.record.linked, np.diff(t), 0.0), 0.0)
    size = 1e-4 * np.array(_VAGUE[: d - 1] + _VAGUE[-1:])
    around = np.concatenate([[np.zeros(d)], np.diag(size), -np.diag(size)])
    y = x[:, None, :] + around
    for k in range(_SUBSTEPS):
        y = _step(fit.model, (t + k * h / _SUBSTEPS)[:, None], y, (h / _SUBSTEPS)[:, None, None])
    flow = (y[:, 1 : d + 1] - y[:, d + 1 :]).transpose(0, 2, 1) / (2 * size)
    defect = np.zeros((n, d))
    defect[:-1] = y[:-1, 0] - x[1:]
    return flow, defect


def _step(model: Model, t: Array, x: Array, h: Array) -> Array:
    k1 = model.rates(t, x)
    k2 = model.rates(t + h[..., 0] / 2, x + h / 2 * k1)
    k3 = model.rates(t + h[..., 0] / 2, x + h / 2 * k2)
    k4 = model.rates(t + h[..., 0], x + h * k3)
    result: Array = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return result


def _sight(fit: Fit) -> Array:
    """How what is seen of every frame changes with its state, (n, m, d)."""
    t, x = fit.record.t, fit.states
    size = 1e-4 * np.array(_VAGUE[: x.shape[1] - 1] + _VAGUE[-1:])
    columns = []
    for k in range(x.shape[1]):
        by = np.zeros(x.shape[1])
        by[k] = size[k]
        up, down = (
            predicted(fit.models, fit.point.sets, fit.record.film, t, x + s * by, t[:, None])[:, 0]
            for s in (1.0, -1.0)
        )
        columns.append((up - down) / (2 * size[k]))
    return np.stack(columns, axis=2)

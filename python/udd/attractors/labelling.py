"""Labels for the attractors of a diagram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.models.state_scaling import Floats

from .attractor import Attractor
from .classification import Classification, MotionClassifier, decided
from .matching import AttractorMatcher, groups, mirror_images
from .section_runs import Crossings


@dataclass(frozen=True, eq=False)
class DiagramLabels:
    """Labels of the jobs and of the parameter's values.

    Attributes
    ----------
    label : ndarray of int (jobs,)
        Label from 1 on. It is 0 if there is no attractor.
    symmetric : ndarray of int (jobs,)
        1 if the attractor is its own mirror image, 0 if not. It is -1 without a symmetry or an attractor.
    duration : ndarray (jobs,)
        Time of a period.
    differ : ndarray of bool (values,)
        True if the ways up and down end on different attractors. Mirror images count as the same.
    unknown : ndarray of bool (values,)
        True if one of the ways ends without an attractor.
    """

    label: NDArray[np.int32]
    symmetric: NDArray[np.int8]
    duration: Floats
    differ: NDArray[np.bool_]
    unknown: NDArray[np.bool_]

    @classmethod
    def nothing(cls, jobs: int, values: int) -> DiagramLabels:
        """Before the work."""
        return cls(
            np.zeros(jobs, dtype=np.int32),
            np.full(jobs, -1, dtype=np.int8),
            np.full(jobs, np.nan),
            np.zeros(values, dtype=bool),
            np.zeros(values, dtype=bool),
        )


def tell(
    judge: MotionClassifier,
    crossings: Crossings,
    verdicts: Classification,
    places: NDArray[np.intp],
    reach: float,
) -> DiagramLabels:
    """Distinguish the attractors, value by value; `places` (paths, starts, values) numbers the jobs."""
    diagram_labels = DiagramLabels.nothing(places.size, places.shape[2])
    is_decided = decided(crossings, verdicts)
    tracks = AttractorMatcher(reach)
    for k in range(places.shape[2]):
        here = [job for job in places[:, :, k].ravel().tolist() if is_decided[job]]
        seen = [judge.attractor(crossings, verdicts, job) for job in here]
        first = groups(seen, judge.tight)
        distinct = sorted(set(first))
        labels = dict(zip(distinct, tracks.label([seen[j] for j in distinct]), strict=True))
        for job, attractor, j in zip(here, seen, first, strict=True):
            diagram_labels.label[job] = labels[j]
            diagram_labels.duration[job] = attractor.duration
        family = _families(judge, seen, distinct, diagram_labels, here, first)
        diagram_labels.unknown[k] = len(here) < places[:, :, k].size
        if places.shape[0] == 2:
            of_job = {job: family[j] for job, j in zip(here, first, strict=True)}
            pairs = places[:, :, k].T.tolist()
            diagram_labels.differ[k] = any(
                up in of_job and down in of_job and of_job[up] != of_job[down] for up, down in pairs
            )
    return diagram_labels


def _families(
    judge: MotionClassifier,
    seen: list[Attractor],
    distinct: list[int],
    labels: DiagramLabels,
    here: list[int],
    first: list[int],
) -> dict[int, int]:
    """To each distinct attractor the first of it and its mirror images; notes which are their own."""
    family: dict[int, int] = {}
    if not judge.coordinates.mirrors:
        return {j: j for j in distinct}
    some = [seen[j] for j in distinct]
    partners = {}
    for place, j in enumerate(distinct):
        images = mirror_images(some, place, judge.coordinates, judge.tight)
        partners[j] = place in images
        family[j] = min(family.get(distinct[i], distinct[i]) for i in (place, *images))
    for job, j in zip(here, first, strict=True):
        labels.symmetric[job] = partners[j]
    return family

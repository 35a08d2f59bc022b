"""Errors of a trajectory, as `bslam eval` computes them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bslam

Path = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Statistics:
    """Statistics of errors; NaN if there are none."""

    rmse: float
    mean: float
    median: float
    max: float
    count: int


@dataclass(frozen=True)
class Evaluation:
    """Errors of a trajectory with respect to ground truth.

    Attributes:
        ate: absolute errors of the positions after alignment, in metres.
        rpe_translation: relative errors over `delta` seconds, in metres.
        rpe_rotation_deg: relative errors over `delta` seconds, in degrees.
        scale: scale of the best alignment by a similarity, truth = scale * estimate; None if it is not determined.
        coverage: fraction of the frames with ground truth that have an estimated pose.
        coverage_of_part: the same of the frames from the first to the last estimated pose.
        gt_length_m: length of the path of the ground truth.
        aligned: (n, 8) the estimate in the world frame of the ground truth: t, x, y, z, qx, qy, qz, qw.
        errors: (k, 2) time in seconds and distance in metres of every compared pose.
    """

    ate: Statistics
    rpe_translation: Statistics
    rpe_rotation_deg: Statistics
    scale: float | None
    coverage: float
    coverage_of_part: float
    gt_length_m: float
    aligned: NDArray[np.float64]
    errors: NDArray[np.float64]


def evaluate(
    est: Path | ArrayLike,
    gt: Path | ArrayLike,
    align: Literal["se3", "sim3", "none"] = "se3",
    *,
    max_dt: float = 0.01,
    delta: float = 1.0,
    gt_frame: Literal["cam0", "body"] = "cam0",
    rig: Path | None = None,
    camera: int | None = None,
    times: Path | None = None,
    plot: Path | None = None,
) -> Evaluation:
    """Computes the errors of an estimated trajectory, as `bslam eval` does.

    Args:
        est: estimate: a file (TUM, EuRoC csv or KITTI poses) or an array (n, 8) like System.trajectory(). An array has
            no name of a frame: without `camera` it is taken for poses of camera 0.
        gt: ground truth, in the same way.
        align: alignment of the estimate: a rigid transform, a similarity, or none.
        max_dt: maximum time difference in seconds between a pose and its ground truth.
        delta: time in seconds between the two poses of a relative error.
        gt_frame: frame of the ground truth poses; body needs `rig`, unless `est` is a file with poses of the body. To
            compare an array of poses of the body with ground truth of the body, leave out `gt_frame` and `rig`.
        rig: calibration with the poses of the cameras on the body. With ground truth of cam0, poses of another camera
            are compared with it by the rig.
        camera: camera of the rig whose poses are estimated; default: the one that the first line of the file `est`
            names, or 0.
        times: time stamps of KITTI poses, one per line; default: times.txt in their folder.
        plot: SVG to write, with both paths and the error over time. It replaces an earlier plot, and no other file.

    Raises:
        Error: a file that cannot be read, a value out of range, fewer than three poses with ground truth, a `plot` that
            is an input or a file of another kind, `camera` without `rig`.
    """
    found: dict[str, Any] = _bslam.evaluate(
        _trajectory(est, "est"), _trajectory(gt, "gt"), align, max_dt, delta, gt_frame, rig, camera, times, plot
    )
    for name in ("ate", "rpe_translation", "rpe_rotation_deg"):
        found[name] = Statistics(**found[name])
    return Evaluation(**found)


def _trajectory(given: Any, name: str) -> Path | NDArray[np.float64]:
    if isinstance(given, (str, os.PathLike)):
        return given
    try:
        rows = np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        found = type(given).__name__
        raise _bslam.Error(f"{name}: found {found}, expected a file or numbers of shape (n, 8)") from None
    if rows.ndim != 2 or rows.shape[1] != 8:
        raise _bslam.Error(f"{name}: found shape {rows.shape}, expected (n, 8): t, x, y, z, qx, qy, qz, qw")
    return rows

"""`python -m bslam.rerun RUN [--save FILE | --connect ADDRESS]`: shows the result of a run in Rerun.

Needs the package rerun-sdk. RUN is the folder that `bslam run` or `bslam live` has written, with report.html.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import pathlib
import socket
import sys
from typing import TYPE_CHECKING, Any, Union
from urllib.parse import urlsplit

import numpy as np

from ._bslam import Error

if TYPE_CHECKING:
    import rerun

Path = Union[str, "os.PathLike[str]"]

_BEGIN, _END = '<script type="application/json" id="bslam-data">', "</script>"
_VIEWER_PORT = 9876
_INSTALL = "rerun-sdk is not installed, which shows runs in Rerun: pip install rerun-sdk"


def load(run: Path) -> dict[str, Any]:
    """Returns the data of the report of a run, with arrays of numbers as numpy arrays (float32).

    Args:
        run: folder of the output of a run.

    Raises:
        Error: the folder has no report.
    """
    file = pathlib.Path(run, "report.html")
    try:
        page = file.read_text(encoding="utf-8")
        data = page[page.index(_BEGIN) + len(_BEGIN) :]
        out = json.loads(data[: data.index(_END)], object_hook=_arrays)
    except (OSError, ValueError) as failure:
        raise Error(f"{file}: found no report that can be read, expected the report of a run") from failure
    if not isinstance(out, dict):
        raise Error(f"{file}: found a report without data, expected the report of a run")
    return out


def log(run: Path, recording: rerun.RecordingStream | None = None) -> None:
    """Logs the result of a run: map, path, rig and its images' frusta, and charts of its frames.

    Times are those of the timeline `time`, in seconds after the first image. Submaps, which have world frames of their
    own, are `submap1` and so on.

    Args:
        run: folder of the output of a run.
        recording: where to log; default: the current recording of Rerun.

    Raises:
        Error: the folder has no report.
        ImportError: rerun-sdk is not installed.
    """
    data = load(run)
    rr = _rerun()
    for number, submap in enumerate(data["submaps"], 1):
        _log_submap(rr, f"submap{number}", submap, data["rig"], recording)
    frames = data["frames"]
    _log_chart(rr, "frame/ms", frames["time"], frames["ms"], recording)
    for camera, counts in zip(data["rig"], frames["cameras"], strict=True):
        for name in ("keypoints", "matched", "inliers"):
            _log_chart(rr, f"{name}/{camera['name']}", frames["time"], counts[name], recording)
    summary = json.dumps(data["summary"], indent=1)
    rr.log("summary", rr.TextDocument(summary), static=True, recording=recording)


def is_reachable(address: str) -> bool:
    """Returns whether something listens at the address of a viewer.

    Args:
        address: such as rerun+http://127.0.0.1:9876/proxy.
    """
    try:
        parts = urlsplit(address)
        if parts.hostname is None:
            return False
        port = parts.port or {"rerun+http": 80, "rerun+https": 443}.get(parts.scheme, _VIEWER_PORT)
        with socket.create_connection((parts.hostname, port), timeout=5):
            return True
    except (OSError, ValueError):
        return False


def main(arguments: list[str] | None = None) -> int:
    """Logs a run and returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bslam.rerun", description="shows the result of a run in Rerun")
    parser.add_argument("run", help="folder of the output of a run")
    target = parser.add_mutually_exclusive_group()
    target.add_argument("--save", metavar="FILE", help="write an .rrd file")
    target.add_argument(
        "--connect", metavar="ADDRESS", help="send it to a viewer, such as rerun+http://127.0.0.1:9876/proxy"
    )
    options = parser.parse_args(arguments)
    part = f"{options.save}.part"  # renamed when it is complete
    try:
        rr = _rerun()
        recording = rr.RecordingStream("bslam")
        if options.save:
            recording.save(part)
        elif options.connect:
            recording.connect_grpc(options.connect)
        else:
            rr.spawn(recording=recording)
        log(options.run, recording)
        recording.flush()
        if options.save:
            recording.disconnect()
            os.replace(part, options.save)
    except ImportError as failure:
        print(f"bslam: {failure}", file=sys.stderr)
        return 2
    except (Error, OSError, RuntimeError) as failure:  # the last one by rerun-sdk
        print(f"bslam: {failure}", file=sys.stderr)
        return 2
    finally:
        if options.save:
            pathlib.Path(part).unlink(missing_ok=True)
    return 0


def _rerun() -> Any:
    try:
        import rerun
    except ImportError as failure:
        raise ImportError(_INSTALL) from failure
    return rerun


def _arrays(value: dict[str, Any]) -> Any:
    return np.frombuffer(base64.b64decode(value["f32"]), "<f4") if isinstance(value.get("f32"), str) else value


def _log_submap(rr: Any, root: str, submap: dict[str, Any], rig: list[dict[str, Any]], recording: Any) -> None:
    path = submap["path"]
    position, rotation = path["position"].reshape(-1, 3), path["rotation"].reshape(-1, 4)
    points = submap["points"]["position"].reshape(-1, 3)
    keyframes = submap["keyframes"]["position"].reshape(-1, 3)
    rr.log(root, rr.ViewCoordinates.RDF, static=True, recording=recording)  # the world is camera 0 of a first frame
    rr.log(
        f"{root}/landmarks",
        rr.Points3D(points, colors=_by_height(points, submap["up"])),
        static=True,
        recording=recording,
    )
    rr.log(f"{root}/keyframes", rr.Points3D(keyframes, colors=[230, 120, 40]), static=True, recording=recording)
    rr.log(f"{root}/path", rr.LineStrips3D([position], colors=[60, 110, 220]), static=True, recording=recording)
    rr.send_columns(
        f"{root}/rig",
        indexes=[rr.TimeColumn("time", duration=path["time"].astype(float))],
        columns=rr.Transform3D.columns(translation=position, quaternion=rotation),
        recording=recording,
    )
    spread = float(np.median(np.ptp(points, axis=0))) if len(points) else 1.0
    for camera in rig:
        name = f"{root}/rig/{camera['name']}"
        pose = rr.Transform3D(translation=camera["position"], quaternion=rr.Quaternion(xyzw=camera["rotation"]))
        rr.log(name, pose, static=True, recording=recording)
        rr.log(
            f"{name}/image",
            rr.LineStrips3D(_frustum(camera["corners"], 0.02 * spread)),
            static=True,
            recording=recording,
        )


def _frustum(corners: list[list[float]], depth: float) -> list[np.ndarray]:
    """Lines from the camera to the corners of its image, and around it."""
    ring = np.asarray(corners, float) * depth
    return [np.vstack([ring, ring[:1]]), *(np.vstack([np.zeros(3), corner]) for corner in ring)]


def _by_height(points: np.ndarray, up: list[float]) -> np.ndarray:
    """Colours from blue (low) to yellow (high)."""
    if not len(points):
        return np.zeros((0, 3), np.uint8)
    height = points @ np.asarray(up, float)
    low, high = np.percentile(height, [5, 95])
    share = np.clip((height - low) / max(high - low, 1e-9), 0, 1)[:, None]
    return ((1 - share) * [50, 60, 160] + share * [230, 210, 60]).astype(np.uint8)


def _log_chart(rr: Any, name: str, time: np.ndarray, values: np.ndarray, recording: Any) -> None:
    known = np.isfinite(values)
    rr.send_columns(
        f"charts/{name}",
        indexes=[rr.TimeColumn("time", duration=time[known].astype(float))],
        columns=rr.Scalars.columns(scalars=values[known].astype(float)),
        recording=recording,
    )


if __name__ == "__main__":
    sys.exit(main())

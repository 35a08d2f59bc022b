"""Wrappers that run the program `bslam` as a child process, for rendering and calibration: minutes on all cores."""

from __future__ import annotations

import os
import pathlib
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Union

from ._bslam import Error, Rig

Path = Union[str, "os.PathLike[str]"]

PROGRAM = pathlib.Path(__file__).parent / "bin" / "bslam"


@dataclass(frozen=True)
class Calibration:
    """An estimated calibration.

    Attributes:
        rig: the estimate.
        text: table of given values, estimates and standard deviations, and what could not be observed.
    """

    rig: Rig
    text: str


def simulate(
    out: Path,
    *,
    rig: Path | Rig | None = None,
    world: Literal["building", "corridor", "twin-rooms", "outdoor", "town"] = "building",
    duration: float | None = None,
    length: str | float | None = None,
    rate: float = 20.0,
    seed: int = 1,
    tour_seed: int | None = None,
    start: float = 1.0,
    laps: int = 0,
    speed: float = 0.0,
    back: bool = False,
    exposure_ms: float = 5.0,
    noise: float = 1.0,
    faults: Path | None = None,
    threads: int = 0,
    overwrite: bool = False,
) -> pathlib.Path:
    """Renders images of a built-in world as seen by a rig, in EuRoC layout with ground truth, as `bslam simulate` does.

    Args:
        out: folder to write into.
        rig: the cameras; default: four cameras, two of them in front.
        world: building: different rooms; corridor, twin-rooms: places that look exactly alike; outdoor: a
            square with houses and trees; town: a drive through streets, with loops.
        duration: seconds; default: 20, or that of the whole drive through the town.
        length: length of the drive through the town in metres, or a text such as "5km"; default: 1 km.
        rate: images per second of each camera.
        seed: seed of world, motion and noise.
        tour_seed: seed of motion and noise, for further tours of one world; default: that of seed.
        start: time stamp of the first images in seconds.
        laps: laps of the tour within the duration; 0: as many as a walking pace allows.
        speed: metres per second; 0: determined by duration and laps, or 8 in the town.
        back: turn around after half of the duration and return along the same path.
        exposure_ms: exposure time in milliseconds, which causes motion blur.
        noise: factor applied to the sensor noise.
        faults: YAML or JSON file with a list of {type, cameras, from, to}; type: black, frozen, over_exposed, blurred,
            dropped, or delayed with delay_s.
        threads: number of threads; 0: one per core.
        overwrite: write into a folder that is not empty; an earlier recording in it is replaced.

    Returns:
        The folder, which Rig.load() and `bslam run` read.

    Raises:
        Error: a value out of range, a folder that is not empty, a file that cannot be read or written.
    """
    options = {
        "world": world,
        "duration": duration,
        "length": length,
        "rate": rate,
        "seed": seed,
        "tour_seed": tour_seed,
        "start": start,
        "laps": laps,
        "speed": speed,
        "back": back,
        "exposure_ms": exposure_ms,
        "noise": noise,
        "faults": faults,
        "threads": threads,
        "overwrite": overwrite,
    }
    with tempfile.TemporaryDirectory() as work:
        _run("simulate", out=out, rig=_rig_file(rig, work), **options)
        _loaded(pathlib.Path(out, "rig.yaml"), work)
    return pathlib.Path(out)


def calibrate(
    data: Path | Sequence[Path],
    *,
    rig: Path | Rig | None = None,
    out: Path | None = None,
    model: Literal["pinhole", "pinhole-radtan", "kannala-brandt"] | None = None,
    fov: float | None = None,
    format: Literal["auto", "euroc", "kitti", "folder", "bag", "video"] = "auto",
    topics: Sequence[str] | None = None,
    side_by_side: bool = False,
    cameras: Sequence[int] | None = None,
    begin: float | None = None,
    end: float | None = None,
    settings: Mapping[str, object] | None = None,
    config: Path | None = None,
    rate: float | None = None,
    stamp_unit: Literal["ns", "us", "ms", "s"] | None = None,
    bayer: str | None = None,
    masks: Path | None = None,
    vignettes: Path | None = None,
    overwrite: bool = False,
) -> Calibration:
    """Estimates intrinsics and extrinsics from recordings of any scene, as `bslam rig calibrate` does.

    Args:
        data: a recording, or a sequence of recordings of the same rig. Several bags or videos of one recording are
            one string, joined by commas.
        rig: rough calibration to begin with; default: the one in the recordings, which must be the same in all.
        out: rig file to write.
        model: begin with this camera model without distortion for all cameras; needs `fov`.
        fov: horizontal field of view in degrees; needs `model`.
        format: data set format.
        topics: image topics of a bag or folders of images, in the order of the rig's cameras; default: those that the rig
            file names, or all, by name.
        side_by_side: each image of the video consists of those of two cameras.
        cameras: cameras of the rig to use, in this order; default: all.
        begin: start of the interval to process, in seconds after the first image.
        end: end of the interval.
        settings: names and values, such as {"calibration.sigma_focal_percent": 5}.
        config: YAML file with settings.
        rate: frame rate in Hz; the time stamps in the files are then frame numbers.
        stamp_unit: unit of the time stamps; default: ns.
        bayer: colour filter of raw images: rggb, bggr, grbg, gbrg or none; one, or one per camera joined by commas.
        masks: folder with camN.png for all images of camera N, or camN/STAMP.png for one image; 0: ignored pixel.
        vignettes: folder with camN.png, the image of an evenly lit surface.
        overwrite: replace `out` if it exists.

    Returns:
        The estimate, and a table of it as text.

    Raises:
        Error: a recording that cannot be read, from which nothing can be estimated, or whose calibration differs
            from that of the first one.
    """
    folders = [data] if isinstance(data, (str, os.PathLike)) else list(data)
    options = {
        "model": model,
        "fov": fov,
        "format": format,
        "topics": None if topics is None else ",".join(topics),
        "side_by_side": side_by_side,
        "cameras": None if cameras is None else ",".join(map(str, cameras)),
        "begin": begin,
        "end": end,
        "config": config,
        "rate": rate,
        "stamp_unit": stamp_unit,
        "bayer": bayer,
        "masks": masks,
        "vignettes": vignettes,
        "overwrite": overwrite,
    }
    assignments = [f"--set={name}={_text(value)}" for name, value in (settings or {}).items()]
    with tempfile.TemporaryDirectory() as work:
        file = pathlib.Path(work, "calibrated.yaml") if out is None else out
        text = _run("rig", "calibrate", *folders, *assignments, out=file, rig=_rig_file(rig, work), **options)
        table, _, _ = text.rstrip("\n").rpartition("\n")  # the last line is the name of the file
        return Calibration(_loaded(file, work), table + "\n")


def _rig_file(rig: Path | Rig | None, folder: str) -> Path | None:
    if not isinstance(rig, Rig):
        return rig
    rig.save(file := pathlib.Path(folder, "rig.yaml"))
    return file


def _loaded(file: Path, work: str) -> Rig:
    """The rig in a file that the program has written. Masks in the folder `work` of _rig_file are moved to the file."""
    rig = Rig.load(file)
    if not any(pathlib.Path(work).glob("rig_mask*.png")):
        return rig
    rig = Rig(rig.cameras)  # with masks that are in memory
    rig.save(file)
    return rig


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _run(*command: Path, **options: Any) -> str:
    """Runs the program and returns what it prints. Options that are None or False are omitted."""
    arguments = [str(PROGRAM), *(os.fspath(word) for word in command), "--progress=never"]
    for name, value in options.items():
        if value is None or value is False:
            continue
        option = "--" + name.replace("_", "-")
        arguments.append(option if value is True else f"{option}={value}")
    # Names of files in its messages need not be UTF-8.
    done = subprocess.run(arguments, capture_output=True, encoding="utf-8", errors="backslashreplace", check=False)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"bslam: ended with status {done.returncode}"]
        if lines[-1].startswith("bslam: unknown command"):
            raise Error(f"{command[0]}: found a wheel without the simulator, expected one made by `pip install .`; "
                        "`python -m bslam.demo` has a recording")
        raise Error(lines[-1].removeprefix("bslam: "))
    return done.stdout

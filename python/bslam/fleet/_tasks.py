"""The tasks of workers. Each runs the program and keeps its results in the cache."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import functools
import json
import os
import pathlib
import shutil
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .. import _bslam
from .._program import PROGRAM
from . import _interruption
from ._cache import (
    FILES_ABOVE,
    Result,
    UnreadableError,
    cached,
    content_of,
    discard,
    key_of,
    local_copy,
    name_of,
    reason_of,
    sha256_of,
    work_folder,
)
from ._sketch import sketch

_NOTHING_TRACKED, _WRONG_INPUT = 3, 2  # exit status
_CANNOT_WRITE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)  # errors that reading never has
_PACKAGE = (pathlib.Path(_bslam.__file__), *sorted(pathlib.Path(__file__).parent.glob("*.py")))
_LOADED = key_of([sha256_of(file) for file in _PACKAGE])  # what this process runs, also if the files are replaced


class RefusedError(_bslam.Error):
    """The program has refused its input, as it does each time."""


class NotWrittenError(_bslam.Error):
    """The program could not write a file, for example because the disk is full: no fault of its input."""


class DamagedError(_bslam.Error):
    """A map in the cache was not what the program wrote. It is deleted, so that the same command makes it again."""


@dataclass(frozen=True)
class Setup:
    """The input that is common to all tasks."""

    cache: str  # folder
    program: str  # hash
    run: tuple[str, ...] = ()  # options of `bslam run`
    settings: tuple[str, ...] = ()  # options of all commands

    def check(self) -> None:
        """Results must not depend on which worker has computed them."""
        if (found := program_hash()) != self.program:
            raise _bslam.Error(
                f"worker on {os.uname().nodename}: found another version of bslam ({found[:12]}), "
                f"expected that of the client ({self.program[:12]})"
            )


def program_hash() -> str:
    """Hash of the program of this installation, which may be replaced at any time, and of the package in use."""
    status = PROGRAM.stat()
    return key_of([_hash_of_version(PROGRAM, status.st_size, status.st_mtime_ns), _LOADED])


@functools.lru_cache(maxsize=1)
def _hash_of_version(file: pathlib.Path, *_: int) -> str:
    return sha256_of(file)


def make_map(setup: Setup, recording: str) -> Result:
    """The map of a recording, with its hash as `map`, its trajectories and its sketch; or the `error`.

    `parts` are the files of the trajectories in further submaps, `warnings` those of the run, and `content` is the hash
    of the recording. The map contains the name of the recording, so that it depends on it.
    """
    setup.check()
    try:
        content = content_of(setup.cache, recording)
    except UnreadableError as error:
        return {"error": str(error), "computed": False}
    depends_on = [setup.program, setup.run, setup.settings, content, name_of(recording)]
    try:
        result = cached(setup.cache, "maps", depends_on, functools.partial(_run_on, recording, content, setup))
    except NotWrittenError:
        raise
    except _bslam.Error as error:
        return {"error": str(error), "computed": True}
    warnings = [w.replace(content, recording) for w in result["warnings"]]
    return {**result, "content": content, "warnings": warnings}


def _run_on(recording: str, content: str, setup: Setup, folder: pathlib.Path) -> Result:
    """Writes the map of a recording and its trajectories. Texts name the recording by the hash of its content."""
    with work_folder() as work:
        data, run = _fetched(recording, work / "data"), work / "run"
        done = _run(
            "run",
            data,
            f"--out={run}",
            f"--save-map={folder}/map.bmap",
            "--mode=sequential",
            "--set=execution.threads=1",
            "--no-report",
            "--progress=never",
            *setup.run,
            *setup.settings,
        )
        above = {f"{os.path.dirname(data)}/{name}": f"{content}/../{name}" for name in FILES_ABOVE}
        names = {f"{data}: ": "", data: content, **above, f"{run}/": ""}
        warnings = [_replaced(names, warning) for warning in _warnings(done)]
        if done.returncode == _NOTHING_TRACKED:
            return {"error": "no frame could be tracked", "warnings": warnings}
        if done.returncode != 0:
            raise _error_of(done)
        parts = sorted((f.name for f in run.glob("trajectory_part*.tum")), key=lambda name: (len(name), name))
        for name in ("trajectory.tum", *parts, "summary.json"):
            shutil.copy(run / name, folder)
    made = _bslam.Map.load(folder / "map.bmap")
    np.save(folder / "sketch.npy", sketch(made.words()))
    return {
        "map": sha256_of(folder / "map.bmap"),
        "keyframes": made.num_keyframes,
        "landmarks": made.num_landmarks,
        "scale": made.scale,
        "parts": parts,
        "warnings": warnings,
    }


def _fetched(recording: str, folder: pathlib.Path) -> str:
    """The path of a recording, which may be in `folder`. An error of its store is one of the recording."""
    try:
        return local_copy(recording, folder)
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _CANNOT_WRITE:
            raise
        raise _bslam.Error(f"cannot read {recording}: {reason_of(error)}") from error


def compare(setup: Setup, a: Result, b: Result) -> Result:
    """Tests whether two maps share a place: `joined`, or the `reason` why not.

    `refused` is added if they cannot be in one map. Texts name maps by their hashes.
    """
    setup.check()

    def make(_: pathlib.Path) -> Result:
        with _intact(a, b):
            files = map(map_of, (a, b))
            verdict = json.loads(run_program("map", "merge", *files, "--dry-run", "--json", *setup.settings))
        reason = next((i["reason"] for i in verdict["inputs"] if not i["joined"]), "")
        return {"joined": not reason, "reason": reason}

    try:
        return cached(setup.cache, "pairs", [setup.program, setup.settings, sorted([a["map"], b["map"]])], make)
    except RefusedError as error:
        return {"joined": False, "refused": True, "reason": _by_hash(str(error), (a, b)), "computed": True}


def merge(setup: Setup, maps: list[Result], final: bool = False) -> Result:
    """The merged map, with a global bundle adjustment if it is the `final` one.

    If the maps cannot be in one map, the result is the `error`, which is empty if it is that of one of the maps.
    `warnings` are about the maps together. Texts name maps by their hashes.
    """
    setup.check()
    if any("error" in m for m in maps):
        return {"error": "", "computed": False}

    def make(folder: pathlib.Path) -> Result:
        options = ["--json", f"--out={folder}/map.bmap", *setup.settings, *([] if final else ["--no-final-ba"])]
        with _intact(*maps):
            done = _checked("map", "merge", *map(map_of, maps), *options)
        merged = json.loads(done.stdout)
        of_inputs = tuple(f"{map_of(m)}: " for m in maps)
        warnings = [_by_hash(w, maps) for w in _warnings(done) if not w.startswith(of_inputs)]
        numbers = {name: merged[name] for name in ("keyframes", "landmarks", "submaps")}
        return {"map": sha256_of(folder / "map.bmap"), **numbers, "warnings": warnings}

    inputs = sorted(m["map"] for m in maps)
    try:
        return cached(setup.cache, "merged", [setup.program, setup.settings, final, inputs], make)
    except RefusedError as error:
        if len(maps) == 1:
            raise
        return {"error": _by_hash(str(error), maps), "computed": True}


def transfer(setup: Setup, own: Result, site: Result) -> Result:
    """The trajectory of a recording in the map of a site; `joined` if it is in the first submap.

    Those in further submaps of its own map are added to it if they are there as well; the others are the `parts`.
    """
    setup.check()

    def make(folder: pathlib.Path) -> Result:
        with _intact(own, site):
            joined = _move("trajectory.tum", own, site, folder)
        added = [name for name in own["parts"] if _move_part(name, own, site, folder)]
        if joined:
            _add_poses(folder / "trajectory.tum", [folder / name for name in added])
        return {"joined": joined, "parts": [name for name in own["parts"] if name not in added]}

    return cached(setup.cache, "trajectories", [setup.program, own["map"], site["map"]], make)


def _move(name: str, own: Result, site: Result, folder: pathlib.Path) -> bool:
    """Writes a trajectory of a recording in the map of a site. Returns whether it is in the first submap."""
    given, file = pathlib.Path(own["folder"], name), folder / name
    run_program("map", "transfer", str(given), f"--from={map_of(own)}", f"--to={map_of(site)}", f"--out={file}")
    with file.open() as lines:
        return " parent=world " in lines.readline()


def _move_part(name: str, own: Result, site: Result, folder: pathlib.Path) -> bool:
    try:
        return _move(name, own, site, folder)
    except RefusedError:  # too few keyframes to know its place, so that it remains where it was
        shutil.copy(pathlib.Path(own["folder"], name), folder)
        return False


def _add_poses(trajectory: pathlib.Path, parts: Sequence[pathlib.Path]) -> None:
    """Adds the poses of other files, in order of time."""
    comments = [line for line in trajectory.read_text().splitlines() if line.startswith("#")]
    poses = [
        line for file in (trajectory, *parts) for line in file.read_text().splitlines() if not line.startswith("#")
    ]
    poses.sort(key=lambda line: float(line.split()[0]))
    trajectory.write_text("\n".join([*comments, *poses]) + "\n")


def map_of(result: Result) -> str:
    """The file of a map in the cache."""
    return str(pathlib.Path(result["folder"], "map.bmap"))


def check_map(result: Result, file: str | os.PathLike[str]) -> None:
    """Deletes a result and raises DamagedError unless `file`, its map or a copy of it, has the hash of its map."""
    with contextlib.suppress(FileNotFoundError):
        if sha256_of(file) == result["map"]:
            return
    discard(result)
    raise DamagedError(
        f"{map_of(result)}: found a damaged map, expected the one that was written; the same command makes it again"
    )


@contextlib.contextmanager
def _intact(*maps: Result) -> Iterator[None]:
    """If the program fails on maps of the cache, and one of them is damaged, this is the error."""
    try:
        yield
    except _bslam.Error:
        for result in maps:
            check_map(result, map_of(result))
        raise


def _by_hash(text: str, maps: Sequence[Result]) -> str:
    """The text with hashes of maps instead of their files."""
    return _replaced({map_of(m): m["map"] for m in maps}, text)


def _replaced(names: Mapping[str, str], text: str) -> str:
    for name, other in names.items():
        text = text.replace(name, other)
    return text


def run_program(*arguments: str) -> str:
    """Runs the program and returns what it prints."""
    return _checked(*arguments).stdout


def refusal(recording: str, *options: str) -> str:
    """Why `bslam run` with these options would refuse a recording; empty if it would not."""
    done = _run("data", "info", recording, "--json", *options)
    try:
        return json.loads(done.stdout)["refused"] or ""
    except (ValueError, KeyError):  # it is no recording
        return _message(done)


def _checked(*arguments: str) -> subprocess.CompletedProcess[str]:
    done = _run(*arguments)
    if done.returncode != 0:
        raise _error_of(done)
    return done


def _error_of(done: subprocess.CompletedProcess[str]) -> _bslam.Error:
    message = _message(done)
    if message.startswith("cannot write ") or message.endswith(", expected a folder that can be created"):
        return NotWrittenError(message)
    refused = done.returncode == _WRONG_INPUT and ", expected " in message
    return (RefusedError if refused else _bslam.Error)(message)


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs the program, which is killed if the worker ends."""
    done = subprocess.run(
        [PROGRAM, *arguments],
        capture_output=True,
        encoding="utf-8",
        errors="backslashreplace",  # names of files in its messages need not be UTF-8
        check=False,
        preexec_fn=_end_together,
    )
    if done.returncode < 0:  # Dask tries again, unless the whole call was interrupted
        _interruption.raise_if_noted()
        raise _interruption.ProgramKilledError(f"bslam {arguments[0]} was ended by signal {-done.returncode}")
    return done


def _warnings(done: subprocess.CompletedProcess[str]) -> list[str]:
    mark = "warning: "
    return [line.removeprefix(mark) for line in done.stderr.splitlines() if line.startswith(mark)]


def _message(done: subprocess.CompletedProcess[str]) -> str:
    lines = done.stderr.strip().splitlines() or [f"bslam: ended with status {done.returncode}"]
    return lines[-1].removeprefix("bslam: ")


_LIBC = ctypes.CDLL(None)


def _end_together() -> None:
    _LIBC.prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG

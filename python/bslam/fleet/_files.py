"""Files of the user: those that options name, which all workers need, and the folder of the results."""

from __future__ import annotations

import json
import os
import pathlib
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from typing import Any, Union

from .. import _bslam
from ._cache import sha256_of
from ._tasks import run_program

Path = Union[str, "os.PathLike[str]"]

_RESULT = re.compile(r"site(_\d+)?\.bmap|apart/[^/]+\.(bmap|tum)|trajectories/[^/]+\.tum")  # names of files of a result
_MASK = re.compile(r'^    mask: "(.*)"$', re.MULTILINE)  # in a rig file that the program has written


def options(
    cache: pathlib.Path, rig: Path | None, config: Path | None, settings: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The options of `run` and of all commands. Files are copied into the cache, under the hashes of their contents."""
    return (
        () if rig is None else (f"--rig={shared_rig(cache, rig)}",),
        (*(() if config is None else (f"--config={_shared(cache, config)}",)), *(f"--set={s}" for s in settings)),
    )


def shared_rig(cache: pathlib.Path, rig: Path) -> pathlib.Path:
    """A rig file in the cache with the calibration and masks of `rig`, which may have any format or be a folder.

    Masks are copied as well, and the file names the copies, so that its hash depends on their contents.
    """
    with tempfile.TemporaryDirectory() as work:
        converted = pathlib.Path(work, "rig.yaml")
        run_program("rig", "convert", str(pathlib.Path(rig).absolute()), str(converted), "--to=bslam")
        text = os.fsdecode(converted.read_bytes())
        text = _MASK.sub(lambda mask: f'    mask: "{_shared(cache, _unquoted(mask[1])).name}"', text)
        converted.write_bytes(os.fsencode(text))
        return _shared(cache, converted)


def _unquoted(text: str) -> str:
    return re.sub(r"\\(?:x([0-9a-f]{2})|(.))", lambda m: chr(int(m[1], 16)) if m[1] else m[2], text)


def _shared(cache: pathlib.Path, file: Path) -> pathlib.Path:
    """The copy of a file in the cache, under the hash of its content."""
    try:
        digest = sha256_of(file)
    except OSError as error:
        raise _bslam.Error(f"cannot open {file}: {error.strerror}") from error
    shared = cache / "files" / f"{digest}{pathlib.Path(file).suffix}"
    if not shared.exists():
        copy(file, shared)
    return shared


def open_results(out: pathlib.Path, overwrite: bool) -> set[str]:
    """Creates the folder of the results and returns the files of an earlier result in it, relative to the folder."""
    make_folder(out, "--out")
    there = set(os.listdir(out))
    if "site.json" not in there and there - {"cache"} and not overwrite:
        raise _bslam.Error(
            f"{out}: --out: found a folder that is not empty, expected an empty or new folder, or --overwrite"
        )
    return _files_of_earlier_result(out / "site.json", overwrite) if "site.json" in there else set()


def _files_of_earlier_result(summary: pathlib.Path, overwrite: bool) -> set[str]:
    try:
        return files_of(json.loads(summary.read_bytes()))
    except OSError as error:
        raise _bslam.Error(f"cannot open {summary}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        if overwrite:
            return set()
        raise _bslam.Error(
            f"{summary}: found another file, expected the site.json of an earlier run, or --overwrite"
        ) from error


def files_of(summary: dict[str, Any]) -> set[str]:
    """The files that the summary of a site names for its recordings. Raises ValueError for names of other files."""
    recordings = summary["recordings"]
    names = {os.fspath(r[kind]) for r in recordings for kind in ("map", "trajectory") if r[kind]}
    names.update(os.fspath(part) for r in recordings for part in r.get("parts", []))
    if other := [name for name in names if not _RESULT.fullmatch(name)]:
        raise ValueError(f"{other[0]} is not the name of a result")
    return names


def make_folder(folder: pathlib.Path, option: str) -> None:
    """Creates the folder of an option."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise _bslam.Error(f"{folder}: {option}: found a file, expected a folder") from error
    except OSError as error:
        raise _bslam.Error(
            f"{folder}: {option}: found {error.strerror}, expected a folder that can be created"
        ) from error


def copy(source: Path, file: pathlib.Path) -> None:
    """Copies a file, which appears under its name when it is complete."""
    write(file, lambda unfinished: shutil.copyfile(source, unfinished))


def write(file: pathlib.Path, make: Callable[[pathlib.Path], Any]) -> None:
    """Writes a file by `make`, under its name when it is complete."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".", dir=file.parent, ignore_cleanup_errors=True) as work:
            unfinished = pathlib.Path(work, file.name)
            make(unfinished)
            unfinished.replace(file)
    except OSError as error:
        raise _bslam.Error(f"cannot write {file}: {error.strerror}") from error

"""Files of the user: those that options name, which all workers need, and the folder of the results."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Union

from .. import _bslam
from . import _interruption
from ._cache import Result, sha256_of
from ._tasks import check_map, map_of, refusal, run_program

Path = Union[str, "os.PathLike[str]"]

_RESULT = re.compile(r"site(_\d+)?\.bmap|apart/[^/]+\.(bmap|tum)|trajectories/[^/]+\.tum")  # names of files of a result
_MASK = re.compile(r'^    mask: "(.*)"$', re.MULTILINE)  # in a rig file that the program has written


def check_settings(config: Path | None, settings: Sequence[str]) -> None:
    """Refuses settings as each run would do it, with the names of the user."""
    if config is not None or settings:
        files = () if config is None else (f"--config={os.fspath(config)}",)
        run_program("settings", *files, *(f"--set={s}" for s in settings))


def check_rig(rig: Path, recordings: Sequence[str]) -> None:
    """Refuses a calibration that fits none of the recordings. Those that are not on disk are not looked at."""
    reason = ""
    for recording in recordings:
        _interruption.raise_if_noted()
        if "://" in recording or not (refused := refusal(recording, f"--rig={os.fspath(rig)}")):
            return
        if not reason and not refusal(recording):  # otherwise the reason is the recording
            reason = refused.partition("; --cameras ")[0]  # an option of other commands
    if reason:
        raise _bslam.Error(f"--rig: it fits none of the recordings: {reason}")


def options(
    cache: pathlib.Path, rig: Path | None, config: Path | None, settings: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...], dict[str, str]]:
    """The options of `run` and of all commands, and the files of the user by those that the options name instead.

    Files are copied into the cache, under the hashes of their contents.
    """
    run: list[str] = []
    common = [f"--set={s}" for s in settings]
    given: dict[str, str] = {}
    if rig is not None:
        run.append(f"--rig={(copied := shared_rig(cache, rig))}")
        given[str(copied)] = os.fspath(rig)
    if config is not None:
        common.insert(0, f"--config={(copied := _shared(cache, config))}")
        given[str(copied)] = os.fspath(config)
    return tuple(run), tuple(common), given


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
    if not _has_content(shared, digest):
        copy(file, shared)
        if not _has_content(shared, digest):
            raise _bslam.Error(f"cannot write {shared}: the copy differs from {file}; the same command continues")
    return shared


def _has_content(file: pathlib.Path, digest: str) -> bool:
    try:
        return sha256_of(file) == digest
    except OSError:
        return False


def open_results(out: pathlib.Path, overwrite: bool, cache: pathlib.Path | None = None) -> set[str]:
    """Creates the folder of the results and returns the files of an earlier result in it, relative to the folder.

    `cache` is the folder of the intermediate results, which may be in it.
    """
    make_folder(out, "--out")
    _check_writable(out)
    there = set(os.listdir(out))
    path_of_cache = os.path.relpath(os.path.realpath(cache or out / "cache"), os.path.realpath(out))
    others = there - {"cache", path_of_cache.partition("/")[0]}
    if "site.json" not in there and others and not overwrite:
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


def _check_writable(out: pathlib.Path) -> None:
    """Refuses a folder before hours of work for it."""
    try:
        tempfile.TemporaryFile(dir=out).close()
    except OSError as error:
        raise _bslam.Error(f"{out}: --out: found {error.strerror}, expected a folder that can be written") from error


def replace_results(
    out: pathlib.Path,
    files: Mapping[str, tuple[Callable[[Any, pathlib.Path], None], Any]],
    summary: dict[str, Any],
    earlier: set[str],
) -> None:
    """Writes `files`, by their names in the folder, and the summary, in place of the `earlier` files.

    Each is given by the function that copies it, such as `copy`, and its source.
    No file is replaced before all are complete, so that the earlier result remains if the disk is full.
    """
    if not (out / "site.json").exists():
        _write_json(out / "site.json", {"schema": 1, "sites": [], "recordings": [], "warnings": []})  # to know it again
    try:
        with tempfile.TemporaryDirectory(prefix=".", dir=out, ignore_cleanup_errors=True) as work:
            for name, (copy_file, source) in files.items():
                copy_file(source, pathlib.Path(work, name))
            _write_json(pathlib.Path(work, "site.json"), summary)
            for name in (*files, "site.json"):
                (out / name).parent.mkdir(exist_ok=True)
                pathlib.Path(work, name).replace(out / name)
    except OSError as error:
        raise _bslam.Error(f"cannot write {out}: {error.strerror}; the same command continues") from error
    for name in earlier - set(files):
        (out / name).unlink(missing_ok=True)


def _write_json(file: pathlib.Path, value: dict[str, Any]) -> None:
    write(file, lambda unfinished: unfinished.write_text(json.dumps(value, indent=1) + "\n"))


def copy(source: Path, file: pathlib.Path) -> None:
    """Copies a file, which appears under its name when it is complete."""
    write(file, lambda unfinished: shutil.copyfile(source, unfinished))


def copy_map(result: Result, file: pathlib.Path) -> None:
    """Copies a map of the cache. Raises DamagedError if it is not the one that was written."""

    def make(unfinished: pathlib.Path) -> None:
        with contextlib.suppress(FileNotFoundError):
            shutil.copyfile(map_of(result), unfinished)
        check_map(result, unfinished)

    write(file, make)


def write(file: pathlib.Path, make: Callable[[pathlib.Path], Any]) -> None:
    """Writes a file by `make`, under its name when it is complete and on the disk."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".", dir=file.parent, ignore_cleanup_errors=True) as work:
            unfinished = pathlib.Path(work, file.name)
            make(unfinished)
            with unfinished.open("rb") as written:
                os.fsync(written.fileno())
            unfinished.replace(file)
    except OSError as error:
        raise _bslam.Error(f"cannot write {file}: {error.strerror}; the same command continues") from error

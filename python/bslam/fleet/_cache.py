"""Results of tasks in files, named by the hash of everything they depend on."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import pathlib
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import IO, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

Result = dict[str, Any]

_ABOVE_EUROC = ("rig.yaml", ".complete", ".partial")  # names of files above a folder mav0 that the program reads
_ABOVE_KITTI_RAW = "calib_cam_to_cam.txt"  # the same above a drive, unless it is in the drive
FILES_ABOVE = (*_ABOVE_EUROC, _ABOVE_KITTI_RAW)
_WORK = "bslam_fleet_"  # begins the names of folders of tasks


class UnreadableError(Exception):
    """A recording cannot be read. The text says which one, and why."""


def reason_of(error: Exception) -> str:
    """The reason of the system, and the file that it concerns; or the text of the error."""
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error) or type(error).__name__
    return error.strerror if error.filename is None else f"{error.filename}: {error.strerror}"


def sha256_of(file: str | os.PathLike[str]) -> str:
    """Hash of the content of a file."""
    with open(file, "rb") as stream:
        return _sha256_in(stream)


def _sha256_in(stream: IO[bytes]) -> str:
    digest = hashlib.sha256()
    while block := stream.read(1 << 20):
        digest.update(block)
    return digest.hexdigest()


def key_of(value: Any) -> str:
    """Hash of a value that JSON can represent."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def cached(cache: str, stage: str, depends_on: Any, make: Callable[[pathlib.Path], Result]) -> Result:
    """The result of `make`, which writes files into the folder it is given, or that of an earlier call.

    The folder is renamed to its final name when it is complete and on the disk. One that cannot be read is replaced.
    `folder` and `computed` are added to the result.
    """
    folder = pathlib.Path(cache, stage, key_of([stage, depends_on]))
    result = _result_in(folder)
    computed = result is None
    if result is None:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".", dir=folder.parent, ignore_cleanup_errors=True) as work:
            made = pathlib.Path(work, "made")
            made.mkdir()
            (made / "result.json").write_text(json.dumps(make(made)))
            _flush(made)
            if _result_in(folder) is None:
                with contextlib.suppress(FileNotFoundError):
                    folder.rename(pathlib.Path(work, "damaged"))
            try:
                made.rename(folder)
            except OSError:  # another worker was faster
                if not folder.exists():
                    raise
        result = json.loads((folder / "result.json").read_bytes())
    return {**result, "folder": str(folder), "computed": computed}


def _result_in(folder: pathlib.Path) -> Result | None:
    """The result in a folder; None if there is none, or a computer that failed has not written all of it."""
    try:
        result = json.loads((folder / "result.json").read_bytes())
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return None
    return result if isinstance(result, dict) else None


def discard(result: Result) -> None:
    """Deletes a result, so that it is made again."""
    folder = pathlib.Path(result["folder"])
    (folder / "result.json").unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def _flush(folder: pathlib.Path) -> None:
    """Writes the files in a folder, and their names, to the disk."""
    for path in (*folder.iterdir(), folder):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        except OSError:
            if path != folder:  # some network file systems cannot do it for folders
                raise
        finally:
            os.close(descriptor)


def content_of(cache: str, recording: str) -> str:
    """Hash of the content of a recording. Raises UnreadableError, unless it is the cache that cannot be used.

    Files on disk are only read again if a size or modification time has changed. In object stores, the listing
    identifies the content; on web servers the header of the answer, or else the content itself.
    """
    with _reading(recording):
        system, root = fsspec.url_to_fs(recording)
        if not isinstance(system, LocalFileSystem):
            return key_of(_listing(system, root))
        files = sorted(_files_below(root))
        if not files:
            raise FileNotFoundError("the folder has no files")
        files += _files_above(system, root, _relative(files, root))
        listing = [(os.path.relpath(f, root), *_stat(f)) for f in files]

    def make(_: pathlib.Path) -> Result:
        with _reading(recording):
            return {"content": key_of([(os.path.relpath(f, root), sha256_of(f)) for f in files])}

    return cached(cache, "contents", [root, listing], make)["content"]


def name_of(recording: str) -> str:
    """The name that the program gives to a recording: that of its folder or file, where links lead."""
    system, root = fsspec.url_to_fs(recording)
    path = pathlib.PurePosixPath(os.path.realpath(root) if isinstance(system, LocalFileSystem) else root)
    return path.parent.name if path.name == "mav0" else path.name


@contextlib.contextmanager
def _reading(recording: str) -> Iterator[None]:
    """Errors are those of a recording."""
    try:
        yield
    except Exception as error:  # each store has errors of its own
        if "://" not in recording and not isinstance(error, (OSError, ValueError, ImportError)):
            raise
        raise UnreadableError(f"cannot open {recording}: {reason_of(error)}") from error


def local_copy(recording: str, folder: pathlib.Path) -> str:
    """The path of a recording, which is downloaded into `folder` unless it is on disk.

    The copy has the name of the original, and so has the folder above it, with the files there that the program reads.
    """
    system, root = fsspec.url_to_fs(recording)
    if isinstance(system, LocalFileSystem):
        return root
    path = pathlib.PurePosixPath(root)
    copy = folder / path.parent.name / path.name
    copy.parent.mkdir(parents=True, exist_ok=True)
    system.get(root, str(copy), recursive=True)
    for file in _files_above(system, root, _relative(_files_below(str(copy)), str(copy))):
        system.get_file(file, str(copy.parent / os.path.basename(file)))
    return str(copy)


@contextlib.contextmanager
def work_folder() -> Iterator[pathlib.Path]:
    """A folder of a task on this computer, for files that are no result. Those of workers that were killed are deleted.

    Each is locked as long as its process lives, and only has the name by which others find it when it is locked.
    """
    temporary = pathlib.Path(tempfile.gettempdir())
    for lost in temporary.glob(f"{_WORK}*"):
        with _locked(lost) as locked:
            if locked:
                shutil.rmtree(lost, ignore_errors=True)
    made = pathlib.Path(tempfile.mkdtemp())
    folder = temporary / f"{_WORK}{made.name}"
    with _locked(made):
        made.rename(folder)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _locked(folder: pathlib.Path) -> Iterator[bool]:
    """Locks a folder, and tells whether this succeeded: another process may hold it, or the disk have no locks."""
    descriptor = None
    try:
        with contextlib.suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        yield descriptor is not None and _lock(descriptor)
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _files_below(path: str, above: tuple[str, ...] = ()) -> Iterator[str]:
    """The files below a folder, or the file itself. Links are followed, unless they lead back to a folder above."""
    place = os.path.realpath(path)
    if not os.path.isdir(path):
        yield path
    elif place not in above:
        for name in os.listdir(path):
            yield from _files_below(os.path.join(path, name), (*above, place))


def _relative(files: Iterable[str], root: str) -> set[str]:
    return {os.path.relpath(file, root) for file in files}


def _files_above(system: fsspec.AbstractFileSystem, root: str, names: Collection[str]) -> dict[str, Any]:
    """By file: what the system knows of the files above a recording that the program reads. `names` are those in it."""
    above = os.path.dirname(root.rstrip("/"))
    found: dict[str, Any] = {}
    for name in _names_above(root, names) if above else ():
        file = os.path.join(above, name)
        with contextlib.suppress(FileNotFoundError, PermissionError):  # some stores refuse what does not exist
            info = system.info(file)
            if info["type"] != "directory":
                found[file] = info
    return found


def _names_above(root: str, names: Collection[str]) -> Collection[str]:
    """The names of the files above a recording that the program reads if they exist."""
    if os.path.basename(root.rstrip("/")) == "mav0":
        return _ABOVE_EUROC
    kitti_raw = any(f"image_{camera:02}/timestamps.txt" in names for camera in range(4))
    return (_ABOVE_KITTI_RAW,) if kitti_raw and _ABOVE_KITTI_RAW not in names else ()


def _listing(system: fsspec.AbstractFileSystem, root: str) -> list[tuple[str, Any]]:
    """The files of a recording in a store, relative to it, each with what changes with its content."""
    system.invalidate_cache()  # a listing is kept as long as the process lives
    found = system.find(root, detail=True)
    if not found:
        raise FileNotFoundError("No such file or directory")
    found.update(_files_above(system, root, _relative(found, root)))
    return [(os.path.relpath(file, root), _version(system, file, found[file])) for file in sorted(found)]


def _version(system: fsspec.AbstractFileSystem, file: str, info: dict[str, Any]) -> Any:
    """What changes with the content of a file in a store. `info` is that of a listing, which may be empty."""
    if "http" not in system.protocol:
        return hashlib.sha256(str(info or system.info(file)).encode()).hexdigest()
    info = system.info(file)  # with the header of the answer
    header = {key: info[key] for key in ("ETag", "Content-MD5", "Digest", "Last-Modified") if info.get(key)}
    if header:
        return [header, info.get("size")]
    with system.open(file) as stream:
        return _sha256_in(stream)


def _stat(file: str) -> list[int]:
    status = os.stat(file)
    return [status.st_size, status.st_mtime_ns]

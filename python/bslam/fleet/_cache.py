"""Results of tasks in files, named by the hash of everything they depend on."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import pathlib
import tempfile
from collections.abc import Callable, Iterator
from typing import IO, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

Result = dict[str, Any]


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
        local = isinstance(system, LocalFileSystem)
        files = sorted(_files_below(root) if local else system.find(root))
        if not files:
            raise FileNotFoundError("the folder has no files" if local else "No such file or directory")
        listing = [(os.path.relpath(f, root), *(_stat(f) if local else [_version(system, f)])) for f in files]
    if not local:
        return key_of(listing)

    def make(_: pathlib.Path) -> Result:
        with _reading(recording):
            return {"content": key_of([(os.path.relpath(f, root), sha256_of(f)) for f in files])}

    return cached(cache, "contents", [root, listing], make)["content"]


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
    """The path of a recording, which is downloaded into `folder` unless it is on disk."""
    system, root = fsspec.url_to_fs(recording)
    if isinstance(system, LocalFileSystem):
        return root
    copy = folder / pathlib.PurePosixPath(root).name
    system.get(root, str(copy), recursive=True)
    return str(copy)


def _files_below(path: str, above: tuple[str, ...] = ()) -> Iterator[str]:
    """The files below a folder, or the file itself. Links are followed, unless they lead back to a folder above."""
    place = os.path.realpath(path)
    if not os.path.isdir(path):
        yield path
    elif place not in above:
        for name in os.listdir(path):
            yield from _files_below(os.path.join(path, name), (*above, place))


def _version(system: fsspec.AbstractFileSystem, file: str) -> Any:
    """What changes with the content of a file in a store."""
    if "http" not in system.protocol:
        return system.ukey(file)
    info = system.info(file)  # ukey is the same for any content
    header = {key: info[key] for key in ("ETag", "Content-MD5", "Digest", "Last-Modified") if info.get(key)}
    if header:
        return [header, info.get("size")]
    with system.open(file) as stream:
        return _sha256_in(stream)


def _stat(file: str) -> list[int]:
    status = os.stat(file)
    return [status.st_size, status.st_mtime_ns]

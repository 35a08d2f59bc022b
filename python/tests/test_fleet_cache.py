"""The cache, and recordings in stores, as workers use them."""

import errno
import functools
import io
import os
import pathlib
import shutil
import subprocess
import sys

import bslam
import fsspec
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _files, _tasks
from bslam.fleet._cache import cached, content_of
from fsspec import AbstractFileSystem
from fsspec.registry import _registry
from test_fleet_requests import masked_rig


class Store(AbstractFileSystem):
    """A store of one file, which the tests describe."""

    cachable = False
    listing_error = None
    reading_error = None
    header: dict = {}
    content = b"the content"

    def find(self, path, *_, detail=False, **__):
        if self.listing_error:
            raise self.listing_error
        return {path: {}} if detail else [path]

    def info(self, path, **_):
        return {"name": path, "type": "file", "size": len(self.content), **self.header}

    def ukey(self, path):
        return path if "http" in self.protocol else super().ukey(path)

    def get(self, *_, **__):
        raise self.reading_error

    def open(self, *_, **__):
        return io.BytesIO(self.content)


@pytest.fixture
def store():
    """Makes a store with a protocol of its own."""
    added = []

    def make(protocol, **attributes):
        made = type("Made", (Store,), {"protocol": protocol, **attributes})
        for name in (protocol,) if isinstance(protocol, str) else protocol:
            added.append((name, _registry.get(name)))
            fsspec.register_implementation(name, made, clobber=True)
        return made

    yield make
    for name, before in added:
        _registry.pop(name)
        if before:
            _registry[name] = before


def made_map(folder, address):
    return _tasks.make_map(_tasks.Setup(str(folder), _tasks.program_hash()), address)


def test_error_of_a_store_is_that_of_the_recording(store, tmp_path):
    store("locked", listing_error=Exception("no credentials"))
    assert made_map(tmp_path, "locked://bucket/monday")["error"] == "cannot open locked://bucket/monday: no credentials"
    store("silent", listing_error=KeyError())
    assert made_map(tmp_path, "silent://bucket/monday")["error"] == "cannot open silent://bucket/monday: KeyError"


def test_recording_that_can_only_be_listed_is_failed(store, tmp_path):
    store("listed", reading_error=PermissionError(13, "Permission denied"))
    error = made_map(tmp_path, "listed://bucket/monday")["error"]
    assert error == "cannot read listed://bucket/monday: Permission denied"


def test_full_disk_under_a_download_is_no_error_of_the_recording(store, tmp_path):
    store("fetched", reading_error=OSError(errno.ENOSPC, "No space left on device"))
    with pytest.raises(OSError, match="No space left on device"):
        made_map(tmp_path, "fetched://bucket/monday")


@pytest.mark.parametrize("text", ["", "{", "[]"])
def test_damaged_result_is_made_again(tmp_path, text):
    def make(folder):
        (folder / "more.txt").write_text("new")
        return {"number": 1}

    folder = pathlib.Path(cached(str(tmp_path), "stage", 1, make)["folder"])
    (folder / "result.json").write_text(text)
    (folder / "more.txt").write_text("")
    again = cached(str(tmp_path), "stage", 1, make)
    assert (again["computed"], again["number"], again["folder"]) == (True, 1, str(folder))
    assert (folder / "more.txt").read_text() == "new"
    assert not cached(str(tmp_path), "stage", 1, make)["computed"]
    assert [f.name for f in (tmp_path / "stage").iterdir()] == [folder.name]


@pytest.fixture
def flushed(monkeypatch):
    """The inodes of the files and folders that were written to the disk."""
    inodes, flush = set(), os.fsync

    def note_flush(descriptor):
        inodes.add(os.fstat(descriptor).st_ino)
        flush(descriptor)

    monkeypatch.setattr(os, "fsync", note_flush)
    return inodes


def test_results_are_on_the_disk_before_they_have_their_name(tmp_path, monkeypatch, flushed):
    renamed, rename = [], pathlib.Path.rename

    def note_rename(path, target):
        renamed.append([p.name for p in (path, *path.iterdir()) if p.stat().st_ino not in flushed])
        return rename(path, target)

    monkeypatch.setattr(pathlib.Path, "rename", note_rename)
    cached(str(tmp_path), "stage", 1, lambda folder: {"size": (folder / "map.bmap").write_text("map")})
    assert renamed == [[]]


@pytest.mark.parametrize("key", ["ETag", "Content-MD5", "Digest", "Last-Modified"])
def test_changed_file_of_a_web_server_is_noticed_by_its_header(store, tmp_path, key):
    made = store(("http", "https"), header={key: "one"})
    content = functools.partial(content_of, str(tmp_path), "https://host/monday.bag")
    before = content()
    assert content() == before
    made.header = {key: "two"}
    assert content() != before


def test_file_of_a_web_server_that_sends_no_header_is_read(store, tmp_path):
    made = store(("http", "https"), content=b"one")
    content = functools.partial(content_of, str(tmp_path), "https://host/monday.bag")
    before = content()
    assert content() == before
    made.content = b"two"
    assert content() != before


def test_copies_of_the_files_of_options_are_on_the_disk_before_they_have_their_name(tmp_path, monkeypatch, flushed):
    named, replace = [], pathlib.Path.replace

    def note_name(path, target):
        named.append((pathlib.Path(target).suffix, path.stat().st_ino in flushed))
        return replace(path, target)

    rig = masked_rig(tmp_path / "given", 0)
    monkeypatch.setattr(pathlib.Path, "replace", note_name)
    _files.shared_rig(tmp_path / "cache", rig)
    assert named == [(".png", True), (".yaml", True)]


@pytest.mark.parametrize("damaged", [".png", ".yaml"])
def test_damaged_copies_of_the_files_of_options_are_written_again(tmp_path, damaged):
    rig = masked_rig(tmp_path / "given", 0)
    shared = _files.shared_rig(tmp_path / "cache", rig)
    (copy,) = shared.parent.glob(f"*{damaged}")
    before = copy.read_bytes()
    copy.write_bytes(before[:10])
    assert _files.shared_rig(tmp_path / "cache", rig) == shared
    assert copy.read_bytes() == before


def test_copy_that_differs_from_its_file_is_refused(tmp_path, monkeypatch):
    (tmp_path / "settings.yaml").write_text("features: {per_image: 800}")
    monkeypatch.setattr(shutil, "copyfile", lambda _, copy: pathlib.Path(copy).write_text("features:"))
    with pytest.raises(bslam.Error, match="the copy differs from .*settings.yaml; the same command continues"):
        _files.options(tmp_path / "cache", None, tmp_path / "settings.yaml", [])


def hash_of_the_installation(folder):
    """What a new process with the package in this folder finds."""
    command = [sys.executable, "-c", "from bslam.fleet import _tasks; print(_tasks.program_hash())"]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=True).stdout


def test_other_compiled_module_is_another_version(tmp_path):
    (copy := tmp_path / "bslam").mkdir()
    for path in pathlib.Path(bslam.__file__).parent.iterdir():
        if path.name != "__pycache__":
            (copy / path.name).symlink_to(path.absolute())
    module = copy / pathlib.Path(bslam._bslam.__file__).name
    before = hash_of_the_installation(tmp_path)
    content = module.read_bytes()
    module.unlink()
    module.write_bytes(content)
    assert hash_of_the_installation(tmp_path) == before
    module.write_bytes(content + b"other")
    assert hash_of_the_installation(tmp_path) != before


def test_program_that_is_replaced_is_another_version(tmp_path, monkeypatch):
    program = tmp_path / "bslam"
    program.write_text("old")
    monkeypatch.setattr(_tasks, "PROGRAM", program)
    setup = _tasks.Setup(str(tmp_path), _tasks.program_hash())
    setup.check()
    (tmp_path / "new").write_text("new")
    (tmp_path / "new").replace(program)
    with pytest.raises(bslam.Error, match="found another version of bslam"):
        setup.check()


def test_files_that_are_written_at_once_are_whole(tmp_path):
    """Two commands that write the same file do not share an unfinished one."""
    file = tmp_path / "rig.yaml"

    def outer(unfinished):
        unfinished.write_text("first")
        _files.write(file, lambda other: other.write_text("second"))
        assert file.read_text() == "second"
        assert unfinished.read_text() == "first"

    _files.write(file, outer)
    assert file.read_text() == "first"
    assert [f.name for f in tmp_path.iterdir()] == ["rig.yaml"]


def test_unfinished_files_are_removed(tmp_path):
    def interrupted(unfinished):
        unfinished.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _files.write(tmp_path / "rig.yaml", interrupted)
    assert not list(tmp_path.iterdir())


def test_folder_with_a_cache_and_other_files_is_not_replaced(tmp_path):
    (tmp_path / "cache").mkdir()
    assert _files.open_results(tmp_path, False) == set()
    (tmp_path / "site.bmap").write_text("mine")
    with pytest.raises(bslam.Error, match="--out: found a folder that is not empty"):
        _files.open_results(tmp_path, False)
    assert _files.open_results(tmp_path, True) == set()


@pytest.mark.parametrize("cache", ["work", "work/of/fleet"])
def test_folder_with_a_cache_of_another_name_is_that_of_an_interrupted_command(tmp_path, cache):
    (tmp_path / cache / "maps").mkdir(parents=True)
    with pytest.raises(bslam.Error, match="--out: found a folder that is not empty"):
        _files.open_results(tmp_path, False, tmp_path / "elsewhere")
    assert _files.open_results(tmp_path, False, tmp_path / cache) == set()
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(bslam.Error, match="--out: found a folder that is not empty"):
        _files.open_results(tmp_path, False, tmp_path / cache)

"""The cache, and recordings in stores, as workers use them."""

import fsspec
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _tasks
from fsspec import AbstractFileSystem
from fsspec.registry import _registry


class Store(AbstractFileSystem):
    """A store of one file, which the tests describe."""

    cachable = False
    listing_error = None
    reading_error = None
    header: dict = {}
    content = b"the content"

    def find(self, path, *_, **__):
        if self.listing_error:
            raise self.listing_error
        return [path]

    def info(self, path, **_):
        return {"name": path, "type": "file", "size": len(self.content), **self.header}

    def ukey(self, path):
        return path if "http" in self.protocol else super().ukey(path)

    def get(self, *_, **__):
        raise self.reading_error

    def open(self, path, *_, **__):
        return fsspec.filesystem("memory").open(path)


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

"""Maps in the cache that a disk or a person has damaged."""

import functools
import pathlib
import re
import shutil

import bslam
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _tasks, map_recordings
from bslam.fleet._cache import sha256_of
from distributed import Client


def change(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    file.write_bytes(content)


def truncate(file):
    file.write_bytes(file.read_bytes()[:-1000])


damages = pytest.mark.parametrize("damage", [change, truncate, pathlib.Path.unlink])


@pytest.fixture
def maps(program_run, tmp_path):
    """Two results of make_map."""
    made = []
    for name in ("first", "second"):
        (folder := tmp_path / name).mkdir()
        shutil.copy(program_run / "map.bmap", folder)
        shutil.copy(program_run / "run/trajectory.tum", folder)
        (folder / "result.json").write_text("{}")
        made.append({"map": sha256_of(folder / "map.bmap"), "folder": str(folder), "parts": []})
    return made


TASKS = {
    "compare": _tasks.compare,
    "merge": lambda setup, a, b: _tasks.merge(setup, [a, b]),
    "adjust": lambda setup, _, merged: _tasks.merge(setup, [merged], True),
    "transfer": _tasks.transfer,
}


@damages
@pytest.mark.parametrize("task", TASKS)
def test_damaged_map_is_no_refusal_and_is_deleted(maps, tmp_path, task, damage):
    first, second = (pathlib.Path(m["folder"]) for m in maps)
    damage(second / "map.bmap")
    setup = _tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash())
    message = "found a damaged map, expected the one that was written; the same command makes it again"
    for _ in range(2):  # Dask tries again
        with pytest.raises(_tasks.DamagedError, match=f"^{re.escape(f'{second}/map.bmap: {message}')}$"):
            TASKS[task](setup, *maps)
        assert not second.exists()
        assert (first / "map.bmap").exists()


def test_maps_that_are_refused_are_kept_if_they_are_not_damaged(maps, tmp_path):
    setup = _tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash())
    assert "expected different maps" in _tasks.compare(setup, *maps)["reason"]
    assert all(pathlib.Path(m["folder"], "map.bmap").exists() for m in maps)


@damages
def test_damaged_map_is_not_delivered_and_made_again(recording, tmp_path, damage):
    out = tmp_path / "site"
    with Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        made = functools.partial(map_recordings, [recording.folder], out, client=client)
        (found,) = made().recordings
        before = (out / found.map).read_bytes()
        (cached,) = (out / "cache/maps").glob("*/map.bmap")
        damage(cached)
        with pytest.raises(bslam.Error, match="found a damaged map, .*; the same command makes it again$"):
            made()
        assert (out / found.map).read_bytes() == before
        assert made().computed == 1
    assert (out / found.map).read_bytes() == before

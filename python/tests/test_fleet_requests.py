"""Requests to map many recordings that fail, and the files of a request, which become part of the cache."""

import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet._cache import content_of


def test_linked_folders_are_part_of_a_recording(recording, tmp_path):
    for camera in ("cam0", "cam1"):
        (tmp_path / f"linked/mav0/{camera}").mkdir(parents=True)
        (tmp_path / f"linked/mav0/{camera}/data").symlink_to(recording.folder / f"mav0/{camera}/data")
    (tmp_path / "linked/mav0/cam1/above").symlink_to(tmp_path / "linked")
    cache, linked = str(tmp_path / "cache"), str(tmp_path / "linked")
    both = content_of(cache, linked)
    assert content_of(cache, linked) == both
    (tmp_path / "linked/mav0/cam1/data").unlink()
    assert content_of(cache, linked) != both

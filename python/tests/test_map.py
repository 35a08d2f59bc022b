import json

import bslam
import numpy as np
import pytest


def test_arrays_agree_with_each_other(finished):
    m = finished[0].map()
    k, n = m.num_keyframes, m.num_landmarks
    assert k >= 2 and n > 100
    assert m.poses.shape == (k, 4, 4) and m.landmarks.shape == (n, 3)
    for column in (m.keyframe_ids, m.keyframe_times_ns, m.keyframe_parents, m.keyframe_submaps):
        assert column.shape == (k,) and column.dtype == np.int64
    for column in (m.landmark_ids, m.landmark_observations, m.landmark_submaps):
        assert column.shape == (n,) and column.dtype == np.int64
    assert 2 * n <= m.landmark_observations.sum() <= m.num_observations  # of keyframes, of their cameras
    assert m.keyframe_parents[0] == -1 and set(m.keyframe_parents[1:]) <= set(m.keyframe_ids)
    assert list(m.submaps) == [m.keyframe_ids[0]] and m.scale == "metric" and len(m.rig) == 2


def test_poses_of_keyframes_are_those_of_the_trajectory(finished):
    m = finished[0].map()
    rows = {round(row[0] * 1e9): row[1:4] for row in finished[0].trajectory()}
    for time_ns, pose in zip(m.keyframe_times_ns, m.poses, strict=True):
        np.testing.assert_allclose(pose[:3, 3], rows[time_ns], atol=1e-9)


def test_covisibility_counts_common_landmarks(finished):
    m = finished[0].map()
    edges = m.covisibility(min_landmarks=1)
    assert edges.shape[1] == 3 and (edges[:, 0] < edges[:, 1]).all() and (edges[:, 2] >= 1).all()
    assert len(m.covisibility(min_landmarks=10**6)) == 0
    with pytest.raises(bslam.Error, match=r"^Map.covisibility: min_landmarks: found 0, expected 1 or more$"):
        m.covisibility(0)


def test_words_are_distinct_and_similar_for_neighbours(finished):
    words = finished[0].map().words()
    assert len(words) == finished[0].map().num_keyframes
    for w in words:
        assert w.dtype == np.int32 and len(w) > 50 and (np.diff(w) > 0).all()
    assert len(np.intersect1d(words[0], words[1])) > len(words[0]) / 10


def test_saved_map_is_that_of_the_program(finished, program, program_run, tmp_path):
    finished[0].save_map(tmp_path / "map.bmap")
    mine, theirs = (bslam.Map.load(file) for file in (tmp_path / "map.bmap", program_run / "map.bmap"))
    np.testing.assert_array_equal(mine.poses, theirs.poses)
    np.testing.assert_array_equal(mine.landmarks, theirs.landmarks)
    info = json.loads(program("map", "info", tmp_path / "map.bmap", "--json"))
    assert (info["keyframes"], info["landmarks"]) == (mine.num_keyframes, mine.num_landmarks)


def test_a_saved_map_replaces_an_earlier_map_and_no_other_file(finished, tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("precious")
    with pytest.raises(bslam.Error, match=r"notes.txt: found an existing file of another kind, expected a new name"):
        finished[0].save_map(notes)
    assert notes.read_text() == "precious"
    for _ in range(2):
        finished[0].save_map(tmp_path / "map.bmap")


def test_map_is_loaded_by_a_system(recording, program_run):
    system, frames = recording.run(load_map=program_run / "map.bmap", localize_only=True)
    assert any(frame.relocalised for frame in frames)
    assert system.map().num_keyframes == bslam.Map.load(program_run / "map.bmap").num_keyframes


def test_errors_are_the_line_of_the_program(program, tmp_path):
    (tmp_path / "map.bmap").write_text("no map")
    for file in (tmp_path / "missing.bmap", tmp_path / "map.bmap"):
        with pytest.raises(bslam.Error) as error:
            bslam.Map.load(file)
        assert str(error.value) == program("map", "info", file, status=2)

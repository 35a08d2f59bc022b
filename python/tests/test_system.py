import gc
import json
import subprocess
import sys
import threading
import tracemalloc
import weakref

import bslam
import numpy as np
import pytest


@pytest.fixture
def system(recording):
    return bslam.System(bslam.Rig.load(recording.folder), mode="sequential")


def test_trajectory_equals_that_of_bslam_run_byte_for_byte(finished, program_run, tmp_path):
    finished[0].save_trajectory(tmp_path / "t.tum")
    assert (tmp_path / "t.tum").read_bytes() == (program_run / "run/trajectory.tum").read_bytes()
    np.testing.assert_allclose(finished[0].trajectory(), np.loadtxt(tmp_path / "t.tum"), atol=1e-9, rtol=0)


def test_the_verdict_on_the_calibration_is_that_of_bslam_run(finished, program_run, system):
    summary = json.loads((program_run / "run/summary.json").read_text())
    assert finished[0].calibration_verdict == summary["calibration"]["verdict"]
    assert system.calibration_verdict == "unknown"


def test_a_saved_trajectory_replaces_an_earlier_one_and_no_other_file(finished, tmp_path):
    rig = tmp_path / "rig.yaml"
    rig.write_text("precious")
    with pytest.raises(bslam.Error, match=r"rig.yaml: found an existing file of another kind, expected a new name"):
        finished[0].save_trajectory(rig)
    assert rig.read_text() == "precious"
    for _ in range(2):
        finished[0].save_trajectory(tmp_path / "t.tum")


def test_settings_and_seed_give_the_result_of_bslam_run(recording, program, tmp_path):
    system, _ = recording.run(settings={"features.per_image": 300, "tracking.frontend": "features"}, seed=3)
    system.save_trajectory(tmp_path / "t.tum")
    options = ["--set=features.per_image=300", "--set=tracking.frontend=features", "--seed=3", "--mode=sequential"]
    program("run", recording.folder, *options, "--out", tmp_path / "run")
    assert (tmp_path / "t.tum").read_bytes() == (tmp_path / "run/trajectory.tum").read_bytes()
    again, _ = recording.run(config=tmp_path / "run/config.yaml")
    np.testing.assert_array_equal(again.trajectory(), system.trajectory())


def test_frames_have_poses_with_shapes(finished, recording):
    system, frames = finished
    frame = frames[-1]
    assert (frame.index, frame.time_ns) == (len(frames) - 1, recording.stamps[-1])
    assert (frame.status, frame.reason, frame.tracking, frame.scale) == ("tracking", "", True, "metric")
    assert frame.T_world_cam0.shape == frame.T_odom_body.shape == (4, 4)
    assert frame.covariance.shape == (6, 6) and (np.diag(frame.covariance) > 0).all()
    assert frame.linear_velocity.shape == frame.angular_velocity.shape == (3,)
    np.testing.assert_allclose(frame.T_map_odom @ frame.T_odom_cam0, frame.T_world_cam0, atol=1e-9)
    assert [c.state for c in frame.cameras] == ["ok", "ok"] and frame.cameras[0].inliers > 20
    assert frames[0].keyframe and frame.total_ms > 0 and min(frame.stages.values()) >= 0
    assert system.trajectory().shape == (len(frames), 8)
    assert [t.shape for t in system.trajectories("body")] == [(len(frames), 8)]


def test_frame_without_pose_has_none(system, recording):
    frame = system.process(5, [np.zeros_like(recording.images[0][0]), None])
    assert (frame.status, frame.tracking, frame.T_world_cam0, frame.covariance) == ("not-started", False, None, None)
    assert frame.reason and [c.keypoints for c in frame.cameras] == [0, 0]


def test_accepts_strided_rows_and_read_only_arrays(recording, finished):
    system = bslam.System(bslam.Rig.load(recording.folder), "sequential")
    height, width = recording.images[0][0].shape
    wide = np.full((height, width + 40), 99, np.uint8)
    for t, (left, right) in zip(recording.stamps, recording.images, strict=True):
        wide[:, 7 : 7 + width] = left
        right.setflags(write=False)
        system.process([t, t], [wide[:, 7 : 7 + width], right])
        wide[:] = 3  # the memory may be used again after the call
    system.finish()
    np.testing.assert_array_equal(system.trajectory(), finished[0].trajectory())


def test_images_are_not_copied(system, recording):
    system.process(recording.stamps[0], recording.images[0])
    peaks = []  # A copy would appear in every peak. The minimum excludes allocations of other threads.
    tracemalloc.start()
    for i in range(1, min(20, len(recording.stamps))):
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()
        system.process(recording.stamps[i], recording.images[i])
        peaks.append(tracemalloc.get_traced_memory()[1] - before)
    tracemalloc.stop()
    assert min(peaks) < recording.images[0][0].size / 4


def test_masked_images_have_no_keypoints_there(system, recording):
    mask = np.zeros_like(recording.images[0][0])
    frame = system.process(recording.stamps[0], recording.images[0], [mask, None])
    assert frame.cameras[0].keypoints == 0 < frame.cameras[1].keypoints


INVALID_INPUTS = [
    ([1.5, 1], None, "stamps[0]: found float 1.5, expected an integer number of nanoseconds"),
    (1.5, None, "stamps: found float, expected an integer number of nanoseconds, or a list of them"),
    ([1], None, "stamps: found 1, expected 2, one for each image"),
    (np.array([1, 2, 3]), None, "stamps: found 3, expected 2, one for each image"),
    (1, [np.zeros((240, 376))] * 2, "images[0]: found an array of float64, shape (240, 376), expected a uint8 array of "
     "shape (h, w): 8-bit grey values"),
    (1, [np.zeros((240, 376, 3), np.uint8)] * 2, "images[0]: found an array of uint8, shape (240, 376, 3), expected a "
     "uint8 array of shape (h, w): 8-bit grey values"),
    (1, [np.zeros((240, 752), np.uint8)[:, ::2]] * 2, "images[0]: found 2 bytes between the pixels of a row, expected "
     "adjacent pixels, as made by numpy.ascontiguousarray"),
    (1, ["a.png", None], "images[0]: found str, expected a uint8 array of shape (h, w), or None"),
    (1, [np.zeros((10, 20), np.uint8)] * 2, "cam0: found an image of 20 x 10, expected 376 x 240, as in the "
     "calibration"),
    (1, [None], "images: found 1, expected 2, one per camera of the rig"),
    (1, [None, None], "images: found none, expected the image of at least one camera"),
    (1, 5, "images: found int 5, expected a list of arrays, one per camera of the rig"),
    (1, "a.png", "images: found str 'a.png', expected a list of arrays, one per camera of the rig"),
    (None, [np.zeros((240, 376), np.uint8)] * 2, "stamps: found NoneType, expected an integer number of nanoseconds, "
     "or a list of them"),
]  # fmt: skip


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda s: np.int64(s[0]), lambda s: np.array(s[0])])
def test_stamps_may_be_numbers_of_numpy(system, recording, kind):
    stamps = [recording.stamps[0]] * 2
    assert system.process(kind(stamps), recording.images[0]).time_ns == stamps[0]


@pytest.mark.parametrize(("stamps", "images", "text"), INVALID_INPUTS)
def test_wrong_input_is_an_error_in_one_line(system, recording, stamps, images, text):
    with pytest.raises(bslam.Error) as error:
        system.process(stamps, images or recording.images[0])
    assert str(error.value) == "System.process: " + text
    assert system.process(recording.stamps[0], recording.images[0]).index == 0  # the system has not changed


def test_wrong_settings_are_errors(recording):
    rig = bslam.Rig.load(recording.folder)
    with pytest.raises(bslam.Error, match=r"^settings: unknown setting 'features.per_imag'; did you mean"):
        bslam.System(rig, settings={"features.per_imag": 1})
    with pytest.raises(bslam.Error, match=r"^settings: mode: found fast, expected one of: sequential, lagged"):
        bslam.System(rig, "fast")
    with pytest.raises(bslam.Error, match="localize_only"):
        bslam.System(rig, localize_only=True)
    assert {s.name: s for s in bslam.settings()}["features.per_image"].expected.startswith("an integer in")


def test_arguments_of_other_types_are_errors_in_one_line(recording):
    rig = bslam.Rig.load(recording.folder)
    cases = [
        (("rig.yaml",), {}, "rig: found str 'rig.yaml', expected a Rig; Rig.load(path) reads a calibration"),
        ((None,), {}, "rig: found None, expected a Rig; Rig.load(path) reads a calibration"),
        ((rig, 3), {}, "mode: found int 3, expected sequential, lagged or parallel"),
        ((rig,), {"seed": "one"}, "seed: found str 'one', expected an integer"),
        ((rig,), {"settings": ["seed"]}, "settings: found list of 1, expected a dict of names and values"),
        ((rig,), {"load_map": 7}, "load_map: found int 7, expected the name of a file"),
    ]
    for arguments, options, text in cases:
        with pytest.raises(bslam.Error) as error:
            bslam.System(*arguments, **options)
        assert str(error.value) == "System: " + text


def test_other_threads_run_during_process(system, recording):
    # The switch interval is longer than the test, so the other thread runs only if process() releases the GIL.
    interval, begin, ran = sys.getswitchinterval(), threading.Event(), []
    thread = threading.Thread(target=lambda: (begin.wait(), ran.append(True)))
    thread.start()
    sys.setswitchinterval(1000)
    try:
        begin.set()
        assert not ran
        for t, images in zip(recording.stamps, recording.images, strict=True):
            system.process(t, images)
        assert ran
    finally:
        sys.setswitchinterval(interval)
        begin.set()
        thread.join()


def test_calling_the_system_from_a_callback_is_an_error(recording):
    calls = []
    system = bslam.System(
        bslam.Rig.load(recording.folder), "sequential", on_keyframe=lambda event: calls.append(call_again())
    )

    def call_again():
        with pytest.raises(bslam.Error, match="while another call is in progress"):
            system.trajectory()
        return system.map().num_keyframes  # may be called at any time

    system.process(recording.stamps[0], recording.images[0])
    assert calls == [1]


def test_events_are_reported(recording):
    keyframes, cameras, lines = [], [], []
    _, frames = recording.run(
        on_keyframe=keyframes.append, on_camera=cameras.append, on_log=lambda level, line: lines.append((level, line))
    )
    assert keyframes[0].keyframe == 0 and keyframes[0].frame.index == 0
    assert len(keyframes) >= sum(frame.keyframe for frame in frames)
    assert {level for level, _ in lines} <= {"info", "warning"} and all("\n" not in line for _, line in lines)


def test_former_names_of_settings_are_warnings(recording):
    lines = []
    bslam.System(
        bslam.Rig.load(recording.folder),
        settings={"tracking.own_times": False},
        on_log=lambda level, line: lines.append((level, line)),
    )
    text = "setting 'tracking.own_times' is now called"
    assert [level for level, line in lines if line.startswith(text)] == ["warning"]


def test_exception_in_a_callback_is_raised(recording):
    def fail(event):
        raise KeyError("mine")

    system = bslam.System(bslam.Rig.load(recording.folder), "sequential", on_keyframe=fail)
    with pytest.raises(KeyError, match="mine"):
        system.process(recording.stamps[0], recording.images[0])
    system.process(recording.stamps[1], recording.images[1])


def test_system_in_a_reference_cycle_is_garbage_collected(recording):
    class Owner:
        def __init__(self):
            self.system = bslam.System(bslam.Rig.load(recording.folder), on_keyframe=self.seen)

        def seen(self, event):
            pass

    owner = Owner()
    owner.system.process(recording.stamps[0], recording.images[0])
    reference = weakref.ref(owner)
    del owner
    gc.collect()
    assert reference() is None


def test_references_to_images_end_with_the_call(system, recording):
    image = recording.images[0][0].copy()
    count = sys.getrefcount(image)
    frame = system.process(recording.stamps[0], [image, None])
    assert sys.getrefcount(image) == count
    pose = frame.T_odom_cam0
    del frame
    assert pose.shape == (4, 4) and pose.flags.writeable  # the array owns its numbers


def test_nothing_leaks_at_exit(recording):
    # Leaked objects of the bindings would be reported on stderr.
    code = f"""
import bslam, numpy as np
rig = bslam.Rig.load({str(recording.folder)!r})
system = bslam.System(rig, on_log=print)
kept = [system.process(1, [np.zeros((240, 376), np.uint8), None]), system.map(), rig[0], system.trajectory()]
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_finish_is_called_once(system, recording):
    system.process(recording.stamps[0], recording.images[0])
    system.finish()
    with pytest.raises(bslam.Error, match=r"^System.finish: found a second call, expected one$"):
        system.finish()
    with pytest.raises(bslam.Error, match=r"process\(\) was called after finish\(\)"):
        system.process(recording.stamps[1], recording.images[1])


@pytest.mark.parametrize("mode", ["parallel", "lagged"])
def test_other_modes_run(recording, mode):
    system = bslam.System(bslam.Rig.load(recording.folder), mode)
    for t, images in zip(recording.stamps, recording.images, strict=True):
        system.process(t, images)
    system.interrupt()
    system.finish()
    assert len(system.trajectory()) == len(recording.stamps)

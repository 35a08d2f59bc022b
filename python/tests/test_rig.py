import os

import bslam
import numpy as np
import pytest
from conftest import RIG


def camera(**changes):
    values = {"model": "pinhole", "resolution": (64, 48), "intrinsics": [50, 50, 31.5, 23.5]}
    return bslam.Camera(**{**values, **changes})


def test_load_reads_files_and_folders_of_data_sets(recording):
    assert [c.name for c in bslam.Rig.load(RIG).cameras] == ["cam0", "cam1"]
    assert len(bslam.Rig.load(str(recording.folder))) == 2


def test_calibration_has_the_values_of_the_file():
    first = bslam.Rig.load(RIG)[0]
    assert (first.model, first.resolution) == ("pinhole-radtan", (376, 240))
    assert first.intrinsics == [229.3, 228.7, 187.5, 119.5]
    assert first.T_body_cam.shape == (4, 4)
    np.testing.assert_allclose(first.T_body_cam[:3, 3], [0.1, 0.055, 0])
    assert first.mask is None


def test_cameras_are_chosen_in_order():
    rig = bslam.Rig.load(RIG, cameras=[1])
    assert [c.name for c in rig.cameras] == ["cam1"]
    assert [c.name for c in bslam.Rig.load(RIG).subset([1, 0]).cameras] == ["cam1", "cam0"]
    with pytest.raises(bslam.Error, match=r"^Rig.subset: found 2, expected cameras in \[0, 1\]$"):
        bslam.Rig.load(RIG, cameras=[0, 2])


def test_rig_is_made_of_numbers_and_saved(tmp_path):
    T_body_cam = np.eye(4)
    T_body_cam[0, 3] = 0.2
    rig = bslam.Rig([camera(), camera(T_body_cam=T_body_cam, time_offset_s=0.01)])
    rig.save(tmp_path / "rig.yaml")
    again = bslam.Rig.load(tmp_path / "rig.yaml")[-1]
    assert (again.name, again.time_offset_s) == ("cam1", 0.01)
    np.testing.assert_array_equal(again.T_body_cam, T_body_cam)


def test_mask_is_copied_into_the_rig():
    mask = np.ones((48, 64), np.uint8)
    mask[:, :10] = 0
    rig = bslam.Rig([camera(mask=mask)])
    mask[:] = 7
    assert rig[0].mask.shape == (48, 64)
    assert (rig[0].mask[:, :10] == 0).all() and (rig[0].mask[:, 10:] != 0).all()
    with pytest.raises(bslam.Error, match=r"^Camera: mask: found shape \(2, 3\), expected \(48, 64\)$"):
        camera(mask=np.zeros((2, 3), np.uint8))


def test_masks_are_numbers_of_one_byte():
    mask = np.ones((48, 64), bool)
    mask[:, :10] = False
    assert (bslam.Rig([camera(mask=mask)])[0].mask == mask).all()
    for other in (np.full((48, 64), 0.5), mask.astype(np.int64)):
        with pytest.raises(bslam.Error, match=r"^Camera: mask: found .*, expected an array of uint8 or bool$"):
            camera(mask=other)


def test_arguments_of_other_types_are_errors_in_one_line():
    reads = "expected a list of Camera; Rig.load(path) reads a calibration"
    cases = [
        (lambda: bslam.Rig("rig.yaml"), f"Rig: cameras: found str 'rig.yaml', {reads}"),
        (lambda: bslam.Rig(None), f"Rig: cameras: found None, {reads}"),
        (lambda: bslam.Rig(camera()), f"Rig: cameras: found Camera, {reads}"),
        (lambda: bslam.Rig([camera(), {}]), "Rig: cameras[1]: found dict, expected a Camera"),
        (lambda: camera(model=3), "Camera: model: found int 3, expected the name of a model, such as pinhole"),
        (lambda: camera(resolution=64), "Camera: resolution: found int 64, expected two integers: width, height"),
        (
            lambda: camera(intrinsics=[50, 50]),
            "Camera: intrinsics: found list of 2, expected four numbers: fx, fy, cx, cy in pixels",
        ),
        (
            lambda: camera(T_body_cam=np.eye(3)),
            "Camera: T_body_cam: found array of float64, shape (3, 3), expected an array of shape (4, 4)",
        ),
    ]
    for call, text in cases:
        with pytest.raises(bslam.Error) as error:
            call()
        assert str(error.value) == text


def test_masks_are_saved_with_the_rig(tmp_path):
    mask = np.full((48, 64), 255, np.uint8)
    mask[:20] = 0
    bslam.Rig([camera(), camera(mask=mask)]).save(tmp_path / "robot.yaml")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["robot.yaml", "robot_mask1.png"]
    tmp_path.rename(moved := tmp_path.with_name("moved"))
    again = bslam.Rig.load(moved / "robot.yaml")
    assert again[0].mask is None
    np.testing.assert_array_equal(again[1].mask, mask)


def test_errors_name_files_that_are_no_unicode(tmp_path):
    file = os.fsencode(tmp_path) + b"/caf\xe9.yaml"
    with pytest.raises(bslam.Error, match=r"caf\\xe9\.yaml"):
        bslam.Rig.load(os.fsdecode(file))


def test_errors_are_the_line_of_the_program(tmp_path, program):
    bad = tmp_path / "bad.yaml"
    bad.write_text(RIG.read_text().replace("229.3", "-229.3"))
    for file in (tmp_path / "missing.yaml", bad):
        with pytest.raises(bslam.Error) as error:
            bslam.Rig.load(file)
        assert str(error.value) == program("rig", "info", file, status=2)
    assert issubclass(bslam.Error, ValueError)


def test_index_out_of_range_ends_a_loop():
    assert len(list(bslam.Rig.load(RIG))) == 2
    with pytest.raises(IndexError):
        bslam.Rig.load(RIG)[2]

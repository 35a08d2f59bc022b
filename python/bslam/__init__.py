"""Visual SLAM for rigs of any number of cameras.

Metres, seconds (nanoseconds if the name ends in _ns), radians, pixels. T_a_b maps coordinates in b to coordinates in a.

    rig = bslam.Rig.load("rig.yaml")
    system = bslam.System(rig, mode="sequential")
    frame = system.process([stamp0_ns, stamp1_ns], [image0, image1])
    system.finish()
    system.trajectory()  # (n, 8)
"""

from ._bslam import (
    Camera,
    CameraEvent,
    CameraStatus,
    Error,
    Frame,
    KeyframeEvent,
    LoopEvent,
    Map,
    Rig,
    Setting,
    System,
    settings,
)
from ._bslam import version as __version__
from ._evaluation import Evaluation, Statistics, evaluate
from ._program import Calibration, calibrate, simulate

__all__ = [
    "Calibration",
    "Camera",
    "CameraEvent",
    "CameraStatus",
    "Error",
    "Evaluation",
    "Frame",
    "KeyframeEvent",
    "LoopEvent",
    "Map",
    "Rig",
    "Setting",
    "Statistics",
    "System",
    "__version__",
    "calibrate",
    "evaluate",
    "settings",
    "simulate",
]

for _name in __all__:  # where users find it, in messages and help
    if _name not in ("__version__", "settings"):
        globals()[_name].__module__ = __name__

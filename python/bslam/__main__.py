"""Runs the program `bslam`: `python -m bslam ARGUMENTS`."""

import os
import sys

from ._program import PROGRAM

os.execv(PROGRAM, [str(PROGRAM), *sys.argv[1:]])

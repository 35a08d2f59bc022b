"""`python -m bslam` is the program."""

import os
import sys

from ._program import PROGRAM

os.execv(PROGRAM, [str(PROGRAM), *sys.argv[1:]])

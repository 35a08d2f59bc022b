#!/usr/bin/env python3
"""Compiles the ROS 2 node against stand-ins of the headers of ROS 2: compile_ros2.py INCLUDE_OF_BSLAM [COMPILER]

Each header of ROS 2 that the node includes becomes one that includes ros2/test_stubs/stand_ins.h. Nothing is linked.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

ROS = pathlib.Path(__file__).resolve().parent.parent
OWN = ('bslam/', 'opencv2/')


def main():
    include, compiler = sys.argv[1], (sys.argv[2:] or ['c++'])[0]
    sources = sorted((ROS / 'ros2').glob('*.cc'))
    with tempfile.TemporaryDirectory() as folder:
        for source in sources + sorted((ROS / 'ros2').glob('*.h')):
            for header in re.findall(r'#include <([^>]+/[^>]+)>', source.read_text()):
                if header.startswith(OWN):
                    continue
                path = pathlib.Path(folder) / header
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text('#include "stand_ins.h"\n')
        for source in sources:
            subprocess.run([compiler, '-std=c++17', '-fsyntax-only', '-Wall', '-Wextra', '-Werror', '-Wno-undefined-inline', f'-I{folder}',
                            f'-I{ROS}', f'-I{ROS}/ros2', f'-I{ROS}/ros2/test_stubs', f'-I{include}', '-I/usr/include/opencv4', source],
                           check=True)
    print(f'ok: {len(sources)} files of the ROS 2 node compile against stand-ins of its headers')


if __name__ == '__main__':
    main()

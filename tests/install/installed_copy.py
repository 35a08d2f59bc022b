#!/usr/bin/env python3
"""Installs a build into a separate folder and uses it like an external project: builds the examples against it with
find_package, as C++17 with warnings as errors, and runs them on a rendered recording. The same images give the same bytes of
trajectory by `bslam run --mode sequential` (the folder), by the example `recorded` (the C++ library) and, if the build has it, by the
Python package.

    installed_copy.py --build BUILD --source SOURCE [--cmake CMAKE] [--data DATA] [--python PYTHON]
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile


def run(*command):
    command = [str(c) for c in command]
    print('$', *command, flush=True)
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(done.stdout, flush=True)
    if done.returncode != 0:
        sys.exit(f'failed with {done.returncode}')
    return done.stdout


def check(condition, claim):
    if not condition:
        sys.exit('check failed: ' + claim)


def check_package(prefix):
    """Checks that the installed package requires only the standard library from its users."""
    targets = next(prefix.rglob('bslamTargets.cmake')).read_text()
    for word in ('-msse', '-Werror', '-Wconversion', 'igen', 'opencv', 'yaml'):
        check(word not in targets, f'bslamTargets.cmake does not contain {word}')
    for header in prefix.rglob('include/bslam/*.h'):
        for include in re.findall(r'#include "([^"]+)"', header.read_text()):
            check(include.startswith('bslam/'), f'{header.name} includes public headers only, not {include}')
    library = next(prefix.rglob('libbslam.so'))
    needed = run('readelf', '-d', library)
    for word in ('opencv', 'embree'):
        check(word not in needed, f'the library does not need {word}')
    check_exports(prefix, run('nm', '-D', '--defined-only', '-C', library))


def check_exports(prefix, exported):
    """The library exports what its headers mark, and what templates of the standard library are made of."""
    marked = set()
    for header in prefix.rglob('include/bslam/*.h'):
        text = header.read_text()
        marked.update(re.findall(r'(?:class|struct) BSLAM_EXPORT (\w+)', text))
        marked.update(re.findall(r'^(?:\[\[noreturn\]\] )?BSLAM_EXPORT [^;(]*?(\w+|operator\S+)\(', text, re.MULTILINE))
    check('System' in marked and 'version' in marked, 'the headers mark what is exported')
    allowed = re.compile(r'(?:(?:typeinfo|typeinfo name|vtable) for )?(?:bslam::(?:%s)(?:\(|::|\[|$)|std::|__gnu_cxx::)'
                         % '|'.join(map(re.escape, sorted(marked))))
    for line in exported.splitlines():
        kind, name = line.split(None, 2)[-2:] if line[0] in '0123456789abcdef' else line.split(None, 1)
        name = re.sub(r'^(?:guard variable for |VTT for )', '', name)
        of_std = kind in 'WVu' and re.search(r'\bstd::|__gnu_cxx::', name) and 'bslam::' not in name.split('(')[0].split('<')[0]
        check(of_std or allowed.match(name), f'{name} ({kind}) is exported only if a header marks it')


def check_pkg_config(prefix, work):
    if not shutil.which('pkg-config'):
        return
    folder = next(prefix.rglob('bslam.pc')).parent
    flags = run('env', f'PKG_CONFIG_PATH={folder}', 'pkg-config', '--cflags', '--libs', 'bslam').split()
    source = work / 'version.cc'
    source.write_text('#include <bslam/bslam.h>\nint main() { return bslam::version().empty(); }\n')
    run('c++', '-std=c++17', source, *flags, f'-Wl,-rpath,{folder.parent}', '-o', work / 'version')
    run(work / 'version')


def check_trajectories(files):
    poses = files[0].read_bytes()
    check(poses.count(b'\n') > 2, f'{files[0].name} has poses')
    for file in files[1:]:
        check(file.read_bytes() == poses, f'{file} has the bytes of {files[0]}')
    print(f'{len(files)} ways give the same {len(poses)} bytes of trajectory')


def check_examples(prefix, cmake, source, data, work, python):
    build = work / 'examples'
    run(cmake, '-S', source / 'examples', '-B', build, f'-DCMAKE_PREFIX_PATH={prefix}', '-DCMAKE_BUILD_TYPE=Release',
        '-DCMAKE_CXX_STANDARD=17', '-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror')
    run(cmake, '--build', build)
    bslam = next(prefix.rglob('bin/bslam'))
    if data is None:
        data = work / 'data'
        run(bslam, 'simulate', '--out', data, '--rig', source / 'tests/install/stereo.yaml', '--duration', 3,
            '--rate', 10, '--progress', 'never')
    run(build / 'recorded', data, work / 'trajectory.tum', work / 'map.bmap')
    run(bslam, 'run', data, '--mode', 'sequential', '--out', work / 'run', '--progress', 'never')
    ways = [work / 'run/trajectory.tum', work / 'trajectory.tum']
    if python:
        run('env', f'PYTHONPATH={python[1]}', 'PYTHONDONTWRITEBYTECODE=1', python[0], source / 'python/examples/folder.py', data, work / 'python.tum')
        ways.append(work / 'python.tum')
    check_trajectories(ways)
    check('keyframes in 1 submaps' in run(build / 'read_map', work / 'map.bmap', work / 'points.xyz'), 'the saved map can be read')
    check((work / 'points.xyz').stat().st_size > 0, 'the map has landmarks')
    run(build / 'live', data, 4)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--build', type=pathlib.Path, required=True)
    parser.add_argument('--source', type=pathlib.Path, required=True)
    parser.add_argument('--cmake', default='cmake')
    parser.add_argument('--data', type=pathlib.Path, help='a recording in EuRoC layout; default: rendered')
    parser.add_argument('--python', type=pathlib.Path, help='interpreter of the Python package in BUILD/python; default: it is not run')
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        run(arguments.cmake, '--install', arguments.build, '--prefix', work / 'prefix')
        check_package(work / 'prefix')
        check_pkg_config(work / 'prefix', work)
        check_examples(work / 'prefix', arguments.cmake, arguments.source, arguments.data, work,
                       arguments.python and (arguments.python, arguments.build / 'python'))


if __name__ == '__main__':
    main()

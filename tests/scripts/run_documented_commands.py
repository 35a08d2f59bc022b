#!/usr/bin/env python3
"""Runs the commands of the documentation.

    run_documented_commands.py BSLAM [--root DIR] [--rig FILE] [PAGE ...]

The blocks of a page that begin with ```sh are executed in order by bash, in a temporary folder of the page, with the program
BSLAM as `bslam`. Pages have the order of the navigation in mkdocs.yml; the folder of an earlier page is ../NAME. A block after
the comment `<!-- not run: REASON -->` is skipped. The comment `<!-- sh ... -->`, which readers do not see, contains
commands that prepare the next block. A failing command is printed with its output, and the exit status is 1.

With --rig, `bslam simulate` without a rig gets this one: most of the time of the documented commands is otherwise that of rendering
the images of the default rig.
"""
import argparse
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

# Adds the rig to a command that names none.
WITH_RIG = r'''#!/bin/sh
case "$*" in
  *--rig*) ;;
  simulate\ *) set -- "$@" --rig {rig} ;;
esac
exec {program} "$@"
'''
BLOCK = re.compile(r'^<!-- not run: (?P<reason>[^\n]*?) -->\n|^<!-- sh\n(?P<hidden>.*?)^-->$|^```sh\n(?P<shown>.*?)^```$',
                   re.MULTILINE | re.DOTALL)


def blocks(text):
    """Yields (line, commands, reason) of each block: commands to run, and the reason if they are not run."""
    reason = None
    for match in BLOCK.finditer(text):
        line = text.count('\n', 0, match.start()) + 2
        if match['reason'] is not None:
            reason = (match.end(), match['reason'])
        elif match['hidden'] is not None:
            yield line, match['hidden'], None
        else:
            yield line, match['shown'], reason[1] if reason and reason[0] == match.start() else None


def pages(root):
    """Pages of docs/ in the order of the navigation, then the others."""
    listed = re.findall(r':\s*([a-z_]+\.md)$', (root / 'mkdocs.yml').read_text(), re.MULTILINE)
    present = sorted(p.name for p in (root / 'docs').glob('*.md'))
    return [p for p in listed if p in present] + [p for p in present if p not in listed]


def run_page(page, folder, environment):
    """Runs the blocks of a page. Returns the numbers of those run and skipped, or None after a failure."""
    done = skipped = 0
    for line, commands, reason in blocks(page.read_text()):
        if reason is not None:
            skipped += 1
            continue
        start = time.monotonic()
        result = subprocess.run(['bash', '-euo', 'pipefail', '-c', commands], cwd=folder, env=environment, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if result.returncode != 0:
            print(f'{page}:{line}: exit status {result.returncode}\n{commands}{result.stdout}')
            return None
        done += 1
        print(f'{page.name}:{line}: {time.monotonic() - start:.1f} s')
    return done, skipped


def install(program, rig, folder):
    """Makes `bslam` in the folder."""
    command = folder / 'bslam'
    if rig is None:
        command.symlink_to(program.resolve())
        return
    command.write_text(WITH_RIG.format(rig=shlex.quote(str(rig.resolve())), program=shlex.quote(str(program.resolve()))))
    command.chmod(0o755)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bslam', type=pathlib.Path)
    parser.add_argument('--root', type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument('--rig', type=pathlib.Path, help='of recordings; default: that of `bslam simulate`')
    parser.add_argument('page', nargs='*', help='names such as start.md; default: all')
    arguments = parser.parse_args()
    total = [0, 0]
    with tempfile.TemporaryDirectory(prefix='bslam_documentation_') as temporary:
        programs = pathlib.Path(temporary, '.bin')
        programs.mkdir()
        install(arguments.bslam, arguments.rig, programs)
        environment = dict(os.environ, PATH=f'{programs}{os.pathsep}{os.environ["PATH"]}')
        for name in arguments.page or pages(arguments.root):
            folder = pathlib.Path(temporary, pathlib.Path(name).stem)
            folder.mkdir()
            counts = run_page(arguments.root / 'docs' / name, folder, environment)
            if counts is None:
                return 1
            total = [a + b for a, b in zip(total, counts)]
    print(f'{total[0]} blocks run, {total[1]} skipped')
    return 0 if total[0] > 0 else 1


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/env python3
"""Tests of run_documented_commands.py with small pages."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().with_name('run_documented_commands.py')
FENCE = '```'


class DocumentedCommands(unittest.TestCase):
    def run_on(self, *options, **pages):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / 'docs').mkdir()
            (root / 'mkdocs.yml').write_text(''.join(f'  - A title: {name}.md\n' for name in pages))
            for name, text in pages.items():
                (root / f'docs/{name}.md').write_text(text)
            program = root / 'program'
            program.write_text('#!/bin/sh\necho "$@" > said\n')
            program.chmod(0o755)
            return subprocess.run([sys.executable, SCRIPT, program, '--root', root, *options], text=True, capture_output=True)

    def test_blocks_are_run_in_order_with_the_program(self):
        result = self.run_on(b=f'{FENCE}sh\nbslam one\n{FENCE}\ntext\n{FENCE}sh\ngrep one said\n{FENCE}\n',
                             a=f'{FENCE}sh\ngrep one ../b/said\n{FENCE}\n')
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn('3 blocks run, 0 skipped', result.stdout)

    def test_a_failing_command_is_an_error_with_its_line(self):
        result = self.run_on(a=f'text\n\n{FENCE}sh\nfalse | cat\ntouch never\n{FENCE}\n')
        self.assertEqual(result.returncode, 1)
        self.assertIn('a.md:4: exit status 1', result.stdout)

    def test_marked_blocks_and_other_languages_are_not_run(self):
        result = self.run_on(a=f'<!-- not run: a reason -->\n{FENCE}sh\nfalse\n{FENCE}\n{FENCE}text\nfalse\n{FENCE}\n'
                               f'{FENCE}sh\ntrue\n{FENCE}\n')
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn('1 blocks run, 1 skipped', result.stdout)

    def test_commands_in_comments_prepare_the_next_block(self):
        result = self.run_on(a=f'<!-- sh\ntouch file\n-->\n{FENCE}sh\nrm file\n{FENCE}\n')
        self.assertEqual(result.returncode, 0, result.stdout)

    def test_the_given_rig_is_added_to_simulations_without_one(self):
        text = (f'{FENCE}sh\nbslam simulate --out "a  b"\ngrep -x "simulate --out a  b --rig /a rig" said\n{FENCE}\n'
                f'{FENCE}sh\nbslam simulate --rig own\ngrep -x "simulate --rig own" said\n{FENCE}\n'
                f'{FENCE}sh\nbslam run simulate --out x\ngrep -x "run simulate --out x" said\n{FENCE}\n')
        result = self.run_on('--rig', '/a rig', page=text)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual(self.run_on(page=f'{FENCE}sh\nbslam simulate\ngrep -x simulate said\n{FENCE}\n').returncode, 0)

    def test_pages_without_commands_are_an_error(self):
        self.assertEqual(self.run_on(a='text\n').returncode, 1)


if __name__ == '__main__':
    unittest.main()

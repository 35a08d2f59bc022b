#!/usr/bin/env python3
import pathlib
import subprocess
import unittest

BUILD = pathlib.Path(__file__).resolve().parents[2] / 'scripts/build'


class Build(unittest.TestCase):
    def test_prints_its_usage_without_a_preset(self):
        for arguments, status in ([], 2), (['-DBSLAM_TESTS=ON'], 2), (['--help'], 0):
            done = subprocess.run([BUILD, *arguments], capture_output=True, text=True)
            self.assertEqual(done.returncode, status)
            self.assertIn('scripts/build PRESET', done.stdout if status == 0 else done.stderr)


if __name__ == '__main__':
    unittest.main()

#!/usr/bin/env python3
"""Tests that the messages in docs/messages.md are those of the program.

Every message in the first column of its tables must occur in src/: what is between `...`, `found` and `expected` in one string.
Every warning of a run and about a calibration, and every reason of a loss, must occur in the page.
"""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs/messages.md').read_text()
# Strings of the sources below that are no messages of their own.
NO_MESSAGES = {'more intervals', 'more intervals, see summary.json', 'and so on', 'keyframes', 'extrinsics check',
               'with it as given', 'with the calibration as given', 'test against the images', '0123456789',
               '`bslam run` estimates them from the motion of the rig', 'there must be one entry per camera'}


def literals(path):
    """The strings of a source file, with adjacent ones joined and `...` for values."""
    text = re.sub(r'^\s*//.*$', '', path.read_text(), flags=re.MULTILINE)
    strings = re.findall(r'"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*', text)
    for string in strings:
        joined = ''.join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', string))
        yield re.sub(r'\{[^{}]*\}', '...', joined.replace('\\n', '').replace('\\"', '"'))


def fragments(message):
    """The parts of a message between values."""
    parts = re.split(r'\.\.\.|\bfound |, expected |: ', message.replace('\\|', '|'))
    return [p.strip(' ,;:()') for p in parts if len(p.strip(' ,;:()')) > 7]


def quoted(page):
    """(line, message) for each message in the first column of a table."""
    for number, line in enumerate(page.splitlines(), 1):
        if line.startswith('| '):
            cell = re.split(r'(?<!\\)\|', line)[1]
            yield from ((number, m) for m in re.findall(r'`([^`]+)`', cell))


class DocumentedMessages(unittest.TestCase):
    maxDiff = None

    def test_documented_messages_exist(self):
        known = '\n'.join(s for p in sorted((ROOT / 'src').rglob('*.cc')) for s in literals(p))
        known += '\n' + (ROOT / 'src/session/summary.h').read_text()
        missing = [f'docs/messages.md:{number}: {part!r} is in no message of src/' for number, message in quoted(PAGE)
                   for part in fragments(message) if part not in known]
        self.assertEqual(missing, [])

    def test_warnings_and_reasons_are_documented(self):
        sources = ['session/run_warnings.cc', 'session/estimate_warnings.cc', 'cli/run_messages.cc', 'calibration/rig_warnings.cc',
                   'calibration/convention_text.cc', 'tracking/tracker_state.cc', 'tracking/camera_status.cc', 'image_files/image_folder.cc']
        page = PAGE.replace('\\|', '|')
        missing = []
        for source in sources:
            for string in literals(ROOT / 'src' / source):
                if '.h' in string or '/' in string and ' ' not in string:
                    continue  # a header
                missing += [f'{source}: {part!r} is not in docs/messages.md' for part in fragments(string)
                            if part not in page and part not in NO_MESSAGES]
        self.assertEqual(missing, [])


if __name__ == '__main__':
    unittest.main()

#!/usr/bin/env python3
"""The live view of `bslam run`, as a browser meets it, and as somebody meets it who should not.

    live_view_test.py BSLAM
"""
import base64
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from browser_connection import SLOWNESS, Browser, View

BSLAM = pathlib.Path(sys.argv.pop(1)).resolve()
RIG = pathlib.Path(__file__).resolve().parents[1] / 'support/ring.yaml'
FRAMES = 20


def floats(value):
    data = base64.b64decode(value['f32'])
    return struct.unpack(f'<{len(data) // 4}f', data)


class LiveView(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.data, cls.out = pathlib.Path(cls.folder.name) / 'data', pathlib.Path(cls.folder.name) / 'out'
        subprocess.run([BSLAM, 'simulate', '--out', cls.data, '--rig', RIG, '--duration', '2', '--rate', '10', '--progress', 'never'],
                       check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def view(self, *options):
        """A run that is paced slowly, so that it does not end before the test has looked."""
        view = View(BSLAM, self.data, self.out, '--pace', 'realtime', *options)
        self.addCleanup(view.process.stdout.close)
        self.addCleanup(view.process.stderr.close)
        self.addCleanup(view.process.wait)
        self.addCleanup(view.process.kill)
        return view

    def paused(self, view):
        """A browser that has paused the run."""
        browser = Browser(view)
        self.addCleanup(browser.close)
        self.assertEqual(browser.status, 101)
        browser.send('pause')
        browser.state({'paused': True})
        return browser

    def finish(self, browser, view):
        browser.send('speed 0')
        browser.send('resume')
        try:
            while True:
                browser.next('state')
        except ConnectionError as closed:
            self.assertEqual(str(closed), 'ended')
        self.assertEqual(view.process.wait(timeout=60 * SLOWNESS), 0)

    def test_only_requests_with_the_token_from_this_machine_are_answered(self):
        view = self.view()
        self.paused(view)
        status, body = view.request()
        self.assertEqual(status, 200)
        self.assertIn('id="bslam-data"', body)
        self.assertEqual(view.request('/')[0], 403)
        self.assertEqual(view.request('/?token=' + '0' * 32)[0], 403)
        self.assertEqual(view.request('/nothing')[0], 403)
        self.assertEqual(view.request(host='evil.example')[0], 403)
        self.assertEqual(view.request(f'/nothing?token={view.token}')[0], 404)
        self.assertEqual(view.request(method='POST')[0], 405)
        self.assertEqual(view.request(extra='Origin: http://evil.example\r\n')[0], 403)
        for wrong in ({'token': '0' * 32}, {'token': ''}, {'origin': 'http://evil.example'}, {'host': f'evil.example:{view.port}'}):
            with self.subTest(**wrong):
                browser = Browser(view, **wrong)
                self.assertEqual(browser.status, 403)
                browser.close()
        own = Browser(view, origin=f'http://127.0.0.1:{view.port}')
        self.assertEqual(own.status, 101)
        own.close()

    def test_frames_and_map_arrive_and_the_run_can_be_paused_stepped_and_paced(self):
        view = self.view()
        browser = self.paused(view)
        browser.send('step')
        first = browser.next('frame')
        for _ in range(5):  # cameras that look aside see the map a few frames later
            browser.send('step')
        frame = first
        while frame['index'] < first['index'] + 5:
            newer = browser.next('frame')
            self.assertGreater(newer['index'], frame['index'])
            frame = newer
        self.assertTrue(frame['tracking'])
        self.assertEqual(len(frame['cameras']), 4)
        for camera in frame['cameras']:
            self.assertEqual(camera['state'], 'ok')
            self.assertTrue(base64.b64decode(camera['jpeg']).startswith(b'\xff\xd8'))
            pixels = floats(camera['tracked'])
            self.assertGreater(len(pixels), 10)
            self.assertTrue(all(-1 <= u <= camera['width'] for u in pixels[::2]))
            self.assertTrue(all(-1 <= v <= camera['height'] for v in pixels[1::2]))
        run = browser.newest('run')
        self.assertTrue(run['live'])
        self.assertGreater(run['landmarks'], 100)
        self.assertEqual(run['submaps'][0]['root'], frame['pose']['root'])
        browser.send('speed 0.5')
        browser.state({'speed': 0.5, 'paused': True})
        for wrong in ('speed -1', 'speed 1e99', 'speed x', 'speed ', 'got nothing', '', '\x00\x01'):
            browser.send(wrong)
        browser.send('speed 2')
        self.assertEqual(browser.next('state')['speed'], 2)  # none of the others had an effect
        self.finish(browser, view)

    def test_the_end_is_the_report(self):
        view = self.view()
        browser = self.paused(view)
        browser.send('speed 0')
        browser.send('resume')
        runs = []
        try:
            while True:
                runs.append(browser.next('run'))
        except ConnectionError as closed:
            self.assertEqual(str(closed), 'ended')
        self.assertNotIn('live', runs[-1])
        self.assertEqual(runs[-1]['summary']['frames']['tracked'], FRAMES)
        self.assertTrue(runs[-1]['summary']['complete'])
        self.assertIn('ate_m', runs[-1]['truth'])
        self.assertEqual(view.process.wait(timeout=60 * SLOWNESS), 0)

    def test_a_browser_that_confirms_nothing_gets_one_update_and_holds_nobody_up(self):
        view = self.view()
        slow, browser = Browser(view), self.paused(view)
        self.addCleanup(slow.close)
        self.finish(browser, view)
        received = {'state': 0, 'frame': 0, 'run': 0}
        while isinstance(message := slow.read(), dict):
            received[message['channel']] += 1
        for channel, count in received.items():  # the first one and, at the end, the last one
            self.assertLessEqual(count, 2, channel)
        self.assertGreaterEqual(received['frame'], 1)

    def test_garbage_does_no_harm(self):
        view = self.view()
        browser = self.paused(view)
        for data in (b'\x00' * 100, b'GET / HTTP/1.1\r\n' + b'X: y\r\n' * 20000 + b'\r\n', b'\xff' * 100000,
                     b'POST /?token=x HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n' + b'x' * 1000):
            try:
                self.assertIn(view.raw(data)[0], (0, 400, 403, 413, 431))
            except ConnectionError:
                pass  # closed before everything was sent
        for opcode, data in ((1, b'x' * 60000), (1, b'\xff\xfe'), (3, b'?'), (15, b'')):
            other = Browser(view)
            other.send(data, opcode)
            with self.assertRaises(ConnectionError):  # the connection is closed, maybe with a closing frame
                for _ in range(100):
                    if isinstance(other.read(), str):
                        raise ConnectionError
            other.close()
        idle = [socket.create_connection(('127.0.0.1', view.port), timeout=20 * SLOWNESS) for _ in range(40)]  # more than are kept
        browser.send('step')
        browser.next('frame')
        for s in idle:
            s.close()
        self.finish(browser, view)

    def test_an_interruption_ends_a_paused_run(self):
        view = self.view()
        browser = self.paused(view)
        browser.send('step')  # a run without any frame would keep the results of an earlier one
        browser.next('frame')
        view.process.send_signal(signal.SIGINT)
        self.assertEqual(view.process.wait(timeout=60 * SLOWNESS), 130)
        self.assertIn('"complete": false', (self.out / 'summary.json').read_text())

    def test_a_port_in_use_and_wrong_ones_are_refused_in_one_line(self):
        with socket.create_server(('127.0.0.1', 0)) as taken:
            cases = [(f'--view={taken.getsockname()[1]}', 'which is in use'), ('--view=x', "--view: found 'x'"), ('--view=70000', '--view'),
                     ('--view=-1', '--view'), ('--view --view-address=nowhere', '--view-address: found nowhere')]
            for options, expected in cases:
                with self.subTest(options=options):
                    ended = subprocess.run([BSLAM, 'run', self.data, '--out', self.out, '--overwrite', *options.split()], capture_output=True, text=True)
                    self.assertEqual(ended.returncode, 2)
                    self.assertEqual(len(ended.stderr.splitlines()), 1, ended.stderr)
                    self.assertIn(expected, ended.stderr)

    def test_a_watched_sequential_run_gives_the_same_bytes(self):
        def result(out):
            # The only difference is where the output is written.
            return (out / 'trajectory.tum').read_bytes(), (out / 'trajectory_live.tum').read_bytes()
        plain = self.out.with_name('plain')
        subprocess.run([BSLAM, 'run', self.data, '--out', plain, '--mode', 'sequential', '--progress', 'never'], check=True,
                       stdout=subprocess.DEVNULL)
        view = self.view('--mode', 'sequential')
        browser = self.paused(view)
        for _ in range(3):
            browser.send('step')
            browser.next('frame')
        self.finish(browser, view)
        self.assertEqual(result(plain), result(self.out))


if __name__ == '__main__':
    unittest.main(verbosity=2)

#!/usr/bin/env python3
"""`bslam serve`, as programs meet it that ask for poses, and as it meets those that send garbage.

    serve_test.py BSLAM
"""
import http.client
import json
import math
import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

BSLAM = pathlib.Path(sys.argv.pop(1)).resolve()
RIG = pathlib.Path(__file__).resolve().parents[1] / 'support/ring.yaml'
SIZE = 376, 240  # of its images
CAMERAS = ['front_left', 'front_right', 'left', 'right']
BOUNDARY = 'boundary0123456789'
SLOWNESS = float(os.environ.get('BSLAM_SLOWNESS', 1))  # of a program built with a sanitizer


def form(images):
    """The body of a request: {name: bytes}."""
    parts = [f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"; filename="x.png"\r\nContent-Type: image/png\r\n\r\n'
             .encode() + content + b'\r\n' for name, content in images]
    return b''.join(parts) + f'--{BOUNDARY}--\r\n'.encode()


def grey(width, height, seed):
    pixels = random.Random(seed).randbytes(width * height)
    return f'P5 {width} {height} 255\n'.encode() + pixels


class Server:
    def __init__(self, map_file, *options):
        self.process = subprocess.Popen([BSLAM, 'serve', map_file, '--port', '0', *options], stdout=subprocess.PIPE, text=True)
        self.line = self.process.stdout.readline()
        self.port = int(re.search(r'http://127\.0\.0\.1:(\d+) ', self.line).group(1))

    def ask(self, method, path, body=b'', headers=None, kind=f'multipart/form-data; boundary={BOUNDARY}'):
        """Status, headers and body of the answer."""
        connection = http.client.HTTPConnection('127.0.0.1', self.port, timeout=60 * SLOWNESS)
        try:
            connection.request(method, path, body, {'Content-Type': kind, **(headers or {})})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def localise(self, images):
        return self.ask('POST', '/v1/localise', form(images))

    def raw(self, data):
        """The status of the answer to bytes; None if the connection is closed without one."""
        with socket.create_connection(('127.0.0.1', self.port), timeout=60 * SLOWNESS) as s:
            try:
                s.sendall(data)
                answer = s.makefile('rb').readline()
            except ConnectionError:
                return None
        return int(answer.split()[1]) if answer else None

    def metric(self, name):
        text = self.ask('GET', '/metrics')[2].decode()
        return float(re.search(rf'^{re.escape(name)} (\S+)$', text, re.MULTILINE).group(1))

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        status = self.process.wait(timeout=60 * SLOWNESS)
        self.process.stdout.close()
        return status


class Serve(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = pathlib.Path(cls.folder.name)
        cls.map = root / 'site.bmap'
        subprocess.run([BSLAM, 'simulate', '--out', root / 'data', '--rig', RIG, '--duration', '3', '--rate', '10', '--progress', 'never'],
                       check=True, stdout=subprocess.DEVNULL)
        subprocess.run([BSLAM, 'run', root / 'data', '--out', root / 'run', '--save-map', cls.map, '--mode', 'sequential',
                        '--progress', 'never'], check=True, stdout=subprocess.DEVNULL)
        rows = [line.split() for line in (root / 'run/trajectory.tum').read_text().splitlines() if not line.startswith('#')]
        cls.truth = {round(float(row[0]) * 1e9): [float(x) for x in row[1:]] for row in rows}
        cls.frames = {}
        for stamp in sorted(cls.truth)[5::8]:
            cls.frames[stamp] = [(name, (root / f'data/mav0/cam{c}/data/{stamp}.png').read_bytes()) for c, name in enumerate(CAMERAS)]

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def serve(self, *options):
        server = Server(self.map, *options)
        self.addCleanup(server.process.wait)
        self.addCleanup(server.process.kill)
        self.addCleanup(server.process.stdout.close)
        return server

    def check_pose(self, body, stamp, tolerance_m=0.02, tolerance_rad=0.01):
        answer = json.loads(body)
        self.assertTrue(answer['localised'], answer)
        truth, pose = self.truth[stamp], answer['T_world_cam0']
        self.assertLess(math.dist(pose['position'], truth[:3]), tolerance_m)
        cosine = abs(sum(a * b for a, b in zip(pose['quaternion_xyzw'], truth[3:])))
        self.assertLess(2 * math.acos(min(1, cosine)), tolerance_rad)
        self.assertEqual([row[3] for row in pose['matrix'][:3]], pose['position'])
        self.assertEqual(len(answer['covariance']), 6)
        self.assertTrue(all(answer['covariance'][i][i] > 0 for i in range(6)))
        return answer

    def test_the_poses_are_those_of_the_run_that_made_the_map(self):
        server = self.serve()
        for stamp, images in self.frames.items():
            status, headers, body = server.localise(images)
            self.assertEqual(status, 200)
            self.assertEqual(headers['Content-Type'], 'application/json')
            answer = self.check_pose(body, stamp)
            self.assertEqual(list(answer['cameras']), CAMERAS)
            self.assertGreater(answer['cameras']['left']['inliers'], 20)
            alone = self.check_pose(server.localise(images[1:2])[2], stamp, 0.05)
            self.assertEqual(list(alone['cameras']), CAMERAS[1:2])
        self.assertEqual(server.metric('bslam_frames_total{localised="true"}'), 2 * len(self.frames))
        described = json.loads(server.ask('GET', '/v1/map')[2])
        self.assertEqual(described['name'], 'site.bmap')
        self.assertEqual([c['name'] for c in described['cameras']], CAMERAS)
        self.assertEqual(described['keyframes'], server.metric('bslam_map_keyframes'))
        self.assertEqual(server.ask('GET', '/healthz')[0], 200)
        self.assertEqual(server.end(), 0)

    def test_images_of_elsewhere_have_no_pose(self):
        server = self.serve()
        for images in ([(name, grey(*SIZE, name)) for name in CAMERAS], [('left', b'P5 %d %d 255\n' % SIZE + bytes(SIZE[0] * SIZE[1]))]):
            status, _, body = server.localise(images)
            self.assertEqual(status, 200)
            answer = json.loads(body)
            self.assertFalse(answer['localised'])
            self.assertIn(answer['reason'], ('not-found', 'few-features', 'no-images'))
            self.assertIsNone(answer['T_world_cam0'])
            self.assertIsNone(answer['covariance'])

    def test_images_under_wrong_names_have_no_pose_unless_most_cameras_agree(self):
        server = self.serve()
        names = CAMERAS[:2]
        for stamp, images in self.frames.items():
            pair = [content for _, content in images[:2]]
            for contents in (reversed(pair), [pair[0], pair[0]]):
                answer = json.loads(server.localise(list(zip(names, contents)))[2])
                self.assertFalse(answer['localised'], answer)
            exchanged = images[:2] + [(images[2][0], images[3][1]), (images[3][0], images[2][1])]
            answer = json.loads(server.localise(exchanged)[2])
            if answer['localised']:
                self.check_pose(json.dumps(answer), stamp)

    def requests(self):
        """Bodies of all kinds."""
        out = []
        for images in self.frames.values():
            out += [form(images), form(images[2:]), form(images[:1]), form(images)[:-20], form([('cam9', images[0][1])])]
        stamps = list(self.frames)
        first, last = self.frames[stamps[0]], self.frames[stamps[-1]]
        out.append(form([first[0], last[1]]))  # images of different places
        out.append(form([('left', grey(*SIZE, 1))]))
        return out

    def test_an_answer_depends_on_the_request_only(self):
        bodies = self.requests()
        alone = self.serve('--workers', '1')
        expected = [alone.ask('POST', '/v1/localise', body) for body in bodies]
        self.assertEqual(sum(e[0] == 200 for e in expected), 3 * len(self.frames) + 2)
        shared = self.serve('--workers', '3', '--queue', '100')
        wrong = []

        def client(seed):
            order = list(range(len(bodies)))
            random.Random(seed).shuffle(order)
            for i in order:
                shared.raw(random.Random(seed + i).randbytes(200))
                status, _, body = shared.ask('POST', '/v1/localise', bodies[i])
                if (status, body) != (expected[i][0], expected[i][2]):
                    wrong.append((i, status, body, expected[i][2]))

        threads = [threading.Thread(target=client, args=(seed,)) for seed in range(4)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(wrong, [])

    def test_a_full_queue_refuses_and_serves_again(self):
        server = self.serve('--workers', '1', '--queue', '1')
        stamp, images = next(iter(self.frames.items()))
        refused, served = threading.Event(), []

        def client():
            while not refused.is_set():
                status, headers, body = server.localise(images)
                if status == 503:
                    served.append(headers['Retry-After'])
                    refused.set()
                else:
                    served.append((status, body))

        threads = [threading.Thread(target=client) for _ in range(8)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        refusals = [s for s in served if isinstance(s, str)]
        self.assertEqual(set(refusals), {'1'})
        self.assertEqual(server.metric('bslam_rejected_total'), len(refusals))
        for status, body in (s for s in served if not isinstance(s, str)):
            self.assertEqual(status, 200)
            self.check_pose(body, stamp)
        self.check_pose(server.localise(images)[2], stamp)
        self.assertEqual(server.metric('bslam_queue_length'), 0)

    def test_garbage_is_refused_in_one_sentence(self):
        server = self.serve('--max-request-mb', '2')
        images = next(iter(self.frames.values()))
        cases = [(form([('cam9', images[0][1])]), "a part 'cam9'"), (form(images[:1] * 2), 'the part front_left twice'),
                 (form([]), 'no part'), (b'', 'does not begin with the boundary'), (form(images)[:-30], 'a part that does not end'),
                 (form([('left', images[0][1][:5000])]), 'an incomplete image'), (form([('left', b'')]), 'an incomplete image'),
                 (form([('left', grey(640, 480, 1))]), 'found an image of 640 x 480, expected 376 x 240'),
                 (form([('left', b'P5 99999 99999 255\n')]), 'found an image of 99999 x 99999'),
                 (form([(f'part{i}', b'') for i in range(5000)]), 'more than 4 parts')]
        for body, expected in cases:
            with self.subTest(expected=expected):
                status, _, answer = server.ask('POST', '/v1/localise', body)
                self.assertEqual(status, 400)
                self.assertIn(expected, json.loads(answer)['error'])
        self.assertEqual(server.ask('POST', '/v1/localise', form(images[:1]), kind='image/png')[0], 400)
        head = b'POST /v1/localise HTTP/1.1\r\nHost: 127.0.0.1\r\n'
        status, headers, answer = server.ask('POST', '/v1/localise', bytes(3 << 20))
        self.assertEqual((status, headers['Content-Type']), (413, 'application/json'))
        self.assertIn('at most 2097152 bytes', json.loads(answer)['error'])
        self.assertEqual(server.raw(head + b'Content-Length: 99999999999999999\r\n\r\nx'), 413)
        self.assertEqual(server.raw(head + b'Content-Length: -1\r\n\r\nx'), 400)
        self.assertEqual(server.raw(head + b'Transfer-Encoding: chunked\r\n\r\n1\r\nx\r\n0\r\n\r\n'), 411)
        self.assertEqual(server.raw(b'GET / HTTP/1.1\r\n' + b'X: y\r\n' * 5000 + b'\r\n'), 431)
        for seed in range(20):
            self.assertIn(server.raw(random.Random(seed).randbytes(3000) + b'\r\n\r\n'), (400, 431, None))
        stalled = [socket.create_connection(('127.0.0.1', server.port)) for _ in range(40)]
        for s in stalled:
            s.sendall(head + b'Content-Length: 1000\r\n\r\nx')
        self.check_pose(server.localise(images)[2], next(iter(self.frames)))
        for s in stalled:
            s.close()

    def test_other_paths_methods_and_origins_are_refused(self):
        server = self.serve()
        for path in ('/', '/v1', '/v1/localise/', '/../../etc/passwd', '/v1/map/../../x', '/site.bmap', 'http://127.0.0.1/v1/map'):
            self.assertEqual(server.ask('GET', path)[0], 404, path)
        self.assertEqual(server.ask('GET', '/v1/localise')[0], 405)
        self.assertEqual(server.ask('POST', '/v1/map')[0], 405)
        self.assertEqual(server.ask('GET', '/v1/map', headers={'Host': 'evil.example'})[0], 403)
        self.assertEqual(server.ask('GET', '/v1/map', headers={'Origin': 'http://evil.example'})[0], 403)

    def test_a_token_is_needed_if_there_is_one(self):
        server = self.serve('--token', 'secret')
        self.assertEqual(server.ask('GET', '/healthz')[0], 200)
        for path in ('/v1/map', '/metrics', '/nothing'):
            status, headers, _ = server.ask('GET', path, headers={'Authorization': 'Bearer secre'})
            self.assertEqual((status, headers['WWW-Authenticate']), (401, 'Bearer'))
        self.assertEqual(server.ask('GET', '/v1/map', headers={'Authorization': 'Bearer secret', 'Host': 'robot.example'})[0], 200)

    def test_requests_that_were_accepted_are_answered_at_the_end(self):
        server = self.serve('--workers', '1')
        stamp, images = next(iter(self.frames.items()))
        answers = []

        def client():
            try:
                answers.append(server.localise(images))
            except OSError:
                answers.append(None)  # it came after the end

        threads = [threading.Thread(target=client) for _ in range(8)]
        for t in threads:
            t.start()
        while server.metric('bslam_queue_length') < 2:  # with one worker, some of eight requests wait
            self.assertTrue(any(t.is_alive() for t in threads))
        waiting = int(server.metric('bslam_queue_length'))
        self.assertEqual(server.end(signal.SIGTERM), 0)
        for t in threads:
            t.join()
        answered = [a for a in answers if a is not None and a[0] != 503]
        self.assertGreaterEqual(len(answered), waiting)
        for answer in answered:
            self.check_pose(answer[2], stamp)

    def test_mistakes_of_the_command_line_are_one_line(self):
        damaged = self.map.with_name('damaged.bmap')
        data = bytearray(self.map.read_bytes())
        data[len(data) // 2] ^= 1
        damaged.write_bytes(data)
        with socket.create_server(('127.0.0.1', 0)) as taken:
            cases = [(['nothing.bmap'], 'cannot open nothing.bmap'), ([damaged], 'damaged.bmap'), ([__file__], 'serve_test.py'),
                     ([self.map, '--port', str(taken.getsockname()[1])], 'which is in use'), ([self.map, '--port', '70000'], '--port'),
                     ([self.map, '--address', 'nowhere'], '--address: found nowhere'), ([self.map, '--workers', '0'], '--workers'),
                     ([self.map, '--rig', 'nothing.yaml'], 'nothing.yaml'), ([self.map, '--set', 'features.levels=4'], 'pyramid'),
                     ([self.map, '--sett', 'x'], '--sett'), ([], 'map')]
            for options, expected in cases:
                with self.subTest(expected=expected):
                    ended = subprocess.run([BSLAM, 'serve', *options], capture_output=True, text=True, timeout=60 * SLOWNESS)
                    self.assertEqual(ended.returncode, 2)
                    self.assertEqual(len(ended.stderr.splitlines()), 1, ended.stderr)
                    self.assertIn(expected, ended.stderr)


if __name__ == '__main__':
    unittest.main(verbosity=2)

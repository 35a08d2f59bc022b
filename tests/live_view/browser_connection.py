"""What a browser says to the live view: HTTP requests and a WebSocket, byte by byte, so that it can also be said wrongly."""
import base64
import json
import os
import re
import socket
import struct
import subprocess

SLOWNESS = float(os.environ.get('BSLAM_SLOWNESS', 1))  # of a program built with a sanitizer


class View:
    """A run of bslam with a live view."""

    def __init__(self, bslam, data, out, *options):
        self.process = subprocess.Popen([str(bslam), 'run', str(data), '--out', str(out), '--overwrite', '--progress', 'never', '--view=0',
                                         *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stderr.readline()
        found = re.fullmatch(r'view: http://127\.0\.0\.1:(\d+)/\?token=([0-9a-f]{32})\n', line)
        assert found, line
        self.port, self.token = int(found[1]), found[2]

    def request(self, target=None, host=None, method='GET', extra=''):
        """Status and body of the answer."""
        head = f'{method} {target or f"/?token={self.token}"} HTTP/1.1\r\nHost: {host or f"127.0.0.1:{self.port}"}\r\n{extra}\r\n'
        return self.raw(head.encode())

    def raw(self, data):
        with socket.create_connection(('127.0.0.1', self.port), timeout=20 * SLOWNESS) as s:
            s.sendall(data)
            answer = b''
            while part := s.recv(1 << 16):
                answer += part
        head, _, body = answer.partition(b'\r\n\r\n')
        return int(head.split()[1]) if head else 0, body.decode(errors='replace')


class Browser:
    """A WebSocket connection to a view."""

    def __init__(self, view, token=None, origin=None, host=None):
        self.socket = socket.create_connection(('127.0.0.1', view.port), timeout=20 * SLOWNESS)
        host = host or f'127.0.0.1:{view.port}'
        origin = f'Origin: {origin}\r\n' if origin else ''
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f'GET /live?token={view.token if token is None else token} HTTP/1.1\r\nHost: {host}\r\n{origin}Upgrade: websocket\r\n'
                             f'Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n').encode())
        self.pending = b''
        self.received = {}  # the newest value of each channel
        head = self._until(b'\r\n\r\n')
        self.status = int(head.split()[1])

    def _until(self, end):
        while end not in self.pending:
            part = self.socket.recv(1 << 16)
            assert part, 'the connection was closed'
            self.pending += part
        found, _, self.pending = self.pending.partition(end)
        return found

    def _take(self, n):
        while len(self.pending) < n:
            part = self.socket.recv(1 << 20)
            if not part:
                raise ConnectionError
            self.pending += part
        taken, self.pending = self.pending[:n], self.pending[n:]
        return taken

    def send(self, text, opcode=1):
        data, mask = text.encode() if isinstance(text, str) else text, os.urandom(4)
        length = bytes([0x80 | len(data)]) if len(data) < 126 else b'\xfe' + struct.pack('>H', len(data))
        self.socket.sendall(bytes([0x80 | opcode]) + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def read(self):
        """The next message as a value, or the text of the closing frame."""
        message = b''
        while True:
            first, second = self._take(2)
            length = second & 127
            if length == 126:
                length = struct.unpack('>H', self._take(2))[0]
            elif length == 127:
                length = struct.unpack('>Q', self._take(8))[0]
            data, opcode = self._take(length), first & 15
            if opcode == 8:
                return data[2:].decode()
            if opcode == 9:
                self.send(data, 10)
            if opcode > 2:
                continue
            message += data
            if first & 0x80:
                return json.loads(message)

    def next(self, channel, confirm=True):
        """The next value of a channel. Others are confirmed and skipped."""
        while True:
            message = self.read()
            if isinstance(message, str):
                raise ConnectionError(message)
            if confirm or message['channel'] != channel:
                self.send(f'got {message["channel"]}')
            self.received[message['channel']] = message['value']
            if message['channel'] == channel:
                return message['value']

    def newest(self, channel):
        """The newest value of a channel so far, or its first. A paused run sends none after it."""
        return self.received[channel] if channel in self.received else self.next(channel)

    def state(self, wanted):
        """Reads until the state has the wanted values."""
        while True:
            value = self.next('state')
            if all(value[k] == v for k, v in wanted.items()):
                return value

    def close(self):
        self.socket.close()

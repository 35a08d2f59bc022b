import contextlib
import http.client
import http.server
import json
import re
import shutil
import socket
import ssl
import subprocess
import threading

import pytest
from bslam.client import Client, ServiceError


@pytest.mark.parametrize(
    ("address", "kind", "port"),
    [
        ("http://robot", "HTTPConnection", 80),
        ("http://robot:8090", "HTTPConnection", 8090),
        ("https://robot", "HTTPSConnection", 443),
        ("https://robot:8443/map/", "HTTPSConnection", 8443),
        ("robot", "HTTPConnection", 8090),
        ("robot:81", "HTTPConnection", 81),
    ],
)
def test_the_port_is_that_of_the_address_or_its_scheme(monkeypatch, address, kind, port):
    def refuse(connection):
        raise OSError(f"asked at {connection.port}")

    monkeypatch.setattr(getattr(http.client, kind), "connect", refuse)
    scheme = "https" if kind == "HTTPSConnection" else "http"
    with pytest.raises(ServiceError, match=f"^{scheme}://robot:{port}: asked at {port}$"):
        Client(address).map()


def test_other_schemes_are_errors():
    for address in ("ftp://x", "http://", ""):
        with pytest.raises(ValueError, match="address: found"):
            Client(address)


class Proxy(http.server.BaseHTTPRequestHandler):
    """A proxy that has the service in a folder."""

    def do_GET(self):
        body = json.dumps({"path": self.path, "token": self.headers["Authorization"]}).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class Other(http.server.BaseHTTPRequestHandler):
    """A server that is not bslam serve; the path says what it answers."""

    answers = {
        "/page/v1/map": (200, {}, b"<html>hello</html>"),
        "/list/v1/map": (200, {}, b"[1, 2]"),
        "/bytes/v1/map": (200, {}, b"\xff\xfe"),
        "/empty/v1/localise": (200, {}, b"{}"),
        "/late/v1/map": (503, {"Retry-After": "Fri, 31 Dec 2100 23:59:59 GMT"}, b"busy"),
        "/past/v1/map": (503, {"Retry-After": "Fri, 31 Dec 1999 23:59:59 GMT"}, b"busy"),
        "/soon/v1/map": (503, {"Retry-After": "2"}, b"busy"),
        "/odd/v1/map": (503, {"Retry-After": "soon"}, b"busy"),
        "/never/v1/map": (503, {}, b"busy"),
    }

    def do_GET(self):
        status, headers, body = self.answers[self.path]
        self.rfile.read(int(self.headers["Content-Length"] or 0))
        self.send_response(status)
        for name, value in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    do_POST = do_GET

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def served(handler):
    """The address of a server with these answers."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture
def other():
    with served(Other) as address:
        yield address


def test_an_answer_of_another_server_is_an_error_of_the_service(other):
    text = f"^{other}: found another answer, expected that of bslam serve$"
    for folder in ("page", "list", "bytes"):
        with pytest.raises(ServiceError, match=text) as caught:
            Client(f"{other}/{folder}").map()
        assert caught.value.status == 200
    with pytest.raises(ServiceError, match=text):
        Client(f"{other}/empty").localise({"cam0": b"P5 1 1 255\n0"})


def test_the_time_to_retry_may_be_a_date_and_need_not_be_understood(other):
    def retry_after(folder):
        with pytest.raises(ServiceError, match="^busy$") as caught:
            Client(f"{other}/{folder}").map()
        assert caught.value.status == 503
        return caught.value.retry_after

    assert retry_after("late") > 1e9
    assert retry_after("past") == 0
    assert retry_after("soon") == 2
    assert retry_after("odd") is None
    assert retry_after("never") is None


def test_a_refusal_before_the_end_of_the_request_is_that_of_the_server():
    """The server answers after the header, and closes the connection while the images are being sent."""

    def refuse(listener):
        connection, _ = listener.accept()
        with connection:
            received = b""
            while b"\r\n\r\n" not in received:
                received += connection.recv(1000)
            connection.sendall(b"HTTP/1.1 503 Busy\r\nRetry-After: 2\r\nContent-Length: 4\r\n\r\nbusy")
            connection.shutdown(socket.SHUT_WR)
            connection.recv(1000)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=refuse, args=[listener])
        thread.start()
        with pytest.raises(ServiceError, match="^busy$") as caught:
            Client(f"127.0.0.1:{listener.getsockname()[1]}").localise({"cam0": bytes(30_000_000)})
        thread.join()
    assert (caught.value.status, caught.value.retry_after) == (503, 2)


@pytest.fixture
def proxy():
    with served(Proxy) as address:
        yield address


@pytest.mark.parametrize(
    ("token", "sent"),
    [
        ("secret\n", "Bearer secret"),
        (" secret words\r\n", "Bearer secret words"),
        ("größer 鍵", "Bearer größer 鍵"),
        ("\n", None),
        ("", None),
    ],
)
def test_a_token_is_sent_as_utf8_without_white_space_around_it(proxy, token, sent):
    found = Client(proxy, token=token).map()["token"]
    assert (found and found.encode("latin-1").decode()) == sent  # the proxy reads headers as latin-1


@pytest.mark.parametrize("character", ["\n", "\r", "\0", "\x7f", "\udc80"])
def test_characters_that_no_header_can_contain_are_refused_in_a_token(character):
    message = re.escape(f"token: found the character {character!r}, expected one line of text, as after --token")
    with pytest.raises(ValueError, match=f"^{message}$"):
        Client("robot", token=f"secret{character}words")


def test_addresses_that_cannot_be_sent_are_errors_of_the_service():
    for address in ("http://a..robot", "http://127.0.0.1:1/größer"):
        with pytest.raises(ServiceError) as caught:
            Client(address).map()
        assert caught.value.status == 0


@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl for a certificate")
def test_a_proxy_with_a_certificate_is_asked_if_the_certificate_is_trusted(tmp_path, monkeypatch):
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    names = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *names]
    subprocess.run([*make, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Proxy) as server:
        server.socket = context.wrap_socket(server.socket, server_side=True)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        client = Client(f"https://localhost:{server.server_port}/site", token="secret")
        with pytest.raises(ServiceError, match="certificate"):
            client.map()
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        assert client.map() == {"path": "/site/v1/map", "token": "Bearer secret"}
        server.shutdown()
        thread.join()

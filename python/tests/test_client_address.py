import http.client
import http.server
import json
import shutil
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

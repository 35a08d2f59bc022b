"""Asks a running `bslam serve` for the pose of images in its map. Needs nothing but NumPy and the standard library.

`Client("http://127.0.0.1:8090").localise({"cam0": image0, "cam1": image1})` returns a `Localisation`.
"""

from __future__ import annotations

import datetime
import email.utils
import http.client
import json
import os
import pathlib
import re
import secrets
import urllib.parse
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

# The usual port of each kind of address; without a scheme that of `bslam serve`.
_PORTS = {"": 8090, "http": 80, "https": 443}

_NOT_IN_HEADERS = re.compile("[\x00-\x08\x0a-\x1f\x7f\ud800-\udfff]")

# Pixels as (height, width) uint8, an encoded image, or the file of one.
Image = Union[NDArray[np.uint8], bytes, str, "os.PathLike[str]"]


class ServiceError(Exception):
    """A request that the server has refused, or an address at which no server of bslam answers.

    Attributes:
        status: status of HTTP; 0 if there was no answer; 200 if the answer is not one of `bslam serve`.
        retry_after: seconds after which a request may be sent again, if the server is busy; else None.
    """

    def __init__(self, message: str, status: int = 0, retry_after: float | None = None) -> None:
        """An error with the attributes of the class; `message` is one sentence."""
        super().__init__(message)
        self.status = status
        self.retry_after = retry_after


@dataclass(frozen=True)
class Localisation:
    """The pose of a frame in the map.

    Attributes:
        localised: whether the place was recognised; if not, the poses are None.
        reason: why it was not, such as "not-found"; "" if it was.
        T_world_cam0: (4, 4), from camera 0 to the map; metres if `scale` is "metric".
        T_world_body: (4, 4), from the body frame of the calibration to the map.
        covariance: (6, 6), of the motion d in the axes of camera 0, rotation (rad) first, with T_world_cam0(true) =
            T_world_cam0 exp(d); None if unknown.
        scale: "metric", "up-to-scale" or "unobservable".
        submap: id of the submap of the poses; poses of different submaps are unrelated.
        cameras: for each camera with an image its state, reason, keypoints, matches and inliers.
    """

    localised: bool
    reason: str
    T_world_cam0: NDArray[np.float64] | None
    T_world_body: NDArray[np.float64] | None
    covariance: NDArray[np.float64] | None
    scale: str | None
    submap: int | None
    cameras: dict[str, dict[str, Any]]


def _encoded(image: Image) -> bytes:
    """The bytes of an image file; pixels become a PGM, which is lossless."""
    if isinstance(image, bytes):
        return image
    if isinstance(image, (str, os.PathLike)):
        return pathlib.Path(image).read_bytes()
    pixels = np.asarray(image)
    if pixels.dtype != np.uint8 or pixels.ndim != 2:
        raise ValueError(f"image: found {pixels.dtype} {pixels.shape}, expected uint8 (height, width)")
    return b"P5 %d %d 255\n" % (pixels.shape[1], pixels.shape[0]) + pixels.tobytes()


def _form(images: Mapping[str, Image]) -> tuple[str, bytes]:
    """Content type and body of a form with one part per image."""
    contents = {name: _encoded(image) for name, image in images.items()}
    boundary = secrets.token_hex(24)
    parts = [
        f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; filename="image"\r\n\r\n'.encode()
        + content
        + b"\r\n"
        for name, content in contents.items()
    ]
    return f"multipart/form-data; boundary={boundary}", b"".join(parts) + f"--{boundary}--\r\n".encode()


def _authorization(token: str) -> dict[str, bytes]:
    """The header with the token, whose bytes the server compares with those of its option."""
    token = token.strip()
    if other := _NOT_IN_HEADERS.search(token):  # the token itself is secret
        raise ValueError(f"token: found the character {other[0]!r}, expected one line of text, as after --token")
    return {"Authorization": b"Bearer " + token.encode()} if token else {}


def _pose(value: dict[str, Any] | None) -> NDArray[np.float64] | None:
    return None if value is None else np.array(value["matrix"], dtype=np.float64)


class Client:
    """A running `bslam serve`. Threads may share it: every request has a connection of its own."""

    def __init__(self, address: str, *, token: str = "", timeout: float = 60.0) -> None:
        """Does not connect yet.

        Args:
            address: as the server prints it, such as "http://127.0.0.1:8090"; or that of a proxy before it, such as
                "https://robot.example/map". The port is 80 for http://, 443 for https://, and 8090 without either,
                unless it is given.
            token: that of the option --token, such as the content of a file: white space around it is ignored.
            timeout: seconds without progress after which a request fails.
        """
        parts = urllib.parse.urlsplit(address if "://" in address else f"//{address}")
        if parts.scheme not in _PORTS or not parts.hostname:
            raise ValueError(f"address: found {address!r}, expected one such as 'http://127.0.0.1:8090'")
        self._encrypted = parts.scheme == "https"
        self._host, self._port, self._timeout = parts.hostname, parts.port or _PORTS[parts.scheme], timeout
        self._folder = parts.path.rstrip("/")
        self._headers = _authorization(token)

    def localise(self, images: Mapping[str, Image]) -> Localisation:
        """The pose of images that were taken at the same time.

        Args:
            images: by name of the camera, of any of the cameras: pixels, an encoded image, or the path of one.

        Raises:
            ServiceError: the server has refused the request, such as an image whose size differs from that of its
                camera, or is busy (`status` 503), or does not answer, or is another one.
        """
        content_type, body = _form(images)
        answer = self._object("POST", "/v1/localise", body, {"Content-Type": content_type})
        try:
            return _localisation(answer)
        except (KeyError, TypeError, ValueError) as error:
            raise self._not_of_bslam() from error

    def map(self) -> dict[str, Any]:
        """Name, cameras and size of the map."""
        return self._object("GET", "/v1/map")

    def metrics(self) -> str:
        """Counters in the text format of Prometheus."""
        return self._request("GET", "/metrics").decode(errors="replace")

    @property
    def _address(self) -> str:
        return f"{'https' if self._encrypted else 'http'}://{self._host}:{self._port}"

    def _not_of_bslam(self) -> ServiceError:
        return ServiceError(f"{self._address}: found another answer, expected that of bslam serve", 200)

    def _object(
        self, method: str, path: str, body: bytes = b"", headers: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """The answer, which is an object of JSON."""
        text = self._request(method, path, body, headers)
        try:
            answer = json.loads(text)
        except ValueError as error:
            raise self._not_of_bslam() from error
        if not isinstance(answer, dict):
            raise self._not_of_bslam()
        return answer

    def _request(self, method: str, path: str, body: bytes = b"", headers: Mapping[str, str] | None = None) -> bytes:
        kind = http.client.HTTPSConnection if self._encrypted else http.client.HTTPConnection
        connection = kind(self._host, self._port, timeout=self._timeout)
        try:
            response = _response(connection, method, self._folder + path, body, {**self._headers, **(headers or {})})
            answer = response.read()
        except (OSError, http.client.HTTPException, UnicodeError) as error:  # of the address
            raise ServiceError(f"{self._address}: {error}") from error
        finally:
            connection.close()
        if response.status == 200:
            return answer
        raise ServiceError(_reason(answer), response.status, _seconds_until(response.getheader("Retry-After")))


def _response(
    connection: http.client.HTTPConnection, method: str, path: str, body: bytes, headers: Mapping[str, str | bytes]
) -> http.client.HTTPResponse:
    try:
        connection.request(method, path, body, headers)
    except (BrokenPipeError, ConnectionResetError) as error:
        # A server that refuses a request answers before it has read the body, and does not wait for the end of it.
        try:
            return connection.getresponse()
        except (OSError, http.client.HTTPException):
            raise error from None
    return connection.getresponse()


def _seconds_until(retry_after: str | None) -> float | None:
    """The header Retry-After, which is a number of seconds, or a date, such as proxies send."""
    if retry_after is None:
        return None
    if retry_after.strip().isdecimal():
        return float(retry_after)
    try:
        date = email.utils.parsedate_to_datetime(retry_after)
    except (TypeError, ValueError):
        return None
    if date.tzinfo is None:  # "-0000": a time of UTC
        date = date.replace(tzinfo=datetime.timezone.utc)
    return max(0.0, (date - datetime.datetime.now(datetime.timezone.utc)).total_seconds())


def _localisation(answer: Mapping[str, Any]) -> Localisation:
    covariance = answer["covariance"]
    return Localisation(
        localised=answer["localised"],
        reason=answer["reason"],
        T_world_cam0=_pose(answer["T_world_cam0"]),
        T_world_body=_pose(answer["T_world_body"]),
        covariance=None if covariance is None else np.array(covariance, dtype=np.float64),
        scale=answer["scale"],
        submap=answer["submap"],
        cameras=answer["cameras"],
    )


def _reason(answer: bytes) -> str:
    try:
        return str(json.loads(answer)["error"])
    except (ValueError, KeyError, TypeError):
        return answer.decode(errors="replace").strip()


def localise(address: str, images: Mapping[str, Image], *, token: str = "", timeout: float = 60.0) -> Localisation:
    """As Client.localise, for a single request."""
    return Client(address, token=token, timeout=timeout).localise(images)

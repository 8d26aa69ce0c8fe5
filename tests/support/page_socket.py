"""A page that draws nothing: the dashboard's websocket, and when a banner came through it."""

from __future__ import annotations

import contextlib
import re
import threading
import time
from typing import Self

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.1,
    "far": 100.0,
    "image_height": 400,
    "image_width": 400,
    "look_at": (1.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""A page counts as open once it has said where it looks from."""


class PageSocket:
    """Reads all that a page is sent, in a thread of its own.

    Attributes:
        banners: Unix time [s] and style classes of every banner that came.
    """

    def __init__(self, port: int) -> None:
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self._socket = connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], max_size=None)
        self._socket.send(msgspec.msgpack.encode(_CAMERA))
        self.banners: list[tuple[float, str]] = []
        self._thread = threading.Thread(target=self._read, name="page socket")
        self._thread.start()

    def _read(self) -> None:
        unpack = zstandard.ZstdDecompressor()
        with contextlib.suppress(ConnectionClosed):
            while True:
                frame = self._socket.recv()
                at_s = time.time()
                assert isinstance(frame, bytes)
                size = int.from_bytes(frame[8:16], "little")
                said = unpack.decompress(frame[16 : 16 + size])
                found = re.search(rb'class="(rg-banner[^"]*)"', said)
                if found:
                    self.banners.append((at_s, found[1].decode()))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._thread.join()

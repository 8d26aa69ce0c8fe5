"""Headless Chromium over its DevTools protocol: enough to open a page, look, click and listen.

    with Browser(folder) as browser:
        page = browser.open("http://127.0.0.1:8080")
        page.wait("document.body.innerText.includes('ready')", 10.0)

Chromium runs without a sandbox (tests run as root in containers), in a profile of its own, and
can reach nothing but loopback: every other name fails to resolve.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any, Self

from websockets.sync.client import ClientConnection, connect

from tests.support.processes import until

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--disable-background-timer-throttling",
    "--disable-renderer-backgrounding",
    "--disable-backgrounding-occluded-windows",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--remote-debugging-port=0",
)
START_S = 30.0


def chromium() -> str | None:
    """Path of a Chromium on this machine."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One Chromium process with its children; leaving ends them all."""

    def __init__(self, folder: Path, size: tuple[int, int] = (1280, 800)) -> None:
        path = chromium()
        assert path is not None, "no chromium"
        self._profile = folder / f"chromium-{time.monotonic_ns()}"
        self._profile.mkdir()
        self._log = (self._profile / "log").open("wb")
        self._process = subprocess.Popen(
            [
                *("nice", "-n", "10"),  # software draws the pages: other tests come first
                path,
                *FLAGS,
                f"--user-data-dir={self._profile}",
                f"--window-size={size[0]},{size[1]}",
                "about:blank",
            ],
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=self._log,
            start_new_session=True,  # its children are ended with it, by the group that it leads
        )
        self._size = size
        self._pages: list[Page] = []

    def open(self, url: str) -> Page:
        """A new page on ``url``."""
        port_file = self._profile / "DevToolsActivePort"
        until(lambda: port_file.exists() and port_file.read_text(), START_S, "DevTools of chromium")
        port = port_file.read_text().splitlines()[0]
        request = urllib.request.Request(
            f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT"
        )
        with urllib.request.urlopen(request, timeout=START_S) as answer:  # noqa: S310 - loopback
            target = json.load(answer)
        page = Page(target["webSocketDebuggerUrl"], self._size)
        self._pages.append(page)
        page.go(url)
        return page

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for page in self._pages:
            page.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._log.close()


class Page:
    """One tab.

    Attributes:
        requested: every URL that it asked for, its own and those of its workers' sockets.
        complaints: errors of its scripts.
    """

    def __init__(self, url: str, size: tuple[int, int]) -> None:
        self._socket: ClientConnection = connect(url, max_size=None)
        self._last = 0
        self.requested: list[str] = []
        self.complaints: list[str] = []
        for domain in ("Page", "Network", "Runtime"):
            self.call(f"{domain}.enable")
        # a page without focus would not try to connect again
        self.call("Emulation.setFocusEmulationEnabled", enabled=True)
        self.resize(*size)

    def call(self, method: str, **params: Any) -> Any:
        """One command of the protocol; its result."""
        self._last += 1
        self._socket.send(json.dumps({"id": self._last, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv(timeout=START_S))
            if message.get("id") == self._last:
                assert "error" not in message, f"{method}: {message['error']}"
                return message["result"]
            self._note(message)

    def go(self, url: str) -> None:
        """Open an address."""
        self.call("Page.navigate", url=url)
        ready = "document.body !== null && document.readyState === 'complete'"
        until(lambda: self.evaluate(ready), START_S, f"{url} loaded")

    def resize(self, width: int, height: int, scale: float = 1.0, *, mobile: bool = False) -> None:
        """Another screen [CSS px]."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=mobile,
        )

    def evaluate(self, script: str) -> Any:
        """The value of a JavaScript expression (awaited if it is a promise)."""
        result = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, f"{script}: {result['exceptionDetails']}"
        return result["result"].get("value")

    def wait(self, script: str, within_s: float) -> Any:
        """Until the expression is truthy; its value."""
        return until(
            lambda: self.evaluate(script), within_s, lambda: f"{script}; the page says: {self.text}"
        )

    @property
    def text(self) -> str:
        """What a reader sees."""
        return str(self.evaluate("document.body.innerText"))

    def click(self, selector: str, within_s: float = 5.0, *, text: str = "") -> None:
        """Press the mouse on the first visible element of a CSS selector that is not disabled.

        With ``text`` only one that says just that.
        """
        spot = self.wait(
            f"""(() => {{
                const found = [...document.querySelectorAll({json.dumps(selector)})];
                const text = {json.dumps(text)};
                const element = found.find(e => e.getClientRects().length && !e.disabled
                    && (!text || e.innerText.trim() === text));
                if (!element) return null;
                element.scrollIntoView({{block: 'center'}});
                const r = element.getBoundingClientRect();
                return [r.x + r.width / 2, r.y + r.height / 2];
            }})()""",
            within_s,
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.call(
                "Input.dispatchMouseEvent",
                type=kind,
                x=spot[0],
                y=spot[1],
                button="left",
                clickCount=1,
            )

    def screenshot(self, path: Path | None = None) -> bytes:
        """The page as PNG, also written to ``path``."""
        image = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            path.write_bytes(image)
        return image

    def close(self) -> None:
        """Let go of the tab; Chromium ends it."""
        self._socket.close()

    def _note(self, message: dict[str, Any]) -> None:
        params = message.get("params", {})
        match message.get("method"):
            case "Network.requestWillBeSent":
                self.requested.append(params["request"]["url"])
            case "Network.webSocketCreated":
                self.requested.append(params["url"])
            case "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(params["exceptionDetails"])[:1000])

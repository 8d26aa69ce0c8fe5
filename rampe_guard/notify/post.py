"""A target that is a URL: each notice is posted to it as JSON."""

from __future__ import annotations

import http.client
import json
import re
import urllib.error
import urllib.request
from base64 import b64encode
from typing import Any
from urllib.parse import unquote, urlsplit

from rampe_guard.errors import SettingsError
from rampe_guard.notify.choose import Notice
from rampe_guard.notify.target import NotHeardError


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """A redirected POST would arrive as a GET without a body, and count as told."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        """Do not follow."""


class Post:
    """Posts each notice; only an answer of 200 to 299 counts as told.

    Args:
        url: http or https.
        timeout_s: for each step on the network [s].

    Raises:
        SettingsError: it is no such URL.
    """

    def __init__(self, url: str, timeout_s: float) -> None:
        try:
            parts = urlsplit(url)
            good = parts.scheme in {"http", "https"} and bool(parts.hostname) and parts.port != 0
        except ValueError:
            good = False
        if not good:
            bare = re.sub("//[^/]*@", "//…@", url).partition("?")[0]
            raise SettingsError(f"{bare!r} is no URL such as http://127.0.0.1:8080/alerts")
        user, _, where = parts.netloc.rpartition("@")
        self.name = f"{parts.scheme}://{where}"  # the rest may be a secret
        self._url, self._timeout_s = parts._replace(netloc=where).geturl(), timeout_s
        self._head = {"Content-Type": "application/json", "User-Agent": "rampe-guard"}
        if user:  # urllib would take it for a part of the host, and say so in its errors
            self._head["Authorization"] = f"Basic {b64encode(unquote(user).encode()).decode()}"
        self._opener = urllib.request.build_opener(_NoRedirect())

    def tell(self, notice: Notice) -> None:
        """Post it.

        Raises:
            NotHeardError: no answer, or not a good one.
        """
        body = json.dumps(notice.body, ensure_ascii=False).encode()
        try:
            request = urllib.request.Request(self._url, body, self._head)  # noqa: S310 - http(s)
            with self._opener.open(request, timeout=self._timeout_s):
                return
        except urllib.error.HTTPError as error:
            code = error.code
            error.close()
            raise NotHeardError(f"{self.name} answered {code}") from None
        except OSError as error:
            reason = getattr(error, "reason", None) or error
            raise NotHeardError(f"{self.name}: {reason}") from None
        except (http.client.HTTPException, ValueError) as error:  # their words quote the URL
            raise NotHeardError(f"{self.name}: {type(error).__name__}") from None

    def stop(self) -> None:
        """Nothing to break off: its thread ends with the process."""

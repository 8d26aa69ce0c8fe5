"""Zenoh in our own terms: sessions, inboxes, publishers. Only the zenoh_ modules here import it.

Nothing is ever computed in a Zenoh callback. Every subscriber and queryable fills a ring
channel, which drops its oldest message when full and so cannot stall the session; whoever
owns the `Inbox` drains it in a thread of his own.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Any, Self, TypeVar

import zenoh

from rampe_guard.errors import ConnectionFailedError, MessageError, SettingsError
from rampe_guard.runtime import zenoh_rules
from rampe_guard.runtime.zenoh_config import blank, parts
from rampe_guard.runtime.zenoh_queries import Desk, Inquiry, Message
from rampe_guard.runtime.zenoh_ros2 import CdrOutbox, latched
from rampe_guard.settings import ZenohSettings
from rampe_guard.settings.network import redacted, shown

T = TypeVar("T")

_CHANGES = 16
"""Comings and goings of a token that wait, and that are looked at once."""
_LOOK_LIKE = "endpoints look like tcp/127.0.0.1:7447"
_TOKEN_GRACE_S = 1.0
"""Existing tokens are told of within milliseconds after the subscription."""


class Inbox:
    """Messages on one key expression, newest kept when they come faster than they are drained."""

    def __init__(self, session: zenoh.Session, key: str, capacity: int) -> None:
        self._subscriber = session.declare_subscriber(key, zenoh.handlers.RingChannel(capacity))
        self._capacity = capacity
        self.overruns = 0

    def drain(self) -> list[Message]:
        """All messages that wait, oldest first; never blocks."""
        messages: list[Message] = []
        while len(messages) < self._capacity:
            sample = self._subscriber.try_recv()
            if sample is None:
                break
            if sample.kind == zenoh.SampleKind.PUT:
                attached = None if (more := sample.attachment) is None else more.to_bytes()
                messages.append(Message(str(sample.key_expr), sample.payload.to_bytes(), attached))
        if len(messages) == self._capacity:
            self.overruns += 1  # a full ring has most likely dropped some
        return messages

    def close(self) -> None:
        """Unsubscribe."""
        self._subscriber.undeclare()

    def read(self, decoder: Callable[[bytes], T]) -> list[T]:
        """What waits and can be read, for viewers: what cannot, the guard tells of."""
        found = []
        for message in self.drain():
            with contextlib.suppress(MessageError):
                found.append(decoder(message.payload))
        return found


class Liveness:
    """Whether a liveliness token exists on one key.

    None for the first second, until anything was heard of it: a token that has never been
    seen by then is not there, which is no better than one that went.
    """

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._subscriber = session.liveliness().declare_subscriber(
            key, zenoh.handlers.RingChannel(_CHANGES), history=True
        )
        self._known_at_s = time.monotonic() + _TOKEN_GRACE_S
        self.alive: bool | None = None

    def poll(self) -> bool | None:
        """The newest state; never blocks."""
        for _ in range(_CHANGES):  # a token that comes and goes all the time does not hold us up
            if (sample := self._subscriber.try_recv()) is None:
                break
            self.alive = sample.kind == zenoh.SampleKind.PUT
        if self.alive is None and time.monotonic() >= self._known_at_s:
            self.alive = False
        return self.alive


class Tokens:
    """Liveliness tokens that appear and go on a key expression; those that exist come first."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._subscriber = session.liveliness().declare_subscriber(
            key, zenoh.handlers.RingChannel(4096), history=True
        )

    def drain(self) -> list[tuple[str, bool]]:
        """Keys of tokens, and whether each appeared; oldest first; never blocks."""
        changes = []
        while (sample := self._subscriber.try_recv()) is not None:
            changes.append((str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))
        return changes


class Outbox:
    """A publisher on one key; ``put`` never waits for a slow subscriber."""

    def __init__(
        self, session: zenoh.Session, key: str, schema: str | None, *, urgent: bool
    ) -> None:
        encoding = zenoh.Encoding.APPLICATION_JSON
        self._publisher = session.declare_publisher(
            key,
            encoding=encoding if schema is None else encoding.with_schema(schema),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
            express=True,
        )

    def put(self, payload: bytes) -> None:
        """Send; lost silently while no router is there."""
        self._publisher.put(payload)

    @property
    def heard(self) -> bool:
        """At least one subscriber matches now."""
        return bool(self._publisher.matching_status)


class Bus:
    """One Zenoh session. A context manager: closing it ends every inbox and outbox."""

    def __init__(self, session: zenoh.Session, *, client: bool) -> None:
        self._session = session
        self._client = client
        self._kept: list[Any] = []

    @classmethod
    def open(cls, settings: ZenohSettings) -> Self:
        """Try to connect once, for about a second.

        Raises:
            ConnectionFailedError: nobody answered.
            SettingsError: the Zenoh configuration is not valid, a certificate cannot be used, or
                messages could be read and forged on their way.
        """
        config = _config(settings)
        client = json.loads(config.get_json("mode")) == "client"
        try:
            return cls(zenoh.open(config), client=client)
        except zenoh.ZError as error:
            named = (*zenoh_rules.endpoints(config.get_json, "connect"), *settings.connect)
            where = settings.config or ", ".join(map(shown, settings.connect)) or "no endpoint"
            reason = redacted(str(error), named).split(" at /")[0]
            raise ConnectionFailedError(f"no Zenoh router at {where}: {reason}") from None

    @classmethod
    def open_retrying(
        cls,
        settings: ZenohSettings,
        stopped: Callable[[], bool],
        say: Callable[[str], None],
        wait: Callable[[float], object],
    ) -> Self | None:
        """Try until a router answers; None when ``stopped`` became true first."""
        while not stopped():
            try:
                return cls.open(settings)
            except ConnectionFailedError as error:
                say(str(error))
                wait(0.5)
        return None

    @property
    def connected(self) -> bool:
        """A client has a router (a peer needs none)."""
        return not self._client or bool(self._session.info.routers_zid())

    def inbox(self, key: str, capacity: int = 256) -> Inbox:
        """Subscribe to a key (or, for viewers, a key expression)."""
        return Inbox(self._session, key, capacity)

    def outbox(self, key: str, schema: str | None = None, *, urgent: bool = False) -> Outbox:
        """Publish on a key; ``urgent`` is for alerts."""
        return Outbox(self._session, key, schema, urgent=urgent)

    def cdr_outbox(self, key: str) -> CdrOutbox:
        """Publish CDR on a key, each message with an attachment or none."""
        return CdrOutbox(self._session, key)

    def latched(self, key: str, timeout_s: float) -> bytes | None:
        """The message that a latched publisher keeps on a key; see `zenoh_ros2.latched`."""
        return latched(self._session, key, timeout_s)

    @property
    def zid(self) -> str:
        """The id of this session."""
        return str(self._session.info.zid())

    def desk(self, key: str) -> Desk:
        """Answer queries on a key."""
        return Desk(self._session, key)

    def liveness(self, key: str) -> Liveness:
        """Watch the liveliness token on a key."""
        return Liveness(self._session, key)

    def tokens(self, key: str) -> Tokens:
        """Watch all liveliness tokens on a key expression."""
        return Tokens(self._session, key)

    def inquire(self, key: str, timeout_s: float = 1.0) -> Inquiry:
        """Query everyone on a key expression, without waiting."""
        return Inquiry(self._session, key, timeout_s)

    def is_alive(self, key: str) -> bool:
        """Whether anybody holds a liveliness token on a key now."""
        replies = self._session.liveliness().get(key, timeout=1.0)
        return any(reply.ok is not None for reply in replies)

    def declare_alive(self, key: str) -> None:
        """Hold a liveliness token on a key for as long as the session lives."""
        self._kept.append(self._session.liveliness().declare_token(key))

    def ask(self, key: str, payload: bytes | None = None, timeout_s: float = 2.0) -> list[bytes]:
        """Query a key; returns the answers.

        Raises:
            ConnectionFailedError: the answer was an error (its text is in the message), or the
                session is closed.
        """
        answers = []
        try:
            replies = self._session.get(key, payload=payload, timeout=timeout_s)
        except zenoh.ZError as error:  # closed by another thread, say
            raise ConnectionFailedError(f"{key}: {str(error).split(' at /')[0]}") from None
        for reply in replies:
            if reply.ok is not None:
                answers.append(reply.ok.payload.to_bytes())
            elif (
                reply.err is not None
                and "timeout" not in (text := str(reply.err.payload.to_string())).lower()
            ):
                raise ConnectionFailedError(f"{key} answered: {text}")
        return answers

    def close(self) -> None:
        """End the session; a session left open would hang the interpreter's exit."""
        self._session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@contextlib.contextmanager
def router(endpoints: Sequence[str], config_file: str | None = None) -> Iterator[None]:
    """Be a Zenoh router (in a process of its own: it needs the whole GIL).

    Args:
        endpoints: to listen on.
        config_file: the router's whole configuration instead.

    Raises:
        SettingsError: the configuration file, or an endpoint, is not valid.
        ConnectionFailedError: an endpoint cannot be listened on, or a certificate not be read.
    """
    where = config_file or ", ".join(map(shown, endpoints))
    try:
        config = _router_config(endpoints, config_file)
    except zenoh.ZError as error:
        help_ = "" if config_file else f"; {_LOOK_LIKE}"
        raise SettingsError(f"{where}: {_reason(error, endpoints)}{help_}") from None
    try:
        session = zenoh.open(config)
    except zenoh.ZError as error:
        reason = _reason(error, endpoints)
        raise ConnectionFailedError(f"{where}: cannot route: {reason}") from None
    try:
        yield
    finally:
        session.close()


def _router_config(endpoints: Sequence[str], config_file: str | None) -> zenoh.Config:
    if config_file is not None:
        return zenoh.Config.from_file(config_file)
    config = zenoh.Config()
    for path, value in (*blank("router"), ("listen/endpoints", json.dumps(list(endpoints)))):
        config.insert_json5(path, value)
    return config


def log_as_told() -> None:
    """Let Zenoh itself log what the environment variable RUST_LOG asks for, if it is set."""
    zenoh.try_init_log_from_env()


def check_configuration(settings: ZenohSettings) -> None:
    """See whether a session could be configured so, without opening one.

    Raises:
        SettingsError: it could not.
    """
    _config(settings)


def is_pattern(key: str) -> bool:
    """Whether a key expression may stand for several keys (``*``, ``**``, ``$*``)."""
    return "*" in key


def check_key_expression(text: str) -> None:
    """See whether Zenoh takes it for a key expression.

    Raises:
        SettingsError: it does not.
    """
    try:
        zenoh.KeyExpr(text)
    except zenoh.ZError as error:
        reason = str(error).split(" at /")[0].splitlines()[0]
        raise SettingsError(f"{text!r} is no key expression: {reason}") from None


def _config(settings: ZenohSettings) -> zenoh.Config:
    try:
        config = _unchecked_config(settings)
    except (zenoh.ZError, ValueError) as error:
        where = settings.config or f"endpoints {', '.join(map(shown, settings.connect))!r}"
        reason = _reason(error, settings.connect)
        raise SettingsError(f"zenoh: {where}: {reason}; {_LOOK_LIKE}") from None
    zenoh_rules.check_keys(config.get_json)
    if settings.plain_network:
        return config
    zenoh_rules.check_exposure(config.get_json)
    allowed = zenoh_rules.allowed_protocols(config.get_json)
    if allowed:
        config.insert_json5("transport/link/protocols", json.dumps(allowed))
    return config


def _reason(error: Exception, endpoints: Sequence[str]) -> str:
    """What Zenoh says, without where in its own code, and without secrets."""
    text = redacted(str(error), tuple(endpoints)).split(" at /")[0].splitlines()[0]
    return text.partition('msg: "')[2] or text


def _unchecked_config(settings: ZenohSettings) -> zenoh.Config:
    config = zenoh.Config() if settings.config is None else zenoh.Config.from_file(settings.config)
    for path, value in parts(settings):
        config.insert_json5(path, value)
    return config

"""``notify``: carries alerts to commands, URLs and a sound until it is told to stop."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

from rampe_guard.client import (
    Alert,
    Item,
    MachineState,
    Protection,
    ProtectionBack,
    ProtectionLost,
)
from rampe_guard.client.feed import Feed
from rampe_guard.core.alarm import Level
from rampe_guard.errors import SettingsError
from rampe_guard.notify.choose import Notice, notice_of, notices_of
from rampe_guard.notify.command import Command
from rampe_guard.notify.messenger import Messenger
from rampe_guard.notify.post import Post
from rampe_guard.notify.sound import Sound, sounding
from rampe_guard.notify.target import Target
from rampe_guard.notify.tones import UNPROTECTED
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.log_lines import LogFormat, configure
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus, is_pattern
from rampe_guard.settings import ZenohSettings, load_site

_WAKE_S = 0.01
_GRACE_S = 2.0
"""How long a router may be away at the start before that is told."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What `notify` was asked for.

    Attributes:
        site: path of a site file, or None.
        bases: key expressions of prefixes of guards, besides the site's.
        network: how to join, instead of as the site file says.
        at_least: level from which transitions are told.
        commands: command lines.
        posts: URLs.
        sound: a player, "bell", or None.
        timeout_s: of each try [s].
        per_minute: notices that each target may get, in the long run [1/min].
        log_format: of what is said on stderr.
    """

    site: str | None
    bases: Sequence[str]
    network: Network
    at_least: Level
    commands: Sequence[str]
    posts: Sequence[str]
    sound: str | None
    timeout_s: float
    per_minute: float
    log_format: LogFormat = "text"


def notify(wishes: Wishes, stop: StopFlag) -> int:
    """Tell until told to stop; waits for a router if there is none.

    Raises:
        SettingsError: nothing to follow or nowhere to tell, or one of them cannot be.
    """
    zenoh, bases = _whom(wishes)
    targets: list[Target] = [Command(line, wishes.timeout_s) for line in wishes.commands]
    targets += [Post(url, wishes.timeout_s) for url in wishes.posts]
    if not targets and wishes.sound is None:
        raise SettingsError("nowhere to tell: give --command, --post or --sound")
    configure(wishes.log_format)
    say = Sayer("rampe_guard.notify")
    sound = None if wishes.sound is None else Sound(wishes.sound, say.warn, sys.stderr)
    desk = Desk([Messenger(t, wishes.per_minute, say.warn) for t in targets], sound, wishes, say)
    try:
        desk.work(zenoh, bases, stop)
    finally:
        desk.stop()
    return 0


class Desk:
    """Between the feed and the targets.

    Args:
        messengers: one for each target.
        sound: what sounds, or None.
        wishes: what was asked for.
        say: log.
    """

    def __init__(
        self, messengers: Sequence[Messenger], sound: Sound | None, wishes: Wishes, say: Sayer
    ) -> None:
        self._messengers, self._sound, self._say = messengers, sound, say
        self._at_least = wishes.at_least

    def work(self, zenoh: ZenohSettings, bases: Sequence[str], stop: StopFlag) -> None:
        """Follow the guards until ``stop``."""
        away = threading.Timer(_GRACE_S, self._no_router, [bases])
        away.daemon = True
        away.start()
        bus = Bus.open_retrying(zenoh, stop, lambda text: self._say.warn("router", text), stop.wait)
        away.cancel()
        if bus is None:
            return
        with bus:
            feed = Feed(bus, bases)
            self._say.info(f"following {', '.join(bases)}")
            items = feed.catch_up()
            self._router_back(bases)
            while not stop():
                machines = feed.fleet.machines
                for item in items:
                    self._take(item, machines.get(item.base))
                if self._sound is not None:
                    self._sound.follow(sounding(machines.values(), self._at_least))
                time.sleep(_WAKE_S)
                items = feed.poll()

    def stop(self) -> None:
        """End all targets."""
        for messenger in self._messengers:
            messenger.stop()
        if self._sound is not None:
            self._sound.stop()

    def _take(self, item: Item, machine: MachineState | None) -> None:
        level = f"{item.level}: " if isinstance(item, Alert) else ""  # of zones, not of guards
        self._say.info(f"{item.machine or item.base}: {level}{item.text}")
        notice = notice_of(item, self._at_least)
        if notice is not None:
            self._offer(notice)
        if isinstance(item, ProtectionBack) and machine is not None:
            for active in notices_of(machine, self._at_least):  # not told while it was lost
                self._offer(active)

    def _offer(self, notice: Notice) -> None:
        for messenger in self._messengers:
            messenger.offer(notice)

    def _no_router(self, bases: Sequence[str]) -> None:
        for base in bases:
            notice = notice_of(_lost(base), self._at_least)
            if notice is not None:
                self._offer(notice)
        if self._sound is not None:
            self._sound.follow(UNPROTECTED)

    def _router_back(self, bases: Sequence[str]) -> None:
        """There is a router; of machines known by name the feed says the rest."""
        for base in bases:
            if is_pattern(base):
                notice = notice_of(_back(base), self._at_least)
                if notice is not None:
                    self._offer(notice)


def _whom(wishes: Wishes) -> tuple[ZenohSettings, tuple[str, ...]]:
    if wishes.site is None:
        if not wishes.bases:
            raise SettingsError("nobody to follow: give a SITE or --base")
        return wishes.network.settings, tuple(wishes.bases)
    site = wishes.network.of(load_site(wishes.site))
    return site.zenoh, (site.keys.base, *wishes.bases)


def _lost(base: str) -> ProtectionLost:
    return ProtectionLost(
        base=base,
        site="",
        machine="",
        protection=Protection.UNAVAILABLE,
        level="warning",
        text="PROTECTION UNAVAILABLE: no Zenoh router",
    )


def _back(base: str) -> ProtectionBack:
    return ProtectionBack(
        base=base,
        site="",
        machine="",
        protection=Protection.DEGRADED,
        level="caution",
        text="the Zenoh router is there; what it knows of machines is told apart",
    )

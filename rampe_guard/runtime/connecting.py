"""Other endpoints than the site file's, for one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rampe_guard.errors import SettingsError
from rampe_guard.settings import DEFAULT_ENDPOINT, Site, ZenohSettings


@dataclass(frozen=True, slots=True)
class Network:
    """How a command was told to join, beside site files.

    Attributes:
        endpoints: to connect to, as a client.
        config: path of a Zenoh configuration file, instead of them.
        plain: messages without certificates may leave the machine.
    """

    endpoints: tuple[str, ...] = ()
    config: str | None = None
    plain: bool = False

    @property
    def said(self) -> bool:
        """Anything was told at all."""
        return bool(self.endpoints) or self.config is not None

    @property
    def settings(self) -> ZenohSettings:
        """Of a session with no site.

        Raises:
            SettingsError: two ways are given.
        """
        if self.config is not None and self.endpoints:
            raise SettingsError("--zenoh FILE names the endpoints itself; leave out --connect")
        ends = () if self.config is not None else self.endpoints or (DEFAULT_ENDPOINT,)
        return ZenohSettings(self.config, "client", ends, plain_network=self.plain)

    def of(self, site: Site) -> Site:
        """The site on this network; on its own if nothing was told."""
        if not self.said:
            return site
        if self.config is not None:
            return replace(site, zenoh=self.settings)
        there = connect_to(site, self.endpoints)
        plain = self.plain or site.zenoh.plain_network
        return replace(there, zenoh=replace(there.zenoh, plain_network=plain))


def connect_to(site: Site, endpoints: Sequence[str]) -> Site:
    """The same site on these Zenoh endpoints; unchanged if there are none."""
    if not endpoints:
        return site
    zenoh = replace(site.zenoh, config=None, connect=tuple(endpoints))
    return replace(site, zenoh=zenoh)

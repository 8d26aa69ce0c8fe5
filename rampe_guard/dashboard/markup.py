"""A `Picture` as HTML, piece by piece: pure, every text escaped.

Each piece is one element of the page; what did not change is not sent again.
"""

from __future__ import annotations

import time
from functools import cache
from html import escape
from pathlib import Path

from rampe_guard.dashboard.picture import Banner, Bar, Card, Event, Picture
from rampe_guard.dashboard.tones import Tone

_SHOWN_EVENTS = 14
_WIDE = 1000.0
"""Units of a bar's own drawing."""


@cache
def style() -> str:
    """The style sheet, to be put on the page once."""
    css = (Path(__file__).parent / "style.css").read_text("utf-8")
    return f"<style>{css}</style>"


def alive(count: int) -> str:
    """What hides the words "no connection" for a moment; it must be sent again and again."""
    return (
        f'<div class="rg-gone" data-count="{count}"><span>✕</span><span>NOT MONITORING</span>'
        "<span>this page has lost its dashboard. Work as if there were no warnings.</span></div>"
    )


def banner(shown: Banner) -> str:
    """Across the top; without protection also a frame round the page."""
    look = shown.tone.look
    flash = " rg-flash" if shown.flash else ""
    detail = f"<small>{escape(shown.detail)}</small>" if shown.detail else ""
    html = (
        f'<div class="rg-banner rg-{look.name}{flash}" role="alert">'
        f'<span class="rg-shape">{look.shape}</span>'
        f'<span class="rg-word">{escape(shown.word)}</span>'
        f'<span class="rg-says"><div>{escape(shown.text)}</div>{detail}</span>'
        f'<span class="rg-count">{escape(shown.count)}</span></div>'
    )
    if shown.tone is Tone.LOST:
        html += f'<div class="rg-frame"><b>{look.shape} {escape(shown.word)} {look.shape}</b></div>'
    return html


def side(picture: Picture) -> str:
    """Zones that have no body, and zones whose place nobody knows; below, what ghosts mean."""
    chips = [
        f'<span class="rg-{z.tone.look.name}">{escape(z.label)}</span>'
        for z in (*picture.limits, *(z for z in picture.zones if not z.known))
    ]
    keys = [
        f'<span><i style="background:{colour}"></i>{words}</span>'
        for shown, colour, words in (
            (picture.intent is not None, "#4f8fd0", "where the operator usually goes"),
            (picture.stopping is not None, "#b07cd8", "where it stops if let go now"),
            (picture.next is not None, "#c4a48c", escape(picture.next_words)),
        )
        if shown
    ]
    return (
        f'<div class="rg-side rg-chips">{"".join(chips)}</div>'
        f'<div class="rg-side rg-legend">{"".join(keys)}</div>'
    )


def head(picture: Picture) -> str:
    """Whose page it is."""
    return (
        f'<div class="rg-spacer"></div><div class="rg-head">{escape(picture.machine)}'
        f"<small>{escape(picture.site)}</small></div>"
    )


def card(shown: Card | None) -> str:
    """One alert, or the place of one."""
    if shown is None:
        return '<div class="rg-card rg-none"><p><b>no alert</b></p><small>&nbsp;</small></div>'
    look = shown.tone.look
    flash = " rg-flash" if shown.flash else ""
    return (
        f'<div class="rg-card rg-{look.name}{flash}"><p><span class="rg-shape">'
        f"{look.shape}</span><b>{escape(shown.title)}</b><span>{escape(shown.count)}</span></p>"
        f"<small>{look.word} · {escape(shown.detail)}</small></div>"
    )


def actuators(picture: Picture) -> str:
    """A bar each."""
    rows = "".join(
        f"<tr><td>{escape(b.name)}</td><td>{_bar(b)}</td><td>{escape(b.value)}</td></tr>"
        f"<tr><td></td><td><small>x̂ {escape(b.expected or '—')}</small></td>"
        f"<td><small>lever {escape(b.lever)}</small></td></tr>"
        for b in picture.bars
    )
    title = f'<div class="rg-title">actuators · {escape(picture.basis)}</div>'
    return f'{title}<table class="rg-bars">{rows}</table>'


def happenings(picture: Picture, unix_less_monotonic_s: float) -> str:
    """Lead times, events, and health in one line."""
    leads = "".join(f"<div><b>{escape(line)}</b></div>" for line in picture.leads)
    lines = "".join(
        _event(event, unix_less_monotonic_s) for event in picture.events[:_SHOWN_EVENTS]
    )
    return (
        '<div class="rg-title">warned before the arm went in</div>'
        f'<div class="rg-rows">{leads or "<small>nothing yet</small>"}</div>'
        '<div class="rg-title">events</div>'
        f'<div class="rg-rows">{lines or "<small>none yet</small>"}</div>'
    )


def footer(picture: Picture) -> str:
    """Health in one line."""
    return f'<div class="rg-foot">{escape(picture.footer)}</div>'


def _event(event: Event, unix_less_monotonic_s: float) -> str:
    clock = time.strftime("%H:%M:%S", time.localtime(event.at_s + unix_less_monotonic_s))
    look = event.tone.look
    return (
        f'<div class="rg-event rg-{look.name}"><time>{clock}</time><em>{look.shape}</em>'
        f"<span>{escape(event.text)}</span></div>"
    )


def _bar(bar: Bar) -> str:
    parts = [f'<rect x="0" y="8" width="{_WIDE:g}" height="6" rx="3" fill="var(--rg-line)"/>']
    for start, end, tone in bar.barred:
        colour = {Tone.CAUTION: "#f0c400", Tone.WARNING: "#ffba00", Tone.IMMINENT: "#e21218"}
        width = _WIDE * max(end - start, 0.0)
        parts.append(
            f'<rect x="{_WIDE * start:.1f}" y="2" width="{width:.1f}" height="18" opacity=".85"'
            f' fill="{colour.get(tone, "var(--rg-soft)")}"/>'
        )
    if bar.near is not None and bar.far is not None:
        width = _WIDE * (bar.far - bar.near)
        parts.append(
            f'<rect x="{_WIDE * bar.near:.1f}" y="4" width="{max(width, 4.0):.1f}" height="14"'
            ' rx="5" fill="var(--rg-way)" opacity=".4"/>'
        )
    if bar.there is not None:
        parts.append(
            f'<rect x="{_WIDE * bar.there - 6:.1f}" y="1" width="12" height="20"'
            ' fill="var(--rg-way)"/>'
        )
    if bar.here is not None:
        parts.append(
            f'<rect x="{_WIDE * bar.here - 9:.1f}" y="0" width="18" height="22" rx="4"'
            ' fill="var(--rg-ink)"/>'
        )
    drawing = "".join(parts)
    return (
        f'<svg class="rg-bar" viewBox="-10 0 {_WIDE + 20:g} 22" preserveAspectRatio="none">'
        f"{drawing}</svg>"
    )

"""What is to be seen in a screenshot: shares of the scene that are blue, red or yellow."""

from __future__ import annotations

import io

import numpy as np
import numpy.typing as npt
from PIL import Image

from tests.support.browser import Page

SIZE = (776, 440)
"""Of the window [px]: software draws it."""
PANEL = 416
TOP = 100
BOTTOM = 60
EDGE = 24
_NO_NOTES = """document.querySelectorAll('.mantine-Notifications-root')
    .forEach(notes => { notes.style.visibility = 'hidden'; })"""
"""viser's notes stand in the scene, and are coloured."""


class Scene:
    """The scene of a page without banner, panel, notes and what is written over it."""

    def __init__(self, page: Page) -> None:
        page.evaluate(_NO_NOTES)
        image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        rgb = np.asarray(image, dtype=np.int16)
        self.rgb: npt.NDArray[np.int16] = rgb[
            TOP + EDGE : -BOTTOM, EDGE : image.width - PANEL - EDGE
        ]

    @property
    def blue(self) -> npt.NDArray[np.bool_]:
        """The arm, and its ghosts."""
        red, _, blue = np.moveaxis(self.rgb, 2, 0)
        return np.asarray((blue - red > 18) & (blue > 45))

    def red(self) -> int:
        """Pixels of what is imminent."""
        red, green, blue = np.moveaxis(self.rgb, 2, 0)
        return int(((red - green > 60) & (red - blue > 60)).sum())

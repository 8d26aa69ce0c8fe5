"""The machine in a browser: the arm and what it must not touch, live, in 3D, by viser.

Pure, without browser: `tones` (what a level looks like), `solids` (shapes of keep-out objects),
`model` (arm poses), `picture` (all that a page shows, as one value), `compose` (messages to a
picture) and `markup` (a picture to HTML). With a network or browser: `feed` (one machine over
Zenoh), `stage` and `panel` (3D and controls of one page), `page` and `server`.
"""

"""The pure core: numpy, scipy and maths. No clock, file, thread, network or log.

Data walks one way through it::

    samples ─► inputs (gate) ─► joystick (category) ─► primitive (start, end, x)
                                                            │
                 rls ◄── rampe (memory per category) ◄──────┘
                              │ predictive distribution
                              ▼
    velocity ──────────► forecast (stopping, intent) ─► PathSweeper ─► alarm ─► events

`guard.Guard.step` is the only composer; everything below it can be used alone.
"""

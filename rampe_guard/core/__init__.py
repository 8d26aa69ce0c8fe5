"""The pure core: numpy, scipy and maths. No clock, file, thread, network or log.

Data walks one way through it::

    samples ─► inputs (gate) ─► joystick (category) ─► primitive (start, end, x)
                                                            │
          rampe ◄── start_observer (ξ), screening ◄─────────┘
            ├── faithful: rls, basis, noise           the paper to the letter
            └── adaptive: experience, committee,      the default
                radial | ridge, spread, modes, passing
            │ displacement (predictive distribution)
            ▼
    velocity ──► forecast (stopping, intent) ─► PathSweeper ─► alarm ─► events
                                                     ▲
    poses of objects ──► moving (where each may be) ─┘

`guard.Guard.step` is the only composer; everything below it can be used alone.
"""

"""What the words and names of a report mean."""

from __future__ import annotations

from typing import Final

GUARD: Final = "guard"
SPARING: Final = "guard_sparing"
GUARDS: Final = {
    GUARD: (
        "the guard itself: on the curve it alarms from the threshold of its one probability on,"
        " and where contact can no longer be avoided (imminent_probability 1); the operating point"
        " is as the site has set both"
    ),
    SPARING: (
        "the guard with imminent_probability 1: by the stopping path it alarms only what is"
        " touched whatever the operator does"
    ),
}
"""What the curves of the guard are."""

DEFINITIONS: Final = {
    "crossing": (
        "the arm's true motion, swept between samples with the guard's certificates, enters a"
        " zone; a re-entry within 0.5 s of leaving is the same crossing"
    ),
    "not_monitoring": (
        "the guard says NOT MONITORING: a crossing then, or at the moment at which it sees again,"
        " is neither warned of nor missed, whoever forecasts; an alarm that is frozen meanwhile is"
        " no warning, and begins anew afterwards; rates are of the rest of the time"
    ),
    "inside_at_first": (
        "the arm was in the zone when the log began: no crossing, since nobody could warn of it"
    ),
    "alarm": (
        "lives as the guard's published alerts do, whoever forecasts: it needs a cause in as many"
        " evaluations in a row as the site's alerts say, is held by a score a little below the"
        " threshold (where there is a score), goes off when the cause was gone for the off-delay,"
        " and is on for the shortest life at least; joined across silence of up to 0.5 s"
    ),
    "strict": (
        "the same with alarms that end at their last cause at the full threshold, joined across"
        " silence of up to 0.5 s: nobody earns credit by staying on"
    ),
    "warned_x_s": (
        "share of all crossings whose alarm began at least x s before, and was on at the entry or"
        " had ended at most 0.5 s before"
    ),
    "missed": "crossings without such an alarm",
    "false_per_min_per_zone": "alarms with no crossing in them or within 0.5 s after",
    "alarmed_share": (
        "share of the time outside contact, over all zones, that an alarm was on; who is always"
        " alarmed is never false and has warned of everything, and nobody would listen to it"
    ),
    "lead": (
        "entry less the start of its alarm, or less the end of the crossing before it within the"
        " same alarm; medians and quantiles are of warned crossings"
    ),
    "operating_point": "as the site's own settings have it",
    "published": (
        "the same of the guard's own alerts at a level or above, from rise to clear, with all its"
        " delays and deadbands"
    ),
    "interval": "2.5 % and 97.5 % of 1000 bootstrap samples of blocks of half a minute (seeded)",
    "reliability": (
        "at every evaluation, of every zone that the arm is not in, and where the log goes on, and"
        " the guard monitors, for the horizon: the probability said, against whether the arm"
        " entered within the horizon"
    ),
    "rms": "root mean square error of the next displacement, in shares of the range",
}
"""What each word means."""

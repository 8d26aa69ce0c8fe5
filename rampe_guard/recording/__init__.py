"""Recordings: what a machine and its guard said, kept so that it can be replayed exactly.

::

    taps → backlog → series → writer        record: Zenoh to MCAP files
    reader → mcap_log → log                 MCAP and CSV to the steps of a guard
    channels, bundle                        what is recorded, and the files of a site in it
"""

from rampe_guard.recording.log import Log, is_mcap, open_log
from rampe_guard.recording.mcap_log import McapLog
from rampe_guard.recording.reader import McapReading

__all__ = ["Log", "McapLog", "McapReading", "is_mcap", "open_log"]

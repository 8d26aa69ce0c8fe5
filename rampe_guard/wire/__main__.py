"""``python -m rampe_guard.wire [FOLDER]`` writes the message contract."""

import sys
from pathlib import Path

from rampe_guard.wire.asyncapi import write_contract

if __name__ == "__main__":
    write_contract(Path(sys.argv[1] if len(sys.argv) > 1 else "config/contract"))

"""``python -m rampe_guard.settings [DIRECTORY]`` writes the JSON Schemas for editors."""

import sys
from pathlib import Path

from rampe_guard.settings.schema import write_schemas

if __name__ == "__main__":
    write_schemas(Path(sys.argv[1] if len(sys.argv) > 1 else "config"))

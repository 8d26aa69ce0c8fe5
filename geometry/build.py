"""Write every mesh and URDF below this folder again: ``python geometry/build.py [FOLDER]``.

``--drives`` prints the pins of the excavator as the site file wants them instead.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import build_bench
import build_excavator
import build_yard

PARTS = (("excavator", build_excavator), ("bench", build_bench), ("scenes", build_yard))


def main() -> None:
    """Build into the folder given, else into the one this script stands in."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    parser.add_argument("--drives", action="store_true", help="print the drives, build nothing")
    arguments = parser.parse_args()
    if arguments.drives:
        print("\n".join(build_excavator.drives()))
        return
    for name, part in PARTS:
        print(f"{name}: {part.build(arguments.folder / name)} triangles")


if __name__ == "__main__":
    main()

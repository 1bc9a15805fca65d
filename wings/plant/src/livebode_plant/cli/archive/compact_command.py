"""`livebode archive compact`: join the small files of a lake."""

from __future__ import annotations

import sys

from livebode.cli import Json
from livebode_plant.cli.archive.options import LakeOf


def compact_command(archive: LakeOf, as_json: Json = False) -> None:
    """Join the small files of a lake, and remove files that belong to no result.

    Files that no table has are removed when they are older than a week: an archive that runs now loses none. A table
    with results that are not complete is left as it is.
    """
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake, compact

    found = compact(Lake(lake_url(archive)))
    if as_json:
        print(to_json({"tables": [vars(one) for one in found]}))
        return
    for one in found:
        print(f"{one.table}: {one.before:,} files, now {one.after:,}; {one.removed:,} old ones removed")
        if one.open_results:
            remark = f"{one.open_results:,} results are not complete: let the archive run to its end first"
            print(f"livebode: {one.table}: files not joined; {remark}", file=sys.stderr)

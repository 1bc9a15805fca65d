"""`python -m bench.first_hour`: what a person does in the first hour with a machine, in a terminal and in a browser.

Eleven tasks, each from the files or senders that a person has to a result that is compared with the truth of the
machine: seconds and commands in the terminal; seconds, clicks and reading in headless Chromium.
`--only TEXT`: the tasks whose name contains it.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from bench.browser import chromium
from bench.first_hour import browser, terminal
from bench.first_hour.servo import write_recordings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", metavar="TEXT")
    only = parser.parse_args().only
    with tempfile.TemporaryDirectory() as scratch:
        recordings = Path(scratch) / "recordings"
        recordings.mkdir()
        write_recordings(recordings)
        print(f"{'in the terminal':28}{'seconds':>9}{'commands':>10}  result")
        for name, task in terminal.TASKS.items():
            if only in name:
                place = Path(scratch) / "terminal" / name.replace(" ", "-")
                shutil.copytree(recordings, place)
                at = terminal.Terminal(place)
                result = outcome(lambda: task(at))  # noqa: B023 - called at once
                print(f"{name:28}{at.seconds:9.1f}{len(at.commands):10}  {result}", flush=True)
        print(f"\n{'in the browser':28}{'seconds':>9}{'of reading':>12}{'clicks':>8}  result")
        with chromium() as started:
            for name, walk in browser.TASKS.items():
                if only in name:
                    place = Path(scratch) / "browser" / name.replace(" ", "-")
                    place.mkdir(parents=True)
                    with browser.Person(started, recordings, place) as person:
                        result = outcome(lambda: walk(person))  # noqa: B023 - called at once
                    print(
                        f"{name:28}{person.total_s:9.0f}{person.reading_s:12.0f}{person.clicks:8}  {result}", flush=True
                    )


def outcome(task: object) -> str:
    """What a task gives, or why it failed."""
    try:
        return str(task())  # type: ignore[operator]
    except AssertionError as failure:
        return f"FAILED: {failure}"


if __name__ == "__main__":
    main()

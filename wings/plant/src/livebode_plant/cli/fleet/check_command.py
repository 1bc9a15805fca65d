"""`livebode fleet check`: the proof that every result is stored exactly once."""

from __future__ import annotations

from livebode.cli import Json
from livebode_plant.cli.fleet.options import Fleet


def check_command(fleet: Fleet, as_json: Json = False) -> None:
    """Compute all results of a fleet again from its log, and compare the stored ones bit for bit.

    The fleet may run meanwhile. Exit code 2 if a response, parameter or event is missing, doubled or different.
    """
    import asyncio

    from livebode.records import to_json
    from livebode_plant.cli.fleet.verdict import require_exact, verdict
    from livebode_plant.fleet.check import CheckResult, check_results
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()

    async def check() -> CheckResult:
        async with FleetLog(settings.log, "livebode check") as log:
            return await check_results(log, axes)

    result = asyncio.run(check())
    if as_json:
        print(to_json(result.as_dict()))
    require_exact(result)
    if not as_json:
        print(verdict(result))

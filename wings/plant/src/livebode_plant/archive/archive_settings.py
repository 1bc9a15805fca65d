"""ArchiveSettings: which recordings are tracked, how, where, and where the results go; from archive.toml."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self
from urllib.parse import urlsplit

from pydantic import Field

from livebode.configuration import Axis, File, Schema, read_table, schema_of, tables_of
from livebode.core import LEVELS, ConfigError, on_loopback
from livebode.dataclass import dataclass
from livebode_plant.settings_section import SettingsFile, SettingsSection, place_beside

_PARTS = re.compile(r"\*\*/|\*|\?|\{(\w*)\}")
_WILD = {"**/": "(?:.*/)?", "*": "[^/]*", "?": "[^/]"}


@dataclass(frozen=True)
class Template:
    """A path or URL with *, ** and ?, and with {site}, {line}, {machine} and {axis}, each the name of a directory."""

    text: str

    def checked(self, key: str = "inputs") -> None:
        """ConfigError if a name in braces is not a level of a machine, or is there twice."""
        names = [part[1] for part in _PARTS.finditer(self.text) if part[0].startswith("{")]
        for name in names:
            if name not in LEVELS or names.count(name) > 1:
                fault = "is there twice" if name in LEVELS else "is not a level of a machine"
                raise ConfigError(
                    "value-invalid",
                    f"{{{name}}} in {self.text!r} {fault}",
                    "write {site}, {line}, {machine} and {axis}, each once",
                    key=key,
                    value=self.text,
                )

    @property
    def pattern(self) -> str:
        """The pattern of the files, with * in place of braces.

        >>> Template("plant/{machine}/*.csv").pattern
        'plant/*/*.csv'
        """
        return re.sub(r"\{\w*\}", "*", self.text)

    def machine(self, place: str) -> dict[str, str]:
        """The levels of the machine that the path of a recording names; none if it does not match.

        >>> Template("plant/{machine}/*.csv").machine("plant/press 4/a.csv")
        {'machine': 'press 4'}
        """
        match = self._expression.fullmatch(place.replace(os.sep, "/"))
        return match.groupdict() if match else {}

    def filled(self, levels: Mapping[str, str | None]) -> str | None:
        """The path of the machine with these levels; None if a level in braces is not known.

        >>> Template("baselines/{site}-{machine}.json").filled({"site": "Graz", "machine": "press 4"})
        'baselines/Graz-press 4.json'
        """
        if not all(levels.get(part[1]) for part in _PARTS.finditer(self.text)):
            return None
        return _PARTS.sub(lambda part: levels[part[1]] or "", self.text)

    @property
    def _expression(self) -> re.Pattern[str]:
        parts, end = [], 0
        text = self.text.replace(os.sep, "/")
        for part in _PARTS.finditer(text):
            parts.append(re.escape(text[end : part.start()]))
            parts.append(_WILD.get(part[0]) or f"(?P<{part[1]}>[^/]+)")
            end = part.end()
        return re.compile("".join([*parts, re.escape(text[end:])]))


Text = Annotated[str, Field(min_length=1)]


class ClusterSection(SettingsSection):
    """[cluster]: the processes that track.

    Parameters
    ----------
    kind
        "local": processes on this computer. "ssh": on other computers. "slurm": jobs of Slurm.
    address
        Scheduler of Dask that is running already, such as "tls://head:8786", instead of starting workers.
    workers
        Number of processes. Default: of a local cluster one for each core.
    memory_mb
        Memory of a process, in MB. A recording that needs more is put in quarantine.
    hosts
        Computers of a cluster by ssh; the first one has the scheduler.
    queue
        Partition of Slurm.
    certificate
        Certificate of this computer in PEM, relative to this file. Required except on the loopback.
    key
        Its private key in PEM, relative to this file.
    authority
        Certificate of the authority that signed the certificates of all computers in the cluster, relative to this
        file.
    """

    kind: Literal["local", "ssh", "slurm"] = "local"
    address: Text | None = None
    workers: Annotated[int, Field(ge=1, le=10_000)] | None = None
    memory_mb: Annotated[int, Field(ge=256)] = 1024
    hosts: list[Text] = []
    queue: Text | None = None
    certificate: File | None = None
    key: File | None = None
    authority: File | None = None

    @property
    def encrypted(self) -> bool:
        """Whether all three files of mutual TLS are named."""
        return None not in (self.certificate, self.key, self.authority)

    def checked(self) -> None:
        """ConfigError if others could send it code: a port of Dask executes what it receives."""
        remote = (
            self.kind != "local" if self.address is None else not on_loopback(urlsplit(self.address).hostname or "")
        )
        if remote and (not self.encrypted or (self.address or "tls://").split("://")[0] != "tls"):
            raise ConfigError(
                "cluster-open",
                f"the cluster {self.address or self.kind} is reached over a network without mutual TLS, and whoever "
                "reaches a port of Dask can execute code",
                "set cluster.certificate, cluster.key and cluster.authority, and write the address as tls://HOST:PORT",
                key="cluster.address" if self.address else "cluster.kind",
                value=self.address or self.kind,
            )
        if self.kind == "ssh" and self.address is None and len(self.hosts) < 2:
            raise ConfigError(
                "incomplete",
                "a cluster by ssh needs cluster.hosts: the computer of the scheduler, and at least one for workers",
                "add them; a computer may be there twice",
                key="cluster.hosts",
            )


class ArchiveSettings(SettingsFile):
    """An archive of recordings, and the lake of their results.

    Parameters
    ----------
    inputs
        Paths or URLs of the recordings, with * in a name and ** for any depth. {site}, {line}, {machine} and {axis}
        name the machine of a recording: "s3://plant/{line}/{machine}/*.csv". Relative to this file.
    recipe
        An axis.toml without its source, relative to this file. Its [machine] applies where the inputs name none. With
        [axes], each recording has all of these axes.
    lake
        Directory, relative to this file, or URL of the results.
    baselines
        Path of the baseline of each machine, with its levels in braces: "baselines/{machine}-{axis}.json". A recording
        of a machine whose file exists is compared with it; `livebode archive learn` writes these files. Relative to
        this file. Default: none.
    cluster
        The processes that track.
    """

    inputs: Annotated[list[Text], Field(min_length=1)]
    recipe: File
    lake: Text
    baselines: Text | None = None
    cluster: ClusterSection = ClusterSection()

    def check_values(self) -> None:
        """ConfigError if the cluster would be open to others, or a template is invalid."""
        self.cluster.checked()
        for template in self.templates:
            template.checked()
        if self.baselines is not None:
            check_baselines(self.baselines, "baselines")

    def check(self) -> None:
        """ConfigError if the recipe is invalid."""
        self.axes()

    def beside(self, folder: Path) -> Self:
        """The settings with their paths relative to a folder."""
        folder = folder.absolute()  # places of recordings are stored in the lake
        places = {
            "inputs": [place_beside(folder, text) for text in self.inputs],
            "lake": place_beside(folder, self.lake),
            "baselines": None if self.baselines is None else str(folder / self.baselines),
        }
        return super().beside(folder).model_copy(update=places)

    @property
    def templates(self) -> list[Template]:
        """The inputs."""
        return [Template(text) for text in self.inputs]

    def axes(self) -> dict[str, Axis]:
        """The axes of the recipe by name, whose source.log is a placeholder; a single one has the empty name.

        Raises
        ------
        ConfigError
            If the recipe is not a configuration of axes without a source, or inputs name the axis as well.
        """
        axes = {}
        for name, data in tables_of(read_table(self.recipe), str(self.recipe)).items():
            place = f"{self.recipe}, axis {name}" if name else str(self.recipe)
            if name and any("{axis}" in text for text in self.inputs):
                raise ConfigError(
                    "key-conflict",
                    "inputs name the axis of a recording by {axis}, and [axes] of the recipe name several in it",
                    "write * in place of {axis}",
                    key="inputs",
                ).at(str(self.recipe))
            axes[name] = self._axis(name, data, place)
        return axes

    def _axis(self, name: str, data: dict[str, Any], place: str) -> Axis:
        source = data.get("source", {})
        if isinstance(source, dict) and (named := [key for key in ("log", "url", "replay") if key in source]):
            raise ConfigError(
                "key-conflict",
                f"the recipe of an archive has a source of its own (source.{named[0]})",
                "remove it: the inputs of the archive are the sources",
                key=f"source.{named[0]}",
            ).at(place)
        own = data | {"source": {**source, "log": "recording"}}
        if name and isinstance(machine := data.get("machine", {}), dict):
            own["machine"] = {"axis": name} | machine
        axis = Axis.of(own, place).beside(self.recipe.parent)
        if self.baselines is not None and axis.monitoring.baseline is not None:
            raise ConfigError(
                "key-conflict",
                "the recipe has a baseline for all machines, and the archive one for each (baselines)",
                "remove one of them",
                key="monitoring.baseline",
            ).at(place)
        return axis


def check_baselines(text: str, key: str) -> None:
    """ConfigError if this is not the path of a file for each machine."""
    Template(text).checked(key)
    if "://" in text or any(sign in text for sign in "*?"):
        raise ConfigError(
            "value-invalid",
            f"{key} = {text!r} is not a path on this computer with the levels of a machine in braces",
            'write it as "baselines/{machine}-{axis}.json"',
            key=key,
            value=text,
        )


def archive_schema() -> Schema:
    """JSON Schema of archive.toml."""
    return schema_of(ArchiveSettings, "archive")


def lake_url(target: str) -> str:
    """The lake of an archive.toml, or this path or URL itself."""
    return ArchiveSettings.read(Path(target)).lake if target.lower().endswith(".toml") else target

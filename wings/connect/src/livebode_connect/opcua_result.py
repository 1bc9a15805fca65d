"""The newest result of an axis under the names of OPC 40001-101, Machinery Result Transfer."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import Any

from livebode.publishing import AxisValues

NAMESPACE = "http://opcfoundation.org/UA/Machinery/Result/"
_MANAGEMENT, _RESULT = 1004, 2001
"""Numbers of ResultManagementType and ResultType in this namespace."""


class ResultTypes:
    """The two types, as far as livebode uses them: without methods and without transfer of files.

    asyncua contains no model of this namespace. The numbers and names are those of the standard, so that a client that
    looks for its types finds the results.
    """

    def __init__(self, ua: Any, server: Any) -> None:
        self._ua, self._server = ua, server
        self.index = 0

    async def add(self) -> None:
        """Add the namespace and the types to the server."""
        nodes = self._server.nodes
        self.index = await self._server.register_namespace(NAMESPACE)
        number = self._ua.NodeId(_MANAGEMENT, self.index)
        await nodes.base_object_type.add_object_type(number, self.named("ResultManagementType"))
        number = self._ua.NodeId(_RESULT, self.index)
        base = self._server.get_node(self._ua.ObjectIds.BaseDataVariableType)
        await base.add_variable_type(number, self.named("ResultType"), self._ua.ObjectIds.BaseDataType)

    def named(self, name: str) -> Any:
        """A name of this namespace."""
        return self._ua.QualifiedName(name, self.index)

    async def managed(self, axis: Any, result: str) -> NewestResult:
        """The result of this name, in a new ResultManagement below the object of an axis."""
        ua = self._ua
        data = ua.NodeId(ua.ObjectIds.BaseDataType)
        above, about = ("ResultManagement", "Results"), "ResultMetaData"

        def at(*path: str) -> tuple[Any, Any]:
            """Number of a node, which belongs to livebode, and its name in the standard."""
            number = ua.NodeId("/".join((str(axis.nodeid.Identifier), *path)), axis.nodeid.NamespaceIndex)
            return number, self.named(path[-1])

        management = await axis.add_object(*at(above[0]), objecttype=ua.NodeId(_MANAGEMENT, self.index))
        results = await management.add_folder(*at(*above))
        whole = await results.add_variable(*at(*above, result), None, datatype=data)
        await whole.delete_reference(ua.NodeId(ua.ObjectIds.BaseDataVariableType), ua.ObjectIds.HasTypeDefinition)
        await whole.add_reference(ua.NodeId(_RESULT, self.index), ua.ObjectIds.HasTypeDefinition)
        described = await whole.add_variable(*at(*above, result, about), None, datatype=data)
        begun = datetime.fromtimestamp(0, UTC)
        return NewestResult(
            await described.add_variable(*at(*above, result, about, "ResultId"), ""),
            await described.add_variable(*at(*above, result, about, "CreationTime"), begun),
            await whole.add_variable(*at(*above, result, "ResultContent"), [""]),
        )


class NewestResult:
    """A result of an axis: its name, its time, and all of it as one text of JSON, which is always of one moment."""

    def __init__(self, name: Any, created: Any, content: Any) -> None:
        self._name, self._created, self._content = name, created, content

    async def set(self, values: AxisValues) -> None:
        """Replace it."""
        plain = values.plain()
        await self._content.write_value([json.dumps(plain, ensure_ascii=False)])
        await self._created.write_value(datetime.fromtimestamp(values.unix_s, UTC))
        await self._name.write_value(f"{values.axis} {values.run} {plain['time']}")

"""OpcUaSink: a server of OPC UA with results as variables, and events and alarms as its events."""

from __future__ import annotations

import asyncio
import hmac
import json
import logging
import socket
import threading
from collections.abc import Callable, Coroutine, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from livebode.core import ConfigError, not_installed
from livebode.publishing import (
    AxisValues,
    EventMessage,
    Measurement,
    PublishSection,
    address,
    cannot_listen,
    server_tls,
    unreachable,
)
from livebode.publishing import password as required_password

RESULT_NAMESPACE = "http://opcfoundation.org/UA/Machinery/Result/"
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
        self.index = await self._server.register_namespace(RESULT_NAMESPACE)
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


NAMESPACE = "urn:livebode:results"
_SEVERITIES = {"high": 900, "medium": 600, "low": 300, "info": 100}
_UNIT_CODES = {"Hz": "HTZ", "s": "SEC", "kg": "KGM", "kg m²": "B32", "deg": "DD", "dB": "2N", "N/m": "4P"}
"""Codes of UNECE Recommendation 20, from which OPC UA makes the number of a unit."""
_UNITS_OF = "http://www.opcfoundation.org/UA/units/un/cefact"
_START_S = 60.0  # for the start of the server, and for each change of its nodes


class OpcUaSink:
    """A server. Clients read and subscribe; nothing can be written.

    Below ``Objects/livebode`` each axis has an object with ``Parameters``, ``Status`` and ``Response``. A parameter has
    the properties ``EngineeringUnits`` and ``Bound``; where it is not valid its status code is bad. An alarm is an
    OffNormalAlarm of this object, each other event a BaseEvent.
    """

    events_at_once = 100
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        try:
            import asyncua
        except ImportError:
            raise not_installed("OPC UA needs asyncua, which is not installed", "asyncua", "opcua") from None
        logging.getLogger("asyncua").setLevel(logging.ERROR)
        self._ua: Any = asyncua.ua
        self._section = section
        address(section), server_tls(section)
        if section.key_file is not None:
            _check_rsa(section.key_file)
        if (required_password(section) is None) != (section.username is None):
            raise ConfigError(
                "incomplete",
                "[[publish]] of kind opcua has one of username and password",
                "add the other one",
                key="publish.username",
            )
        self._loop = asyncio.new_event_loop()
        self._thread: threading.Thread | None = None
        self._server: Any = None
        self._axes: dict[str, Any] = {}
        self._results: dict[str, NewestResult] = {}
        self._variables: dict[tuple[str, ...], Any] = {}

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Pass these to the clients that are subscribed now."""
        self._run(lambda: self._trigger_all(events))

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Set the variables."""
        self._run(lambda: self._set_all(values))

    def close(self) -> None:
        """End the server."""
        if self._thread is not None:
            if self._server is not None:
                asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(self._section.timeout_s)
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
        self._loop.close()

    def _run(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._loop.run_forever, name="livebode opcua", daemon=True)
            self._thread.start()

        async def served() -> None:
            if self._server is None:
                await self._start()
            await work()

        try:
            asyncio.run_coroutine_threadsafe(served(), self._loop).result(_START_S)
        except TimeoutError as error:
            raise unreachable(error, _START_S) from None

    async def _start(self) -> None:
        import asyncua
        from asyncua.crypto import permission_rules

        _check_free(*address(self._section)[1:3])
        library: Any = asyncua
        rules: Any = permission_rules
        section = self._section
        server = library.Server(user_manager=_Users(section))
        await server.init()
        server.set_endpoint(section.url or "")
        server.set_server_name("livebode")
        policies = self._ua.SecurityPolicyType
        policy = policies.NoSecurity
        if section.certificate_file is not None:
            policy = policies.Basic256Sha256_SignAndEncrypt
            await server.load_certificate(str(section.certificate_file))
            await server.load_private_key(str(section.key_file))
        server.set_security_policy([policy], permission_ruleset=rules.SimpleRoleRuleset())
        index = await server.register_namespace(NAMESPACE)
        await server.start()
        self._server, self._index = server, index
        self._root = await server.nodes.objects.add_object(index, "livebode")
        self._types = ResultTypes(self._ua, server)
        await self._types.add()

    async def _stop(self) -> None:
        await self._server.stop()

    async def _axis(self, name: str) -> Any:
        if name not in self._axes:
            axis = await self._root.add_object(self._ua.NodeId(name, self._index), self._named(name))
            await axis.set_event_notifier([self._ua.EventNotifier.SubscribeToEvents])
            self._axes[name] = axis
        return self._axes[name]

    def _named(self, name: str) -> Any:
        return self._ua.QualifiedName(name, self._index)

    async def _set_all(self, values: Sequence[AxisValues]) -> None:
        for axis_values in values:
            for measured in axis_values.measurements:
                await self._set_measurement(axis_values, measured)
            for name, value in axis_values.status.items():
                await self._set(axis_values, ("Status", name), value)
            alarms = [f"{alarm.priority}: {alarm.message}" for alarm in axis_values.alarms]
            await self._set(axis_values, ("Status", "alarms"), alarms)
            for name in ("frequency_hz", "real", "imag", "sigma", "coherence") if axis_values.response else ():
                column = (axis_values.response or {})[name]
                await self._set(
                    axis_values, ("Response", name), [float("nan") if v is None else float(v) for v in column]
                )
            await self._set_result(axis_values)

    async def _set_result(self, values: AxisValues) -> None:
        if values.axis not in self._results:
            axis = await self._axis(values.axis)
            self._results[values.axis] = await self._types.managed(axis, "Newest")
        await self._results[values.axis].set(values)

    async def _set_measurement(self, values: AxisValues, measured: Measurement) -> None:
        path = ("Parameters", measured.name)
        variable = await self._set(values, path, measured.value)
        key = (values.axis, *path, "Bound")
        bound = float("nan") if measured.bound is None else measured.bound
        if key not in self._variables:
            await variable.add_property(self._index, "EngineeringUnits", self._unit(measured.unit))
            self._variables[key] = await variable.add_property(self._index, "Bound", bound)
        await self._variables[key].write_value(bound)

    async def _set(self, values: AxisValues, path: tuple[str, ...], value: Any) -> Any:
        """Write a variable, which is made when it is new; None is a bad value."""
        ua = self._ua
        kinds = {str: ua.VariantType.String, int: ua.VariantType.Int64}
        first = value[0] if isinstance(value, list) and value else "" if isinstance(value, list) else value
        kind = kinds.get(type(first), ua.VariantType.Double)
        variant = ua.Variant(0.0 if value is None else value, kind, is_array=isinstance(value, list))
        key = (values.axis, *path)
        if key not in self._variables:
            folder = await self._folder(values.axis, path[0])
            node = self._ua.NodeId("/".join(key), self._index)
            self._variables[key] = await folder.add_variable(node, self._named(path[1]), variant)
        status = ua.StatusCode(ua.StatusCodes.BadNoDataAvailable if value is None else ua.StatusCodes.Good)
        moment = datetime.fromtimestamp(values.unix_s, UTC)
        variant = ua.Variant(None, ua.VariantType.Null) if value is None else variant
        await self._variables[key].write_value(ua.DataValue(variant, StatusCode=status, SourceTimestamp=moment))
        return self._variables[key]

    async def _folder(self, axis: str, name: str) -> Any:
        key = (axis, name)
        if key not in self._variables:
            above = await self._axis(axis)
            self._variables[key] = await above.add_object(
                self._ua.NodeId(f"{axis}/{name}", self._index), self._named(name)
            )
        return self._variables[key]

    def _unit(self, unit: str) -> Any:
        """The unit as in OPC 10000-8; its number is -1 where no code is known."""
        ua = self._ua
        number = int.from_bytes(_UNIT_CODES[unit].encode(), "big") if unit in _UNIT_CODES else -1
        return ua.EUInformation(_UNITS_OF, number, ua.LocalizedText(unit), ua.LocalizedText(unit))

    async def _trigger_all(self, events: Sequence[EventMessage]) -> None:
        ua = self._ua
        for event in events:
            source = await self._axis(event.axis)
            alarm = event.condition != "event"
            kind = ua.ObjectIds.OffNormalAlarmType if alarm else ua.ObjectIds.BaseEventType
            generator = await self._server.get_event_generator(kind, source)
            of = generator.event
            of.Severity, of.SourceName = _SEVERITIES[event.priority], event.axis
            if alarm:
                active = event.condition == "alarm"
                of.ConditionName, of.Retain = event.cause, active
                of.NodeId = ua.NodeId(f"{event.axis}/Alarms/{event.cause}", self._index)
                of.ConditionClassName = ua.LocalizedText(event.kind)
                setattr(of, "EnabledState/Id", True)
                setattr(of, "ActiveState/Id", active)
                of.ActiveState = ua.LocalizedText("Active" if active else "Inactive")
            await generator.trigger(datetime.fromtimestamp(event.unix_s, UTC), event.message)
            # Most clients subscribe at the object of the server; the library passes an event to one object only.
            of.emitting_node = ua.NodeId(ua.ObjectIds.Server)
            await generator.isession.subscription_service.trigger_event(of, subscription_id=None)


def _check_rsa(path: Path) -> None:
    """ConfigError for another kind of key, with which the library would fail at each connection."""
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    if not isinstance(load_pem_private_key(path.read_bytes(), None), RSAPrivateKey):
        raise ConfigError(
            "file-unusable",
            f"the key {path} is not one of RSA, which Basic256Sha256 of OPC UA requires",
            "make certificate and key with RSA of 2048 bits or more",
            key="publish.key_file",
            path=str(path),
        )


def _check_free(host: str, port: int) -> None:
    """PublishError if nothing can listen there; making a server to find that out takes seconds."""
    try:
        with socket.create_server((host, port)):
            pass
    except OSError as error:
        raise cannot_listen(host, port, error) from None


class _Users:
    """Who may read: everybody, or the one user of the section."""

    def __init__(self, section: PublishSection) -> None:
        self._section = section

    def get_user(
        self, _server: Any, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> Any:
        """The user with a role that may not change anything; None for another one."""
        from asyncua.crypto.permission_rules import User, UserRole

        del certificate
        expected = required_password(self._section)
        if expected is not None:
            right = hmac.compare_digest((password or "").encode(), expected.encode())
            if not right or username != self._section.username:
                return None
        return User(role=UserRole.User)

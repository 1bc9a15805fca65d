"""Servers of asyncua in processes of their own, each told over standard input what to write.

Lines in: {"sample": …, "data": […, …], "stamp_s": …}. Lines out: "serving" with the number of the process, and "ready"
when every node is subscribed to.

The import of asyncua and the nodes that the standard demands cost two seconds of the processor. The process that is
started, with the number of a socket as its argument, has them once; it forks a server for each message, which has the
port, the folder of certificates and the login, and the descriptors of the server's standard input and output.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import signal
import socket
import sys
from datetime import UTC, datetime

from asyncua import Server, ua
from asyncua.crypto.permission_rules import User, UserRole

NODES = ("w", "y", "sample")


class Users:
    """One user with a password, as the command line says."""

    def __init__(self, name: str, password: str) -> None:
        self._login = (name, password)

    def get_user(self, _server, username=None, password=None, certificate=None):
        del certificate
        return User(role=UserRole.User) if (username, password) == self._login else None


async def prepared() -> Server:
    server = Server()
    await server.init()
    return server


async def serve(server: Server, port: int, folder: str, login: list[str]) -> None:
    if login:
        server.iserver.user_manager = Users(*login)
    server.set_endpoint(f"opc.tcp://127.0.0.1:{port}/livebode")
    if folder:
        server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        await server.load_certificate(f"{folder}/server.der")
        await server.load_private_key(f"{folder}/server.pem")
    axis = await server.nodes.objects.add_object(2, "axis")
    variables = {}
    for name in NODES:
        empty = ua.Variant(0, ua.VariantType.Int64) if name == "sample" else ua.Variant([0.0], ua.VariantType.Double)
        variables[name] = await axis.add_variable(ua.NodeId(f"axis.{name}", 2), name, empty)
    async with server:
        print("serving", os.getpid(), flush=True)
        await asyncio.gather(obey(server, variables), report_ready(server))


async def obey(server: Server, variables: dict) -> None:
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        fields = json.loads(line)
        stamp = datetime.fromtimestamp(fields["stamp_s"], UTC).replace(tzinfo=None)
        values = {
            "w": ua.Variant(fields["data"][0], ua.VariantType.Double),
            "y": ua.Variant(fields["data"][1], ua.VariantType.Double),
            "sample": ua.Variant(fields["sample"], ua.VariantType.Int64),
        }
        for name, value in values.items():
            await server.write_attribute_value(variables[name].nodeid, ua.DataValue(value, SourceTimestamp=stamp))
    sys.exit(0)


async def report_ready(server: Server) -> None:
    service = server.iserver.subscription_service
    while True:
        for subscription in service.subscriptions.values():
            if len(subscription.monitored_item_srv._monitored_items) >= len(NODES):
                print("ready", flush=True)
                return
        await asyncio.sleep(0.01)


def fork_servers(orders: socket.socket, server: Server) -> None:
    """Until the tests have ended."""
    while True:
        message, files, _, _ = socket.recv_fds(orders, 1 << 16, 2)
        if not message:
            return
        if os.fork() == 0:
            orders.close()
            for number, file in enumerate(files):
                os.dup2(file, number)
            asyncio.run(serve(server, *json.loads(message)))
            return
        for file in files:
            os.close(file)


if __name__ == "__main__":
    logging.disable(logging.CRITICAL)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for a server that was killed
    fork_servers(socket.socket(fileno=int(sys.argv[1])), asyncio.run(prepared()))

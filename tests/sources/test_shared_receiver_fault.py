"""The thread that computes receives for all UDP sources, another one where it does not come to it."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

import numpy as np
import pytest

from livebode.sources.live import LiveBlock
from livebode.sources.live.datagrams import DatagramReceiver
from livebode.sources.live.inbox import Inbox
from tests.support.peers.peer import PATIENCE_S, RATE_HZ, SAMPLES, batches, fed, send_all, until
from tests.support.peers.plain import TcpPeer


def port() -> socket.socket:
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.bind(("127.0.0.1", 0))
    return found


def send(to: socket.socket, *texts: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for text in texts:
            sender.sendto(text, to.getsockname())


def receivers() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "livebode datagrams"]


def test_each_port_gets_its_own_datagrams_in_order_and_the_last_one_ends_the_thread() -> None:
    receiver, got = DatagramReceiver(), ([], [])
    before = len(receivers())
    with port() as a, port() as b:
        with receiver.receiving(a, lambda text, _: got[0].append(text)):
            with receiver.receiving(b, lambda text, _: got[1].append(text)):
                assert len(receivers()) == before + 1
                send(a, *[b"a%d" % i for i in range(50)])
                send(b, *[b"b%d" % i for i in range(50)])
                until(lambda: len(got[0]) == len(got[1]) == 50, "all datagrams")
            send(b, b"late")
            send(a, b"last")
            until(lambda: got[0][-1] == b"last", "a port to be received from after another one was closed")
        until(lambda: len(receivers()) == before, "the thread to end")
    assert got == ([b"a%d" % i for i in range(50)] + [b"last"], [b"b%d" % i for i in range(50)])


def test_a_port_that_fails_raises_in_its_own_source_and_disturbs_no_other() -> None:
    receiver, got = DatagramReceiver(), []

    def fail(*_: object) -> None:
        raise OSError("the port is gone")

    with port() as a, port() as b, receiver.receiving(b, lambda text, host: got.append((text, host))) as others:
        with receiver.receiving(a, fail) as check:
            check()
            send(a, b"1")
            until(lambda: receiver._failures, "the failure")
            with pytest.raises(OSError, match="the port is gone"):
                check()
            send(b, b"2")
            until(lambda: got, "the other port")
            others()
        with receiver.receiving(a, lambda text, host: got.append((text, host))):  # as a source that tries again
            send(a, b"3")
            until(lambda: len(got) == 2, "the port that failed")
    assert got == [(b"2", "127.0.0.1"), (b"3", "127.0.0.1")]


def test_a_thread_that_waits_receives_until_it_does_something_else_for_long() -> None:
    receiver, by = DatagramReceiver(), []
    with port() as a, receiver.receiving(a, lambda *_: by.append(threading.current_thread())):

        def received() -> bool:
            send(a, b"1")
            receiver.receive(0.1)
            return by[-1:] == [threading.current_thread()]

        until(received, "this thread to receive")
        send(a, b"2")
        until(lambda: by[-1].name == "livebode datagrams", "the other thread to receive")


def test_a_thread_that_waits_for_datagrams_is_woken() -> None:
    receiver, returned = DatagramReceiver(), threading.Event()

    def wait() -> None:
        receiver.receive(10 * PATIENCE_S)
        returned.set()

    with port() as a, receiver.receiving(a, lambda *_: None):
        waiting = threading.Thread(target=wait)
        waiting.start()
        until(lambda: (receiver.wake(), returned.is_set())[1], "it to be woken")
        waiting.join()


def test_what_arrives_while_an_axis_waits_for_its_turn_is_one_block_of_at_most_a_quarter_second(tmp_path: Path) -> None:
    found: list[LiveBlock] = []
    with TcpPeer(tmp_path) as peer:

        def script() -> None:
            peer.wait_ready()
            send_all(peer, batches(40, first=0), pause_s=0.0)

        with fed(peer, script) as source:

            def wait() -> None:
                until(lambda: found[1:] or source.waiting_s > 38.5 * SAMPLES / RATE_HZ, "all other batches to wait")

            for block in source.stream(wait_s=0.0):
                found += [] if block is None else [block]
                wait()
                if found and found[-1].stop == 40 * SAMPLES:
                    break
    assert [len(block) for block in found] == [SAMPLES, 1000, 950]
    assert np.array_equal(np.concatenate([block["w"] for block in found]), np.arange(40 * SAMPLES))
    assert not any(block.gap for block in found)


def test_an_axis_hears_of_samples_only_when_enough_wait_for_a_response() -> None:
    inbox, heard = Inbox(), []
    inbox.listener = lambda: heard.append(round(inbox.seconds * RATE_HZ))
    inbox.enough_s = (2.5 * SAMPLES - 0.5) / RATE_HZ
    for batch in batches(4, first=0):
        inbox.put(batch, wait=False)
    inbox.close()
    assert heard == [3 * SAMPLES, 4 * SAMPLES, 4 * SAMPLES]

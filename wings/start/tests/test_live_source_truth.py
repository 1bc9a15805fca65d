"""From the address of a machine that sends to its Bode plot, in Chromium, as a person clicks."""

from __future__ import annotations

import contextlib
import json
import threading
import time
import tomllib
from collections.abc import Iterator
from itertools import repeat
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Channel
from livebode.dashboard import ServerSettings
from livebode.records import RunRecord
from livebode.sources.live import Batch, encode_layout, encode_samples
from livebode_start.listening import LISTENERS_MAX
from tests.support.browser import Tab, chromium, until
from tests.support.foreign import FIELDS, messages, sending, tcp_sender, udp_sender
from tests.support.guarded import TOKEN, VIEWER
from tests.support.many_runs import ask
from tests.support.peers.broker import Mosquitto, publisher, stop
from tests.support.peers.peer import free_port
from tests.support.servo_csv import SERVO, WINDOW, recording
from tests.support.start_pages import CHANNELS, start_page

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
UNITS = {"torque_offset": "N m", "torque": "N m", "motor_speed": "rad/s"}
BATCH = 100


@contextlib.contextmanager
def servo(port: int, batch: int = BATCH) -> Iterator[None]:
    """The servo of two masses sends its samples by UDP, in its own rate, as long as the test lasts."""
    columns = recording(24)
    data = np.array([columns[name] for name in UNITS])[:, 8 * WINDOW :]  # steady: the next repetition follows smoothly
    channels = tuple(Channel(name, unit) for name, unit in UNITS.items())
    layout, ended = encode_layout(channels, SERVO.rate_hz), threading.Event()

    def datagrams() -> Iterator[bytes]:
        for first in range(0, 1 << 30, batch):
            part = data[:, np.arange(first, first + batch) % data.shape[1]]
            yield layout
            yield encode_samples(Batch(first, part, channels, SERVO.rate_hz, 7), double=True)

    def send(link: object) -> None:
        began = time.monotonic()
        for number, datagram in enumerate(datagrams()):
            if ended.wait(max(0.0, began + number // 2 * batch / SERVO.rate_hz - time.monotonic())):
                return
            with contextlib.suppress(OSError):  # nobody listens now
                link.sendto(datagram, ("127.0.0.1", port))  # type: ignore[attr-defined]

    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        thread = threading.Thread(target=send, args=(link,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


def enter(tab: Tab, address: str) -> None:
    """Enter an address as a person does."""
    tab.page.wait_for_selector("#address")
    tab.page.fill("#address", address)
    tab.page.press("#address", "Enter")


def measured(tab: Tab) -> None:
    """Measure until the page of the run shows responses, and finish there."""
    tab.page.wait_for_selector("#measure:enabled")
    tab.page.click("#measure")
    tab.page.wait_for_url("**/run/**")
    tab.until("window.livebode?.bode.curves.measured")
    tab.page.wait_for_selector("#finish:visible")


@pytest.mark.parametrize("options", [{}, PHONE], ids=["desk", "phone"])
def test_from_the_address_of_a_servo_to_its_bode_plot(tmp_path: Path, options: dict) -> None:
    folder, port = tmp_path / "runs", free_port()
    name = f"udp-{port}"
    with servo(port), start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False, **options) as tab:
        enter(tab, f"udp://127.0.0.1:{port}")
        tab.page.wait_for_url("**/measure**")
        tab.page.wait_for_selector("#measure:enabled")
        assert {role: tab.page.input_value(f"#role-{role}") for role in CHANNELS} == CHANNELS
        assert tab.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        heard = tab.page.locator("#channels tbody tr").all_inner_texts()
        assert [row.split("\t")[:2] for row in heard] == [list(channel) for channel in UNITS.items()]
        assert not tab.page.is_visible("#span")
        text = tomllib.loads(tab.page.text_content("#text") or "")
        assert text["source"] == {"url": f"udp://127.0.0.1:{port}", "rate_hz": SERVO.rate_hz}
        assert text["lines"]["window"] == 1000
        measured(tab)
        assert tab.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        tab.page.click("#finish")
        tab.page.wait_for_selector("#finish", state="hidden")
        tab.page.wait_for_function("() => /· recorded/.test(document.getElementById('status-text').textContent)")
        assert tab.wrong == []
    assert (folder / f"{name}.toml").exists()
    summary = json.loads((folder / name / "run.json").read_text())
    assert summary["record"]["ended"] or summary["record"]["finished"]
    response = RunRecord.open(folder / name).responses()[-1:]
    truth = SERVO.response(response.frequency_hz)
    assert np.all(np.abs(response.value[0] - truth) < 0.05 * np.abs(truth))


def test_the_messages_of_another_program_are_mapped_and_their_rate_can_be_set(tmp_path: Path) -> None:
    with (
        tcp_sender(messages()) as port, start_page(tmp_path) as url, chromium() as browser,
        Tab(browser, url, wait=False) as tab,
    ):  # fmt: skip
        enter(tab, f"tcp://127.0.0.1:{port}")
        tab.page.wait_for_selector("#measure:enabled")
        assert set(tab.page.locator("#channels tbody th").all_inner_texts()) == {
            "ts", "n", "drive.enabled", *FIELDS.values()
        }  # fmt: skip
        tab.page.fill("#rate-hz", "1000")
        tab.page.click("#rate-set")
        tab.page.wait_for_url("**rate_hz=1000")
        tab.page.wait_for_selector("#measure:enabled")
        source = tomllib.loads(tab.page.text_content("#text") or "")["source"]
        assert source == {
            "url": f"tcp://127.0.0.1:{port}", "rate_hz": 1000, "sample_field": "n", "fields": FIELDS
        }  # fmt: skip
        tab.page.click("#again")
        tab.page.wait_for_selector("#again:disabled")
        tab.page.wait_for_selector("#again:enabled")
        tab.page.wait_for_selector("#measure:enabled")
        assert tab.wrong == []


def test_of_a_broker_with_several_topics_each_is_listed_and_one_is_chosen(tmp_path: Path) -> None:
    with Mosquitto(tmp_path) as broker:
        client = publisher(broker.port)

        def send(payload: bytes) -> None:
            client.publish("hall/axis1", payload)
            client.publish("hall/temperature", b'{"celsius": 21.5}')

        with (
            sending(send, messages()), start_page(tmp_path / "runs") as url, chromium() as browser,
            Tab(browser, url, wait=False) as tab,
        ):  # fmt: skip
            enter(tab, f"mqtt://127.0.0.1:{broker.port}")
            tab.page.wait_for_selector(".start .heard table")
            assert "hall/temperature: celsius" in tab.page.inner_text(".start .heard")
            assert "give one of them" in tab.page.inner_text(".heard-status")
            enter(tab, f"mqtt://127.0.0.1:{broker.port}/hall/axis1")
            tab.page.wait_for_selector("#measure:enabled")
            assert tab.page.text_content("#command") == "livebode run axis1.toml --out=axis1"
        stop(client)


def sentence(tab: Tab, address: str) -> str:
    """What the page says of an address that cannot be used."""
    enter(tab, address)
    tab.page.wait_for_selector(".heard-status.wrong")
    return tab.page.inner_text(".heard-status")


def test_what_cannot_be_used_is_the_sentence_of_inspect(tmp_path: Path) -> None:
    silent, garbage = free_port(), free_port()
    with (
        udp_sender(garbage, repeat(b"12.5;13.5;rpm")), start_page(tmp_path / "runs") as url, chromium() as browser,
        Tab(browser, url, wait=False, **PHONE) as tab,
    ):  # fmt: skip
        assert "no samples arrived within 3 s (nothing was received)" in sentence(tab, f"udp://127.0.0.1:{silent}")
        assert "13 bytes and begins with b'12.5;13.5;rpm'" in sentence(tab, f"udp://127.0.0.1:{garbage}")
        assert "password_env" in sentence(tab, "mqtt://user:secret@127.0.0.1")
        assert "scheme that is not supported" in sentence(tab, "http://127.0.0.1:80")
        assert "livebode inspect serial:/dev/ttyACM0" in sentence(tab, "serial:///dev/ttyACM0")
        assert tab.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        assert "secret" not in tab.page.url
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(("token", "status"), [("", 401), (VIEWER, 403), (TOKEN, 400)])
def test_only_an_operator_listens(tmp_path: Path, token: str, status: int) -> None:
    with start_page(tmp_path, ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER)) as url:
        assert ask(url, "/api/listen", {"address": "nothing"}, token=token)[0] == status


def test_an_address_has_one_listener_and_the_server_a_few(tmp_path: Path) -> None:
    addresses = [f"udp://127.0.0.1:{free_port()}" for _ in range(LISTENERS_MAX)]
    asked = [*addresses, addresses[0], f"udp://127.0.0.1:{free_port()}"]
    answers: list[str] = []

    def listen(url: str, address: str) -> None:
        answers.append(ask(url, "/api/listen", {"address": address})[2]["error"])

    with start_page(tmp_path) as url:
        threads = [threading.Thread(target=listen, args=(url, address)) for address in asked]
        for number, thread in enumerate(threads):
            thread.start()
            if number >= LISTENERS_MAX:
                until(lambda number=number: len(answers) > number - LISTENERS_MAX, "the refusal")  # type: ignore[misc]
        for thread in threads:
            thread.join()
    assert len(answers) == len(asked)
    assert sum("nothing was received" in answer for answer in answers) == LISTENERS_MAX
    assert sum("listened to already" in answer for answer in answers) == 2

"""The files of examples/deploy, used by the programs that they are for: systemd's checks, and a real nginx."""

from __future__ import annotations

import json
import re
import ssl
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from livebode.configuration import ServeSection
from livebode.dashboard import ServerSettings
from tests.support.dashboards import Watched
from tests.support.guarded import TOKEN, port_of
from tests.support.peers.certificates import Authority
from tests.support.peers.peer import PATIENCE_S, free_port, program, until

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples/deploy"
UNIT = FOLDER / "livebode@.service"
PAGE = (ROOT / "docs/how-to/deploy.md").read_text("utf-8")


def test_the_unit_is_valid_and_its_exposure_is_that_of_the_page(tmp_path: Path) -> None:
    analyze = program("systemd-analyze")
    text = UNIT.read_text("utf-8")
    installed = tmp_path / UNIT.name
    livebode = Path(sys.executable).with_name("livebode")
    installed.write_text(text.replace("/opt/livebode/bin/livebode", str(livebode)), "utf-8")
    verified = subprocess.run([analyze, "verify", installed], capture_output=True, text=True)
    assert (verified.returncode, verified.stderr) == (0, "")
    command = f"{analyze} security --offline=true --no-pager examples/deploy/{UNIT.name}".split()
    security = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    found = re.search(r"Overall exposure level .*: (\S+) (\w+)", security.stdout)
    assert found, security.stderr
    assert f"exposure {found[1]} of 10 ({found[2]})" in PAGE


@contextmanager
def proxied(folder: Path, upstream: int, certificate: Path, key: Path) -> Iterator[int]:
    """nginx with the file of the example in front of this port; the value is its own port."""
    port = free_port()
    server = (FOLDER / "nginx.conf").read_text("utf-8")
    for ours, theirs in (
        ("443", str(port)), ("8765", str(upstream)),
        ("/etc/livebode/tls.crt", str(certificate)), ("/etc/livebode/tls.key", str(key)),
    ):  # fmt: skip
        assert ours in server
        server = server.replace(ours, theirs)
    places = "".join(f"{name}_temp_path {folder};\n" for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    (folder / "nginx.conf").write_text(
        f"daemon off;\npid {folder}/pid;\nevents {{}}\nhttp {{\naccess_log off;\n{places}{server}}}\n"
    )
    command = [program("nginx"), "-p", folder, "-c", folder / "nginx.conf", "-e", folder / "errors"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as nginx:
        try:
            until(lambda: (folder / "pid").exists() and (folder / "pid").read_text().strip(), "nginx")
            yield port
        finally:
            nginx.terminate()


def test_the_dashboard_works_behind_nginx_with_a_secure_cookie_and_without_other_origins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    authority = Authority(tmp_path, "authority")
    certificate, key = authority.sign("dashboard")
    monkeypatch.setenv("LIVEBODE_TOKEN", TOKEN)
    section = ServeSection(port=0, token_env="LIVEBODE_TOKEN", certificate_file=certificate, key_file=key)
    (tmp_path / "nginx").mkdir()
    trust = ssl.create_default_context(cafile=str(authority.file))
    with (
        Watched(tmp_path / "run", ServerSettings.of(section)) as watched,
        proxied(tmp_path / "nginx", port_of(watched), certificate, key) as port,
    ):
        watched.go(6000)
        base = f"https://127.0.0.1:{port}"
        request = urllib.request.Request(
            f"{base}/login", json.dumps({"token": TOKEN}).encode(), {"Origin": base, "Content-Type": "application/json"}
        )
        with urllib.request.urlopen(request, context=trust) as answer:
            cookie = answer.headers["set-cookie"]
        assert "Secure" in cookie
        cookies = {"Cookie": cookie.partition(";")[0]}
        with urllib.request.urlopen(urllib.request.Request(base, headers=cookies), context=trust) as answer:
            assert b"<!doctype html>" in answer.read().lower()
        live = f"wss://127.0.0.1:{port}/live"
        with connect(live, ssl=trust, origin=base, additional_headers=cookies) as link:
            assert link.recv(timeout=PATIENCE_S)
        with pytest.raises(InvalidStatus, match="403"):
            connect(live, ssl=trust, origin="https://elsewhere.example", additional_headers=cookies)

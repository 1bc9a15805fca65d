"""Who is refused by the dashboard, and that refusing costs the run nothing."""

from __future__ import annotations

import json
import re
import ssl
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
import websockets
from websockets.sync.client import connect

from livebode.configuration import Axis, ServeSection
from livebode.core import ConfigError, Event, LivebodeError, ServerError
from livebode.dashboard import Dashboard, ServerSettings
from livebode.dashboard.access import Access
from livebode.dashboard.guard import Guard
from tests.support.browser import Tab, chromium
from tests.support.dashboards import Watched
from tests.support.errors import refused
from tests.support.guarded import TOKEN, VIEWER, ask, cookie, guarded, login, origin, port_of
from tests.support.peers.certificates import Authority

ACTIONS = ("/api/acknowledge", "/api/shelve", "/api/unshelve")


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with guarded(tmp_path_factory.mktemp("guarded")) as found:
        yield found


def test_nothing_is_shown_without_a_token(watched: Watched) -> None:
    assert ask(watched, "/")[:2][0] == 303
    for path in (
        "/api/past?axis=0&from=0&to=1",
        "/api/moment?axis=0&from=0",
        "/api/signals?axis=0",
        "/api/loop?axis=0",
        "/api/steps?axis=0&trial=gain~0.3",
        "/api/export?axis=0&from=0&to=1",
        "/api/saved?axis=0",
    ):
        status, _, body = ask(watched, path)
        assert (status, json.loads(body)["error"]) == (401, "log in first")
    for path in (*ACTIONS, "/api/saved"):
        assert ask(watched, path, "POST", {"axis": 0, "event": "x"}, Origin=origin(watched))[0] == 401
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        connect(f"ws://127.0.0.1:{port_of(watched)}/live", origin=origin(watched))


def test_a_login_gives_a_cookie_that_scripts_and_other_sites_cannot_use(watched: Watched) -> None:
    status, cookies = login(watched, TOKEN)
    assert status == 200
    assert "HttpOnly" in cookies
    assert "SameSite=strict" in cookies
    assert TOKEN not in cookies
    mine = cookies.partition(";")[0]
    assert ask(watched, "/", Cookie=mine)[0] == 200
    assert ask(watched, "/api/past?axis=0&from=0&to=1", Cookie=mine)[0] == 200
    assert ask(watched, "/logout", "POST", {}, Origin=origin(watched), Cookie=mine)[0] == 200
    assert ask(watched, "/api/past?axis=0&from=0&to=1", Cookie=mine)[0] == 401
    # A program may send the token in a header instead, and needs no origin then; never in the address.
    bearer = f"Bearer {TOKEN}"
    assert ask(watched, "/api/past?axis=0&from=0&to=1", Authorization=bearer)[0] == 200
    assert ask(watched, f"/api/past?axis=0&from=0&to=1&token={TOKEN}")[0] == 401


def test_a_viewer_may_only_look(watched: Watched) -> None:
    mine = cookie(watched, VIEWER)
    assert ask(watched, "/api/past?axis=0&from=0&to=1", Cookie=mine)[0] == 200
    headers = {"Origin": origin(watched), "Cookie": mine, "Content_Type": "application/json"}
    assert json.loads(ask(watched, "/api/saved?axis=0", Cookie=mine)[2]) == {"references": [], "annotations": []}
    for path in (*ACTIONS, "/api/saved"):
        status, _, body = ask(watched, path, "POST", {"axis": 0, "event": "x"}, **headers)
        assert (status, json.loads(body)["error"]) == (403, "this session is read-only")
    assert not (watched.directory / "references.json").exists()
    with connect(
        f"ws://127.0.0.1:{port_of(watched)}/live", origin=origin(watched), additional_headers={"Cookie": mine}
    ) as live:
        assert json.loads(live.recv())["facts"]["role"] == "viewer"


@pytest.mark.parametrize("wrong", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}", ""])
def test_other_origins_are_refused(watched: Watched, wrong: str) -> None:
    mine, wrong = cookie(watched, TOKEN), wrong.format(port=port_of(watched))
    body = {"axis": 0, "event": "x"}
    headers = {"Cookie": mine, "Content_Type": "application/json"} | ({"Origin": wrong} if wrong else {})
    assert all(ask(watched, path, "POST", body, **headers)[0] == 403 for path in ACTIONS)
    assert ask(watched, "/login", "POST", {"token": TOKEN}, **({"Origin": wrong} if wrong else {}))[0] == 403
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        connect(f"ws://127.0.0.1:{port_of(watched)}/live", origin=wrong or None, additional_headers={"Cookie": mine})


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1@evil.example", "a b", "[::1", ""]
)
def test_a_request_for_an_unknown_host_name_is_refused(watched: Watched, host: str) -> None:
    mine = cookie(watched, TOKEN)
    assert ask(watched, "/api/past?axis=0&from=0&to=1", Host=host, Cookie=mine)[0] in (400, 421)
    assert ask(watched, "/", Host=host)[0] in (400, 421)


def test_only_requests_for_known_host_names_are_served() -> None:
    guard = Guard(lambda *_: None, names=("drive-7.plant",))  # type: ignore[arg-type, return-value]
    for host in ("drive-7.plant", "Drive-7.plant:8765", "localhost:1", "127.0.0.1:8765", "[::1]:8765", "10.1.2.3"):
        assert guard._known(host), host
    for host in ("drive-7.plant.evil", "plant", "", "1.2.3.4.evil", "[::1]@x", "x:99999999"):
        assert not guard._known(host), host


def test_no_get_changes_anything(watched: Watched) -> None:
    mine = cookie(watched, TOKEN)
    for path in (*(f"{path}?axis=0&event=x" for path in ACTIONS), "/logout"):
        assert ask(watched, path, Cookie=mine)[0] == 405
    assert ask(watched, "/", Cookie=mine)[0] == 200  # still logged in
    for method in ("PUT", "DELETE", "PATCH"):
        for path in ("/", "/login", "/api/acknowledge", "/static/main.js"):
            assert ask(watched, path, method, {}, Origin=origin(watched), Cookie=mine)[0] == 405


def test_every_answer_has_the_security_headers(watched: Watched) -> None:
    for path in (
        "/",
        "/login",
        "/static/main.js",
        "/static/../board.py",
        "/api/past",
        "/no/such",
        "/static/uplot/uPlot.esm.js",
    ):
        _, headers, _ = ask(watched, path)
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert "strict-transport-security" not in headers, "it is for TLS alone"
        assert "server" not in headers
    for path in ("/static/../app.py", "/static/%2e%2e/app.py", "/static/..%2fapp.py", "/static/uplot/../../app.py"):
        assert ask(watched, path)[0] == 404, path
    html = Path(__file__).parents[2] / "src/livebode/dashboard/static/index.html"
    assert not re.search(r"<script(?![^>]*src=)|\son\w+=|style=|javascript:|https?:", html.read_text())


def test_code_of_the_page_never_makes_html_of_data() -> None:
    root = Path(__file__).parents[2]
    for file in (*root.glob("src/**/static/*.js"), *root.glob("wings/*/src/**/static/*.js")):
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacent|document\.write|eval\(|new Function", file.read_text()
        )


def test_wrong_tokens_are_refused_with_increasing_delay_and_reported_once() -> None:
    now, messages = [0.0], list[str]()
    access = Access(ServerSettings("127.0.0.1", 0, token=TOKEN), messages.append, clock=lambda: now[0])
    for _ in range(5):
        assert access.login("wrong" * 10, "10.0.0.5") is None
    waits = []
    for _ in range(12):
        with pytest.raises(ServerError) as stopped:
            access.login(TOKEN, "10.0.0.5")  # even the right one waits
        assert stopped.value.code == "server.too-many-tries"
        waits.append(stopped.value.retry_after_s)
        now[0] += waits[-1]
        assert access.login("wrong", "10.0.0.5") is None
    assert waits == sorted(waits)
    assert waits[0] == 1.0
    assert waits[-1] == 300.0
    assert access.login(TOKEN, "10.0.0.6"), "others do not wait"
    now[0] += 300
    assert access.login(TOKEN, "10.0.0.5")
    assert messages == ["the dashboard rejected a wrong token from 10.0.0.5"]
    for i in range(5000):
        access.login("wrong", f"2001:db8:{i:x}::1")
    assert len(access._wrong) <= 1024
    assert len(access._reported) <= 1024


def test_login_sessions_expire_and_their_number_is_limited() -> None:
    now = [0.0]
    access = Access(ServerSettings("127.0.0.1", 0, token=TOKEN), lambda _: None, clock=lambda: now[0])
    first = access.login(TOKEN, "::1")
    assert access.role(f"livebode={first}", "", "::1") == "operator"
    now[0] = 13 * 3600.0
    assert access.role(f"livebode={first}", "", "::1") is None
    for _ in range(100):
        last = access.login(TOKEN, "::1")
    assert sum(map(len, access._sessions.values())) <= 64
    assert access.role(f"a=b; livebode={last}", "", "::1") == "operator"
    for rubbish in ("livebode=", "livebode", ";;=;", "livebode=" + "é" * 500, "\0"):
        assert access.role(rubbish, "", "::1") is None


def test_log_ins_end_only_sessions_of_their_role_and_first_their_own() -> None:
    now = [0.0]
    access = Access(
        ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER), lambda _: None, clock=lambda: now[0]
    )
    people = {
        address: access.login(token, address)
        for token in (TOKEN, VIEWER)
        for address in (f"192.0.2.{len(token)}", f"2001:db8:{len(token)}::1")
    }
    program = [access.login(token, "198.51.100.1") for _ in range(100) for token in (TOKEN, VIEWER)]
    for address, session in people.items():
        assert access.role(f"livebode={session}", "", address) in ("operator", "viewer")
    assert access.role(f"livebode={program[0]}", "", "198.51.100.1") is None
    assert access.role(f"livebode={program[-2]}", "", "198.51.100.1") == "operator"
    assert access.role(f"livebode={program[-1]}", "", "198.51.100.1") == "viewer"
    access.logout(f"livebode={program[-1]}")
    assert access.role(f"livebode={program[-1]}", "", "198.51.100.1") is None
    now[0] = 13 * 3600.0  # what is over makes room
    mine = access.login(TOKEN, "::1")
    assert len(access._sessions["operator"]) == 1
    for _ in range(62):
        access.login(TOKEN, "::1")
    assert access.role(f"livebode={mine}", "", "::1") == "operator"


def test_tokens_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each try compares with both tokens, all of a hash, whatever it is like."""
    import hmac

    seen: list[tuple[bytes, bytes]] = []
    real = hmac.compare_digest
    monkeypatch.setattr(hmac, "compare_digest", lambda a, b: (seen.append((a, b)), real(a, b))[1])
    access = Access(ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER), lambda _: None)
    for token in (TOKEN, VIEWER, "", "x", TOKEN + "x"):
        seen.clear()
        access.login(token, "::1")
        assert [len(a) == len(b) == 32 for a, b in seen] == [True, True]


SERVE = {"token": TOKEN, "short": "short", "viewer": VIEWER, "spaces": "with spaces " * 4}


@pytest.mark.parametrize(
    ("section", "code", "key"),
    [
        ({"address": "0.0.0.0"}, "open-without-token", "serve.address"),
        ({"address": "192.168.1.5"}, "open-without-token", "serve.address"),
        ({"address": "0.0.0.0", "token_env": "token"}, "open-without-tls", "serve.address"),
        ({"address": "::", "viewer_token_env": "viewer"}, "open-without-tls", "serve.address"),
        ({"address": "plant"}, "value-invalid", "serve.address"),
        ({"token_env": "short"}, "token-weak", "serve.token_env"),
        ({"token_env": "spaces"}, "token-weak", "serve.token_env"),
        ({"token_env": "token", "viewer_token_env": "token"}, "tokens-equal", "serve.viewer_token_env"),
        ({"certificate_file": "/no/such"}, "key-missing", "serve.certificate_file"),
        ({"certificate_file": "/no/such", "key_file": "/no/such"}, "file-unreadable", "serve.certificate_file"),
        ({"certificate_file": __file__, "key_file": __file__}, "file-unusable", "serve.certificate_file"),
    ],
)
def test_impossible_settings_of_the_server_are_refused(
    monkeypatch: pytest.MonkeyPatch, section: dict[str, str], code: str, key: str
) -> None:
    for name, value in SERVE.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(ConfigError) as caught:
        ServerSettings.of(ServeSection.model_validate(section))
    assert (caught.value.code, caught.value.key) == (f"config.{code}", key)
    shown = json.dumps(caught.value.as_dict())
    assert not any(secret in shown for secret in SERVE.values() if len(secret) > 5)


@pytest.mark.parametrize(
    ("section", "word"),
    [
        ({"token_env": "nowhere"}, "serve.token_env names a variable that is not set"),
        ({"token_file": "/no/such"}, "cannot be read"),
        ({"token_env": "token", "token_file": "/no/such"}, "both"),
    ],
)
def test_a_missing_token_is_refused(monkeypatch: pytest.MonkeyPatch, section: dict[str, str], word: str) -> None:
    for name, value in SERVE.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(LivebodeError, match=re.escape(word)) as caught:
        ServerSettings.of(ServeSection.model_validate(section))
    shown = json.dumps(caught.value.as_dict())
    assert not any(secret in shown for secret in SERVE.values() if len(secret) > 5)


@pytest.mark.parametrize("key", ["token_file", "viewer_token_file"])
def test_a_token_that_others_can_read_is_refused_with_the_remedy(tmp_path: Path, key: str) -> None:
    path = tmp_path / "the token"
    path.write_text(TOKEN)
    section = ServeSection.model_validate({key: path})
    for mode in (0o644, 0o604, 0o620, 0o602):
        path.chmod(mode)
        with pytest.raises(ConfigError) as caught:
            ServerSettings.of(section)
        assert (caught.value.code, caught.value.mode) == ("config.file-open-to-others", mode)
        assert caught.value.remedy.startswith(f"run `chmod 600 '{path}'`")
        assert TOKEN not in json.dumps(caught.value.as_dict())
    for mode in (0o600, 0o640, 0o400):
        path.chmod(mode)
        assert TOKEN in (ServerSettings.of(section).token, ServerSettings.of(section).viewer_token)


def test_the_documented_command_writes_a_token_that_only_its_owner_can_read(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "how-to" / "dashboard.md").read_text()
    command = re.search(r"^    (.*token_urlsafe.*)$", text, re.MULTILINE).group(1)
    path = tmp_path / "token"
    command = command.replace("/etc/livebode/token", str(path)).replace("python ", f"{sys.executable} ")
    subprocess.run(["sh", "-c", f"umask 022; {command}"], check=True)
    assert ServerSettings.of(ServeSection(token_file=path)).token == path.read_text().strip()


def test_a_port_in_use_is_reported() -> None:
    with Dashboard(ServerSettings("127.0.0.1", 0)) as first:
        port = int(first.url.rsplit(":", 1)[1].strip("/"))
        with refused(ServerError, "port-taken", port=port), Dashboard(ServerSettings("127.0.0.1", port)):
            pass


def test_tls_and_a_token_for_another_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    authority = Authority(tmp_path, "authority")
    certificate, key = authority.sign("dashboard")
    monkeypatch.setenv("LIVEBODE_TOKEN", TOKEN)
    section = ServeSection(
        address="0.0.0.0", port=0, token_env="LIVEBODE_TOKEN", certificate_file=certificate, key_file=key
    )
    with Watched(tmp_path / "run", ServerSettings.of(section)) as watched:
        watched.go(6000)
        port = port_of(watched)
        trust = ssl.create_default_context(cafile=str(authority.file))
        base = f"https://127.0.0.1:{port}"
        request = urllib.request.Request(
            f"{base}/login", json.dumps({"token": TOKEN}).encode(), {"Origin": base, "Content-Type": "application/json"}
        )
        with urllib.request.urlopen(request, context=trust) as answer:
            assert "Secure" in answer.headers["set-cookie"]
            assert answer.headers["strict-transport-security"] == "max-age=31536000"
        with pytest.raises((OSError, urllib.error.URLError)):
            urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5)


def test_secrets_are_nowhere_but_where_they_belong(watched: Watched) -> None:
    with chromium() as browser, Tab(browser, watched.url, wait=False) as tab:
        tab.page.locator("#log-in:enabled").wait_for()
        tab.page.fill("#token", "wrong" * 10)
        tab.page.keyboard.press("Enter")
        tab.page.locator("#wrong", has_text="token is wrong").wait_for()
        tab.page.fill("#token", TOKEN)
        tab.page.keyboard.press("Enter")
        tab.until("window.livebode?.bode.curves.measured")
        assert TOKEN not in tab.page.content()
        assert TOKEN not in tab.page.url
        assert tab.page.evaluate("() => document.cookie") == ""
        assert not any(TOKEN in text for text in tab.wrong)
        watched.hub(Event("change", 1, 0.1, "changed", {}))
    watched.go(11_000)
    assert any("wrong token from" in line for line in watched.messages)
    assert len([line for line in watched.messages if "127.0.0.1" in line]) == 1
    for file in watched.directory.rglob("*"):
        if file.is_file():
            assert TOKEN.encode() not in file.read_bytes()
            assert VIEWER.encode() not in file.read_bytes()
    assert TOKEN not in repr(ServerSettings("127.0.0.1", 0, token=TOKEN))


def test_the_section_of_a_file_is_not_recorded(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(
        '[source]\nlog = "x.csv"\n[signals]\noutput = "y"\n[serve]\ntoken_file = "secret"\nport = 9000\n'
    )
    axis = Axis.read(tmp_path / "axis.toml")
    assert axis.serve.token_file == tmp_path / "secret"
    assert axis.serve.port == 9000
    with pytest.raises(LivebodeError, match="did you mean 'token_file'"):
        Axis.of({"source": {"log": "x"}, "signals": {"output": "y"}, "serve": {"tokenfile": "x"}}, "it")


def test_read_only_applies_to_operators_too() -> None:
    access = Access(ServerSettings("127.0.0.1", 0, read_only=True), lambda _: None)
    assert access.role("", "", "::1") == "viewer"
    access = Access(ServerSettings("127.0.0.1", 0, token=TOKEN, read_only=True), lambda _: None)
    assert access.role("", f"Bearer {TOKEN}", "::1") == "viewer"

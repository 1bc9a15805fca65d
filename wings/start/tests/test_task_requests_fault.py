"""Requests that no form sends: without a token, of a viewer, for other files, with other fields, too many."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from livebode.core import LivebodeError
from livebode.dashboard import Dashboard, ServerSettings
from livebode.plugins import named
from livebode_start.results import Results
from livebode_start.task_pages import request_of
from livebode_start.tasks import TASKS, check_request, fields_of, offered
from tests.support.browser import until
from tests.support.command import livebode, signals, write_csv
from tests.support.guarded import TOKEN, VIEWER
from tests.support.many_runs import ask

HOSTILE = ["..", "../secret", "/etc/passwd", "monday/../../secret", "C:\\secret", "secret", "", ".", "link", "monday\0"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run, a result of each task, and links to a secret beside them."""
    above = tmp_path_factory.mktemp("above")
    log = write_csv(above / "log.csv", signals())
    run = "--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", "100"
    directory = above / "machines"
    assert livebode("run", log, *run, "--rate", "1000", "--out", directory / "monday").code == 0
    (above / "secret").write_text("secret")
    (above / "secret.json").write_text("secret")
    (directory / "baselines").mkdir()
    (directory / "baselines" / "own.json").write_text("{}")
    os.symlink(above / "secret.json", directory / "baselines" / "link.json")
    os.symlink(above, directory / "designs")
    (directory / "monday" / "report.html").write_text("<script>1</script>")
    os.symlink(above / "secret", directory / "monday" / "report.pdf")
    os.symlink(directory / "monday", directory / "link")
    return directory


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER))
    dashboard.view_all(folder)
    with dashboard:
        yield dashboard.url


def order(**more: object) -> dict[str, object]:
    return {"task": "report", "runs": ["monday"], "values": {}, **more}


@pytest.mark.parametrize("path", ["/api/tasks", "/api/task?task=learn", "/api/job?id=0"])
def test_nothing_is_told_without_a_token(url: str, path: str) -> None:
    assert ask(url, path)[0] == 401
    assert ask(url, path, token=VIEWER)[0] in (200, 400)


@pytest.mark.parametrize("path", ["/task?task=learn", "/result/report/monday/report.html"])
def test_a_page_without_a_token_leads_to_the_login(url: str, path: str) -> None:
    status, headers, text = ask(url, path)
    assert (status, headers["location"]) == (303, "/login")
    assert "script" not in text


def test_only_an_operator_starts_or_cancels_a_job(url: str) -> None:
    assert ask(url, "/api/task", order())[0] == 401
    assert ask(url, "/api/task", order(), token=VIEWER)[0] == 403
    refused_by_the_command = order(values={"--paper": "a9"})
    status, _, answer = ask(url, "/api/task", refused_by_the_command, token=TOKEN)
    assert status == 200
    assert ask(url, "/api/cancel", {"job": answer["job"]})[0] == 401
    assert ask(url, "/api/cancel", {"job": answer["job"]}, token=VIEWER)[0] == 403
    until(lambda: ask(url, f"/api/job?id={answer['job']}", token=VIEWER)[2]["ended"] is not None, "the end")


def test_a_report_is_shown_in_a_sandbox(url: str) -> None:
    status, headers, text = ask(url, "/result/report/monday/report.html", token=VIEWER)
    assert status == 200
    assert "sandbox;" in headers["content-security-policy"]
    assert "default-src 'none'" in headers["content-security-policy"]
    assert headers["content-type"].startswith("text/html")
    assert text


def test_what_is_downloaded_is_never_shown(url: str) -> None:
    status, headers, _ = ask(url, "/result/learn/own/own.json", token=VIEWER)
    assert status == 200
    assert headers["content-disposition"] == "attachment; filename*=UTF-8''own.json"
    assert headers["content-type"] == "application/octet-stream"


@pytest.mark.parametrize("task", sorted(TASKS))
@pytest.mark.parametrize("name", HOSTILE)
def test_no_address_leads_out_of_the_directory(url: str, task: str, name: str) -> None:
    for file in (*HOSTILE, "secret.json", "link.json", "report.pdf", "run.json"):
        path = f"/result/{task}/{quote(name, safe='')}/{quote(file, safe='')}"
        status, _, text = ask(url, path, token=TOKEN)
        assert status in (307, 400, 404), path
        assert text != "secret"


@given(st.sampled_from(sorted(TASKS)), st.text() | st.sampled_from(HOSTILE), st.text() | st.sampled_from(HOSTILE))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@example("learn", "link", "link.json")
@example("report", "monday", "report.pdf")
@example("report", "monday", "run.json")
@example("design", "machines", "log.csv")
def test_only_listed_files_are_read(folder: Path, task: str, name: str, file: str) -> None:
    listed = [(row["name"], each) for row in Results(folder).listed(TASKS[task].folder) for each, _ in row["files"]]
    assert set(listed) <= {("own", "own.json"), ("monday", "report.html")}
    if (name, file) in listed:
        return
    with pytest.raises(LivebodeError):
        Results(folder).file(TASKS[task].folder, name, file)


TEXTS = st.text(max_size=30) | st.sampled_from(
    ["--json", "-x", "=--force", "$(id)", "a\nb", "\0", "\ud800", "../x", "'"]
)


@given(
    st.sampled_from(sorted(TASKS)),
    st.data(),
    st.lists(st.sampled_from(["monday", "link", "designs", "../machines/monday", "-x"]), max_size=2),
    TEXTS,
)
def test_a_command_has_only_the_options_of_its_form(
    folder: Path, task: str, data: st.DataObject, runs: list[str], name: str
) -> None:
    fields = [field.name for field in fields_of(task)]
    values = data.draw(st.dictionaries(st.sampled_from(fields) | TEXTS, TEXTS, max_size=3))
    asked = {"runs": runs, "name": name, "values": values}
    try:
        request = request_of(asked, folder)
        check_request(task, request)
        made = TASKS[task].order(request)
    except LivebodeError:
        return
    assert set(runs) <= {"monday"}
    assert set(values) <= set(fields)
    command, *words = made.arguments
    options = words[: words.index("--")]
    places = words[words.index("--") + 1 :]
    assert command == TASKS[task].command
    allowed = {"--out", "--template", *fields}
    assert {option.partition("=")[0] for option in options} <= allowed
    for place in [
        *places,
        *(o.partition("=")[2] for o in options if o.startswith(("--out", "--template"))),
    ]:
        assert not Path(place).is_absolute()
        assert ".." not in Path(place).parts
    os.fsencode("".join(made.arguments))  # a process can have them


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ({"task": "rm"}, "the task 'rm' is not offered here"),
        ({"task": None}, "the task '' is not offered here"),
        ({"runs": ["../machines/monday"]}, "there is no run '../machines/monday'"),
        ({"runs": "monday"}, "the request is not that of a form"),
        ({"runs": []}, "0 runs are chosen, and this task needs 1; choose them in the list"),
        ({"task": "learn", "name": "../x"}, "'../x' cannot be the name of a file"),
        ({"task": "learn", "name": "nul"}, "'nul' cannot be the name of a file"),
        ({"task": "design", "name": "a"}, "'designs' is a link"),
        ({"values": {"--force": "yes"}}, "a field of the request is not one of the form"),
        ({"values": {"--customer": "a" * 2000}}, "its text is too long"),
        ({"values": {"--customer": ["a"]}}, "the request is not that of a form"),
        ({"limits": [{"quantity": 1}]}, "the request is not that of a form"),
        ({"limits": [{}] * 60}, "a field of the request is not one of the form"),
    ],
)
def test_another_request_is_refused_in_one_sentence(url: str, more: dict[str, object], sentence: str) -> None:
    status, _, answer = ask(url, "/api/task", order(**more), token=TOKEN)
    assert (status, sentence in answer["error"]) == (400, True), answer


def test_a_request_that_is_too_long_is_refused(url: str) -> None:
    assert ask(url, "/api/task", json.dumps(order(name="a" * 300_000)).encode(), token=TOKEN)[0] == 400


def test_a_directory_that_cannot_be_made_is_said_before_anything_starts(tmp_path: Path) -> None:
    (tmp_path / "baselines").write_text("a file where a directory is to be")
    request = request_of({"runs": [], "name": "a", "values": {}}, tmp_path)
    with pytest.raises(LivebodeError, match="baselines"):
        TASKS["learn"].order(request).prepare()


def test_a_task_is_offered_where_its_command_is(monkeypatch: pytest.MonkeyPatch) -> None:
    assert offered() == ["compare", "learn", "report", "design"]
    left = {name: command for name, command in named("commands").items() if name not in ("compare", "report")}
    monkeypatch.setattr("livebode_start.tasks.named", lambda _: left)
    assert offered() == ["learn", "design"]

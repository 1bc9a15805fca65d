"""The widget of a notebook follows a run that `livebode run` writes, and its page asks only while somebody looks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import livebode
from livebode.core import Channel
from livebode.interface._widget import _PAGE, RunWidget
from livebode.sources.live import Batch, encode_line
from tests.support.browser import chromium
from tests.support.command import RATE_HZ, signals
from tests.support.live_runs import started
from tests.support.peers.peer import until
from tests.support.small_axis import SMALL_AXIS

CHANNELS = (Channel("w", "A"), Channel("u", "A"), Channel("y", "rad/s"))
HOST = """
async (source) => {
  const { render } = (await import(`data:text/javascript,${encodeURIComponent(source)}`)).default;
  const values = { html: "<b>first</b>", every_s: 0.02, finished: false };
  const heard = [], asked = [];
  const model = {
    get: (name) => values[name], on: (name, f) => heard.push([name, f]), send: (content) => asked.push(content),
  };
  const wait = async (done) => { while (!done()) await new Promise((after) => setTimeout(after, 5)); };
  const end = render({ model, el: document.body });
  const first = document.body.textContent;
  await wait(() => asked.length > 2);
  values.html = "<b>second</b>";
  heard.forEach(([name, f]) => name === "change:html" && f());
  values.finished = true;
  await new Promise((after) => setTimeout(after, 60));
  const count = asked.length;
  await new Promise((after) => setTimeout(after, 200));
  end();
  return [first, document.body.textContent, asked.length - count];
}
"""


def lines(samples: int) -> list[bytes]:
    columns = signals(samples)
    data = np.array([columns[name] for name in "wuy"])
    parts = [data[:, at : at + 40].copy() for at in range(0, samples, 40)]
    return [encode_line(Batch(40 * i, part, CHANNELS, float(RATE_HZ), 9)) for i, part in enumerate(parts)]


def test_a_widget_shows_what_a_live_run_has_recorded_and_that_it_ended(tmp_path: Path) -> None:
    configuration, run = tmp_path / "axis.toml", tmp_path / "live"
    configuration.write_text(f'[source]\nurl = "stdin:"\n{SMALL_AXIS}')
    every = lines(4000)
    with started(configuration, run) as process:
        process.stdin.write(b"".join(every[:50]))
        process.stdin.flush()
        until(lambda: (run / "run.json").exists(), "the run begins")
        widget = RunWidget(run)
        until(lambda: (widget.look(), "<img" in widget.html)[1], "a response is recorded")
        first = widget.html
        assert not widget.finished
        process.stdin.write(b"".join(every[50:]))
        process.stdin.close()
        until(lambda: (widget.look(), widget.finished)[1], "the run has ended")
    assert widget.html != first
    assert f"{len(livebode.Run(run).responses)} of plant" in widget.html


def test_the_page_asks_for_the_record_until_the_run_has_ended() -> None:
    with chromium() as browser:
        page = browser.new_page()
        assert page.evaluate(HOST, _PAGE) == ["first", "second", 0]


def test_a_run_that_is_gone_is_reported_in_the_place_of_the_picture(tmp_path: Path) -> None:
    run = livebode.example_run(tmp_path / "run")
    widget = run.widget()
    for file in run.path.iterdir():
        file.unlink()
    widget.look()
    assert "is not the directory of a run" in widget.html

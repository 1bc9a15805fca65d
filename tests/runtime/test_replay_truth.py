"""Samples that a run recorded are tracked again: with the numbers of their sender, from any of them on."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis import learn
from livebode.configuration import Axis
from livebode.core import BaselineError, Channel, RecordError, Responses, RunClock
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord
from livebode.records.summary_file import to_document
from livebode.runtime import Destination, Document, RecordedRun, RunControl, TrackerResults, run
from livebode.sources.live import Address, Batch, ReplaySource, SenderSample, SourceSettings, encode_line
from tests.support.command import LINES, RATE_HZ, livebode, signals
from tests.support.errors import refused
from tests.support.live_runs import table
from tests.support.small_axis import SMALL_AXIS

CHANNELS = (Channel("w", "A"), Channel("u", "A"), Channel("y", "rad/s"))
FIRST = 70_000
RECORDED = SMALL_AXIS + "[record]\nsamples = true\n"
DATA = np.array([signals(3000)[name] for name in "wuy"])
LOST = range(800, 880)
EPOCHS = 9, 2**64 - 1  # the second is the largest that a frame has


def sent() -> list[Batch]:
    """Two seconds of the first epoch of which some are lost, then one of the second, which counts from 0."""
    batches = [
        Batch(at + FIRST if at < 2000 else at - 2000, DATA[:, at : at + 40], CHANNELS, RATE_HZ, EPOCHS[at >= 2000])
        for at in range(0, 3000, 40)
    ]
    return [batch for batch in batches if batch.epoch == EPOCHS[1] or batch.first_sample - FIRST not in LOST]


def axis_file(folder: Path, source: str) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / "axis.toml"
    path.write_text(f"[source]\n{source}\n{RECORDED}")
    return path


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of a machine, with its samples."""
    folder = tmp_path_factory.mktemp("live")
    (folder / "lines").write_bytes(b"".join(map(encode_line, sent())))
    with (folder / "lines").open("rb") as lines, mock.patch.object(sys, "stdin", lines):
        run(Axis.read(axis_file(folder, 'url = "stdin:"')), Destination(folder / "run", lambda *_: None))
    return folder / "run"


def replayed(live: Path, to: Path, stop_at: int = 1 << 62) -> Path:
    """Of the run, in `to`; stopped after this sample."""
    control = RunControl()

    def stopping(document: Document) -> None:
        if isinstance(document, TrackerResults) and document.block.stop > stop_at:
            control.end()

    axis = Axis.read(axis_file(to.parent, f'replay = "{live}"'))
    run(axis, Destination(to, lambda *_: None, subscribers=(stopping,)), control)
    return to


def kinds(path: Path) -> list[tuple[str, int]]:
    found = [(event.kind, event.sample) for event in RunRecord.open(path).events()]
    return [event for event in found if event[0] in ("loss", "restart", "gap")]


def test_a_replayed_run_has_the_results_of_the_live_one_by_the_numbers_of_the_sender(live, tmp_path):
    again = replayed(live, tmp_path / "again")
    first, second = table(live), table(again)
    np.testing.assert_array_equal(second["sample"] - FIRST, first["sample"])
    for name in ("re", "im", "sigma", "valid", "coherence"):
        np.testing.assert_allclose(second[name], first[name], rtol=1e-9, atol=1e-12, err_msg=name)
    assert kinds(again) == [(kind, sample + FIRST) for kind, sample in kinds(live)]
    summary = json.loads((again / "run.json").read_text())
    assert summary["record"]["finished"]
    assert summary["numbering"] == [[FIRST, 9, FIRST], [FIRST + 2000, EPOCHS[1], 0]]
    assert json.loads((live / "run.json").read_text())["numbering"] == [[0, 9, FIRST], [2000, EPOCHS[1], 0]]


def test_a_replay_of_a_replay_is_the_same_to_the_last_bit(live, tmp_path):
    once = replayed(live, tmp_path / "once")
    (tmp_path / "more").mkdir()
    twice = replayed(once, tmp_path / "more" / "twice")
    for what in ("responses", "samples"):
        first, second = table(once, what), table(twice, what)
        assert all(first[name].tobytes() == second[name].tobytes() for name in first)


def test_a_run_and_its_replay_are_not_learned_together(live, tmp_path):
    with refused(BaselineError, "run-repeated", other=str(live)):
        learn([live, replayed(live, tmp_path / "again")])


@pytest.mark.parametrize("stop_at", [900, 2300])
def test_a_stopped_replay_continues_at_the_number_of_the_sender(live, tmp_path, stop_at):
    whole = table(replayed(live, tmp_path / "whole"))
    replayed(live, tmp_path / "cut", FIRST + stop_at)
    assert RunRecord.open(tmp_path / "cut").finished == (stop_at > 2999)
    cut = table(replayed(live, tmp_path / "cut"))
    assert all(whole[name].tobytes() == cut[name].tobytes() for name in whole)


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(EPOCHS), st.integers(-50, 2100))
def test_batches_begin_at_any_number_of_any_epoch(live, epoch, at):
    log = RecordedRun(live)
    number = max(0, at + (FIRST if epoch == 9 else 0))
    found, every = in_rows(log.batches(SenderSample(epoch, number))), in_rows(sent())
    due = np.count_nonzero((every[:, 0] > epoch) | (every[:, 0] == epoch) & (every[:, 1] >= number))
    assert due <= len(found) < due + RATE_HZ  # from the batch that contains it
    np.testing.assert_array_equal(found, every[len(every) - len(found) :])
    assert set(log.channels) == set(CHANNELS)


def in_rows(batches: Iterable[Batch]) -> np.ndarray:
    """Epoch, number, w, u and y of each sample."""
    rows = [np.empty((0, 5))]
    for batch in batches:
        number, by_name = np.arange(batch.first_sample, batch.stop), dict(zip(batch.channels, batch.data))
        epoch = np.full(len(number), float(batch.epoch))
        rows.append(np.stack([epoch, number, *(by_name[name] for name in CHANNELS)], 1))
    return np.concatenate(rows)


def test_the_time_of_day_of_each_sample_is_that_of_the_live_run(live, tmp_path):
    """As far as it is known: a restart of the sender is a pause of unknown length."""
    copy = shutil.copytree(live, tmp_path / "copy")
    summary = json.loads((copy / "run.json").read_text())
    del summary["crc32"]
    summary |= {"clock": [[0.0, 1.8e9], [1.5, 1.8e9 + 0.25]]}
    (copy / "run.json").write_bytes(to_document(summary))
    assert RecordedRun(copy).clock.pieces == []
    (copy / "run.json").write_bytes(to_document(summary | {"numbering": summary["numbering"][:1]}))
    again = RunRecord.open(replayed(copy, tmp_path / "again")).clock
    for second in (0.0, 1.2, 1.7):
        assert again.unix_s(second + FIRST / RATE_HZ) == RunRecord.open(copy).clock.unix_s(second)


class Memory:
    """A log in memory that cannot be read at times, as one of a server."""

    channels, rate_hz, samples, clock = CHANNELS, float(RATE_HZ), None, RunClock()

    def __init__(self, batches: list[Batch], fails: int) -> None:
        self.kept, self.fails = batches, fails

    def batches(self, begin: SenderSample | None = None) -> Iterator[Batch]:  # noqa: ARG002 - every one from the first
        for batch in self.kept:
            if self.fails and batch.first_sample % 1000 == 610:
                self.fails -= 1
                raise ConnectionError("no answer")
            yield batch


def test_a_log_that_fails_is_read_again_and_repeats_are_dropped():
    batches = [replace(batch, epoch=9) for batch in sent() if batch.epoch == 9 and batch.first_sample < FIRST + 800]
    source = ReplaySource(SourceSettings(replay=Path("log")), Address("replay", path="log"), Memory(batches, 1))
    with source.open():
        blocks = list(source.blocks())
    assert blocks[0].start == FIRST
    np.testing.assert_array_equal(np.concatenate([block.data for block in blocks], axis=1), DATA[:, :800])


@pytest.mark.parametrize("left_out", [7, 130])
def test_responses_belong_to_the_same_samples_wherever_reading_begins(left_out):
    def tracked(first: int) -> Responses:
        log = Memory([Batch(FIRST + 3 + first, DATA[:, first:2000], CHANNELS, RATE_HZ, 9)], 0)
        tracker = Tracker(Settings(lines=LINES, excitation="w", input="u", output="y", hop=20))
        with ReplaySource(SourceSettings(replay=Path("log")), Address("replay", path="log"), log).open() as source:
            return Responses.join([tracker.process(block) for block in source.blocks()])

    whole, part = tracked(0), tracked(left_out)
    same, here = np.isin(whole.sample, part.sample), part.valid.all(axis=1) & (part.sample > part.sample[0] + 200)
    assert np.all((part.sample + 1) % 20 == 0)
    assert np.count_nonzero(here) > 80
    np.testing.assert_allclose(part.value[here], whole.value[same][here], rtol=1e-12)


def test_what_cannot_be_replayed_is_refused(live, tmp_path):
    path = axis_file(tmp_path / "own", f'replay = "{live}"')
    result = livebode("run", path, "--out", live, "--force")
    assert (result.code, "choose another directory for the run" in result.err) == (2, True)
    assert RunRecord.open(live).finished is False  # untouched: a live source has no end of its own
    path.write_text(path.read_text().replace("[record]\nsamples = true\n", ""))
    run(Axis.read(path), Destination(tmp_path / "without", lambda *_: None))
    path.write_text(path.read_text().replace(str(live), str(tmp_path / "without")))
    result = livebode("run", path, "--out", tmp_path / "third")
    assert "has no recorded samples; record them with samples = true in [record]" in result.err
    path.write_text(path.read_text().replace("[source]", "[source]\nrate_hz = 1000"))
    assert "source.rate_hz does not apply to replay" in livebode("run", path, "--out", tmp_path / "third").err
    with pytest.raises(RecordError, match="has no samples of epoch 0x7"):
        list(RecordedRun(live).batches(SenderSample(7, 0)))

"""The same signals written to every format by the libraries that define them, for the tests of the readers."""

from __future__ import annotations

import base64
import shutil
import struct
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import asammdf
import can
import h5py
import nptdms
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
import scipy.io.wavfile
from can.io.mf4 import MF4Writer
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from livebode.sources import Log
from livebode.sources import open_log as open_alone
from tests.support.scope_project import Acquired, write_project
from tests.support.ulog_file import ulog_file

RATE_HZ = 4000.0
Signals = Mapping[str, NDArray[np.float64]]
SINUMERIK_ALPHABET = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
PYTHON_ALPHABET = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~"


def table(signals: Signals) -> pa.Table:
    return pa.table({name: pa.array(values) for name, values in signals.items()})


def write_csv(path: Path, signals: Signals) -> None:
    rows = [",".join(signals), *(",".join(map(repr, map(float, row))) for row in zip(*signals.values()))]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def write_parquet(path: Path, signals: Signals) -> None:
    pq.write_table(table(signals), path, row_group_size=333)


def write_arrow(path: Path, signals: Signals) -> None:
    with pa.OSFile(str(path), "wb") as file, pa.ipc.new_file(file, table(signals).schema) as writer:
        writer.write_table(table(signals), max_chunksize=333)


def write_mat(path: Path, signals: Signals) -> None:
    scipy.io.savemat(path, {name: values[:, np.newaxis] for name, values in signals.items()}, do_compression=True)


def write_mat73(path: Path, signals: Signals) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in signals.items():
            data = file.create_dataset(name, data=values[np.newaxis])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_hdf5(path: Path, signals: Signals) -> None:
    with h5py.File(path, "w") as file:
        for name, values in signals.items():
            file.create_dataset(name, data=values, chunks=(333,) if len(values) > 333 else None)


def write_npz(path: Path, signals: Signals) -> None:
    np.savez_compressed(path, **dict(signals))


def write_tdms(path: Path, signals: Signals) -> None:
    with nptdms.TdmsWriter(path) as file:
        for part in range(0, len(next(iter(signals.values()))), 333):
            file.write_segment(
                [nptdms.ChannelObject("log", name, values[part : part + 333]) for name, values in signals.items()]
            )


def write_mdf(path: Path, signals: Signals) -> None:
    given = [
        asammdf.Signal(values, clock_s(signals), name=name, master_metadata=("t", 1))
        for name, values in signals.items()
        if name != "t"
    ]
    with asammdf.MDF(version="4.10") as file:
        file.append(given, common_timebase=True)
        file.save(path, overwrite=True, compression=2)


def write_lvm(path: Path, signals: Signals) -> None:
    """Without a column of time; where the signals have none the increment gives the rate."""
    width = len(signals)
    delta = f"Delta_X\t{1 / RATE_HZ!r}" if "t" not in signals else "Samples\t1"
    lines = [
        "LabVIEW Measurement\t",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "X_Columns\tNo",
        "***End_of_Header***\t",
    ]
    lines += ["\t", f"Channels\t{width}", delta, "***End_of_Header***", "\t".join(["X_Value", *signals, "Comment"])]
    rows = ["\t".join(["", *map(repr, map(float, row))]) for row in zip(*signals.values())]
    path.write_text("\r\n".join([*lines, *rows]) + "\r\n", encoding="utf-8", newline="")


def write_twincat(path: Path, signals: Signals) -> None:
    """An export with one time column in ms for all channels; where none is given it is that of the rate."""
    time = signals.get("t", np.arange(len(next(iter(signals.values())))) / RATE_HZ)
    given = {name: values for name, values in signals.items() if name != "t"}
    write_scope(path, [(time, {name: ("", values) for name, values in given.items()})])


def write_svdx(path: Path, signals: Signals) -> None:
    """A project with a chart; its times have the resolution of 100 ns."""
    given = {name: values.astype("<f8") for name, values in signals.items() if name != "t"}
    time_s = clock_s(signals)
    write_project(path, [Acquired(f"MAIN.{name}", time_s, values, name) for name, values in given.items()])


def write_codesys(path: Path, signals: Signals) -> None:
    """A trace in ms; where the signals have no time it is that of the rate."""
    given = {name: values for name, values in signals.items() if name != "t"}
    write_trace(path, {name: (clock_s(signals) * 1e3, values) for name, values in given.items()})


def write_trace(
    path: Path, variables: Mapping[str, tuple[Sequence[float], Sequence[object]]], flags: str = "Flags; 16"
) -> None:
    """A trace of CODESYS: of each variable its times, in the unit of the flags, and its values."""
    lines = ["[key]; [value]", "IecTaskName; MainTask", "EveryNCycles; 1", flags]
    for number, (name, (times, values)) in enumerate(variables.items()):
        lines += [f"{number}.Variable; {name}", f"{number}.Class; 7", f"{number}.GraphColor; 4278190335"]
        rows = [f"; {time:.9g}; {value}" for time, value in zip(times, values, strict=True)]
        lines += [f"{number}.Data; ", *rows]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8", newline="")


def write_scope(
    path: Path,
    groups: list[tuple[NDArray[np.float64], dict[str, tuple[str, NDArray[np.float64]]]]],
    delimiter: str = "\t",
    decimal: str = ".",
    end: str = "",
) -> None:
    """An export of TwinCAT Scope: for each group its times in s, and its channels with unit and values.

    The longest group must come first: a line ends behind the last group that still has samples.
    """
    properties = {
        "Name": "{name}",
        "SymbolComment": "",
        "Data-Type": "REAL64",
        "SampleTime[ms]": "0,25",
        "SymbolName": "MAIN.{name}",
        "Unit": "{unit}",
    }
    lines = [
        f"Name{delimiter}scope 1",
        f"File{delimiter}C:\\scope.csv",
        f"Starttime of export{delimiter}132959733843760000",
    ]
    lines += ["", ""]
    for key, text in properties.items():
        lines.append(
            delimiter.join(
                cell
                for _, channels in groups
                for cell in [
                    key,
                    *(
                        text.format(name=name, unit=f"{unit} (Quantity)" if unit else "(None)")
                        for name, (unit, _) in channels.items()
                    ),
                ]
            )
        )
    lines.append("")
    for row in range(len(groups[0][0])):
        cells = [
            cell
            for time, channels in groups
            if row < len(time)
            for cell in [f"{1000 * time[row]:.9g}", *(repr(float(values[row])) for _, values in channels.values())]
        ]
        lines.append(delimiter.join(cells).replace(".", decimal))
    path.write_text("\n".join([*lines, end] if end else lines) + "\n", encoding="utf-8")


def base85(values: NDArray[np.float64]) -> str:
    """Python's base-85 of the same groups of four bytes, in the alphabet of the control."""
    text = base64.b85encode(values.astype(">f8").tobytes())
    return text.translate(bytes.maketrans(PYTHON_ALPHABET, SINUMERIK_ALPHABET)).decode("ascii")


def write_sinumerik(path: Path, signals: Signals) -> None:
    """Two records of half the length each; the signals must be called input and output."""

    def array(values: NDArray[np.float64]) -> str:
        return (
            f'<TimeSeries><NumericArray name="m_ValueVector"><unsigned_int name="m_length">{len(values)}</unsigned_int>'
            f'<raw name="m_pNumberArray"><![CDATA[\n{base85(values)}\n]]></raw></NumericArray></TimeSeries>'
        )

    nodes = [
        f'<PlatformSignalNode><unsigned_int name="m_uNodeId">{61 + at}</unsigned_int><integer '
        f'name="m_iUniqueInstanceId">{at}</integer>{"".join(map(array, np.array_split(signals[name], 2)))}'
        "</PlatformSignalNode>"
        for at, name in enumerate(("output", "input"))
    ]
    path.write_text(
        '<?xml version="1.0" encoding="ISO-8859-1"?><ResponseTestCustom>'
        f'<float name="m_dProcessUpdateTime">{1 / RATE_HZ!r}</float>{"".join(nodes)}'
        '<LinkedList name="m_listPrimaryFreqRespSigNodeData"><PrimaryFreqRespSigNodeData>'
        '<integer name="m_iInputSigNodeUniqueInstanceID">1</integer>'
        '<integer name="m_iOutputSigNodeUniqueInstanceID">0</integer>'
        "</PrimaryFreqRespSigNodeData></LinkedList></ResponseTestCustom>",
        encoding="latin-1",
    )


def write_wav(path: Path, signals: Signals) -> None:
    """As float64; the format has no names."""
    scipy.io.wavfile.write(path, int(RATE_HZ), np.column_stack(list(signals.values())))


def clock_s(signals: Signals) -> NDArray[np.float64]:
    """Time of the samples in formats that always have it; where none is given it is that of the rate."""
    return signals.get("t", np.arange(len(next(iter(signals.values())))) / RATE_HZ)


def write_ulog(path: Path, signals: Signals) -> None:
    """One topic, log."""
    time_us = np.rint(clock_s(signals) * 1e6).astype(np.uint64)
    given = {name: values.astype("<f8") for name, values in signals.items() if name != "t"}
    path.write_bytes(ulog_file({"log": {"timestamp": time_us, **given}}))


def write_ros(storage: StoragePlugin, path: Path, signals: Signals) -> None:
    """One topic, /log, whose header has the time; a bag is a directory, of which a reader takes the file."""
    given = {name: values for name, values in signals.items() if name != "t"}
    store = get_typestore(Stores.ROS2_HUMBLE)
    fields = "".join(f"float64 {name}\n" for name in given)
    store.register(get_types_from_msg(f"std_msgs/Header header\n{fields}", "test_msgs/msg/Log"))
    header, stamp, log = (
        store.types[name] for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "test_msgs/msg/Log")
    )
    bag = path.with_name(f"{path.stem}_bag")
    shutil.rmtree(bag, ignore_errors=True)
    with Writer(bag, version=9, storage_plugin=storage) as writer:
        topic = writer.add_connection("/log", log.__msgtype__, typestore=store)
        for at, (time_s, row) in enumerate(zip(clock_s(signals), zip(*given.values(), strict=True), strict=True)):
            seconds, nanoseconds = divmod(round(time_s * 1e9), 1_000_000_000)
            message = log(header(stamp(seconds, nanoseconds), "drive"), *row)
            writer.write(topic, at, store.serialize_cdr(message, log.__msgtype__))
    next(one for one in bag.iterdir() if one.suffix in (".mcap", ".db3")).rename(path)


FD_LENGTHS = 8, 12, 16, 20, 24, 32, 48, 64
DBC = "frames.dbc"


def write_dbc(path: Path, names: Sequence[str], length: int) -> None:
    """A message Log, number 0x123, whose signals are doubles."""
    signals = [f' SG_ {name} : {64 * at}|64@1- (1,0) [0|0] "" X' for at, name in enumerate(names)]
    kinds = [f"SIG_VALTYPE_ 291 {name} : 2;" for name in names]
    lines = ['VERSION ""', "NS_ :", "BS_:", "BU_: X", f"BO_ 291 Log: {length} X", *signals, *kinds]
    path.write_text("\n".join(lines) + "\n")


class Mf4Writer(MF4Writer):
    """Without the date that python-can subtracts."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._start_time = 0.0


def write_frames(writer: type, path: Path, signals: Signals) -> None:
    """One message, Log, in frames of CAN FD with the DBC beside them."""
    given = {name: values for name, values in signals.items() if name != "t"}
    length = next(length for length in FD_LENGTHS if length >= 8 * len(given))
    write_dbc(path.with_name(DBC), list(given), length)
    rows = np.column_stack(list(given.values())).astype("<f8")
    with writer(path) as file:
        for time_s, row in zip(clock_s(signals).tolist(), rows):
            data = row.tobytes().ljust(length, b"\0")
            # BLF has whole nanoseconds, and its writer rounds down.
            frame = can.Message(time_s + 5e-10, 291, is_extended_id=False, is_fd=True, data=data, channel=0)
            file.on_message_received(frame)


def open_log(path: Path, **options: object) -> Log:
    """The recording, with the DBC that a writer here left beside it."""
    dbc = path.with_name(DBC)
    return open_alone(path, **({"dbc": dbc} if dbc.exists() else {}), **options)


WRITERS: dict[str, tuple[str, Callable[[Path, Signals], None]]] = {
    "delimited": (".csv", write_csv),
    "parquet": (".parquet", write_parquet),
    "arrow": (".arrow", write_arrow),
    "matlab": (".mat", write_mat),
    "matlab73": (".mat", write_mat73),
    "hdf5": (".h5", write_hdf5),
    "npz": (".npz", write_npz),
    "tdms": (".tdms", write_tdms),
    "mdf": (".mf4", write_mdf),
    "sinumerik": (".xml", write_sinumerik),
    "lvm": (".lvm", write_lvm),
    "codesys": (".csv", write_codesys),
    "svdx": (".svdx", write_svdx),
    "twincat": (".csv", write_twincat),
    "ulog": (".ulg", write_ulog),
    "wav": (".wav", write_wav),
    "blf": (".blf", partial(write_frames, can.BLFWriter)),
    "asc": (".asc", partial(write_frames, can.ASCWriter)),
    "mcap": (".mcap", partial(write_ros, StoragePlugin.MCAP)),
    "rosbag": (".db3", partial(write_ros, StoragePlugin.SQLITE3)),
}
"""Ending and writer for each module of `livebode.sources` that reads a format."""
NAMES = {
    "asc": ("Log.input", "Log.output"),
    "blf": ("Log.input", "Log.output"),
    "mcap": ("/log.input", "/log.output"),
    "rosbag": ("/log.input", "/log.output"),
    "ulog": ("log.input", "log.output"),
    "wav": ("c1", "c2"),
}
"""What the signals input and output are called where the format does not keep these names."""
OWN_RATE = "sinumerik", "wav"
"""Formats that define a rate and have no time column."""
CLOCKS = {
    "asc": "Log.time",
    "blf": "Log.time",
    "codesys": "t",
    "mcap": "/log.header.stamp",
    "mdf": "t",
    "rosbag": "/log.header.stamp",
    "svdx": "t",
    "twincat": "t",
    "ulog": "log.timestamp",
}
"""The time column of formats that always have one."""


def names(module: str) -> tuple[str, str]:
    return NAMES.get(module, ("input", "output"))


def signals(samples: int = 1000, seed: int = 0) -> dict[str, NDArray[np.float64]]:
    """Two signals with every order of magnitude that a double has room for in a recording."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.integers(-12, 12, samples)
    return {"input": rng.standard_normal(samples) * scale, "output": rng.standard_normal(samples) / 3}


def with_time(given: Signals, rate_hz: float = RATE_HZ) -> dict[str, NDArray[np.float64]]:
    samples = len(next(iter(given.values())))
    return {"t": np.arange(samples) / rate_hz, **given}


def write(module: str, folder: Path, given: Signals, stem: str = "log") -> Path:
    suffix, writer = WRITERS[module]
    path = folder / f"{stem}{suffix}"
    writer(path, given)
    return path


def dspace(samples: int) -> dict[str, NDArray[np.void]]:
    """A recording as dSPACE ControlDesk lays it out: rec.X.Data is time, rec.Y(k) has Name, Unit and Data."""
    time = np.arange(samples) / RATE_HZ
    y = np.zeros((1, 2), dtype=[("Name", object), ("Unit", object), ("Data", object)])
    y[0, 0] = ("Model Root/Speed/omega", "rad/s", time[np.newaxis] * 2)
    y[0, 1] = ("Model Root/Current/iq", "A", time[np.newaxis] * 3)
    rec = np.zeros((1, 1), dtype=[("X", object), ("Y", object), ("RTProgram", object)])
    x = np.zeros((1, 1), dtype=[("Name", object), ("Data", object)])
    x[0, 0] = ("HostService", time[np.newaxis])
    rec[0, 0] = (x, y, "axis.sdf")
    return {"rec": rec}


def write_dspace73(path: Path, samples: int) -> None:
    """The same as `dspace` in a v7.3 file: groups, and references for the elements of Y."""
    time = np.arange(samples) / RATE_HZ

    def text(parent: h5py.Group, name: str, value: str) -> h5py.Dataset:
        data = parent.create_dataset(name, data=np.frombuffer(value.encode("utf-16-le"), np.uint16)[:, np.newaxis])
        data.attrs["MATLAB_class"] = np.bytes_("char")
        return data

    with h5py.File(path, "w", userblock_size=512) as file:
        refs, rec = file.create_group("#refs#"), file.create_group("rec")
        x = rec.create_group("X")
        text(x, "Name", "HostService")
        x.create_dataset("Data", data=time[:, np.newaxis])
        y = rec.create_group("Y")
        for field, values in {
            "Name": [
                text(refs, f"n{k}", name) for k, name in enumerate(("Model Root/Speed/omega", "Model Root/Current/iq"))
            ],
            "Unit": [text(refs, f"u{k}", unit) for k, unit in enumerate(("rad/s", "A"))],
            "Data": [refs.create_dataset(f"d{k}", data=(time * (k + 2))[:, np.newaxis]) for k in range(2)],
        }.items():
            data = y.create_dataset(field, (2, 1), dtype=h5py.ref_dtype)
            for at, target in enumerate(values):
                data[at, 0] = target.ref
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + struct.pack("<H", 0x0200) + b"IM")

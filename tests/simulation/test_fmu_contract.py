"""A plant of one's own as an FMU, built here from a few lines of C: FMI 2 and FMI 3, with a known truth."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, SimulationError, UsageError
from livebode.estimation import Settings, Tracker
from livebode.simulation import Drive, FmuAxis, Sensor, Standstill
from tests.support.axes import LINES, MULTISINE, RATE_HZ, fast_stroke
from tests.support.errors import refused

fmpy = pytest.importorskip("fmpy", reason="the extra `fmu` is not installed")
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64" or shutil.which("gcc") is None,
    reason="the FMU of this test is built by gcc for linux64",
)

INERTIA, VISCOUS = 0.0052, 0.01

# The interface of FMI as far as a co-simulation slave without options needs it; `build` adds the rest, which say "ok".
SOURCE = r"""
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
typedef struct { double torque, angle, velocity; } Plant;
#define API __attribute__((visibility("default")))
static void *make(void) { return calloc(1, sizeof(Plant)); }
/* J w' = T - b w, exact under a constant torque. */
static void advance(Plant *p, double h) {
    const double J = 0.0052, b = 0.01, e = exp(-b / J * h), rest = p->torque / b;
    p->angle += rest * h + (p->velocity - rest) * (1 - e) * J / b;
    p->velocity = rest + (p->velocity - rest) * e;
    if (p->torque > 1000) p->velocity = NAN;
}
static void get(Plant *p, const unsigned *vr, size_t n, double *v) {
    for (size_t i = 0; i < n; ++i) v[i] = vr[i] == 0 ? p->torque : vr[i] == 1 ? p->angle : p->velocity;
}
API void *fmi2Instantiate(const char *a, int t, const char *g, const char *r, const void *f, int v, int l) {
    (void)a; (void)t; (void)g; (void)r; (void)f; (void)v; (void)l; return make(); }
API void fmi2FreeInstance(void *c) { free(c); }
API const char *fmi2GetVersion(void) { return "2.0"; }
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API int fmi2SetupExperiment(void *c, int a, double b, double d, int e, double f) {
    (void)c; (void)a; (void)b; (void)d; (void)e; (void)f; return 0; }
API int fmi2SetReal(void *c, const unsigned *vr, size_t n, const double *v) {
    for (size_t i = 0; i < n; ++i) if (vr[i] == 0) ((Plant *)c)->torque = v[i];
    return 0; }
API int fmi2GetReal(void *c, const unsigned *vr, size_t n, double *v) { get(c, vr, n, v); return 0; }
API int fmi2DoStep(void *c, double t, double h, int x) { (void)t; (void)x; advance(c, h); return 0; }
API void *fmi3InstantiateCoSimulation(const char *a, const char *g, const char *r, _Bool v, _Bool l, _Bool e, _Bool y,
    const unsigned *q, size_t n, void *env, void *log, void *up) {
    (void)a; (void)g; (void)r; (void)v; (void)l; (void)e; (void)y; (void)q; (void)n; (void)env; (void)log; (void)up;
    return make(); }
API void fmi3FreeInstance(void *c) { free(c); }
API const char *fmi3GetVersion(void) { return "3.0"; }
API int fmi3EnterInitializationMode(void *c, _Bool a, double b, double d, _Bool e, double f) {
    (void)c; (void)a; (void)b; (void)d; (void)e; (void)f; return 0; }
API int fmi3SetFloat64(void *c, const unsigned *vr, size_t n, const double *v, size_t m) {
    (void)m; return fmi2SetReal(c, vr, n, v); }
API int fmi3GetFloat64(void *c, const unsigned *vr, size_t n, double *v, size_t m) {
    (void)m; get(c, vr, n, v); return 0; }
API int fmi3DoStep(void *c, double t, double h, _Bool x, _Bool *a, _Bool *b, _Bool *d, double *last) {
    (void)x; advance(c, h); *a = *b = *d = 0; *last = t + h; return 0; }
"""

DESCRIPTION = {
    2: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="plant" guid="{plant}">
<CoSimulation modelIdentifier="plant" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="torque" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="position" valueReference="1" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="velocity" valueReference="2" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/><Unknown index="3"/></Outputs></ModelStructure>
</fmiModelDescription>""",
    3: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="plant" instantiationToken="{plant}">
<CoSimulation modelIdentifier="plant" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="torque" valueReference="0" causality="input" variability="continuous" start="0"/>
<Float64 name="position" valueReference="1" causality="output" variability="continuous"/>
<Float64 name="velocity" valueReference="2" causality="output" variability="continuous"/>
<Float64 name="time" valueReference="3" causality="independent" variability="continuous"/>
</ModelVariables>
<ModelStructure><Output valueReference="1"/><Output valueReference="2"/></ModelStructure>
</fmiModelDescription>""",
}  # fmt: skip


def headers_text(folder: Path, version: int) -> str:
    return (folder / f"fmi{version}Functions.h").read_text()


def build(folder: Path, version: int) -> Path:
    source, library, fmu = folder / "plant.c", folder / "plant.so", folder / f"plant{version}.fmu"
    headers = Path(fmpy.__file__).parent / "c-code"
    every = {name for n in (2, 3) for name in re.findall(r"\b(fmi\d[A-Z]\w+?)TYPE\b", headers_text(headers, n))}
    others = sorted(name for name in every if f"{name}(" not in SOURCE)
    source.write_text(SOURCE + "".join(f"API int {name}(void *c) {{ (void)c; return 0; }}\n" for name in others))
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
    place = {2: "linux64", 3: "x86_64-linux"}[version]
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION[version])
        archive.write(library, f"binaries/{place}/plant.so")
    return fmu


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2", "FMI 3"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("fmu"), request.param)


def whole(axis: FmuAxis, block_samples: int = 4096) -> Block:
    blocks = list(axis.blocks(block_samples=block_samples))
    return Block(np.hstack([block.data for block in blocks]), blocks[0].channels, axis.rate_hz)


def test_an_estimator_sees_the_plant_of_the_fmu(fmu: Path) -> None:
    # A stiff position loop brings the periodic state within seconds.
    drive = Drive(position_gain_per_s=15.0)
    record = whole(FmuAxis(path=fmu, drive=drive, excitation_n_m=MULTISINE, seconds=6.0))
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w")
    found = Tracker(settings).process(record.cut(len(record) - 1200, len(record)))[-1].value
    decay = np.exp(-VISCOUS / INERTIA / RATE_HZ)
    truth = (1 - decay) / VISCOUS / (LINES.z - decay)
    assert np.max(np.abs(found / truth - 1)) < 1e-8
    assert np.allclose(record["x"], 0.019 * record["position"])


def test_the_motion_begins_at_the_position_of_the_plant(fmu: Path) -> None:
    drive, motion = Drive(position_gain_per_s=15.0, velocity_gain_n_m_s=1.0), fast_stroke()
    record = whole(FmuAxis(path=fmu, drive=drive, motion=motion, seconds=0.9))
    assert record["position_reference"][0] == record["position"][0] == 0
    assert record["x"].max() == pytest.approx(motion.end_m - motion.start_m, rel=0.02)


def test_cutting_changes_no_sample_and_every_iteration_is_the_same(fmu: Path) -> None:
    axis = FmuAxis(path=fmu, excitation_n_m=MULTISINE, seconds=0.2, sensor=Sensor(noise_rad_per_s=0.1), seed=4)
    first = whole(axis)
    assert len(first) == axis.samples == 800
    assert np.array_equal(first.data, whole(axis, 77).data)
    assert next(axis.blocks(["u"], 10)).names == ("u",)


def test_a_plant_that_blows_up_stops_the_run(fmu: Path) -> None:
    axis = FmuAxis(path=fmu, excitation_n_m=np.r_[np.zeros(50), 2000.0, np.zeros(900)], seconds=1)
    with pytest.raises(SimulationError) as stopped:
        whole(axis)
    assert stopped.value.code == "simulation.diverged"
    assert stopped.value.time_s == pytest.approx(51 / RATE_HZ)


def test_unsuitable_fmus_are_refused(fmu: Path, tmp_path: Path) -> None:
    with refused(UsageError, "unknown-name", value="velo"):
        FmuAxis(path=fmu, velocity="velo")
    with refused(SimulationError, "fmu-unusable", path=str(tmp_path / "missing.fmu")):
        FmuAxis(path=tmp_path / "missing.fmu")
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(fmu.read_bytes()[:500])
    with refused(SimulationError, "fmu-unusable", path=str(broken)):
        FmuAxis(path=broken)
    foreign = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(foreign, "w") as new:
        new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
        new.writestr("binaries/win64/plant.dll", b"")
    with refused(SimulationError, "fmu-unusable", platforms=["win64"]):
        FmuAxis(path=foreign)
    with refused(UsageError, "out-of-range", argument="position_m", value=5.0):
        FmuAxis(path=fmu, motion=Standstill(position_m=5.0))

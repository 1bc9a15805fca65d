"""The kind of a quantity follows from the dimension of its unit, whatever its spelling."""

from __future__ import annotations

from math import pi
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Channel, PlantKinds, QuantityKind, UnitReading, UsageError, read_unit, split_plant_unit
from tests.support.errors import refused

KINDS = get_args(QuantityKind)

# Kind and SI units in one, from the definitions of the units: 1 N = 1 kg m/s², 1 min = 60 s, 1 rev = 2 pi rad.
BY_HAND = [
    ("torque", 1.0, "N m; Nm; N·m; N*m; N.m; 牛米; 牛·米; N-m; kg m²/s²; kg m^2 s^-2; kg·m²·s⁻²; [N m]"),
    ("torque", 1e-3, "mN m; mNm; N mm; Nmm"),
    ("torque", 1e-2, "Ncm; N cm"),
    ("torque", 1e3, "kNm; kN m"),
    ("force", 1.0, "N; kg m/s²; kg m/(s^2); kg*m/s/s"),
    ("force", 1e3, "kN"),
    ("current", 1.0, "A; Arms; Aeff; Apk"),
    ("current", 1e-3, "mA"),
    ("velocity", 1.0, "rad/s; rad s^-1; rad·s⁻¹; rad s-1; rad s**-1; rad s^(-1); rad / s; (rad)/(s)"),
    ("velocity", 1.0, "1/s; s^-1; m/s; m s⁻¹"),
    ("velocity", 1e-3, "mm/s; mrad/s; m/s*mm/m"),
    ("velocity", 2 * pi / 60, "rpm; RPM; rev/min; r/min; U/min; turn/min; 1/min; min⁻¹; min^-1; min-1; /min; 转/分"),
    ("velocity", 2 * pi, "rev/s; U/s; rps; 转/秒"),
    ("velocity", pi / 180, "°/s; deg/s; degree/s; degrees/s; Grad/s; 度/秒"),
    ("velocity", 1 / 60, "m/min"),
    ("position", 1.0, "rad; m"),
    ("position", 1e-6, "µm; μm; um; urad"),
    ("position", 1e-3, "mm; mrad"),
    ("position", pi / 180, "°; deg; Grad; 度"),
    ("position", pi / 180e3, "mdeg"),
    ("position", 2 * pi, "rev; turn"),
    ("acceleration", 1.0, "rad/s²; rad/s^2; rad/s2; rad/s/s; rad s^-2; rad/(s s); rad/(s*s); m/s²; m/s2; 1/s²; s⁻²"),
    ("acceleration", 1e-3, "mm/s²"),
    ("acceleration", pi / 180, "°/s²; deg/s^2"),
    ("acceleration", 2 * pi / 60, "rpm/s; 1/min/s; U/min/s"),
    ("acceleration", 9.80665, "g; gn; G"),
    ("acceleration", 9.80665e-3, "mg"),
]  # fmt: skip
OTHER = (
    "", "1", "counts", "inc", "counts/s", "%", "V", "bar", "Hz", "s", "kg", "kg m²", "J", "W", "N/m", "N m/rad",
    "N m s/rad", "A s", "rad/s³", "m²", "2 m", "1e-3 m", "m/", "(m", "m)", ")m(", "()", "/", "^2",
    "m^99999999999999", "m^10/m^9", "rad per s", "N m N m", "°C", "m" * 1000,
)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "kind", "factor"),
    [(text, kind, factor) for kind, factor, texts in BY_HAND for text in texts.split("; ")],
)
def test_a_recognised_unit_gives_the_kind_and_the_factor_of_its_dimension(text: str, kind: str, factor: float) -> None:
    assert read_unit(text).kind == kind
    assert read_unit(text).factor == pytest.approx(factor, rel=1e-12)
    assert Channel("x", text).kind == kind


@pytest.mark.parametrize("text", OTHER)
def test_a_unit_of_another_dimension_or_unknown_is_other(text: str) -> None:
    assert read_unit(text) == UnitReading("other", 1.0, False)
    assert Channel("x", text).stated_kind == ("other" if text else None)


@given(st.text(alphabet=" 12^-+*/().·²⁻⁰°µmsNAradkgUnipx[]", max_size=70))
def test_any_text_gives_one_of_the_kinds_and_a_positive_factor(text: str) -> None:
    found = read_unit(text)
    assert found.kind in KINDS
    assert 0 < found.factor < float("inf")


@given(
    st.lists(
        st.tuples(st.sampled_from(["m", "s", "N", "A", "rad", "kg", "mm", "deg"]), st.integers(-3, 3)), max_size=4
    ),
    st.sampled_from([" ", "*", "·", "."]),
    st.sampled_from(["^", "**", ""]),
)
def test_the_spelling_of_products_and_powers_changes_nothing(
    words: list[tuple[str, int]], product: str, power: str
) -> None:
    powers = [(symbol, exponent) for symbol, exponent in words if exponent]
    plain = read_unit(" ".join(f"{symbol}^{exponent}" for symbol, exponent in powers))
    other = read_unit(product.join(f"{symbol}{power}{exponent}" for symbol, exponent in powers))
    over = " ".join(f"{symbol}{exponent}" for symbol, exponent in powers if exponent > 0) or "1"
    under = " ".join(f"{symbol}{-exponent}" for symbol, exponent in powers if exponent < 0)
    fraction = read_unit(f"{over}/({under})" if under else over)
    assert plain.kind == other.kind == fraction.kind
    assert plain.factor == pytest.approx(other.factor, rel=1e-12)
    assert plain.factor == pytest.approx(fraction.factor, rel=1e-12)


def test_the_unit_of_a_plant_is_split_into_those_of_output_and_input() -> None:
    for output in ("rad/s", "m/(s s)", "rad/(s)", "°"):
        for input in ("N m", "A", "kg m/(s^2)"):
            assert split_plant_unit(f"{output}/({input})") == (output, input)
    assert [split_plant_unit(text) for text in ("", "dB", "m/A", ")", "m)")] == [("", "")] * 5
    assert PlantKinds.of_unit("rad/s/(N m)") == PlantKinds("velocity", "torque", "rad/s", "N m")
    assert PlantKinds.of_unit("dB") == PlantKinds("other", "other", "dB", "dB")
    assert PlantKinds.of_unit("") == PlantKinds(None, None)


def test_a_declared_kind_wins_over_the_unit_and_a_wrong_one_is_rejected() -> None:
    assert Channel("speed", "counts", "velocity").stated_kind == "velocity"
    assert Channel("speed", "rad", "velocity").kind == "velocity"
    with refused(UsageError, "not-one-of", argument="kind", value="speed", allowed=list(KINDS)):
        Channel("speed", "rad/s", "speed")  # type: ignore[arg-type]

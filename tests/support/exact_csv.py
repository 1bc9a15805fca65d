"""CSV as pandas reads it exactly: by default from 3.1 on, before that with an option that 3.1 deprecates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from packaging.version import Version

EXACT: dict[str, Any] = {} if Version(pd.__version__) >= Version("3.1") else {"float_precision": "round_trip"}


def read_exactly(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, **EXACT)

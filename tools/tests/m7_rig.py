"""The mark of tests that need the emulated Cortex-M7. Import it once tools/m7 is in sys.path."""

from __future__ import annotations

import pytest

from m7 import MissingToolError, require_tools


def _missing() -> str:
    try:
        require_tools()
    except MissingToolError as missing:
        return str(missing)
    return ""


needs_rig = pytest.mark.skipif(bool(_missing()), reason=_missing())

from __future__ import annotations

import pytest

from target.bxcan.pokes import Desk


@pytest.fixture
def desk() -> Desk:
    return Desk()

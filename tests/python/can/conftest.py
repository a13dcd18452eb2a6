"""The real C codec."""

from __future__ import annotations

import pytest
from python.can.codec import Codec, build


@pytest.fixture(scope="session")
def codec(tmp_path_factory: pytest.TempPathFactory) -> Codec:
    return Codec(build(tmp_path_factory.mktemp("codec")))

"""What the pages behind the first ones tell people to type works, as test_readme.py has it for those."""

from __future__ import annotations

import pytest
from quality.conftest import SourceTree
from quality.test_readme import Block, cases, run_block


@pytest.mark.parametrize("block", cases("sh", "python", first=False))
def test_a_block_does_what_its_page_says(block: Block, source_tree: SourceTree, request: pytest.FixtureRequest) -> None:
    run_block(block, source_tree, request)

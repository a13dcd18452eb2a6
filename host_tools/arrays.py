"""Names of numpy's arrays, for annotations."""

from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]
"""Of floats."""

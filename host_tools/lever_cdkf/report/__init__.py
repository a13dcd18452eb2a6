"""The report of a run: one self-contained, interactive HTML page for somebody who has never seen the project.

`write_report` is all that others need. Inside: `run` reads the trace, `charts` turn it into figures (plain plotly.js
JSON, so plotly's Python classes are never loaded), `summary_html` makes answer and tables, `captions` says what is
special in the estimator's model and in the truth, `page` puts it together with page.html, page.css, page.js and
plotly.js from the plotly package.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ..runtime.files import write_text
from ..runtime.provenance import with_provenance

if TYPE_CHECKING:
    from ..results.summary import Summary
    from .page import Story
    from .run import Run


def write_report(
    trace: Mapping[str, NDArray[Any]],
    summary: Summary | None,
    path: str | os.PathLike[str],
    story: Story | None = None,
) -> None:
    """Write the page; raise LeverError when `path` cannot be written.

    `trace` has the columns of trace.csv, of which only time_s is indispensable; `summary` is that of summary.json,
    where there is one.
    """
    from .run import Run  # here, so that importing this package stays quick

    write_page(Run(trace, summary), path, story)


def write_page(run: Run, path: str | os.PathLike[str], story: Story | None = None) -> None:
    """write_report() of a run that may have kept less than a whole trace."""
    from .page import build

    write_text(path, with_provenance(build(run, story), run.summary.provenance if run.summary else None))

"""Test ratios on the bus: what the façade says, one statistic after the other, and put side by side again."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import TEST_RATIOS, Estimator
from lever_cdkf.results.ratios import TestRatios
from python.conftest import Samples


def test_what_is_sent_is_what_the_facade_says(samples: Samples) -> None:
    """After two seconds, one statistic a sample."""
    estimator = Estimator(Config(settings={"publish_test_ratios": 1.0, "publish_period": 1e-4}))
    kept = TestRatios()
    sent = dict[str, float]()
    for k, pair in enumerate(samples(0, 2100)):
        for frame in pair:
            estimator.on_frame(*frame)
        estimator.step()
        said = estimator.test_ratios()
        answers = [codec.decode(*frame)[1] for frame in iter(estimator.next_frame, None) if frame[0] == 0x21E]
        for fields in answers:
            name = TEST_RATIOS[int(fields["evidence"])]
            sent[name] = fields["ratio"]
            assert fields["ratio"] == pytest.approx(min(max(said[name], 0.0), 65.534), abs=5.1e-4)
            row = {"time_s": k * 1e-3, "evidence": fields["evidence"], "test_ratio": fields["ratio"]}
            kept.add({column: np.array([value]) for column, value in row.items()})
    assert tuple(said) == TEST_RATIOS
    assert kept.at(np.array([3.0]))[0].tolist() == [sent[name] for name in said]
    assert np.isnan(kept.at(np.array([-1.0]))).all()
    assert sent["innovation"] > 0.0

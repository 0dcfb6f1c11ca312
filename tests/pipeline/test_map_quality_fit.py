"""The fit of the model by which maps get their quality."""

from __future__ import annotations

import numpy as np

from pipeline.quality import MAP_MOST
from pipeline.stages.logistic import load_models
from research.map_quality_fit import NAMES, Row, fit, left_out, scores_of


def rows() -> list[Row]:
    """Forty maps of ten repositories: what lies beyond the rooms tells most of the wrong ones, noise tells nothing."""
    rng = np.random.default_rng(3)
    found = []
    for k in range(40):
        right = k % 3 == 0
        beyond = 0.0 if right or rng.random() < 0.2 else 0.05
        grounds = {"beyond_rooms": beyond, "free_wall": float(rng.random())}
        found.append(Row(f"somebody/maps{k % 10}", right, grounds))
    return found


def test_what_tells_wrong_maps_weighs_most_and_nothing_speaks_for_a_map() -> None:
    model = fit(rows())
    weights = {name: weight for name, weight in model.weights.items() if name not in MAP_MOST}
    assert min(weights, key=lambda name: weights[name]) == "beyond_rooms"
    assert all(model.weights[name] <= most for name, most in MAP_MOST.items())
    assert all(weight < 0 for weight in model.weights.values())
    assert fit(rows()) == model


def test_a_map_is_scored_by_a_model_that_saw_nothing_of_its_repository() -> None:
    known = rows()
    flipped = [Row(r.repository, not r.right, r.grounds) if r.repository.endswith("s4") else r for r in known]
    own = [k for k, row in enumerate(known) if row.repository.endswith("s4")]
    assert (left_out(known)[own] == left_out(flipped)[own]).all()
    assert not np.allclose(scores_of(fit(known), known), scores_of(fit(flipped), known))


def test_the_model_in_use_weighs_only_what_the_fit_knows() -> None:
    assert load_models()["map"].weights.keys() <= set(NAMES)

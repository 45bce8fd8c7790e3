"""Modes of a document: what is packed is read again, to half of each step."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.results.closed_form_modes import (
    coefficients_of,
    modes_of,
    pack_modes,
    require_modes,
)


@given(seed=st.integers(0, 10**6), genus=st.integers(1, 4), stride=st.sampled_from([1, 2]))
def test_what_is_packed_is_read_again(seed: int, genus: int, stride: int) -> None:
    random = np.random.default_rng(seed)
    modes = np.unique(stride * random.integers(-4, 5, (random.integers(0, 60), genus)), axis=0)
    modes = random.permutation(modes)
    count = len(modes)
    values = random.normal(size=count) * 10.0 ** random.uniform(-14, 2, count)
    steps = 10.0 ** random.uniform(-17, -9, count)
    for given_values in (values, np.array([Decimal(x) for x in values.tolist()], dtype=object)):
        packed = pack_modes(modes, given_values, steps, stride)
        require_modes(("modes",), packed["modes"], genus, count)
        found = {
            tuple(mode): value
            for mode, value in zip(
                modes_of(packed, genus, stride).tolist(), coefficients_of(packed), strict=True
            )
        }
        assert len(found) == count
        for mode, value, step in zip(modes.tolist(), values, steps, strict=True):
            assert abs(found[tuple(mode)] - value) <= step / 2 + 4e-16 * abs(value)


def test_neighbours_share_a_row_and_numbers_end_where_they_count() -> None:
    modes = np.array([[1, 2], [0, 1], [1, 0], [1, 1], [2, 5]])
    packed = pack_modes(modes, [0.12345678, -1e-4, 3e-9, 2.5e-5, 1.0], [1e-6] * 4 + [1e-8])
    assert packed["modes"] == [[0, 1, 1], [1, 0, 3], [2, 5, 1]]
    assert packed["coefficients"] == [-100, 0, 25, 123457, 1000000.0]
    assert packed["scale"] == 1e6
    texts = pack_modes(modes[:2], [Decimal("0.12345678"), Decimal("-1e-7")], [1e-6] * 2)
    assert (texts["coefficients"], texts["scale"]) == (["0", "123457"], "1e6")


@pytest.mark.parametrize(
    "rows",
    [
        3,
        [[1]],
        [[1, 2, 3, 4]],
        [[1, 2.0, 1]],
        [[1, True, 1]],
        [[1, 2**40, 1]],
        [["1", 2, 1]],
        [[1, 2, 2]],
    ],
)
def test_rows_that_are_none_are_named(rows: Any) -> None:
    with pytest.raises(InvalidInput, match="modes"):
        require_modes(("modes",), rows, 2, 1)

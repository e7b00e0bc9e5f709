"""Where two values differ: by place, exactly or but for rounding."""

from dataclasses import dataclass

import pytest

from dzdesign.core.artefact_reading import NOTHING, Difference, differences


@dataclass(frozen=True)
class Measured:
    dp_MPa: float
    rows: tuple[float, ...] = ()


def places(*values, **options):
    return [each.place for each in differences(*values, **options)]


@pytest.mark.parametrize(
    ("stated", "follows", "place"),
    [
        (Measured(1.0), Measured(1.1), "dp_MPa"),
        (Measured(1.0, (1.0, 2.0)), Measured(1.0, (1.0, 3.0)), "rows[1]"),
        (Measured(1.0, (1.0,)), Measured(1.0, (1.0, 2.0)), "rows"),
        ({"a": {"b": 1}}, {"a": {}}, "a.b"),
        ([1, "ab"], [1, "ac"], "[1]"),
        (True, 1.5, ""),
        (None, 0.0, ""),
    ],
)
def test_the_place_is_named(stated, follows, place):
    assert places(stated, follows) == places(stated, follows, rounding=1e-6) == [place]
    assert list(differences(stated, stated)) == []


def test_rounding_is_of_floats_only_and_no_wider_than_given():
    assert places((1.0, 1e-9), (1.0 + 9e-7, 9e-7), rounding=1e-6) == []
    assert places((1.0, 1e6), (1.0 + 2e-6, 1e6 + 2), rounding=1e-6) == ["[0]", "[1]"]
    assert places(1.0, 1.0 + 1e-15) == [""]
    assert places(1_000_000_000, 1_000_000_001, rounding=1e-6) == [""]


def test_a_key_that_one_lacks_is_nothing_there():
    assert list(differences({"a": 1}, {"b": 2})) == [
        Difference(place="b", stated=NOTHING, follows=2), Difference(place="a", stated=1, follows=NOTHING),
    ]  # fmt: skip

"""A link's value is refuted with as few searches as decide it."""

from collections.abc import Sequence
from typing import Any

import pytest

from rhythmid.diagnose.joints import contradiction
from rhythmid.diagnose.joints.contradiction import Searched, contradicted

KNOWN = {
    "base": 4.0,
    "shoulder": -1.0,
    "elbow": -20.0,
    "wrist": 7.0,
}  # log odds with the effects that are known


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr(
        contradiction, "weight_of_values", lambda found, before, after, joints: KNOWN[joints[0]]
    )
    return []


def outcome(
    monkeypatch: pytest.MonkeyPatch, searched: list[str], after: dict[str, float]
) -> tuple[bool, list[str]]:
    """Whether the value is refuted if the searches bring these log odds, and the joints of the results."""
    monkeypatch.setattr(contradiction, "weight_of_joints", lambda before, now, joints: after[joints[0]])

    def search(joints: Sequence[str], waiting: int) -> Searched:
        searched.extend(joints)
        assert waiting == len(KNOWN) - len(searched)
        results: Any = dict.fromkeys(joints)
        return results, {}

    found: Any = dict.fromkeys(KNOWN)
    balances: Any = None
    refuted, (better, _) = contradicted(found, balances, balances, list(KNOWN), search)
    return refuted, list(better)


def test_one_joint_that_still_contradicts_decides_and_the_others_keep_their_results(monkeypatch, searched):
    assert outcome(monkeypatch, searched, {"elbow": -18.0}) == (True, ["elbow"])
    assert searched == ["elbow"]


def test_a_value_with_which_a_further_effect_is_found_is_kept(monkeypatch, searched):
    after = {"elbow": 30.0, "shoulder": -1.0}
    assert outcome(monkeypatch, searched, after) == (False, ["elbow", "shoulder"])

"""The menu of next experiments: what the machine, and the sampling of its records, can bear."""

import pytest

from rhythmid.diagnose.answer.next_experiment import _menu
from rhythmid.excitation.sequence import build


@pytest.mark.parametrize("highest", [4.0, 40.0, 400.0])
def test_no_experiment_excites_what_the_sampling_cannot_show(highest):
    bands = [spec["band"] for _, spec, _ in _menu(1.0, 6.0, 10.0, highest) if "band" in spec]
    assert bands and max(high for _, high in bands) <= highest
    assert max(high for _, high in bands) == min(highest, 21 * 6.0)


def test_every_experiment_of_the_menu_can_be_built():
    for words, spec, factor in _menu(1.0, 6.0, 10.0, 100.0):
        assert build(spec).duration > 0.0 and factor > 0.0 and words

"""The paper's Table 1: its numbers, and ours from bags alone."""

import io
import json

import pytest
from rich.console import Console

from rhythmid.table1 import CASES, run_case, show, table1, worst_error


def test_the_cases_are_the_papers() -> None:
    assert [(case.input, case.measurement) for case in CASES] == [
        (u, y) for u in (0.0, 0.04, 0.08) for y in (0.0, 0.05, 0.1)
    ]
    assert CASES[8].minus == pytest.approx((0.0821, 0.1002))
    assert CASES[5].plus == pytest.approx((0.0412, 0.0951))


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("table1")
    return folder, table1(folder, [CASES[4], CASES[8]])  # test_identify_paper has the one without delays


def test_every_estimate_beats_what_is_asked_for(rows) -> None:
    for row in rows[1]:
        values, estimates = row.fitted, row.result["methods"]["paper"]
        assert values["linear_spring.stiffness"] == pytest.approx(200.0, rel=2e-4)
        assert values["switched_damper.stance"] == pytest.approx(2.0, rel=3e-3)
        assert estimates["G0"]["sum"] == pytest.approx(row.case.input + row.case.measurement, abs=0.2e-3)
        for name in ("G-1", "G+1"):
            assert estimates[name]["input"] == pytest.approx(row.case.input, abs=0.8e-3)
            assert estimates[name]["measurement"] == pytest.approx(row.case.measurement, abs=0.8e-3)


def test_joint_maximum_likelihood_is_better_still(rows) -> None:
    for row in rows[1]:
        delays, values = row.result["delays"], row.result["parameters"]
        assert delays["input"]["value"] == pytest.approx(row.case.input, abs=2e-5)
        assert delays["measurement"]["value"] == pytest.approx(row.case.measurement, abs=2e-5)
        assert values["switched_damper.stance"]["value"] == pytest.approx(2.0, rel=2e-4)


def test_the_figures_of_the_paper_are_drawn_and_the_bags_kept(rows) -> None:
    folder, _ = rows
    for name in ("figure2_magnitude.png", "figure3_phase.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    assert (folder / "experiment_5" / "metadata.yaml").exists()


def test_the_json_holds_the_actual_delays(rows) -> None:
    result = json.loads(json.dumps([row.result for row in rows[1]]))
    assert [one["actual"] for one in result] == [
        {"input": case.input, "measurement": case.measurement} for case in (CASES[4], CASES[8])
    ]


def test_the_bag_tells_nothing_of_the_truth(rows) -> None:
    content = b"".join(path.read_bytes() for path in (rows[0] / "experiment_5").iterdir())
    assert b"delays" not in content and b"stiffness" not in content
    assert b"/hopper/plant/joint_states" not in content and b"/hopper/command" not in content


def test_the_printed_table_shows_both(rows) -> None:
    console = Console(file=io.StringIO(), width=160)
    show(rows[1], console)
    assert isinstance(console.file, io.StringIO)
    text = console.file.getvalue()
    assert "(102.7)" in text and "#9" in text and "Joint maximum likelihood" in text
    assert worst_error(rows[1]) < 0.8e-3


def test_an_experiment_that_was_recorded_before_is_not_overwritten(rows) -> None:
    from rhythmid.errors import InputError

    with pytest.raises(InputError, match="exists"):
        run_case(CASES[4], rows[0])

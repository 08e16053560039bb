"""Pages: self-contained, safe, complete, whatever the diagnosis found."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.report.diagnosis import diagnosis_page
from rhythmid.report.findings import ElementScore, ElementWords, Findings, FreeFunction, TransferChange
from rhythmid.report.identification import comparison_section, identification_page
from rhythmid.report.page import Page, render, write_page
from rhythmid.report.record_quality import RecordQuality
from rhythmid.report.run import Compared, Run

EVIL = '</title><img src=x onerror="alert(1)">'


class Outline(HTMLParser):
    """Headings, links, ids, figures and their captions, addresses."""

    VOID = {"meta", "link", "br", "img", "hr", "input"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


def estimate(value: float, std: float | None, unit: str) -> dict[str, Any]:
    return {"value": value, "std": std, "unit": unit}


def result(
    verdict: str = "missing_physics", element: str = "coulomb_friction", slot: str = "force"
) -> dict[str, Any]:
    named = verdict != "consistent"
    delays = {
        "input": estimate(0.02, 1e-4, "s"), "measurement": estimate(0.015, 1e-4, "s"), "sum": estimate(0.035, 5e-5, "s"),
        "separable": True, "assumption": "the forcing acts undelayed",
    }  # fmt: skip
    parameters = {
        "linear_spring.stiffness": estimate(200.0, 0.1, "N/m"),
        "inertia.mass": estimate(1.0, 0.0, "kg"),
    }
    effect = {
        "element": element, "slot": slot, "equation": "F = −F_c sgn v", "share": 0.93, "probability": 0.98,
        "parameters": {"force": estimate(0.05, 1e-3, "N")},
    }  # fmt: skip
    return {
        "verdict": verdict,
        "summary": "The model lacks coulomb friction. With it, the error falls from 5 % to 0.5 %." if named else "Nothing is missing.",
        "detection": {"p_value": 1e-9, "nominal_nrmse": 0.3, "refitted_nominal_nrmse": 0.05, "noise_floor_nrmse": 0.004},
        "location": {"slot": slot if named else None, "where": "in the balance of forces", "evidence": ["best score in slot force: chi2 = 100"]},
        "missing": [effect] if named else [],
        "joint_probability": 0.97 if named else 0.0,
        "indistinguishable": [["coulomb_friction", "stribeck_friction"]] if named else [],
        "alternatives": [
            {"elements": ["stribeck_friction"], "delta_bic": 3.0, "heldout_nrmse": 0.005},
            {"elements": [], "delta_bic": 5000.0, "heldout_nrmse": None},
        ],
        "fit": {
            "refitted_nominal": {"train_nrmse": 0.05, "heldout_nrmse": 0.06},
            "augmented": {"train_nrmse": 0.005, "heldout_nrmse": 0.005},
        },
        "parameters": parameters | ({"coulomb_friction.force": estimate(0.05, 1e-3, "N")} if named else {}),
        "delays": delays,
        "next_experiment": "a step of bias force",
        "calibration": ["linear_spring.stiffness: 180 in the nominal model, 200 ± 0.1 N/m in the records"],
        "excluded": ["second_mode: the model diverges"],
        "heldout": "held out: h1",
        "hypotheses": [
            hypothesis("effects", 0.0, 0.98, [element]), hypothesis("effects", 12.0, 0.02, ["stribeck_friction"]),
            hypothesis("freed_value", 300.0, 0.0, ["inertia.mass"]), hypothesis("nominal", 400.0, 0.0, []),
        ],
        "rejections": [
            {"hypothesis": ["stribeck_friction"], "name": "within_bounds", "statistic": 0.0, "threshold": 1e-3, "reason": "the effect has become the limit of another one"},
            {"hypothesis": ["inertia.mass"], "name": "share_of_rest", "statistic": None, "threshold": 0.2, "reason": "so small a part belongs to something else"},
        ],
        "remainder": {"share": 0.0, "significant": False, "goes_with": None, "curve": None},
        "scoring": {"kind": "free_run", "bandwidth": None, "reason": "the model follows the machine in free run"},
        "assumptions": ["the forcing acts undelayed on the mass"],
        "notes": [],
    }  # fmt: skip


def hypothesis(kind: str, worse: float, probability: float, elements: list[str]) -> dict[str, Any]:
    return {
        "elements": elements, "kind": kind, "score": 1000.0 - worse, "score_difference": worse, "standard_error": 0.1 * worse,
        "probability": probability, "heldout_nrmse": None if kind == "nominal" else 0.01,
    }  # fmt: skip


REMAINDER = {
    "share": 0.07, "significant": True, "goes_with": "velocity", "curve": {"grid": [-0.1, 0.0, 0.1], "force": [-0.2, 0.0, 0.2]},
}  # fmt: skip


def findings(told: dict[str, Any], name: str = "run 1", forced: bool = True) -> Findings:
    """Findings about two short records, one of them held out."""
    rng = np.random.default_rng(0)
    time = np.arange(800) * 0.01
    motion = 0.01 * np.cos(2 * np.pi * time)
    repaired = bool(told["missing"])
    everything = np.ones(800, bool)
    run = Run(
        name, time, motion, motion + 1e-3 * np.sin(4 * np.pi * time), motion + 1e-5 * rng.standard_normal(800) if repaired else None,
        motion, np.gradient(motion, 0.01), time % 1.0 if forced else None, everything, ~everything,
    )  # fmt: skip
    grid = np.linspace(-0.1, 0.1, 30)
    frequency = np.linspace(0.1, 5.0, 50)
    htf = np.ones((5, 50), complex)
    change = TransferChange(frequency, (0, -1, 1, -2, 2), 1.1 * htf, htf, "m/N", 1.0)
    refitted = {
        "linear_spring.stiffness": estimate(201.0, 0.1, "N/m"),
        "inertia.mass": estimate(1.0, 0.0, "kg"),
    }
    return Findings(
        result=told,
        source=f"nominal.yaml against {name}",
        slots={"force": ("gravity", "linear_spring"), "command": ("input_delay",)},
        forced=forced,
        compared=Compared("motion", "m"),
        runs=(run, replace(run, name="h1", heldout=True)),
        chosen=tuple(effect["element"] for effect in told["missing"]),
        output_unit="m",
        force_unit="N",
        noise=1e-5,
        slow_noise=1e-5,
        scores=(ElementScore("coulomb_friction", "force", 100.0), ElementScore("sensor_lag", "sensor", 7.0)),
        threshold=14.0,
        functions=(FreeFunction("velocity", 0.9, grid, np.sign(grid), "m/s", "N", 0.0, grid, 0.0 * grid),),
        transfer=change if forced else "no periodic forcing was recorded",
        nominal={name: estimate(180.0, None, one["unit"]) for name, one in refitted.items()},
        refitted=refitted,
        refitted_delays=told["delays"],
        records=(
            RecordQuality(name, "fit", ("output", "input"), 8.0, 100.0, 1e-5, 1, 3, 0, ("output: 1 gap",)),
        ),
        words={
            "coulomb_friction": ElementWords(
                "Coulomb friction", {"force": "friction force F_c"}, ("stribeck_friction",)
            )
        },
        command=f"rhythmid diagnose {name}",
        models={"Nominal model": "inertia: {}\n"},
        hints=(("coulomb_friction", "stribeck_friction", "dwell at low speed"),),
    )


def by_effort() -> Findings:
    """Findings of an answer that was scored by effort: what belongs to free runs is absent."""
    told = result() | {
        "scoring": {"kind": "effort", "bandwidth": 12.0, "reason": "a controller holds the machine"},
        "remainder": REMAINDER | {"goes_with": "load"},
        "delays": {},
    }
    told["detection"] = told["detection"] | {"p_value": None, "nominal_nrmse": None}
    made = findings(told)
    run = replace(made.runs[0], phase=None, size=0.02)
    return Findings(
        told, made.source, made.slots, False, Compared("effort", "N", "predicted", 12.0), (run,), made.chosen, "m", "N",
        made.nominal, made.refitted, made.records, made.words, made.command, made.models,
    )  # fmt: skip


def rows_with(html: str, *texts: str) -> list[str]:
    """Text of the rows of all tables that hold any of these texts."""
    rows = [
        re.sub(r"\s", " ", re.sub("<[^>]+>", " ", row)) for row in re.findall("<tr.*?</tr>", html, re.DOTALL)
    ]
    return [row for row in rows if any(text in row for text in texts)]


def identified() -> dict[str, Any]:
    frequency = np.linspace(0.1, 6.0, 80)
    return {
        "parameters": {"linear_spring.stiffness": estimate(200.0, 0.1, "N/m")},
        "delays": result()["delays"] | {"closure": {"z": 0.4}, "aliases": [[0.52, -0.48]]},
        "harmonics": [
            {"m": m, "frequency": frequency.tolist(), "magnitude": (0.01 + 0 * frequency).tolist(),
             "phase": (-0.2 * frequency).tolist(), "std": (1e-4 + 0 * frequency).tolist()}
            for m in (-2, -1, 0, 1, 2)
        ],
        "methods": {"paper": {"G0": {"sum": 0.0351}, "G-1": {"input": 0.021, "measurement": 0.0141}}},
        "quality": {"rate": 1000.0, "gaps": 0, "jitter_std": 0.0, "nrmse": 0.01},
        "notes": ["the smoothing lowers the peak"],
    }  # fmt: skip


def pages() -> list[tuple[str, Page]]:
    made = [
        (verdict, diagnosis_page(findings(result(verdict))))
        for verdict in ("consistent", "missing_physics", "undecided")
    ]
    unknown = result("unknown_physics") | {"remainder": REMAINDER}
    made.append(("unknown_physics", diagnosis_page(findings(unknown))))
    made.append(("effort", diagnosis_page(by_effort())))
    made.append(("unforced", diagnosis_page(findings(result(), forced=False))))
    made.append(
        (
            "identification",
            identification_page(identified(), "hopper.yaml from run", (), "rhythmid identify run", {}),
        )
    )
    return made


@pytest.fixture(scope="module", params=pages(), ids=lambda case: case[0])
def html(request: pytest.FixtureRequest) -> str:
    return render(request.param[1])


def test_tags_are_balanced_and_headings_in_order(html: str) -> None:
    outline = Outline(html)
    assert outline.open == []
    levels = [int(tag[1]) for tag, _ in outline.tags if re.fullmatch("h[1-6]", tag)]
    assert levels.count(1) == 1 and levels[0] == 1
    assert all(after - before <= 1 for before, after in zip(levels, levels[1:]))


def test_nothing_is_fetched_and_nothing_runs(html: str) -> None:
    outline = Outline(html)
    assert not outline.all("script") and not outline.all("link") and not outline.all("iframe")
    assert not re.search(r"https?://", html.replace("http://www.w3.org/2000/svg", ""))
    assert "url(" not in html and "@import" not in html
    policy = next(m for m in outline.all("meta") if m.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in str(policy["content"])


def test_every_figure_says_what_to_see_in_it(html: str) -> None:
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", html, re.DOTALL)
    assert len(captions) == html.count("<figure") > 3
    assert all(len(caption) > 30 for caption in captions)
    for attributes in Outline(html).all("svg"):
        assert attributes.get("aria-hidden") == "true" or attributes.get("aria-label")


def test_links_lead_to_sections_with_distinct_names(html: str) -> None:
    outline = Outline(html)
    names = [a["id"] for _, a in outline.tags if "id" in a]
    assert len(names) == len(set(names))
    links = [str(a["href"]) for a in outline.all("a")]
    assert links and all(link.startswith("#") and link[1:] in names for link in links)


def test_names_from_recordings_stay_text() -> None:
    told = result()
    told["next_experiment"] = told["excluded"][0] = EVIL
    html = render(diagnosis_page(findings(told, name=EVIL)))
    assert "<img" not in html
    assert "&lt;img" in html


@pytest.mark.parametrize(
    ("verdict", "heading"),
    [
        ("consistent", "Nothing is missing"),
        ("missing_physics", "Missing physics: Coulomb friction"),
        ("unknown_physics", "Something unknown is missing"),
        ("undecided", "Undecided"),
    ],
)
def test_the_verdict_comes_first(verdict: str, heading: str) -> None:
    html = render(diagnosis_page(findings(result(verdict))))
    assert f"<h1>{heading}</h1>" in html
    assert html.index("<h1>") < html.index("<nav") < html.index("<section")


def test_only_names_that_the_answer_stands_by_come_with_their_probability() -> None:
    named, nearest = (
        render(diagnosis_page(findings(result(v)))) for v in ("missing_physics", "unknown_physics")
    )
    for words in ("probability of this name", "the probability of the name is", ">probability<"):
        assert words in named and words not in nearest
    assert "weight of evidence" in nearest


def test_hypotheses_stand_with_how_much_worse_they_predict_and_how_sure_that_is() -> None:
    html = render(diagnosis_page(findings(result())))
    (table,) = (one for one in re.findall("<table.*?</table>", html, re.DOTALL) if "Predicts worse by" in one)
    _, chosen, rival, freed, nominal = rows_with(table, "")
    assert "chosen" in chosen and "best" in chosen and "98 %" in chosen
    assert "not believed" in rival and "Stribeck friction" in rival
    assert "12.0 ±" in rival and "1.2" in rival
    assert "a value held fixed is wrong" in freed and "below 0.1" in freed
    assert "400 ±" in nominal


def test_rejections_stand_with_statistic_threshold_and_reason() -> None:
    html = render(diagnosis_page(findings(result())))
    (row,) = rows_with(html, "the effect has become the limit of another one")
    assert "Stribeck friction" in row and "within bounds" in row and "0.001" in row


def test_a_small_remainder_is_told_beside_names_that_stand() -> None:
    html = render(diagnosis_page(findings(result() | {"remainder": REMAINDER})))
    assert "The final model leaves 7\u202f% of the mismatch, by more than chance" in html
    assert "The names stand all the same" in html


def test_the_remainder_s_curve_is_drawn_where_no_free_function_was_simulated() -> None:
    html = render(diagnosis_page(replace(findings(result() | {"remainder": REMAINDER}), functions=())))
    assert "What is left over velocity" in html


def test_an_answer_by_effort_shows_efforts_and_nothing_of_free_runs() -> None:
    html = render(diagnosis_page(by_effort()))
    for shown in (
        "of the effort",
        "measured − predicted [",
        "Scored by effort",
        "below 12 Hz",
        "What is left over load",
    ):
        assert shown in html or shown in re.sub("<[^>]+>", "", html), shown
    for absent in (
        "free run",
        "simulated output",
        "Harmonics of the cycle",
        "best scores of",
        "Best score in each slot",
        "of the motion",
        "p-value",
    ):
        assert absent not in html, absent


def test_a_value_that_was_set_free_is_not_called_an_effect() -> None:
    told = result() | {"missing": [], "verdict": "undecided"}
    made = findings(result())
    runs = tuple(
        replace(run, labels=("refitted nominal model", "with the value set free")) for run in made.runs
    )
    html = render(diagnosis_page(replace(made, result=told, runs=runs, chosen=("inertia.mass",))))
    assert "with the value set free" in html and "added effect" not in html
    (row,) = rows_with(html, "a value held fixed is wrong")
    assert "chosen" in row


def test_the_diagnosis_shows_all_that_it_promises() -> None:
    html = render(diagnosis_page(findings(result())))
    for promised in (
        "Where model and machine part", "What is missing", "How much better it fits", "What is left unexplained",
        "Harmonics of the cycle", "The hypotheses", "What is not believed, and why", "What was assumed", "Parameters", "Delays", "What remains unknown", "The next experiment",
        "Calibration", "Quality of the records", "How to reproduce this", "What was not tried", "dwell at low speed",
        "the forcing acts undelayed", "1 (3 samples lost)", "rhythmid diagnose run 1", "friction force F<sub>c</sub>",
    ):  # fmt: skip
        assert promised in html, promised


def test_the_parameters_table_shows_what_the_refit_had_bent() -> None:
    html = render(diagnosis_page(findings(result())))
    row = next(r for r in re.findall(r"<tr.*?</tr>", html) if "linear spring: stiffness" in r and "180" in r)
    text = re.sub("<[^>]+>", " ", row).replace("\u00a0", " ")
    assert "201.00 ± 0.20" in text and "200.00 ± 0.20" in text and "−0.5" in text
    new = next(r for r in re.findall(r"<tr.*?</tr>", html) if "coulomb friction: force" in r and "new" in r)
    assert "marked" in new


def test_without_forcing_the_page_says_why_there_are_no_transfer_functions() -> None:
    assert "No periodic forcing was recorded." in render(diagnosis_page(findings(result(), forced=False)))


def test_an_identification_without_separable_delays_gives_the_sum_only() -> None:
    told = identified()
    nothing = estimate(0.0, None, "s") | {"value": None}
    told["delays"] |= {
        "separable": False,
        "input": nothing,
        "measurement": nothing,
        "assumption": "no forcing is known",
    }
    told["delays"] |= {
        "intervals": {"input": [0.0, 0.035]},
        "undetermined": ["both delays by opposite amounts"],
    }
    html = render(identification_page(told, "a model from run", (), "rhythmid identify run", {}))
    assert "cannot tell the two delays apart" in html
    assert "late together" in html
    assert "between 0.00\u202fms and 35.00\u202fms" in html
    assert "both delays by opposite amounts" in html


def test_experiments_stand_beside_their_actual_delays() -> None:
    experiment = identified() | {"actual": {"input": 0.02, "measurement": 0.016}}
    section = comparison_section([experiment, experiment], ["1", "2"])
    html = render(
        Page("t", "k", "v", "w", "plain", identification_page(experiment, "", (), "", {}).tiles, (section,))
    )
    assert "20.0 / 16.0 ms" in html and "21.0 / 14.1 ms" in html
    assert "largest error of the final estimates is 1.00\u202fms" in html


def test_a_page_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    page = diagnosis_page(findings(result()))
    write_page(tmp_path / "report.html", page)
    assert (tmp_path / "report.html").read_text(encoding="utf-8").endswith("</html>\n")
    with pytest.raises(InputError):
        write_page(tmp_path / "report.html" / "below a file.html", page)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_a_noise_level_that_is_not_known_is_not_shown() -> None:
    known, unknown = findings(result("consistent")), replace(findings(result("consistent")), noise=None)
    assert "noise alone would make" in render(diagnosis_page(known))
    html = render(diagnosis_page(unknown))
    assert "noise alone" not in html
    assert "nothing repeats in these records" in html


def test_an_unknown_effect_is_never_said_to_be_explained() -> None:
    html = render(diagnosis_page(findings(result("unknown_physics"))))
    assert "leaves nothing that a free function" not in html
    assert "seems to be" in html

"""Answers as a report gets them, made by hand: a diagnosis of a hopper, one by effort, an identification."""

import re
from dataclasses import replace
from typing import Any

import numpy as np

from rhythmid.report.findings import ElementScore, ElementWords, Findings, FreeFunction, TransferChange
from rhythmid.report.record_quality import RecordQuality
from rhythmid.report.run import Compared, Run


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
        "excluded": [{"name": "second_mode", "reason": "the model diverges"}],
        "heldout": "held out: h1",
        "hypotheses": [
            hypothesis("effects", 0.0, 0.98, [element]), hypothesis("effects", 12.0, 0.02, ["stribeck_friction"]),
            hypothesis("freed_value", 300.0, 0.0, ["inertia.mass"]), hypothesis("nominal", 400.0, 0.0, []),
        ],
        "rejections": [
            {"hypothesis": ["stribeck_friction"], "name": "within_bounds", "statistic": 0.0, "threshold": 1e-3, "reason": "only a limit of its parameters is identifiable, where it is another effect"},
            {"hypothesis": ["inertia.mass"], "name": "share_of_rest", "statistic": None, "threshold": 0.2, "reason": "so small a part belongs to something else"},
        ],
        "remainder": {"share": 0.0, "significant": False, "goes_with": None, "curve": None},
        "scoring": {"kind": "free_run", "bandwidth": None, "reason": "the model follows the records of the fit in free run"},
        "families": [],
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

"""Message about MATLAB files with nothing but objects that are not read."""

from collections.abc import Mapping

# MATLAB commands that write an object of a class as a table
WRITTEN_BY = {
    "Simulink.SimulationData.Dataset": "writetimetable(extractTimetable({name}), 'run.csv')",
    "timeseries": "writetimetable(timeseries2timetable({name}), 'run.csv')",
    "timetable": "writetimetable({name}, 'run.csv')",
    "table": "writetable({name}, 'run.csv')",
}


def complaint_of_objects(objects: Mapping[str, str]) -> str:
    """Reason why a file with nothing but objects, given as their classes by name, holds no table, and what to do."""
    name, kind = next(iter(objects.items()))
    written = WRITTEN_BY.get(kind, "").format(name=name)
    mend = f"in MATLAB  {written}" if written else "in MATLAB save its numbers as arrays"
    return f"{name!r} is an object of MATLAB's class {kind}, whose numbers are not read here; {mend}"

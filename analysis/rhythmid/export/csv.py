"""CSV: one row per number of a joint, then one row per remark."""

import csv
import io
from collections.abc import Sequence

from rhythmid.export.joint import Joint, number

HEADER = ("joint", "quantity", "value", "unit", "meaning")


def text(joints: Sequence[Joint], source: str) -> str:
    """The table of joints; `control` states the meaning of the command, `source` the origin of the numbers."""
    written = io.StringIO()
    table = csv.writer(written, lineterminator="\n")
    table.writerow(HEADER)
    for joint in joints:
        table.writerow((joint.name, "source", source, "", "model that was identified"))
        table.writerow((joint.name, "control", joint.control, "", "what the command is"))
        for one in joint.quantities:
            table.writerow((joint.name, one.name, number(one.value), one.unit, one.meaning))
        for remark in joint.remarks:
            table.writerow((joint.name, "remark", "", "", remark))
    return written.getvalue()

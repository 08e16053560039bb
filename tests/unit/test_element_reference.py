"""The reference page says what the element files say."""

from pathlib import Path

from rhythmid.elements.element import LEADING
from rhythmid.elements.reference import reference

PAGE = Path(__file__).parents[2] / "docs" / "elements.md"


def test_the_page_in_the_docs_is_the_one_that_the_files_give(catalogue):
    assert PAGE.read_text(encoding="utf-8") == reference(catalogue), (
        "run: python -m rhythmid.elements.reference > docs/elements.md"
    )


def test_every_element_and_parameter_is_on_the_page(catalogue):
    page = reference(catalogue)
    for name, element in catalogue.items():
        section = page.split(f"### `{name}`\n")[1].split("\n### ")[0]
        assert element.equation in section and element.reference in section
        for parameter in element.parameters:
            assert f"| `{parameter.name}` | {parameter.unit} |" in section


def test_the_page_says_which_motion_each_force_sees_and_what_every_kernel_is_given(catalogue):
    page = PAGE.read_text(encoding="utf-8")
    for (slot, acts), given in LEADING.items():
        assert f"| {slot} | `{acts}` | {', '.join(f'`{one}`' for one in given)} |" in page
    for element in catalogue.values():
        section = page.split(f"### `{element.name}`\n")[1].split("\n### ")[0]
        if element.slot == "force" and element.kernel is not None and element.acts != "drive":
            assert (
                f"- Sees x and v of the mass {'in the room' if element.acts == 'body' else 'relative to the base'}."
                in section
            )
        assert ("- Acts against base or room." in section) is (element.against is not None)

"""The reference page says what the element files say."""

from pathlib import Path

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

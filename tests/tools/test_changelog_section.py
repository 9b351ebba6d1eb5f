"""The text of a release's page."""

import changelog_section

CHANGELOG = """# Changelog

## 0.2.0

- [Guides](docs/site/index.md#guides), as [others](https://example.org) have.

## 0.1.0

- Old.
"""


def test_a_section_ends_where_the_next_version_begins():
    assert changelog_section.section(CHANGELOG, "0.2.0").endswith("have.")
    assert changelog_section.section(CHANGELOG, "0.1.0") == "- Old."
    assert changelog_section.section(CHANGELOG, "0.3.0") is None


def test_links_to_files_lead_to_the_repository():
    text = changelog_section.led(changelog_section.section(CHANGELOG, "0.2.0"), "0.2.0")
    assert "(https://github.com/surfrecon/surfrecon/blob/v0.2.0/docs/site/index.md#guides)" in text
    assert "(https://example.org)" in text

# SPDX-License-Identifier: LGPL-2.1-or-later
"""What mkdocs adds to the pages in docs/: the front page from README, and the reference from the code."""

from __future__ import annotations

import argparse
import json
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from page_commands import steps

ROOT = Path(__file__).resolve().parents[1]


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that nobody writes."""
    from mkdocs.structure.files import File

    os.environ["COLUMNS"] = "100"  # argparse folds its help at the width of the terminal
    pages = {
        "index.md": front(),
        "decisions/index.md": decisions(),
        "reference/commands.md": commands(),
        "reference/exit-codes.md": exit_codes(),
        "reference/findings.md": findings(),
        "reference/json.md": schemas(),
        "reference/api.md": api(),
        "reference/command-lines.md": executed(),
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Links to files of the repository that are no pages become their names."""
    here = (Path(config["docs_dir"]) / page.file.src_uri).parent

    def named(match: re.Match[str]) -> str:
        target = match[2].partition("#")[0]
        outside = not re.match(r"[a-z]+:|#", match[2]) and not (here / target).resolve().is_relative_to(
            Path(config["docs_dir"]).resolve()
        )
        return f"{match[1]} (`{target.lstrip('./')}`)" if outside else match[0]

    markdown = markdown.replace("](decisions/)", "](decisions/index.md)")
    # mkdocs moves a page into a folder of its own, and leaves HTML as it is.
    markdown = markdown if page.is_homepage else markdown.replace('<img src="', '<img src="../')
    return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)", named, markdown)


def on_post_build(config: Any) -> None:
    """End with an error if a page shows a picture that is not there."""
    site = Path(config["site_dir"])
    for page in site.rglob("*.html"):
        for source in re.findall(r'<img[^>]* src="([^":]+)"', page.read_text("utf-8")):
            if page.name != "404.html" and not (page.parent / source).is_file():
                raise SystemExit(f"{page.relative_to(site)}: there is no picture {source}")


def front() -> str:
    """README, with its links from docs/."""
    text = (ROOT / "README.md").read_text("utf-8")
    text = re.sub(r"\]\((?!docs/|[a-z]+:|#)", "](../", text)
    return text.replace("](docs/", "](")


def decisions() -> str:
    """The titles of the decisions."""
    paths = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    titles = [(path.name, path.read_text("utf-8").partition("\n")[0].lstrip("# ")) for path in paths]
    return "\n".join(["# Decisions", "", *(f"- [{title}]({name})" for name, title in titles), ""])


def commands() -> str:
    """The help of every command, by theme."""
    from silo.cli.command_table import THEMES
    from silo.cli.parser import build_parser

    (known,) = (one.choices for one in build_parser()._actions if isinstance(one, argparse._SubParsersAction))
    lines = ["# Commands", "", "As `silo-mod COMMAND --help` prints them."]
    for theme, names in THEMES.items():
        lines += ["", f"## {theme}"]
        for name in names:
            lines += ["", f"### {name}", "", "```text", known[name].format_help().rstrip(), "```"]
    return "\n".join(lines) + "\n"


def exit_codes() -> str:
    """The exit codes, with what the code says of them."""
    page = (ROOT / "docs" / "headless.md").read_text("utf-8")
    table = page.split("## Exit codes\n")[1].split("\n## ")[0]
    return f"# Exit codes\n{table}\n"


def findings() -> str:
    """Every finding: what it is, and what a person does about it."""
    from silo.bom.findings import FindingCode

    head = [
        "# Findings",
        "",
        "What the walk through an assembly reports; [the rules of counting](../counting-rules.md) say more,",
        "and [mass and inertia](../inertia.md) has the warnings about masses.",
        "",
        "| code | severity | it is | do |",
        "|---|---|---|---|",
    ]
    rows = (f"| `{code}` | {code.severity} | {code.meaning} | {code.remedy} |" for code in FindingCode)
    return "\n".join([*head, *rows, ""])


def executed() -> str:
    """Every command line of README and docs, with how it is tried."""
    lines = [
        "# Command lines that are tried",
        "",
        "Each is run by the tests in the order of its page, or says why not.",
    ]
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))):
        blocks = [step for step in steps(page.read_text("utf-8")) if step.kind == "sh"]
        if blocks:
            lines += ["", f"## {page.relative_to(ROOT)}"]
        for block in blocks:
            said = f"Not run: {block.reason}." if block.reason else "Run:"
            lines += ["", said, "", "```sh", *block.commands(), "```"]
    return "\n".join(lines) + "\n"


def schemas() -> str:
    """The JSON Schema of each command's --json."""
    from silo.cli.json_schemas import NAMES, schema_of

    lines = ["# JSON", "", "As `silo-mod schema COMMAND` prints them (JSON Schema 2020-12)."]
    for name in NAMES:
        lines += ["", f"## {name}", "", "```json", json.dumps(schema_of(name), indent=1), "```"]
    return "\n".join(lines) + "\n"


def api() -> str:
    """The server's requests and what they carry, from its OpenAPI description."""
    from silo_server.run import create_app
    from silo_server.settings import Settings

    with tempfile.TemporaryDirectory() as folder:
        described = create_app(Settings(database_url=f"sqlite:///{folder}/x.db")).openapi()
    lines = ["# The server's API", "", "A running server describes itself in full at `/api/openapi.json`."]
    lines += ["[The API](../server-api.md) says what merges, events, tokens and files mean."]
    by_tag: dict[str, list[str]] = {}
    for path, methods in described["paths"].items():
        for method, request in methods.items():
            by_tag.setdefault(*request["tags"], []).extend(_request(f"{method.upper()} {path}", request))
    for tag, requests in by_tag.items():
        lines += ["", f"## {tag.capitalize()}", *requests]
    lines += ["", "## Bodies"]
    for name, schema in described["components"]["schemas"].items():
        lines += ["", f"### {name}", "", "```json", json.dumps(schema, indent=1), "```"]
    return "\n".join(lines) + "\n"


def _request(name: str, request: Mapping[str, Any]) -> Iterator[str]:
    yield from ("", f"### `{name}`", "", request.get("description") or request["summary"])
    parameters = request.get("parameters", ())
    if parameters:
        yield from ("", "| parameter | in | |", "|---|---|---|")
    for one in parameters:
        words = [one.get("description", "")] + ["needed"] * one["required"]
        yield f"| `{one['name']}` | {one['in']} | {', '.join(filter(None, words)).replace('|', '/')} |"
    bodies = _shapes(request.get("requestBody", {}))
    if bodies:
        yield from ("", f"Body: {bodies}")
    yield ""
    for status, answer in request["responses"].items():
        shapes = _shapes(answer)
        yield f"- **{status}** {answer['description']}{': ' + shapes if shapes else ''}"


def _shapes(part: Mapping[str, Any]) -> str:
    """Return the types and the schemas of a body, with links to these."""
    found = []
    for kind, content in part.get("content", {}).items():
        names = re.findall(r'"#/components/schemas/([^"]+)"', json.dumps(content))
        links = [f"[{name}](#{name.lower()})" for name in dict.fromkeys(names)]
        found.append(" or ".join(links) if kind == "application/json" and links else f"`{kind}`")
    return ", ".join(dict.fromkeys(found))

# SPDX-License-Identifier: LGPL-2.1-or-later
"""The workflows of ``examples/ci/``: each step as the runner runs it, in a repository with a pull request.

What the runner would have installed is stood in for: ``pip`` and ``apt-get`` do nothing, ``gh`` asks the same
service with ``curl``. The service keeps the comments of a pull request, as GitHub's and Forgejo's does.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import parse_qsl

import pytest
import yaml

from silo.cli.setup.demo_edits import set_element_count

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NEEDED = ("git", "jq", "curl", "bash", "iconv")
MISSING = [name for name in NEEDED if shutil.which(name) is None]
pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not on this machine: {', '.join(MISSING)}")

GH = """#!/bin/bash
# gh api [--paginate] [-X METHOD] PATH [--jq FILTER] [-F body=@FILE]
shift
while [ $# -gt 0 ]; do
  case $1 in
    --paginate) all="?all" ;;
    -X) method=$2; shift ;;
    --jq) filter=$2; shift ;;
    -F) body=${2#body=@}; shift ;;
    *) path=$1 ;;
  esac
  shift
done
if [ -n "$body" ]; then jq -n --rawfile body "$body" '{body: $body}' > "$body.json"; fi
curl -sS --fail-with-body -H "Authorization: token $GH_TOKEN" -X "${method:-GET}" ${body:+-d @$body.json} \\
  "$SERVICE/$path$all" | jq -r "${filter:-.}"
"""


@dataclass
class Service:
    """Comments by their number; everything else is as the pull request says."""

    url: str = ""
    comments: dict[int, str] = field(default_factory=dict)


@pytest.fixture
def service() -> Iterator[Service]:
    """Comments of pull request 7, of which one is another robot's."""
    kept = Service(comments={1: "coverage: 81 %"})

    class Handler(BaseHTTPRequestHandler):
        def answer(self) -> None:
            length = int(self.headers.get("Content-Length") or 0)
            body = json.loads(self.rfile.read(length))["body"] if length else ""
            path, _, query = self.path.removeprefix("/repos/our/cad/issues").partition("?")
            steps, link = path.strip("/").split("/"), ""
            data: Any = {}
            if self.headers["Authorization"] != "token t0k":
                code = 401
            elif steps == ["7", "comments"] and self.command == "POST":
                code, kept.comments[max(kept.comments) + 1] = 201, body
            elif steps == ["7", "comments"]:
                code, data = (
                    200,
                    [{"id": n, "body": b, "user": {"type": "Bot"}} for n, b in kept.comments.items()],
                )
                if query != "all":  # a service that gives pages has its own idea of their length
                    at = int(dict(parse_qsl(query)).get("page", "1"))
                    data, left = data[at - 1 : at], data[at:]
                    url = f"{kept.url}{self.path.partition('?')[0]}?limit=50&page="
                    link = f'<{url}1>; rel="first"' + (f', <{url}{at + 1}>; rel="next"' if left else "")
            elif steps[0] == "comments" and self.command == "PATCH":
                code, kept.comments[int(steps[1])] = 200, body
            else:
                code = 404
            content = json.dumps(data).encode()
            self.send_response(code)
            self.send_header("Content-Length", str(len(content)))
            if link:
                self.send_header("Link", link)
            self.end_headers()
            self.wfile.write(content)

        do_GET = do_POST = do_PATCH = answer

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        kept.url = f"http://127.0.0.1:{server.server_port}"
        yield kept
        server.shutdown()


@dataclass
class Runner:
    """Runs the steps of a workflow in a checkout, as its service's runner does."""

    workflow: dict[str, Any]
    checkout: Path
    tools: Path
    service: Service
    git: Callable[..., str]

    def run(self) -> int:
        """The exit code of the first step that fails, else 0."""
        (job,) = self.workflow["jobs"].values()
        base, head = (self.git(self.checkout, "rev-parse", name) for name in ("origin/main", "HEAD"))
        values = {
            "github.event.pull_request.base.sha": base,
            "github.event.pull_request.head.sha": head,
            "github.event.pull_request.number": "7",
            "github.repository": "our/cad",
            "github.api_url": self.service.url,
            "github.token": "t0k",
            "secrets.BOM_TOKEN": "t0k",
        }
        files = {name: self.tools / name for name in ("GITHUB_ENV", "GITHUB_STEP_SUMMARY")}
        for path in files.values():
            path.write_text("")
        for step in job["steps"]:
            if "run" not in step:
                continue
            given = {
                name: re.sub(r"\$\{\{\s*(.*?)\s*\}\}", lambda found: values[found[1]], text)
                for name, text in step.get("env", {}).items()
            }
            later = dict(line.split("=", 1) for line in files["GITHUB_ENV"].read_text().splitlines())
            script = step["run"].replace("/opt/silo", str(self.tools))
            environment = {
                **os.environ,
                "PATH": f"{self.tools / 'bin'}{os.pathsep}{os.environ['PATH']}",
                "SERVICE": self.service.url,
                "PYTHONPATH": os.pathsep.join(sys.path),
                **{name: str(path) for name, path in files.items()},
                **later,
                **given,
            }
            done = subprocess.run(
                ["bash", "-e", "-c", script],
                cwd=self.checkout,
                env=environment,
                capture_output=True,
                text=True,
            )
            if done.returncode:
                print(done.stdout, done.stderr)
                return done.returncode
        return 0


@pytest.fixture(params=["github", "forgejo"])
def runner(
    request: pytest.FixtureRequest, git: Any, gearbox: Path, tmp_path: Path, service: Service
) -> Runner:
    """A clone of a repository whose branch has four bolts more than main, which went on meanwhile."""
    text = (EXAMPLES / "ci" / f"{request.param}-bom-diff.yml").read_text("utf-8")
    folder = gearbox.parent
    git(folder, "init", "-q", "-b", "main")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "first")
    git(folder, "checkout", "-qb", "more-bolts")
    set_element_count(gearbox, "CoverBolts", added=4)
    git(folder, "commit", "-qam", "more bolts")
    git(folder, "checkout", "-q", "main")
    (folder / "notes.txt").write_text("main went on")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "notes")
    git(tmp_path, "clone", "-q", "-b", "more-bolts", str(folder), "checkout")
    tools = tmp_path / "tools"
    (tools / "bin").mkdir(parents=True)
    programs = {
        "pip": "#!/bin/sh\n",
        "apt-get": "#!/bin/sh\n",
        "python3": "#!/bin/sh\n",  # of "python3 -m venv"
        "gh": GH,
        "silo-mod": f'#!/bin/sh\nexec {sys.executable} -m silo.cli.main "$@"\n',
    }
    for name, program in programs.items():
        (tools / "bin" / name).write_text(program)
        (tools / "bin" / name).chmod(0o755)
    return Runner(yaml.safe_load(text), tmp_path / "checkout", tools, service, git)


def test_a_pull_request_has_one_comment_that_follows_its_pushes(runner: Runner) -> None:
    """A state that is not whole is commented too, and fails; what cannot be compared is no comment."""
    comments, branch = runner.service.comments, runner.checkout
    assert runner.run() == 0
    assert list(comments) == [1, 2]
    assert "| quantity changed | M8x20 Bolt | 12 → 16 |" in comments[2]
    set_element_count(branch / "TopAssembly.FCStd", "CoverBolts", added=2)
    (branch / "parts" / "Cover.FCStd").unlink()
    runner.git(branch, "commit", "-qam", "still more, without the cover")
    assert runner.run() == 1
    assert "12 → 18" in comments[2]
    assert "parts/Cover.FCStd is missing" in comments[2]
    # A shallow clone has no commit where the branch began.
    origin = f"file://{branch.parent / 'gearbox'}"
    shallow = ("clone", "-q", "--depth", "1", "--no-single-branch", "-b", "more-bolts", origin, "shallow")
    runner.git(branch.parent, *shallow)
    before, runner.checkout = dict(comments), branch.parent / "shallow"
    assert runner.run() == 2
    assert comments == before
    assert list(comments) == [1, 2], "replaced, and nobody else's"
    assert comments[1] == "coverage: 81 %"


def test_the_pre_commit_hook_names_a_command_that_there_is(run: Any, git: Any, gearbox: Path) -> None:
    """Also for the first commit of a repository, and for one that only removes a part."""
    (hook,) = yaml.safe_load((EXAMPLES.parent / ".pre-commit-hooks.yaml").read_text("utf-8"))
    program, *words = hook["entry"].split()
    assert (program, hook["pass_filenames"], hook["always_run"]) == ("silo-mod", False, True)
    git(gearbox.parent, "init", "-q")
    ran = run(*words, gearbox.parent)
    assert ran.code == 0, ran.err
    assert "TopAssembly.FCStd: Top Assembly (new assembly)" in ran.out
    git(gearbox.parent, "add", "-A")
    git(gearbox.parent, "commit", "-qm", "first")
    git(gearbox.parent, "rm", "-q", "parts/Cover.FCStd")
    ran = run(*words, gearbox.parent)
    assert (ran.code, "parts/Cover.FCStd is missing" in ran.out) == (1, True)

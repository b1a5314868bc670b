# SPDX-License-Identifier: LGPL-2.1-or-later
"""Schemathesis against a server of its own for ten minutes: all phases, valid and invalid data, stateful.

    python benchmarks/server_fuzz.py [sqlite] [postgres] [--seconds S] [--seed N]

No answer may be a 5xx but an honest 503, and every answer must be one that the OpenAPI document has, with its
type and its body. What it calls valid and is refused, and the other way round, is listed at the end
(``positive_data_acceptance``, ``negative_data_rejection``). The stream, which never ends, the mode and the
caller's own account are left out: a run that closes its own server finds nothing more.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom

TOKEN = "silo_benchmark_fuzz_0123456789abcdef"
CHECKS = (
    "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance,"
    "positive_data_acceptance,negative_data_rejection"
)
# A user who is found by a link may be the caller: an admin who demotes himself ends the run as well.
HOOKS = """
import schemathesis

@schemathesis.hook
def before_call(context, case, kwargs):
    if str((case.path_parameters or {}).get("username", "")).casefold() == "admin":
        case.path_parameters["username"] = "somebody"

@schemathesis.serializer("model/gltf-binary")
def as_bytes(ctx, value):
    return value if isinstance(value, bytes) else str(value).encode()
"""
ACCEPTED = ["2xx", "3xx", 400, 401, 403, 404, 409, 429]
LEFT_OUT = ("/api/events", "/api/admin/mode", "/api/auth/logout", "/api/auth/tokens/{token_id}")


def expectations(document: Any) -> str:
    """Schemathesis' settings: 400 is right for valid data where the document says why, and only there."""
    told = ""
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            if "x-valid-but-refused" in operation:
                told += f'[[operations]]\ninclude-name = "{method.upper()} {path}"\n'
                told += f"checks.positive_data_acceptance.expected-statuses = {ACCEPTED}\n\n"
    return told


def main() -> int:
    """Both databases, or the one that is named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", help="sqlite, postgres; both where none is named")
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    bad = 0
    for kind in args.kinds or ["sqlite", "postgres"]:
        with tempfile.TemporaryDirectory() as folder:
            databases = Databases(Path(folder))
            with (
                ServerProcess(databases.new(kind), Path(folder) / "files", TOKEN) as server,
                Api(server.base_url, TOKEN) as api,
            ):
                top, sub, leaf = (api.item(number) for number in ("TOP", "SUB", "LEAF"))
                api.merge(top, {sub: 2, leaf: 1})
                api.good("POST", bom(sub), {"child_part_number": leaf})
                print(f"{kind}: {args.seconds} s", flush=True)
                config = Path(folder, "schemathesis.toml")
                config.write_text(expectations(api.good("GET", "/api/openapi.json")), "utf-8")
                Path(folder, "fuzz_hooks.py").write_text(HOOKS, "utf-8")
                command = [
                    str(Path(sys.executable).with_name("schemathesis")),
                    *["--config-file", str(config), "run"],
                    f"{server.base_url}/api/openapi.json",
                    *["-H", f"Authorization: Bearer {TOKEN}", "--mode", "all", "--checks", CHECKS],
                    *["--phases", "examples,coverage,fuzzing,stateful", "--max-time", str(args.seconds)],
                    *["--continue-on-failure", "--seed", str(args.seed), "--generation-database", "none"],
                    *["--request-timeout", "30", "--suppress-health-check", "all", "--no-color"],
                    *[word for path in LEFT_OUT for word in ("--exclude-path", path)],
                ]
                hooked = {**os.environ, "SCHEMATHESIS_HOOKS": "fuzz_hooks", "PYTHONPATH": folder}
                bad += subprocess.run(command, cwd=folder, env=hooked, check=False).returncode != 0
                api.forget_connection()  # it was idle for longer than a server keeps it
                me = api.get("/api/auth/me")
                print(f"{kind}: the caller still is {me['role']}", flush=True)
            databases.close()
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

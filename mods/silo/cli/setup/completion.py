# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod completion``: the script that completes commands, options, their choices and files in a shell.

The scripts are made from the parsers, and need no package and no run of silo-mod while somebody types.
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator

from silo.bom.errors import Exit
from silo.cli.output_words import first_sentence

SHELLS = ("bash", "zsh", "fish")


def add_completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=SHELLS, help="bash, zsh or fish")


def run_completion(args: argparse.Namespace) -> int:
    """Print the script of a shell."""
    from silo.cli.parser import build_parser, command_parsers

    commands = command_parsers(build_parser())
    print({"bash": _bash, "zsh": _zsh, "fish": _fish}[args.shell](commands))
    return Exit.DONE


def _visible(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the options that the help shows."""
    for action in parser._actions:
        if action.option_strings and action.help != argparse.SUPPRESS:
            yield action


def _choices(action: argparse.Action) -> list[str]:
    return [str(choice) for choice in action.choices or ()]


def _positional(parser: argparse.ArgumentParser) -> list[str]:
    return [word for action in parser._actions if not action.option_strings for word in _choices(action)]


def _bash(commands: dict[str, argparse.ArgumentParser]) -> str:
    lines = [
        "# silo-mod: completion for bash",
        "_silo_mod() {",
        '    local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}"',
        '    local words="" command="" w',
        '    for w in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do [[ $w == -* ]] || { command="$w"; break; }; done',
        "    COMPREPLY=()",
        '    case "$command $before" in',
    ]
    for name, parser in commands.items():
        for action in _visible(parser):
            if choices := _choices(action):
                pattern = "|".join(f'"{name} {option}"' for option in action.option_strings)
                lines.append(f"        {pattern}) words={shlex.quote(' '.join(choices))} ;;")
    lines += ['        *) case "$command" in', f'            "") words={shlex.quote(" ".join(commands))} ;;']
    for name, parser in commands.items():
        options = [option for action in _visible(parser) for option in action.option_strings]
        plain = _positional(parser)
        test = f"[[ $word == -* ]] && words={shlex.quote(' '.join(options))}"
        lines.append(f"            {name}) {test} || words={shlex.quote(' '.join(plain))} ;;")
    lines += [
        "        esac ;;",
        "    esac",
        '    [[ -n $words ]] && mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")',
        "}",
        "complete -o default -o bashdefault -F _silo_mod silo-mod",
    ]
    return "\n".join(lines)


def _zsh(commands: dict[str, argparse.ArgumentParser]) -> str:
    lines = [
        "#compdef silo-mod",
        "# silo-mod: completion for zsh",
        "_silo_mod() {",
        "    local -a commands",
        "    commands=(",
    ]
    lines += [
        f"        {shlex.quote(name + ':' + _zsh_text(parser.description))}"
        for name, parser in commands.items()
    ]
    lines += [
        "    )",
        "    if (( CURRENT == 2 )); then _describe command commands; return; fi",
        '    local command="${words[2]}"',
        '    words=("${words[@]:1}"); (( CURRENT-- ))',
        '    case "$command" in',
    ]
    for name, parser in commands.items():
        specs = []
        for action in _visible(parser):
            choices = _choices(action)
            rest = f": :({' '.join(choices)})" if choices else "" if action.nargs == 0 else ": :_files"
            specs += [
                shlex.quote(f"*{option}[{_zsh_text(action.help)}]{rest}") for option in action.option_strings
            ]
        plain = _positional(parser)
        specs.append(shlex.quote(f"*: :({' '.join(plain)})" if plain else "*: :_files"))
        lines.append(f"        {name}) _arguments {' '.join(specs)} ;;")
    lines += [
        "    esac",
        "}",
        "if [[ $zsh_eval_context[-1] == loadautofunc ]]",
        'then _silo_mod "$@"; else compdef _silo_mod silo-mod; fi',
    ]
    return "\n".join(lines)


def _zsh_text(text: str | None) -> str:
    return "".join(" " if c in "[]:\\'`$\"" else c for c in first_sentence(text or ""))


def _fish(commands: dict[str, argparse.ArgumentParser]) -> str:
    lines = ["# silo-mod: completion for fish"]
    for name, parser in commands.items():
        about = _fish_quoted(first_sentence(parser.description or ""))
        lines.append(f"complete -c silo-mod -f -n __fish_use_subcommand -a {name} -d {about}")
        given = f"-n '__fish_seen_subcommand_from {name}'"
        for action in _visible(parser):
            for option in action.option_strings:
                word = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
                choices = _choices(action)
                values = "" if action.nargs == 0 else " -x" if choices else " -r -F"
                values += f" -a {_fish_quoted(' '.join(choices))}" if choices else ""
                help_text = _fish_quoted(first_sentence(action.help or ""))
                lines.append(f"complete -c silo-mod {given} {word}{values} -d {help_text}")
        if plain := _positional(parser):
            lines.append(f"complete -c silo-mod {given} -f -a {_fish_quoted(' '.join(plain))}")
    return "\n".join(lines)


def _fish_quoted(text: str) -> str:
    inner = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{inner}'"

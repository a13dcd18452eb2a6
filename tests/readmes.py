"""Commands as README files and --help have them, for the tests that run them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

KEPT = "m_p_walk c_p_walk k_p_walk walk_ceiling robbins_monro_time z_ddot_gain z_ddot_delay lever_friction"
SHORTER = {
    r"lever tune \S+": r"\g<0>" + "".join(f" --keep {name}" for name in KEPT.split()),
    r"lever compare --paper": r"\g<0> --duration 4 --estimators dual_annealing rls",
    r"lever figures --paper": r"\g<0> --only figure_4_states",
}
"""Commands with less to calculate: one setting is looked for, two estimators are compared, one figure is drawn."""


def blocks(readme: Path, language: str) -> dict[int, str]:
    """Return the content of each block of a language, by the line that it begins at."""
    text = readme.read_text(encoding="utf-8")
    fenced = re.compile(rf"^```{language}\n(.*?)^```", re.MULTILINE | re.DOTALL)
    return {text.count("\n", 0, match.start()) + 1: match[1] for match in fenced.finditer(text)}


def lever_commands(script: str) -> list[list[str]]:
    """Return the arguments of each call of `lever` in lines of a shell."""
    commands: list[list[str]] = []
    for line in script.replace("\\\n", " ").splitlines():
        commands.append([])
        words = shlex.shlex(line, posix=True, punctuation_chars="|&;<>")
        words.whitespace_split = True
        for word in words:
            if set(word) <= set("|&;<>"):
                commands.append([])
            else:
                commands[-1].append(word)
    return [command[1:] for command in commands if command[:1] == ["lever"]]

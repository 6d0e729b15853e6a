# SPDX-License-Identifier: BSD-3-Clause
"""For scripts that Blender runs: ../shared/scenes/render_orbit.py as it is, but for what a script changes in its text."""
import sys

arguments = sys.argv[sys.argv.index("--") + 1 :]


def named(name):
    return arguments[arguments.index("--" + name) + 1]


def source():
    with open(named("renderer")) as file:
        return file.read()


def replaced_once(text, old, new):
    if text.count(old) != 1:
        raise SystemExit(f"{named('renderer')}: expected one '{old}', found {text.count(old)}")
    return text.replace(old, new)


def run(text, scope):
    scope["__name__"] = "__main__"
    exec(compile(text, named("renderer"), "exec"), scope)

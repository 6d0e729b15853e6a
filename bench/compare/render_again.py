# SPDX-License-Identifier: BSD-3-Clause
"""Renders a scene of ../shared/scenes as it is found days later, with Debian's Blender:

    nice blender -b -P bench/compare/render_again.py -- --renderer ../shared/scenes/render_orbit.py \
        --scene ../shared/scenes/van.py --changes van --seed 7 --spp 10 --limit 24 --out RAW

The renderer and the scene are run as they are but for what is named here: another start of both orbits and
other jitter, another sun, one part 5 K warmer, one part moved, of some scenes everything warmer by the day.
Seed and surroundings stay those of the first visit, so that nothing else changes; `--limit 24` leaves the test
views out.
"""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from scene_renderer import named, replaced_once, run, source


class Change:
    """Which boxes and cylinders of a scene are altered: told by where the scene puts them."""

    def __init__(self, warmer, warmer_by_k, moved, moved_to, day_k=0.0):
        self.warmer, self.warmer_by_k, self.moved, self.moved_to = warmer, warmer_by_k, moved, moved_to
        self.day_k = day_k
        self.made = set()

    def loc(self, loc):
        if loc == self.moved:
            self.made.add("moved")
            return self.moved_to
        return loc

    def warm(self, loc, material, M):
        if loc != self.warmer:
            return material
        self.made.add("warmer")
        vis = json.loads(material["vis"])
        return M("warmer", vis["color"], vis["rough"], vis["metal"], temp=material["temp"] + self.warmer_by_k - self.day_k,
                 noise=vis["noise"])


CHANGES = {
    # the blue panel of the left side; the pallet in front of the van
    "van": Change((-0.7, 0.945, 1.35), 5.0, (3.2, 1.9, 0.4), (2.9, -1.9, 0.4)),
    # the door; the logs beside the hut; a day 3 K warmer
    "hut": Change((-0.75, 1.07, 0.85), 5.0, (2.3, 1.3, 0.25), (2.4, -1.8, 0.25), day_k=3.0),
}

change = CHANGES[named("changes")]
text = replaced_once(
    source(),
    "exec(compile(open(scene_file).read(),scene_file,'exec'))",
    "box, cyl = altered(box), altered(cyl)\n"
    "M = of_the_day(M)\n"
    "exec(compile(open(scene_file).read(),scene_file,'exec'))\n"
    "CONFIG['sun'] = 140.0; rng.seed(1234)",
)
text = replaced_once(text, "vis=orbit(vis_r,C['vis_el'],0.0)", "vis=orbit(vis_r,C['vis_el'],13.0)")
text = replaced_once(text, "rng.uniform(5,25)", "rng.uniform(30,34)")


def altered(primitive):
    def make(loc, first, second, *rest, **named_rest):
        # box(loc, size, m, ...) and cyl(loc, r, d, m, ...)
        if primitive.__name__ == "box":
            return primitive(change.loc(loc), first, change.warm(loc, second, scope["M"]), *rest, **named_rest)
        return primitive(change.loc(loc), first, second, change.warm(loc, rest[0], scope["M"]), *rest[1:], **named_rest)

    return make


def of_the_day(material):
    def make(*given, **named_given):
        made = material(*given, **named_given)
        made["temp"] = made["temp"] + change.day_k
        return made

    return make


scope = {"altered": altered, "of_the_day": of_the_day}
run(text, scope)
if change.made != {"warmer", "moved"}:
    raise SystemExit(f"{named('scene')}: only {sorted(change.made)} of the changes were found in it")

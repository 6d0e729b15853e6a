# SPDX-License-Identifier: BSD-3-Clause
"""The van of ../shared/scenes days later, for its renderer: the drum 5 K warmer, the pallet moved, another sun,
another start of the orbits. Surroundings stay.

    nice blender -b -P ../shared/scenes/render_orbit.py -- --scene bench/compare/van_later.py \\
        --base ../shared/scenes/van.py --seed 7 --spp 10 --limit 24 --out RAW

Runs inside the renderer, whose names (arg, mats, S, rng, CONFIG) it uses; the scene itself is imported, not copied.
"""
base = arg("base", "../shared/scenes/van.py")
exec(compile(open(base).read(), base, "exec"))
warmer = [m for m in mats if m.name == "drum"]
moved = [o for o in S.objects if o.type == "MESH" and o.data.materials and o.data.materials[0].name == "pallet"]
if len(warmer) != 1 or len(moved) != 1:
    raise SystemExit(f"{base}: expected one drum and one pallet, found {len(warmer)} and {len(moved)}")
warmer[0]["temp"] = warmer[0]["temp"] + 5.0
moved[0].location = (2.9, -1.9, 0.4)
CONFIG["sun"] = 140.0
rng.seed(1234)

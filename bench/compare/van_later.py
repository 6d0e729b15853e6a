# SPDX-License-Identifier: BSD-3-Clause
# The van of ../shared/scenes some days later, for render_orbit.py: the drum beside it 5 K warmer, the pallet
# moved by 0.6 m, another sun, other stations. What stood round it stands where it stood.
#   blender -b -P ../shared/scenes/render_orbit.py -- --scene bench/compare/van_later.py \
#       --base ../shared/scenes/van.py --seed 7 --spp 16 --out RAW
base = arg('base', '../shared/scenes/van.py')
exec(compile(open(base).read(), base, 'exec'))
for m in mats:
    if m.name == 'drum':
        m['temp'] = m['temp'] + 5.0
moved = [o for o in S.objects if o.type == 'MESH' and o.data.materials and o.data.materials[0].name == 'pallet']
assert len(moved) == 1
moved[0].location.x += 0.6
CONFIG['sun'] = 160.0
rng.seed(29)

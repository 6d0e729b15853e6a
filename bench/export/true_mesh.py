# SPDX-License-Identifier: BSD-3-Clause
"""The true surface of a rendered scene, with Debian's Blender, as binary PLY in the scene's metres:

    blender -b -P ../shared/scenes/render_orbit.py -P bench/export/true_mesh.py -- \
        --scene ../shared/scenes/van.py --seed 7 --what none --out SCRATCH --mesh van.ply

All mesh objects with their modifiers, the ground and the surroundings too: who compares crops. The
surroundings follow the seed; the object does not.
"""
import struct
import sys

import bpy

target = sys.argv[sys.argv.index("--mesh") + 1]
depsgraph = bpy.context.evaluated_depsgraph_get()
points, faces = bytearray(), bytearray()
count = triangles = 0
for source in bpy.context.scene.objects:
    if source.type != "MESH":
        continue
    evaluated = source.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    mesh.calc_loop_triangles()
    for vertex in mesh.vertices:
        points += struct.pack("<3d", *(evaluated.matrix_world @ vertex.co))
    for triangle in mesh.loop_triangles:
        faces += struct.pack("<B3i", 3, *(count + i for i in triangle.vertices))
    count += len(mesh.vertices)
    triangles += len(mesh.loop_triangles)
    evaluated.to_mesh_clear()
with open(target, "wb") as out:
    out.write(
        (
            "ply\nformat binary_little_endian 1.0\n"
            f"element vertex {count}\nproperty double x\nproperty double y\nproperty double z\n"
            f"element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
        ).encode()
    )
    out.write(points)
    out.write(faces)
print("true mesh:", count, "vertices,", triangles, "triangles")

# SPDX-License-Identifier: BSD-3-Clause
"""A GLB of `orbitfuse export` in Debian's Blender:

    blender -b --python-exit-code 1 -P tests/app/export/glb_in_blender.py -- FILE.glb

Blender's importer gives vertices and colours; that of 3.4 leaves out attributes of one's own, so the
temperatures are read from the file and put on the mesh, as a user's script would.
"""
import json
import struct
import sys

import bpy
import numpy

if not hasattr(numpy, "bool"):  # Debian's importer is older than Debian's numpy
    numpy.bool = bool

path = sys.argv[sys.argv.index("--") + 1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False)
meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
assert len(meshes) == 1, "%d meshes" % len(meshes)
mesh = meshes[0].data

with open(path, "rb") as file:
    data = file.read()
length = struct.unpack_from("<I", data, 12)[0]
scene = json.loads(data[20 : 20 + length])
binary = 20 + length + 8
accessor = scene["accessors"][scene["meshes"][0]["primitives"][0]["attributes"]["_TEMPERATURE"]]
view = scene["bufferViews"][accessor["bufferView"]]
kelvin = struct.unpack_from("<%df" % accessor["count"], data, binary + view.get("byteOffset", 0))
assert len(mesh.vertices) == len(kelvin), (len(mesh.vertices), len(kelvin))
layer = mesh.attributes.new("temperature", "FLOAT", "POINT")
layer.data.foreach_set("value", kelvin)
known = [k for k in kelvin if k > 0]
assert known and min(known) > 150 and max(known) < 2000, "temperatures out of any range"

low, high = scene["meshes"][0]["extras"]["box"]["low"], scene["meshes"][0]["extras"]["box"]["high"]
for axis in range(3):  # Blender turns glTF's y up back to z up: the sidecar's frame
    values = [v.co[axis] for v in mesh.vertices]
    assert abs(min(values) - low[axis]) < 1e-3 * (high[axis] - low[axis]), (axis, min(values), low)
    assert abs(max(values) - high[axis]) < 1e-3 * (high[axis] - low[axis]), (axis, max(values), high)
assert len(mesh.color_attributes) == 1
colours = {tuple(round(c, 2) for c in d.color[:3]) for d in mesh.color_attributes[0].data[:30000]}
assert len(colours) > 20, "colours are missing"
print(
    "blender: %d vertices, %d triangles, %.2f to %.2f K, %d without temperature"
    % (len(mesh.vertices), len(mesh.polygons), min(known), max(known), len(kelvin) - len(known))
)

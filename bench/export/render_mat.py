# SPDX-License-Identifier: BSD-3-Clause
"""Renders a scene of ../shared/scenes with the printed mat on its ground, with Debian's Blender:

    build/release/bench/export/mat_image mat.png --size 2.4
    nice blender -b -P bench/export/render_mat.py -- --renderer ../shared/scenes/render_orbit.py \
        --scene ../shared/scenes/statue.py --mat mat.png --mat-size 2.4 --seed 7 --spp 8 --limit 24 --out RAW

The renderer and the scene are run as they are; the mat lies flat round the middle, where the object stands.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from scene_renderer import named, replaced_once, run, source


def lay_mat():
    import bpy

    bpy.ops.mesh.primitive_plane_add(size=float(named("mat-size")), location=(0, 0, 0.003), rotation=(0, 0, 0.3))
    scope["obj"](bpy.context.object, scope["M"]("printed mat", (1, 1, 1), 0.9))


def with_mat(build):
    def printed(material, mode):
        import bpy

        build(material, mode)
        if mode != "visible" or material.name != "printed mat":
            return
        nodes = material.node_tree
        texture = nodes.nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.load(named("mat"), check_existing=True)
        surface = next(n for n in nodes.nodes if n.type == "BSDF_PRINCIPLED")
        nodes.links.new(nodes.nodes.new("ShaderNodeTexCoord").outputs["UV"], texture.inputs["Vector"])
        nodes.links.new(texture.outputs["Color"], surface.inputs["Base Color"])

    return printed


text = replaced_once(
    source(),
    "exec(compile(open(scene_file).read(),scene_file,'exec'))",
    "exec(compile(open(scene_file).read(),scene_file,'exec'))\nlay_mat(); build = with_mat(build)",
)
scope = {"lay_mat": lay_mat, "with_mat": with_mat}
run(text, scope)

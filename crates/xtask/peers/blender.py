"""The way from Blender: builds a scene there, exports it as glTF with the settings that the book names, renders it with Cycles and with
wavepool's path tracer, and compares means and tiles as peers.py does.

Rough dielectrics, metals by the GGX distribution, a mirror, a lamp that is a mesh, a point light, a sun. Metals are the same in both; under a
dielectric coat Cycles scales the base by the coat's albedo towards the viewer alone, wavepool reciprocally. Blender's exporter cannot say that
a surface has no coat by an index of 1, and calls glass thin unless a thickness is set.

Then the scenes of scenes.py, with this renderer's model in Cycles' closures (wavepool_osl.py).

usage: blender.py PATH_TRACER FOLDER [--assets FOLDER] [--quick] [SCENE ...]
"""

import argparse
import os

import bpy
import numpy as np

import in_cycles
from path_tracer_call import export, render
from scenes import FROM_BLENDER, OF_MITSUBA, TO_BLENDER, chosen_scenes, write_matte_box
from statistics_of_tiles import judge, table_head


def material(name, color, metallic=0.0, roughness=1.0, emission=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.distribution = "GGX"
    values = {
        "Base Color": (*color, 1.0),
        "Metallic": metallic,
        "Roughness": roughness,
        "IOR": 1.5,
        "Diffuse Roughness": 0.0,
    }
    if emission:
        strength = max(emission)
        values |= {"Emission Color": (*[value / strength for value in emission], 1.0), "Emission Strength": strength}
    for key, value in values.items():
        shader.inputs[key].default_value = value
    # Cycles' lamps shine both ways, and so does what has two sides in glTF.
    made.use_backface_culling = False
    return made


def add_quad(name, corners, with_material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    thing = bpy.data.objects.new(name, mesh)
    thing.data.materials.append(with_material)
    bpy.context.collection.objects.link(thing)


def add_sphere(name, center, radius, with_material):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=radius, location=center)
    thing = bpy.context.object
    thing.name = name
    bpy.ops.object.shade_smooth()
    thing.data.materials.append(with_material)


def add_light(name, kind, energy, location, rotation=(0, 0, 0)):
    light = bpy.data.lights.new(name, kind)
    light.energy = energy
    if kind == "POINT":
        light.shadow_soft_size = 0.0
    else:
        light.angle = 0.0
    thing = bpy.data.objects.new(name, light)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.collection.objects.link(thing)


def build():
    """A box that is open towards the camera; z is up, as always in Blender."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white, red, green = (material(n, c) for n, c in [("white", (0.7, 0.7, 0.7)), ("red", (0.6, 0.1, 0.08)), ("green", (0.12, 0.45, 0.1))])
    lamp = material("lamp", (0.0, 0.0, 0.0), emission=(12.0, 11.0, 9.0))
    add_quad("floor", [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], white)
    add_quad("ceiling", [(-2, 2, 3), (2, 2, 3), (2, -2, 3), (-2, -2, 3)], white)
    add_quad("back", [(-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3)], white)
    add_quad("left", [(-2, -2, 0), (-2, 2, 0), (-2, 2, 3), (-2, -2, 3)], red)
    add_quad("right", [(2, 2, 0), (2, -2, 0), (2, -2, 3), (2, 2, 3)], green)
    add_quad("lamp", [(-0.5, 0.5, 2.995), (0.5, 0.5, 2.995), (0.5, -0.5, 2.995), (-0.5, -0.5, 2.995)], lamp)
    add_sphere("rough metal", (-1.1, 0.7, 0.6), 0.6, material("copper", (0.95, 0.6, 0.4), 1.0, 0.35))
    add_sphere("rougher metal", (0.3, 1.0, 0.5), 0.5, material("steel", (0.7, 0.7, 0.72), 1.0, 0.7))
    add_sphere("mirror", (0.9, -0.4, 0.5), 0.5, material("mirror", (0.9, 0.9, 0.9), 1.0, 0.0))
    add_sphere("matte", (-0.5, -0.7, 0.35), 0.35, material("blue", (0.2, 0.3, 0.7)))
    add_light("point", "POINT", 40.0, (1.2, -1.2, 2.4))
    add_light("sun", "SUN", 0.5, (0, 0, 5), (1.1, 0.2, 0.4))
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y = "VERTICAL", 0.7
    thing = bpy.data.objects.new("camera", camera)
    thing.location, thing.rotation_euler = (0, -6.4, 1.5), (np.pi / 2, 0, 0)
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing


def export_gltf(path):
    """The settings of the book: +Y up, cameras, punctual lights in units without 683 lumens per watt."""
    bpy.ops.export_scene.gltf(
        filepath=path,
        export_format="GLB",
        export_yup=True,
        export_cameras=True,
        export_lights=True,
        export_extras=True,
        export_apply=True,
        export_import_convert_lighting_mode="COMPAT",
    )


class Cycles:
    def __init__(self, arguments):
        self.path_tracer, self.folder = arguments.path_tracer, os.path.abspath(arguments.folder)
        self.runs = 4 if arguments.quick else 8
        self.out = os.path.join(self.folder, "cycles.exr")

    def compare(self, name, scene, options, samples, theirs):
        """`theirs` makes one picture of a seed; no roulette here."""
        a, b = [], []
        for seed in range(self.runs):
            a.append(render(self.path_tracer, scene, options, samples, seed, "megakernel,roulette=none")[0])
            b.append(theirs(seed))
        judge(name, "Cycles", "none", a, b, samples, self.folder)

    def compare_open(self, name, scene):
        """What is open in Blender with the glTF file that it came from or went to."""
        size, samples, depth = (128, 128), 64, 12
        options = ["--size", "128x128", "--depth", depth]
        self.compare(name, scene, options, samples, lambda seed: in_cycles.render(size, samples, seed, depth, self.out))

    def from_blender(self):
        scene = os.path.join(self.folder, "from_blender.glb")
        build()
        export_gltf(scene)
        self.compare_open(FROM_BLENDER, scene)

    def to_blender(self):
        scene = os.path.join(self.folder, "matte_box_with_back.gltf")
        write_matte_box(scene, lamp_has_back=True)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_scene.gltf(filepath=scene)
        bpy.context.scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
        self.compare_open(TO_BLENDER, scene)

    def agree(self, name, scene):
        exported = in_cycles.Exported(export(self.path_tracer, name, scene.file, scene.options, self.folder))
        self.compare(name, scene.file, scene.options, scene.samples, lambda seed: exported.render(scene.samples, seed, self.out))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("path_tracer")
    parser.add_argument("folder")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--assets")
    parser.add_argument("scenes", nargs="*")
    arguments = parser.parse_intermixed_args()
    os.makedirs(arguments.folder, exist_ok=True)
    cycles = Cycles(arguments)
    print(f"Blender {bpy.app.version_string}, Cycles\n")
    print(table_head(), flush=True)
    if not arguments.scenes or FROM_BLENDER in arguments.scenes:
        cycles.from_blender()
    if not arguments.scenes or TO_BLENDER in arguments.scenes:
        cycles.to_blender()
    for name, scene in chosen_scenes(arguments.scenes, cycles.folder, arguments.assets):
        if name.split("+")[0] in OF_MITSUBA:
            continue
        if scene is None:
            print(f"| {name} | Cycles | | | skipped: no file | | | | |", flush=True)
        else:
            cycles.agree(name, scene)


if __name__ == "__main__":
    main()

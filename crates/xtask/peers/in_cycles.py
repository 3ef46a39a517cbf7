"""Scenes that `path-tracer export --mitsuba --materials model` has written, in Blender, and pictures of them by Cycles.

One export serves both peers, so that they see the same triangles, normals, texels, cameras and lights. What is not understood is an error.
"""

import os
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import bpy
import cycles.osl
import numpy as np
from mathutils import Matrix

import wavepool_osl
from path_tracer_call import picture_of

# Blender as a module does not find the module by which it asks a shader for its parameters.
sys.path += [str(folder) for folder in pathlib.Path(cycles.osl.__file__).parents[3].glob("python/lib/*/site-packages")]
# Blender's third axis is up.
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
FILTERS = {"bilinear": "Linear", "nearest": "Closest"}
EXTENSIONS = {"repeat": "REPEAT", "mirror": "MIRROR", "clamp": "EXTEND"}


def child(element, name, kind=None):
    """The part of that name, if there is one."""
    found = [part for part in element if part.get("name") == name and kind in (None, part.tag)]
    return found[0] if found else None


def parts(element, kind):
    return [part for part in element if part.tag == kind]


def number(element, name, otherwise=None):
    part = child(element, name)
    return otherwise if part is None else float(part.get("value"))


def matrix_of(transform):
    values = np.array([float(value) for value in transform.find("matrix").get("value").split()])
    # Transforms of textures have three rows.
    return values.reshape(2 * (int(np.sqrt(len(values))),))


def read_ply(path):
    """Positions, normals, texture coordinates, triangles."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = [int(line.split()[-1]) for line in data[:end].decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(data, "<f4", counts[0] * 8, end).reshape(-1, 8)
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("corners", "<i4", 3)]), counts[1], end + vertices.nbytes)
    return vertices[:, :3], vertices[:, 3:6], vertices[:, 6:], faces["corners"]


def mesh_of(name, path):
    positions, normals, coordinates, triangles = read_ply(path)
    turn = Z_UP[:3, :3].T
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(positions @ turn, np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    layer = mesh.uv_layers.new(name="UVMap")
    # Blender's images begin at the bottom.
    corners = coordinates[triangles.ravel()] * [1, -1] + [0, 1]
    layer.uv.foreach_set("vector", np.ascontiguousarray(corners, np.float32).ravel())
    mesh.update(calc_edges=True)
    free = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
    free.data.foreach_set("vector", np.ascontiguousarray(normals @ turn, np.float32).ravel())
    return mesh


class Exported:
    """One exported scene as Blender's only scene."""

    def __init__(self, xml):
        self.folder = os.path.dirname(os.path.abspath(xml))
        source = os.path.join(self.folder, "wavepool.osl")
        wavepool_osl.write(source)
        is_compiled, self.shader = cycles.osl.osl_compile(source, lambda kind, text: None)
        if not is_compiled:
            raise ValueError(f"{source} does not compile")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.shading_system = True
        scene.world = bpy.data.worlds.new("dark")
        scene.world.use_nodes = True
        scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
        root = ElementTree.parse(xml).getroot()
        sensor = root.find("sensor")
        film = sensor.find("film")
        self.size = [int(number(film, name)) for name in ("width", "height")]
        # A path of n scattering events has n + 1 segments, and Mitsuba counts these.
        self.depth = int(number(root.find("integrator"), "max_depth")) - 1
        self.camera(sensor)
        # The back of a lamp is a copy in Mitsuba; here the lamp itself shines both ways.
        shapes = {os.path.basename(child(shape, "filename").get("value")): shape for shape in root.findall("shape")}
        for file, shape in shapes.items():
            if not file.startswith("back_"):
                self.shape(file, shape, file.replace("mesh_", "back_") in shapes)
        for emitter in root.findall("emitter"):
            if emitter.get("type") != "envmap":
                raise ValueError(f"{xml}: lights of type {emitter.get('type')} are not understood")
            self.panorama(emitter)

    def camera(self, sensor):
        if sensor.get("type") != "perspective":
            raise ValueError(f"cameras of type {sensor.get('type')} are not understood")
        camera = bpy.data.cameras.new("camera")
        camera.sensor_fit, camera.angle_y = "VERTICAL", np.radians(number(sensor, "fov"))
        camera.clip_start, camera.clip_end = 1e-4, 1e5
        thing = bpy.data.objects.new("camera", camera)
        # Mitsuba's cameras look along +z with +x to the left.
        thing.matrix_world = Matrix((Z_UP @ matrix_of(child(sensor, "to_world")) @ np.diag([-1.0, 1, -1, 1])).tolist())
        bpy.context.collection.objects.link(thing)
        bpy.context.scene.camera = thing

    def shape(self, file, shape, shines_both_ways):
        name = file.removesuffix(".ply")
        thing = bpy.data.objects.new(name, mesh_of(name, os.path.join(self.folder, child(shape, "filename").get("value"))))
        thing.shadow_terminator_shading_offset = thing.shadow_terminator_geometry_offset = 0.0
        bpy.context.collection.objects.link(thing)
        thing.data.materials.append(self.material(name, shape, shines_both_ways))

    def material(self, name, shape, shines_both_ways):
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        material.cycles.use_bump_map_correction = False
        tree = material.node_tree
        tree.nodes.clear()
        script = tree.nodes.new("ShaderNodeScript")
        script.mode, script.filepath = "EXTERNAL", self.shader
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], script.inputs["Normal"])
        self.surface(tree, script, shape.find("bsdf"))
        surface = script.outputs["Surface"]
        emitter = shape.find("emitter")
        if emitter is not None:
            surface = self.lamp(tree, surface, emitter, shines_both_ways)
        material.cycles.emission_sampling = "NONE" if emitter is None else "FRONT_BACK" if shines_both_ways else "FRONT"
        tree.links.new(surface, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return material

    def lamp(self, tree, surface, emitter, shines_both_ways):
        emission = tree.nodes.new("ShaderNodeEmission")
        self.put(tree, emission.inputs["Color"], child(emitter, "radiance"))
        emission.inputs["Strength"].default_value = 1.0
        if not shines_both_ways:
            front = tree.nodes.new("ShaderNodeMath")
            front.operation, front.inputs[0].default_value = "SUBTRACT", 1.0
            tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
            tree.links.new(front.outputs[0], emission.inputs["Strength"])
        both = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(surface, both.inputs[0])
        tree.links.new(emission.outputs[0], both.inputs[1])
        return both.outputs[0]

    def surface(self, tree, script, bsdf):
        """Sets what one BSDF and those within it say."""
        kind, inner = bsdf.get("type"), parts(bsdf, "bsdf")
        put = lambda socket, name: self.put(tree, script.inputs[socket], child(bsdf, name))  # noqa: E731
        if kind == "diffuse":
            script.inputs["Ior"].default_value = 1.0
            put("BaseColor", "reflectance")
        elif kind == "wavepool":
            put("BaseColor", "base_color")
            put("Metallic", "metallic")
            put("Roughness", "roughness")
            put("Ior", "ior")
        elif kind in ("dielectric", "thindielectric"):
            # Overwritten by a blend's weight.
            script.inputs["GlassShare"].default_value = 1.0
            script.inputs["IsSolid"].default_value = int(kind == "dielectric")
            put("GlassIor", "int_ior")
            put("Tint", "specular_transmittance")
        elif kind == "mask":
            put("Opacity", "opacity")
        elif kind == "normalmap":
            node = tree.nodes.new("ShaderNodeNormalMap")
            node.uv_map = "UVMap"
            self.put(tree, node.inputs["Color"], child(bsdf, "normalmap"))
            tree.links.new(node.outputs["Normal"], script.inputs["Normal"])
        elif kind not in ("twosided", "blendbsdf"):
            raise ValueError(f"surfaces of type {kind} are not understood")
        for part in inner:
            self.surface(tree, script, part)
        if kind == "blendbsdf":
            put("GlassShare", "weight")

    def put(self, tree, socket, value):
        """A number, a colour or a texture into a socket."""
        if value.tag == "float":
            socket.default_value = float(value.get("value"))
        elif value.tag == "rgb":
            socket.default_value = (*[float(part) for part in value.get("value").split(",")], 1.0)
        else:
            to_uv = child(value, "to_uv")
            if to_uv is not None and not np.array_equal(matrix_of(to_uv), np.eye(3)):
                raise ValueError("transforms of textures are not understood")
            node = tree.nodes.new("ShaderNodeTexImage")
            node.image = self.image(child(value, "filename").get("value"))
            node.interpolation = FILTERS[child(value, "filter_type").get("value")]
            node.extension = EXTENSIONS[child(value, "wrap_mode").get("value")]
            tree.links.new(node.outputs["Color"], socket)

    def image(self, file):
        image = bpy.data.images.load(os.path.join(self.folder, file))
        image.colorspace_settings.name, image.alpha_mode, image.use_half_precision = "Non-Color", "NONE", False
        return image

    def panorama(self, emitter):
        tree = bpy.context.scene.world.node_tree
        node = tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = self.image(child(emitter, "filename").get("value"))
        # As in wavepool, a texel has one radiance.
        node.interpolation = "Closest"
        turn = tree.nodes.new("ShaderNodeMapping")
        # The middle of the picture lies towards -z of glTF, which is +y of Blender, and towards +x for Cycles.
        turn.inputs["Rotation"].default_value = (0, 0, -np.pi / 2)
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], turn.inputs["Vector"])
        tree.links.new(turn.outputs["Vector"], node.inputs["Vector"])
        tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])

    def render(self, samples, seed, out):
        return render(self.size, samples, seed, self.depth, out)


def render(size, samples, seed, depth, out):
    """Cycles' picture of what is open in Blender, by paths of at most `depth` scattering events."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    settings = scene.cycles
    settings.device = "CPU"
    settings.samples, settings.seed = samples, seed
    settings.use_adaptive_sampling = settings.use_denoising = settings.use_light_tree = False
    # The first scattering event is not counted there.
    settings.max_bounces = settings.diffuse_bounces = settings.glossy_bounces = settings.transmission_bounces = depth - 1
    settings.transparent_max_bounces = 64
    settings.sample_clamp_direct = settings.sample_clamp_indirect = settings.blur_glossy = settings.light_sampling_threshold = 0.0
    settings.caustics_reflective = settings.caustics_refractive = True
    settings.pixel_filter_type, settings.filter_width = "BOX", 1.0
    render_settings = scene.render
    render_settings.resolution_x, render_settings.resolution_y = size
    render_settings.resolution_percentage = 100
    render_settings.image_settings.file_format = "OPEN_EXR"
    render_settings.image_settings.color_depth = "32"
    render_settings.filepath = out
    bpy.ops.render.render(write_still=True)
    return picture_of(out)
